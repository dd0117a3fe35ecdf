"""What re-making a paper gives: its statements with verdicts, tables and figures, as numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

__all__ = [
    "CANNOT_BE_JUDGED",
    "DOES_NOT_HOLD",
    "HOLDS",
    "HOLDS_WHEN",
    "VERDICTS",
    "Evidence",
    "Figure",
    "FigurePanel",
    "Part",
    "Progress",
    "Reproduction",
    "Statement",
    "Table",
    "Trace",
    "amount",
    "put_together",
    "silent",
]

#: Called with a stage and the share of the whole that is done.
Progress = Callable[[str, float], None]

HOLDS, HOLDS_WHEN = "holds", "holds when"
DOES_NOT_HOLD, CANNOT_BE_JUDGED = "does not hold", "cannot be judged"
VERDICTS = (HOLDS, HOLDS_WHEN, DOES_NOT_HOLD, CANNOT_BE_JUDGED)

# Below this an angle, a length or a ratio of this kind is the rounding of the run.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Evidence:
    """One number that a verdict rests on, computed in the same run.

    Attributes
    ----------
    what : str
    value : float
    unit : str
        Empty for a pure number.
    """

    what: str
    value: float
    unit: str = ""

    @property
    def shown(self) -> str:
        """The value to three digits with its unit."""
        return amount(self.value, self.unit)


@dataclass(frozen=True)
class Statement:
    """One testable statement of a paper, and what came of testing it.

    Attributes
    ----------
    key : str
    place : str
        Where it stands in the paper.
    quote : str
        One sentence at most, word for word.
    verdict : str
        One of `VERDICTS`.
    condition : str
        What follows the words "holds when"; empty for the other verdicts.
    because : str
        What was done, and what it shows.
    evidence : tuple of Evidence
    figure : str
        Slug of the figure that shows it; empty if none does.

    Raises
    ------
    ValueError
        The verdict is unknown, or a condition is missing or superfluous.
    """

    key: str
    place: str
    quote: str
    verdict: str
    condition: str
    because: str
    evidence: tuple[Evidence, ...]
    figure: str = ""

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise ValueError(f"{self.key}: '{self.verdict}' is no verdict")
        if bool(self.condition) != (self.verdict == HOLDS_WHEN):
            raise ValueError(f"{self.key}: a condition belongs to '{HOLDS_WHEN}' and to it alone")


@dataclass(frozen=True)
class Table:
    """Numbers in rows.

    Attributes
    ----------
    slug, title, caption : str
    columns : tuple of str
        The first names the rows; the others with their units.
    rows : tuple of (str, tuple of float or None)
    """

    slug: str
    title: str
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, tuple[float | None, ...]], ...]


@dataclass(frozen=True)
class Trace:
    """One curve of a figure; its name decides how it is drawn.

    Attributes
    ----------
    name : str
    x, y : ndarray, (n,)
        NaN in `y` breaks the curve.
    points : bool
        Points at the values, because nothing was computed between them.
    reference : bool
        A truth or a closed form, against which the others are seen.
    """

    name: str
    x: Array
    y: Array
    points: bool = False
    reference: bool = False


@dataclass(frozen=True)
class FigurePanel:
    """One set of axes: label with its unit, curves, logarithmic or not."""

    y_label: str
    traces: tuple[Trace, ...]
    log: bool = False


@dataclass(frozen=True)
class Figure:
    """Panels above each other that share the horizontal axis.

    Attributes
    ----------
    slug, title, caption : str
    parameters : str
        Every number that was chosen here because the paper's figure did not survive.
    x_label : str
        With its unit.
    panels : tuple of FigurePanel
    x_log : bool
    marks : tuple of (float, str)
        Places on the horizontal axis that matter, with a label.
    """

    slug: str
    title: str
    caption: str
    parameters: str
    x_label: str
    panels: tuple[FigurePanel, ...]
    x_log: bool = False
    marks: tuple[tuple[float, str], ...] = ()


@dataclass(frozen=True)
class Reproduction:
    """A reproduced paper.

    Attributes
    ----------
    name : str
        The word for it on the command line.
    paper : str
        Author, year, title, journal.
    headline : str
        What came of it, in a sentence or two.
    statements : tuple of Statement
    tables : tuple of Table
    figures : tuple of Figure
    conventions : tuple of (str, str)
        What it stands on: a word and what is meant by it.
    """

    name: str
    paper: str
    headline: str
    statements: tuple[Statement, ...]
    tables: tuple[Table, ...]
    figures: tuple[Figure, ...]
    conventions: tuple[tuple[str, str], ...] = ()

    def count(self, verdict: str) -> int:
        """Return how many statements have this verdict."""
        return sum(s.verdict == verdict for s in self.statements)


def amount(value: float, unit: str = "") -> str:
    """Write a number to three significant digits with its unit; what is rounding, as that."""
    if not np.isfinite(value):
        return "not a number"
    space = "" if unit in ("", "°", "°/s", "%") else " "
    size = abs(value)
    if size < ROUNDING:
        return f"< 1e-9{space}{unit}"
    if 1e-3 <= size < 1e5:
        digits = f"{value:.3g}" if size < 100 else f"{value:.4g}" if size < 1000 else f"{value:.0f}"
    else:
        digits = f"{value:.1e}"
    return f"{digits}{space}{unit}"


def silent(stage: str, share: float) -> None:
    """Report progress to nobody."""


#: What one part of a paper gives.
Part = tuple[list[Statement], list[Table], list[Figure]]


def put_together(parts: Sequence[tuple[str, Callable[[], Part]]], progress: Progress) -> Part:
    """Make the parts of a paper one after the other.

    Parameters
    ----------
    parts : sequence of (str, callable)
        Name of the stage, and what makes the part.
    progress : callable
        Called before each with its stage and the share of the parts that is done.

    Returns
    -------
    tuple of list
        Statements, tables and figures of all, in the order of the parts.
    """
    statements: list[Statement] = []
    tables: list[Table] = []
    figures: list[Figure] = []
    for k, (stage, make) in enumerate(parts):
        progress(stage, k / len(parts))
        judged, listed, drawn = make()
        statements += judged
        tables += listed
        figures += drawn
    return statements, tables, figures
