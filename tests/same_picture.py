"""Whether two pictures are the same to the eye, whatever machine drew them."""

from __future__ import annotations

import re
from importlib.metadata import version
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
# Matplotlib, which draws pictures of the papers, names clips and markers by their content.
NAMES = re.compile(r"\b[pmC](?=[0-9a-f]{10}\b)[0-9a-f]+")
_STATED = re.search(r"^matplotlib==(\S+)", (ROOT / "constraints.txt").read_text(), re.M)
#: Whether this matplotlib draws as the one that drew them.
PINNED = _STATED is None or version("matplotlib") == _STATED[1]
NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")


def same_picture(a, b):
    """Whether nothing differs but numbers, by less than can be seen: 0.015 of a pixel."""
    texts = [NAMES.sub("", path.read_text(encoding="utf-8")) for path in (a, b)]
    if NUMBER.sub("", texts[0]) != NUMBER.sub("", texts[1]):
        return False
    x, y = (np.array(NUMBER.findall(text), dtype=np.float64) for text in texts)
    return x.shape == y.shape and bool((np.abs(x - y) < 0.015).all())
