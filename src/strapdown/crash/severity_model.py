"""Injury-risk models, and the probability of injury with a bound from the inputs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from strapdown.errors import ConfigError, DataError, Finding

__all__ = ["SPEEDS", "InjuryRisk", "SeverityModel", "Term", "injury_risk"]

#: Units of speed, in m/s. Inputs with these units are given in m/s; others in their stated unit.
SPEEDS: dict[str, float] = {"m/s": 1.0, "km/h": 1.0 / 3.6, "mph": 0.44704}
TRANSFORMS = ("identity", "log", "square")
OUTSIDE = ("refuse", "tell")


@dataclass(frozen=True)
class Term:
    """One term of the logit.

    Attributes
    ----------
    input : str
        Name of the input: ``delta_v``, ``age``, ``crash_type``.
    coefficient : float
        Per unit of the transformed input; for a category, added where it matches.
    unit : str
        Of the input in the source's table; empty for a category.
    transform : {'identity', 'log', 'square'}
        Applied to the input in its unit; log is natural.
    equals : str, optional
        The category; such a term has no unit.
    """

    input: str
    coefficient: float
    unit: str = ""
    transform: str = "identity"
    equals: str | None = None


@dataclass(frozen=True)
class SeverityModel:
    """A published model of the probability of an injury: ``1/(1 + exp(-w))``.

    Attributes
    ----------
    name, title : str
    author, year, table : str
        Publication, and the table with the coefficients.
    outcome : str
        Predicted outcome: ``MAIS3+``.
    intercept : float
    terms : tuple of Term
    validity : dict
        By input, the least and greatest value for which the model is valid, in the unit of
        its term.
    applies : dict
        By input, the categories for which the model is valid: ``{"crash_type": ("front",)}``.
    note : str
        Origin of the coefficients and of the validity range.
    """

    name: str
    title: str
    author: str
    year: int
    table: str
    outcome: str
    intercept: float
    terms: tuple[Term, ...]
    validity: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    applies: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    note: str = ""

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(dict.fromkeys(term.input for term in self.terms))

    def unit(self, name: str) -> str:
        """Unit of an input in the table; empty for a category."""
        return next((t.unit for t in self.terms if t.input == name and t.equals is None), "")

    @property
    def source(self) -> str:
        """Author, year, title and table in one line."""
        return f"{self.author} ({self.year}): {self.title}, {self.table}"


@dataclass(frozen=True)
class InjuryRisk:
    """Probability of an injury from one model.

    Attributes
    ----------
    model : SeverityModel
    probability : float
    low, high : float
        Bound from the uncertainty of the inputs alone, without that of the coefficients.
    coverage : float
        Of the bound.
    logit, logit_sd : float
    findings : tuple of Finding
    """

    model: SeverityModel
    probability: float
    low: float
    high: float
    coverage: float
    logit: float
    logit_sd: float
    findings: tuple[Finding, ...] = ()


def injury_risk(
    model: SeverityModel,
    inputs: Mapping[str, float | str],
    sd: Mapping[str, float] | None = None,
    *,
    coverage: float = 0.95,
    outside: str = "refuse",
) -> InjuryRisk:
    """Probability of an injury, with a bound from the uncertainty of the inputs.

    Parameters
    ----------
    model : SeverityModel
    inputs : dict
        By name: speeds in m/s, others in the unit of the model's table, categories as words.
    sd : dict, optional
        Standard deviations in the same units, taken as independent.
    coverage : float
        Of the bound, between 0 and 1.
    outside : {'refuse', 'tell'}
        Action where the model is not valid: an error, or a finding with the number.

    Returns
    -------
    InjuryRisk

    Raises
    ------
    DataError
        An input is missing or not a number, or the model is not valid there.
    ConfigError
        An option or an sd is not valid.

    Notes
    -----
    The logistic function is monotone, so the bound is that of the logit transformed by it; for
    untransformed inputs (no log, no square) and normal errors it is exact.
    """
    from scipy.special import expit, ndtri

    spread = dict(sd or {})
    _check_options(model, spread, coverage, outside)
    findings = list(_validity(model, inputs, spread, float(ndtri(0.5 + 0.5 * coverage)), outside))
    logit, variance = model.intercept, 0.0
    slopes: dict[str, float] = {}
    for term in model.terms:
        given = _given(model, inputs, term.input)
        if term.equals is not None:
            logit += term.coefficient if given == term.equals else 0.0
            continue
        value = _value(model, term.input, given)
        made, slope = _transformed(model, term, value)
        logit += term.coefficient * made
        slopes[term.input] = slopes.get(term.input, 0.0) + term.coefficient * slope
    for name, slope in slopes.items():
        factor = SPEEDS.get(model.unit(name), 1.0)
        variance += (slope * spread.get(name, 0.0) / factor) ** 2
    reach = float(ndtri(0.5 + 0.5 * coverage)) * math.sqrt(variance)
    return InjuryRisk(
        model,
        float(expit(logit)),
        float(expit(logit - reach)),
        float(expit(logit + reach)),
        coverage,
        logit,
        math.sqrt(variance),
        tuple(findings),
    )


def _check_options(
    model: SeverityModel, sd: Mapping[str, float], coverage: float, outside: str
) -> None:
    if outside not in OUTSIDE:
        raise ConfigError(
            "crash.outside-option-unknown",
            quantity="outside",
            outside=outside,
            word=outside,
            known=OUTSIDE,
        )
    if not 0.0 < coverage < 1.0:
        raise ConfigError("crash.coverage-none", quantity="coverage", coverage=coverage)
    for name, value in sd.items():
        if not (math.isfinite(value) and value >= 0.0):
            raise ConfigError(
                "crash.standard-deviation-negative", quantity=f"sd of {name}", value=value
            )


def _given(model: SeverityModel, inputs: Mapping[str, float | str], name: str) -> float | str:
    if name not in inputs:
        unit = model.unit(name)
        raise DataError(
            "crash.model-needs-number" if unit else "crash.model-needs-word",
            quantity=name,
            name=model.name,
            input=name,
            unit="m/s" if unit in SPEEDS else unit,
        )
    return inputs[name]


def _value(model: SeverityModel, name: str, given: float | str) -> float:
    """Return a number in the unit of the model's table."""
    if isinstance(given, str) or not math.isfinite(given):
        raise DataError(
            "crash.no-finite-number",
            quantity=name,
            given=given,
            name=name,
            unit="m/s" if model.unit(name) in SPEEDS else model.unit(name),
        )
    return float(given) / SPEEDS.get(model.unit(name), 1.0)


