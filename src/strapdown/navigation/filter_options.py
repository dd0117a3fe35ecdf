"""What can be chosen of the filter of a chain: its error model, covariance, rule and steps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from strapdown.errors import ConfigError
from strapdown.estimation.covariance import CovarianceForm
from strapdown.estimation.covariances import COVARIANCES
from strapdown.estimation.error_model import ErrorModel
from strapdown.estimation.rotation_vector_model import RotationVectorModel
from strapdown.estimation.update_rule import UpdateRule
from strapdown.tables.checks import is_number

__all__ = ["FilterOptions"]


@dataclass(frozen=True)
class FilterOptions:
    """Error-state filter, closed loop, covariance at a rate of its own.

    Attributes
    ----------
    model : type of ErrorModel
    form : CovarianceForm
    rule : UpdateRule, optional
        How far an observation is believed where its aid has no rule of its own; without one, all
        of it.
    step : float, s
        Longest time over which the covariance goes by means of attitude and force.
    mark_interval : float, s
        Longest time between two records of the covariance.

    Raises
    ------
    ConfigError
        A time is none.
    """

    model: type[ErrorModel] = RotationVectorModel
    form: CovarianceForm = field(default_factory=COVARIANCES["ud"])
    rule: UpdateRule | None = None
    step: float = field(default=0.1, metadata={"unit": "s"})
    mark_interval: float = field(default=1.0, metadata={"unit": "s"})

    summary: ClassVar[str] = "error-state filter, closed loop, covariance at a rate of its own"
    source: ClassVar[str] = "Chernodarov (2009)"

    def __post_init__(self) -> None:
        # Over 10 s attitude and force are no longer means of anything.
        for name, most in (("step", 10.0), ("mark_interval", 3600.0)):
            value = getattr(self, name)
            if not is_number(value) or not 0.0 < value <= most:
                raise ConfigError(
                    "navigation.no-time-covariance-can-take", quantity=name, value=value, most=most
                )
