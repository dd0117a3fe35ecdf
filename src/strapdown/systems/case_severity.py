"""What published models say of the severity of a case."""

from __future__ import annotations

from dataclasses import dataclass

from strapdown.config.crash_case import CaseSpec
from strapdown.crash.severity import SEVERITY_MODELS, find_severity_model
from strapdown.crash.severity_model import InjuryRisk, SeverityModel, injury_risk
from strapdown.crash.unit_reconstruction import UnitReconstruction
from strapdown.errors import DataError, Finding

__all__ = ["SeverityAnswer", "case_severity", "main_event"]


@dataclass(frozen=True, eq=False)
class SeverityAnswer:
    """What one model says, or why it says nothing.

    Attributes
    ----------
    model : SeverityModel
    risk : InjuryRisk or None
    because : Finding or None
        Why there is none.
    """

    model: SeverityModel
    risk: InjuryRisk | None
    because: Finding | None = None


def main_event(unit: UnitReconstruction) -> int | None:
    """Return the number, from 0, of the event in which the velocity changed most.

    Returns
    -------
    int or None
        None where there is no event.
    """
    if not unit.body:
        return None
    return max(range(len(unit.body)), key=lambda k: unit.body[k].event.resultant)


def case_severity(spec: CaseSpec, unit: UnitReconstruction) -> tuple[SeverityAnswer, ...]:
    """Ask the models that the case names, or all that fit the type of the crash.

    Parameters
    ----------
    spec : CaseSpec
    unit : UnitReconstruction
        Whose event of the largest change is meant.

    Returns
    -------
    tuple of SeverityAnswer
        Empty without an event. A model that is not valid here, or lacks an input, says why.

    Raises
    ------
    ConfigError
        A model is unknown.
    """
    number = main_event(unit)
    if number is None:
        return ()
    whole, kind = unit.body[number].event, unit.types[number].name
    inputs: dict[str, float | str] = {"delta_v": whole.resultant, "crash_type": kind}
    inputs |= spec.options.severity_inputs
    names = spec.options.severity
    models = [find_severity_model(name) for name in names] if names is not None else _fitting(kind)
    sd = {"delta_v": whole.bound.along(whole.delta_v.vector)}
    answers = []
    for model in models:
        try:
            answers.append(SeverityAnswer(model, injury_risk(model, inputs, sd)))
        except DataError as error:
            answers.append(SeverityAnswer(model, None, error.finding))
    return tuple(answers)


def _fitting(kind: str) -> list[SeverityModel]:
    """Models of this type alone, or those of all crashes where there are none."""
    own = [m for m in SEVERITY_MODELS.values() if kind in m.applies.get("crash_type", ())]
    return own or [m for m in SEVERITY_MODELS.values() if not m.applies]
