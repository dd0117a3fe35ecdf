"""The one table of covariance forms."""

from __future__ import annotations

from strapdown.estimation.covariance import CovarianceForm
from strapdown.estimation.joseph import Joseph, Plain

COVARIANCES: dict[str, type[CovarianceForm]] = {"joseph": Joseph, "plain": Plain}
