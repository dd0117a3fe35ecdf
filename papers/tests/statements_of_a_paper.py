"""What holds for the statements of each reproduced paper, and for their page in the manual."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np

from papers.page import statements_markdown

BEGIN = "<!-- statements: begin; written by `make statements` -->\n"
END = "<!-- statements: end -->"


def check_statements(made) -> None:
    """Each has a quote of one sentence, numbers, and a figure that exists."""
    slugs = {f.slug for f in made.figures}
    for s in made.statements:
        assert 0 < len(s.quote) < 300, s.key
        assert not re.search(r"[a-z]\. [A-Z]", s.quote), s.key
        assert s.evidence, s.key
        assert s.figure in {"", *slugs}, s.key
        assert all(np.isfinite(e.value) for e in s.evidence), s.key
    assert len(slugs) == len(made.figures)


def check_manual(made, page: Path) -> None:
    """The page has the statements as this code makes them; written anew where that is asked for."""
    table = statements_markdown(made)
    text = page.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    written, _, after = rest.partition(END)
    if os.environ.get("STRAPDOWN_WRITE_STATEMENTS"):
        written = f"\n{table}\n"
        page.write_text(before + BEGIN + written + END + after, encoding="utf-8")
    assert written.strip() == table.strip(), "run `make statements` and read the difference"
