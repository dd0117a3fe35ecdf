"""``python -m papers.chernodarov --out DIR``."""

from papers.chernodarov.paper import reproduce_chernodarov
from papers.page import run

run("chernodarov", reproduce_chernodarov)
