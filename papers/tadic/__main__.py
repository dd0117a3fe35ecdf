"""``python -m papers.tadic --out DIR``."""

from papers.page import run
from papers.tadic.paper import reproduce_tadic

run("tadic", reproduce_tadic)
