"""Where the names of vertical marks stand above a chart, so that none lies on another."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["LONGEST_BESIDE", "label_rows", "label_side"]

#: Letters of a level's name that find room beside the axes; a longer one stands on its line.
LONGEST_BESIDE = 18
# Between names in one row, letters.
_APART = 1.5


def label_side(share: float, label: str, letter: float) -> str:
    """Return how a name stands to its mark, so that it does not leave the axes.

    Parameters
    ----------
    share : float
        Of the axis that lies left of the mark.
    label : str
    letter : float
        Width of a letter, as a share of the axis.

    Returns
    -------
    {'left', 'center', 'right'}
        What of the name lies at the mark.
    """
    half = 0.5 * letter * len(label)
    if share < half:
        return "left"
    return "right" if share > 1.0 - half else "center"


def label_rows(shares: Sequence[float], labels: Sequence[str], letter: float) -> tuple[int, ...]:
    """Return the row of each name, from 0 at the axes upward.

    Parameters
    ----------
    shares, labels, letter
        As in `label_side`, of every mark.

    Returns
    -------
    tuple of int
        The lowest row in which a name lies on none of those to its left.
    """
    ends: list[float] = []
    rows = [0] * len(shares)
    for k in sorted(range(len(shares)), key=lambda j: (shares[j], j)):
        wide = letter * len(labels[k])
        part = {"left": 0.0, "center": 0.5, "right": 1.0}[label_side(shares[k], labels[k], letter)]
        start = shares[k] - part * wide
        free = (row for row, end in enumerate(ends) if end + _APART * letter <= start)
        row = next(free, len(ends))
        if row == len(ends):
            ends.append(0.0)
        ends[row] = start + wide
        rows[k] = row
    return tuple(rows)