def _transformed(model: SeverityModel, term: Term, value: float) -> tuple[float, float]:
    """Value of the term and its slope with respect to the input in its unit."""
    if term.transform == "square":
        return value * value, 2.0 * value
    if term.transform == "log":
        if value <= 0.0:
            raise DataError(
                "crash.takes-logarithm-value",
                quantity=term.input,
                name=model.name,
                value=value,
                unit=term.unit,
            )
        return math.log(value), 1.0 / value
    return value, 1.0


def _validity(
    model: SeverityModel,
    inputs: Mapping[str, float | str],
    sd: Mapping[str, float],
    reach: float,
    outside: str,
) -> list[Finding]:
    findings = []
    for name, categories in model.applies.items():
        if name not in inputs:
            findings.append(
                Finding(
                    "crash.not-stated",
                    quantity=name,
                    name=model.name,
                    categories=categories,
                    name_2=name,
                )
            )
        elif inputs[name] not in categories:
            said = {"name": model.name, "categories": categories, "category": inputs[name]}
            findings.append(_outside("crash.model-for-others", name, outside, **said))
    for name, (low, high) in model.validity.items():
        value = _value(model, name, _given(model, inputs, name))
        error = reach * sd.get(name, 0.0) / SPEEDS.get(model.unit(name), 1.0)
        said = {"name": model.name, "value": value, "unit": model.unit(name)}
        said |= {"low": low, "high": high}
        if not low <= value <= high:
            findings.append(_outside("crash.outside-model-range", name, outside, **said))
        elif not low <= value - error <= value + error <= high:
            findings.append(
                Finding("crash.bound-leaves-range", quantity=name, error=error, data=said)
            )
    return findings


def _outside(code: str, quantity: str, outside: str, **values: Any) -> Finding:
    if outside == "refuse":
        raise DataError(f"{code}-refused", quantity=quantity, data=values)
    return Finding(code, quantity=quantity, data=values)
