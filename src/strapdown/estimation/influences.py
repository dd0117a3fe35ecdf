"""The one table of influence functions."""

from __future__ import annotations

from strapdown.estimation.influence import Influence
from strapdown.estimation.influence_huber import Huber
from strapdown.estimation.influence_none import LeastSquares

INFLUENCES: dict[str, type[Influence]] = {"huber": Huber, "none": LeastSquares}
