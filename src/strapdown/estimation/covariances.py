"""The one table of covariance forms."""

from __future__ import annotations

from strapdown.estimation.covariance import CovarianceForm
from strapdown.estimation.joseph import Joseph, Plain
from strapdown.estimation.ud import BiermanThornton
from strapdown.estimation.wd import Chernodarov

COVARIANCES: dict[str, type[CovarianceForm]] = {
    "joseph": Joseph,
    "ud": BiermanThornton,
    "wd": Chernodarov,
    "plain": Plain,
}
