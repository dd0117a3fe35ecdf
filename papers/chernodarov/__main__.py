"""``python -m papers.chernodarov --out DIR``."""

from __future__ import annotations

from papers.chernodarov.paper import reproduce_chernodarov
from papers.page import run

run("chernodarov", reproduce_chernodarov)
