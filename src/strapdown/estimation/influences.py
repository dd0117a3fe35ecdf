"""The one table of influence functions."""

from __future__ import annotations

from strapdown.estimation.influence import Influence
from strapdown.estimation.influence_hampel import Hampel
from strapdown.estimation.influence_huber import Huber
from strapdown.estimation.influence_igg3 import Igg3
from strapdown.estimation.influence_none import LeastSquares
from strapdown.estimation.influence_tukey import Tukey

INFLUENCES: dict[str, type[Influence]] = {
    "huber": Huber,
    "hampel": Hampel,
    "tukey": Tukey,
    "igg3": Igg3,
    "none": LeastSquares,
}
