"""``python -m papers.tadic --out DIR``."""

from __future__ import annotations

from papers.page import run
from papers.tadic.paper import reproduce_tadic

run("tadic", reproduce_tadic)
