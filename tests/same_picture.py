"""Whether two pictures are the same to the eye, whatever machine drew them."""

from __future__ import annotations

import re

import numpy as np

NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")


def same_picture(a, b):
    """Whether nothing differs but numbers, by less than can be seen: 0.015 of a pixel."""
    texts = [path.read_text(encoding="utf-8") for path in (a, b)]
    if NUMBER.sub("", texts[0]) != NUMBER.sub("", texts[1]):
        return False
    x, y = (np.array(NUMBER.findall(text), dtype=np.float64) for text in texts)
    return x.shape == y.shape and bool((np.abs(x - y) < 0.015).all())
