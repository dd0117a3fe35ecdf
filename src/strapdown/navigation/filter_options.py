"""Options of the filter of a chain: error model, covariance form, update rule and steps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from strapdown.errors import ConfigError
from strapdown.estimation.covariance import COVARIANCES, CovarianceForm, UpdateRule
from strapdown.estimation.error_model import ErrorModel, RotationVectorModel
from strapdown.tables.checks import is_number


@dataclass(frozen=True)
class FilterOptions:
    """Error-state filter, closed loop, with its own covariance step.

    Attributes
    ----------
    rule : UpdateRule, optional
        Weighting of observations whose aid has no rule of its own; full weight if not given.
    step : float, s
        Longest step of the covariance, propagated with mean attitude and force.
    mark_interval : float, s
        Longest time between two records of the covariance.
    """

    model: type[ErrorModel] = RotationVectorModel
    form: CovarianceForm = field(default_factory=COVARIANCES["ud"])
    rule: UpdateRule | None = None
    step: float = field(default=0.1, metadata={"unit": "s"})
    mark_interval: float = field(default=1.0, metadata={"unit": "s"})

    summary: ClassVar[str] = "error-state filter, closed loop, covariance at a rate of its own"
    source: ClassVar[str] = "Chernodarov (2009)"

    def __post_init__(self) -> None:
        # Over 10 s means of attitude and force are no longer representative.
        for name, most in (("step", 10.0), ("mark_interval", 3600.0)):
            value = getattr(self, name)
            if not is_number(value) or not 0.0 < value <= most:
                raise ConfigError(
                    "navigation.no-time-covariance-can-take", quantity=name, value=value, most=most
                )


# Correction by the estimated errors: closed-loop (fed back), open-loop (output only), or none.


@dataclass(frozen=True)
class Correction:
    """Use of the estimated errors."""

    kind: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]
    #: Whether mechanization and sensors are corrected by the estimates (closed loop).
    feeds_back: ClassVar[bool]
    #: Whether the estimates are subtracted from the output.
    corrects: ClassVar[bool] = True


@dataclass(frozen=True)
class ClosedLoop(Correction):
    """State and sensors are corrected at every epoch, so that errors stay small ("damping")."""

    kind: ClassVar[str] = "feedback"
    summary: ClassVar[str] = "closed loop: state and sensors are corrected at each epoch"
    source: ClassVar[str] = "Chernodarov (2009), Figs. 8, 10"
    feeds_back: ClassVar[bool] = True


@dataclass(frozen=True)
class OpenLoop(Correction):
    """Open-loop correction: the mechanization runs free, its output is corrected.

    Errors grow as those of an unaided system, and the model of the filter is linear in them: its
    covariance holds while they are small. Over a hundred drives of four minutes it held with a
    heading known to 0.2 deg and biases of 2 deg/h and 0.2 mg at the start; with ten times these
    the mean normalized square of the errors was seven times the stated one, where closed-loop
    correction was consistent. For good sensors, and for comparison.
    """

    kind: ClassVar[str] = "feedforward"
    summary: ClassVar[str] = "open loop: the mechanization runs free, its output is corrected"
    source: ClassVar[str] = "Chernodarov (2009) (6)"
    feeds_back: ClassVar[bool] = False


@dataclass(frozen=True)
class NoCorrection(Correction):
    """No correction: the mechanization runs free, and its output is shown as it is.

    The filter estimates as with open-loop correction, and its estimates are recorded; drifts and
    biases that an alignment has estimated stay on the sensors, and the attitude of the alignment
    is kept. The error of the output is the estimate that is left on it, x, with the covariance P
    of the estimate: its stated covariance is the mean square, ``P + x x'``.
    """

    kind: ClassVar[str] = "none"
    summary: ClassVar[str] = "not corrected: the output of the free mechanization"
    source: ClassVar[str] = "Chernodarov (2009), Figs. 9, 11"
    feeds_back: ClassVar[bool] = False
    corrects: ClassVar[bool] = False


DAMPINGS: dict[str, type[Correction]] = {
    one.kind: one for one in (ClosedLoop, OpenLoop, NoCorrection)
}
