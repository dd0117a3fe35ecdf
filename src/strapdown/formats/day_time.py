"""Times of day as stamps: 13:05:58.200, with or without a date before it."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["day_nanoseconds", "is_day_time"]

_TIME = re.compile(
    r"(?:\d{1,2}[./-]\d{1,2}[./-]\d{2,4}[ T]+)?(\d{1,2}):([0-5]\d):([0-5]\d)(?:[.,:](\d{1,9}))?"
)
_DAY = 86_400 * 10**9
# A decrease of more than half a day is midnight.
_HALF_DAY = _DAY // 2


def is_day_time(field: str) -> bool:
    """Whether a field is a time of day, with seconds."""
    return _TIME.fullmatch(field) is not None


def day_nanoseconds(texts: NDArray[Any]) -> NDArray[np.int64] | None:
    """Convert times of day to nanoseconds since the midnight before the first.

    Parameters
    ----------
    texts : ndarray of object, (n,)

    Returns
    -------
    ndarray of int, (n,), or None
        None if one is not a time of day. Counting continues past midnight; dates are ignored.
    """
    found = [None if t is None else _TIME.fullmatch(str(t).strip()) for t in texts]
    if not found or any(m is None or int(m[1]) > 23 for m in found):
        return None
    whole = np.array(
        [
            (int(m[1]) * 3600 + int(m[2]) * 60 + int(m[3])) * 10**9
            + int((m[4] or "0").ljust(9, "0"))
            for m in found
            if m
        ],
        dtype=np.int64,
    )
    fell = np.concatenate([[0], np.cumsum(np.diff(whole) < -_HALF_DAY)])
    return np.asarray(whole + fell * _DAY, dtype=np.int64)
