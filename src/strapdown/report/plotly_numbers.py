"""Numbers as plotly wants them."""

from __future__ import annotations

import math

from strapdown.report.chart import Array

__all__ = ["numbers"]


def numbers(values: Array, digits: int) -> list[float | None]:
    """Numbers to so many significant digits; None, which breaks a line, for NaN."""
    return [None if math.isnan(v) else float(f"{v:.{digits}g}") for v in values.tolist()]
