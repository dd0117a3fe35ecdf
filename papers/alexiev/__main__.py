"""``python -m papers.alexiev --out DIR``."""

from __future__ import annotations

from papers.alexiev.paper import reproduce_alexiev
from papers.page import run

run("alexiev", reproduce_alexiev)
