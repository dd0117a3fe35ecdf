"""``python -m papers.alexiev --out DIR``."""

from papers.alexiev.paper import reproduce_alexiev
from papers.page import run

run("alexiev", reproduce_alexiev)
