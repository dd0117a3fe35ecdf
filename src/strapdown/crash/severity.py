"""Injury-risk models, and the probability of injury with a bound from the inputs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np

from strapdown.config.toml_file import KeyPath, TomlFile, read_toml
from strapdown.dsp.chi_square import normal_quantile
from strapdown.errors import ConfigError, DataError, Finding, add_warning, check_choice
from strapdown.units import SPEEDS as ALL_SPEEDS

#: Units of speed, in m/s. Inputs with these units are given in m/s; others in their stated unit.
SPEEDS: dict[str, float] = {unit: ALL_SPEEDS[unit] for unit in ("m/s", "km/h", "mph")}
TRANSFORMS = ("identity", "log", "square")
OUTSIDE = ("refuse", "tell")


@dataclass(frozen=True)
class Term:
    """One term of the logit.

    `coefficient` is per unit of the transformed input (log is natural), `unit` that of the source's
    table; for a category (`equals`) it is added where the input matches.
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
    covariance : tuple of tuple of float
        Of the intercept and of the coefficients in the order of the terms; empty where the source
        states none. Of standard errors alone it is diagonal.
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
    covariance: tuple[tuple[float, ...], ...] = ()

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
        Bound from the uncertainty of the inputs and, where the model has their covariance, of the
        coefficients.
    coverage : float
        Of the bound.
    logit, logit_sd : float
    model_sd : float or None
        Part of the logit's standard deviation that is the model's; None where its source states
        none, and the bound leaves it out.
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
    model_sd: float | None = None


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

    Raises
    ------
    DataError
        An input is missing or not a number, or the model is not valid there.
    ConfigError
        An option or an sd is not valid.

    Notes
    -----
    The logistic function is monotone, so the bound is that of the logit transformed by it; for
    untransformed inputs (no log, no square) and normal errors it is exact. The variance of the
    logit by the coefficients is ``x' V x`` with their covariance V and x = (1, transformed inputs).
    """
    from scipy.special import expit

    spread = dict(sd or {})
    _check_options(model, spread, coverage, outside)
    reach = normal_quantile(0.5 + 0.5 * coverage)
    findings = list(_validity(model, inputs, spread, reach, outside))
    logit, variance = model.intercept, 0.0
    slopes: dict[str, float] = {}
    regressors = [1.0]
    for term in model.terms:
        given = _given(model, inputs, term.input)
        if term.equals is not None:
            regressors.append(1.0 if given == term.equals else 0.0)
            logit += term.coefficient * regressors[-1]
            continue
        value = _value(model, term.input, given)
        made, slope = _transformed(model, term, value)
        regressors.append(made)
        logit += term.coefficient * made
        slopes[term.input] = slopes.get(term.input, 0.0) + term.coefficient * slope
    for name, slope in slopes.items():
        factor = SPEEDS.get(model.unit(name), 1.0)
        variance += (slope * spread.get(name, 0.0) / factor) ** 2
    own = None
    if model.covariance:
        x = np.array(regressors)
        own = float(x @ np.array(model.covariance) @ x)
        variance += own
    reach *= math.sqrt(variance)
    return InjuryRisk(
        model,
        float(expit(logit)),
        float(expit(logit - reach)),
        float(expit(logit + reach)),
        coverage,
        logit,
        math.sqrt(variance),
        tuple(findings),
        None if own is None else math.sqrt(max(own, 0.0)),
    )


def _check_options(
    model: SeverityModel, sd: Mapping[str, float], coverage: float, outside: str
) -> None:
    check_choice("crash.outside-option-unknown", OUTSIDE, quantity="outside", outside=outside)
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
    findings: list[Finding] = []
    for name, categories in model.applies.items():
        if name not in inputs:
            add_warning(
                findings,
                "crash.not-stated",
                quantity=name,
                name=model.name,
                categories=categories,
                name_2=name,
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
            add_warning(findings, "crash.bound-leaves-range", quantity=name, error=error, data=said)
    return findings


def _outside(code: str, quantity: str, outside: str, **values: Any) -> Finding:
    if outside == "refuse":
        raise DataError(f"{code}-refused", quantity=quantity, data=values)
    return Finding(code, quantity=quantity, data=values)


# Published models of injury risk.
#
# Only models with an identified published table are included. URGENCY and its successors
# (Malliaris 1997, Bahouth 2004, Kononen 2011) and the MAIS3+ model of the planner by Geisslinger
# and others (2023) are not: their coefficients were found in programs that name no table of a
# publication. `load_severity_model` reads them from a user who has the source.


WANG_NOTE = (
    "Logistic regression on NASS-CDS 2010-2015, all occupants together, belted or not. The report "
    "itself was not at hand: the coefficients are as two public programs quote them, which name "
    "the tables, A-3 of all crashes and A-6 of frontal ones (also as 4-1 and 4-3). The range given "
    "is that in which the curves of one table keep their order (a graver injury is less likely), "
    "and not the report's own. Its tables of other directions were not seen."
)
# First crossing of two curves of a table, in mph, rounded down: 56.3 and 60.4.
WANG_RANGE = {"all": 56.0, "front": 60.0}
WANG_TABLE = {"all": "A-3", "front": "A-6"}


def _wang(crash: str, outcome: str, intercept: float, slope: float) -> SeverityModel:
    return SeverityModel(
        name=f"wang_2022_{crash}_{outcome.lower().replace('+', '')}",
        title="MAIS(05/08) injury probability curves as functions of delta V, DOT HS 813 219",
        author="Wang",
        year=2022,
        table=f"Table {WANG_TABLE[crash]}",
        outcome=outcome,
        intercept=intercept,
        terms=(Term("delta_v", slope, "mph"),),
        validity={"delta_v": (0.0, WANG_RANGE[crash])},
        applies={} if crash == "all" else {"crash_type": (crash,)},
        note=WANG_NOTE,
    )


#: Models by name, as selected by the user.
SEVERITY_MODELS: dict[str, SeverityModel] = {
    "wang_2022_all_mais1": _wang("all", "MAIS1+", -1.3925, 0.0815),
    "wang_2022_all_mais2": _wang("all", "MAIS2+", -5.1331, 0.1479),
    "wang_2022_all_mais3": _wang("all", "MAIS3+", -6.9540, 0.1637),
    "wang_2022_all_mais4": _wang("all", "MAIS4+", -8.2070, 0.1564),
    "wang_2022_all_mais5": _wang("all", "MAIS5+", -8.7927, 0.1598),
    "wang_2022_all_fatal": _wang("all", "fatal", -8.9819, 0.1603),
    "wang_2022_front_mais1": _wang("front", "MAIS1+", -1.4930, 0.0854),
    "wang_2022_front_mais2": _wang("front", "MAIS2+", -4.9429, 0.1425),
    "wang_2022_front_mais3": _wang("front", "MAIS3+", -6.9774, 0.1620),
    "wang_2022_front_mais4": _wang("front", "MAIS4+", -8.4254, 0.1586),
    "wang_2022_front_mais5": _wang("front", "MAIS5+", -8.8355, 0.1566),
    "wang_2022_front_fatal": _wang("front", "fatal", -9.0422, 0.1571),
}


def find_severity_model(name: str) -> SeverityModel:
    """Return a model by its name, or that of a file that ends in ``.toml``.

    Raises
    ------
    ConfigError
        There is none of that name, and the message suggests the nearest; or as
        `load_severity_model`.
    """
    if name.lower().endswith(".toml"):
        return load_severity_model(name)
    check_choice("crash.no-severity-model", SEVERITY_MODELS, quantity="severity model", name=name)
    return SEVERITY_MODELS[name]


# Injury-risk model from a TOML file transcribed from a publication.


#: Largest coefficient.
LARGEST = 1e100
TEXTS = ("title", "author", "table", "outcome")
TOP = (
    *TEXTS,
    *("year", "intercept", "terms", "validity", "applies", "note"),
    *("covariance", "intercept_standard_error"),
)
NUMBER_TERM = ("input", "unit", "coefficient", "transform", "standard_error")
CATEGORY_TERM = ("input", "equals", "coefficient", "standard_error")


def load_severity_model(path: str | Path) -> SeverityModel:
    """Read an injury-risk model.

    Parameters
    ----------
    path : str or Path
        A TOML file; its name is that of the model. ``title``, ``author``, ``year``, ``table`` and
        ``outcome`` give the outcome and the source; ``intercept`` and ``[[terms]]`` are the logit.
        Each term has ``input``, ``unit`` and ``coefficient`` (and ``transform``: identity, log or
        square), or, for a category, ``input``, ``equals`` and ``coefficient``. ``[validity]`` gives
        ``input = [least, greatest]`` in the unit of its term, ``[applies]`` gives
        ``input = ["category", ...]``. For the bound, ``covariance`` is the matrix of the intercept
        and of the coefficients in the order of the terms; or ``intercept_standard_error`` and the
        ``standard_error`` of every term, whose correlations are then taken as zero.

    Raises
    ------
    ConfigError
        The file is missing or not in this form; the message names the line and the key.
    """
    file = read_toml(Path(path))
    table = file.table
    _known(file, table, TOP, "")
    texts = {key: _text(file, table, key) for key in TEXTS}
    year = table.get("year")
    if isinstance(year, bool) or not isinstance(year, int):
        raise _bad(file, "year", "crash.year-not-whole", year=year)
    note = table.get("note", "")
    if not isinstance(note, str):
        raise _bad(file, "note", "crash.no-text")
    terms = _terms(file, table)
    return SeverityModel(
        name=file.path.stem,
        year=year,
        intercept=_number(file, table.get("intercept"), "intercept"),
        terms=terms,
        validity=_ranges(file, table.get("validity", {}), terms),
        applies=_applies(file, table.get("applies", {})),
        note=note,
        covariance=_covariance(file, table),
        **texts,
    )


def _covariance(file: TomlFile, table: Mapping[str, Any]) -> tuple[tuple[float, ...], ...]:
    """Covariance of the coefficients: as stated, or of standard errors; empty without either."""
    rows = table["terms"]
    names = [
        "intercept_standard_error",
        *(f"terms {k + 1}.standard_error" for k in range(len(rows))),
    ]
    given = [table.get(names[0]), *(row.get("standard_error") for row in rows)]
    known = [name for name, value in zip(names, given, strict=True) if value is not None]
    if "covariance" not in table:
        if not known:
            return ()
        if len(known) < len(names):
            lacks = next(name for name in names if name not in known)
            raise _bad(file, lacks, "crash.standard-error-missing", given=known[0])
        errors = [_number(file, v, n) for n, v in zip(names, given, strict=True)]
        for name, error in zip(names, errors, strict=True):
            if error < 0.0:
                raise _bad(file, name, "crash.standard-error-negative", value=error)
        return tuple(tuple(row) for row in np.diag(np.square(errors)).tolist())
    if known:
        raise _bad(file, known[0], "crash.covariance-and-standard-errors")
    stated = table["covariance"]
    size = len(names)
    square = isinstance(stated, list) and len(stated) == size
    if not square or not all(isinstance(row, list) and len(row) == size for row in stated):
        raise _bad(file, "covariance", "crash.covariance-not-square", size=size)
    matrix = np.array([[_number(file, v, "covariance") for v in row] for row in stated])
    # Published matrices are rounded.
    scale = float(np.abs(matrix).max())
    if not np.allclose(matrix, matrix.T, rtol=0.0, atol=1e-6 * scale) or (
        float(np.linalg.eigvalsh(matrix)[0]) < -1e-3 * scale
    ):
        raise _bad(file, "covariance", "crash.covariance-not-valid")
    return tuple(tuple(row) for row in matrix.tolist())


def _terms(file: TomlFile, table: Mapping[str, Any]) -> tuple[Term, ...]:
    rows = table.get("terms")
    if not isinstance(rows, list) or not rows or not all(isinstance(r, dict) for r in rows):
        raise _bad(file, "terms", "crash.terms-missing")
    terms: list[Term] = []
    for k, row in enumerate(rows, start=1):
        place = f"terms {k}"
        category = "equals" in row
        _known(file, row, CATEGORY_TERM if category else NUMBER_TERM, f"{place}.")
        name = _text(file, row, "input", f"{place}.")
        coefficient = _number(file, row.get("coefficient"), f"{place}.coefficient")
        if category:
            term = Term(name, coefficient, equals=_text(file, row, "equals", f"{place}."))
        else:
            transform = row.get("transform", "identity")
            if not isinstance(transform, str) or transform not in TRANSFORMS:
                raise _bad(
                    file,
                    f"{place}.transform",
                    "crash.transform-unknown",
                    transform=transform,
                    word=str(transform),
                    known=TRANSFORMS,
                )
            term = Term(name, coefficient, _text(file, row, "unit", f"{place}."), transform)
        for other in terms:
            _refuse_clash(file, place, term, other)
        terms.append(term)
    return tuple(terms)


def _refuse_clash(file: TomlFile, place: str, term: Term, other: Term) -> None:
    if term.input != other.input:
        return
    if (term.equals is None) != (other.equals is None):
        code = "crash.term-number-and-category"
    elif term.unit != other.unit:
        code = "crash.term-in-two-units"
    elif (term.transform, term.equals) == (other.transform, other.equals):
        code = "crash.term-twice"
    else:
        return
    units = {"unit": term.unit, "before": other.unit, "speeds": SPEEDS.keys()}
    raise _bad(file, place, code, input=term.input, **units)


def _ranges(file: TomlFile, given: Any, terms: tuple[Term, ...]) -> dict[str, tuple[float, float]]:
    if not isinstance(given, dict):
        raise _bad(file, "validity", "crash.validity-not-a-table")
    numbers = {t.input: t for t in terms if t.equals is None}
    ranges: dict[str, tuple[float, float]] = {}
    for name, pair in given.items():
        place = f"validity.{name}"
        if name not in numbers:
            raise _bad(file, place, "crash.no-term-number-input", word=name, known=numbers)
        if not isinstance(pair, list) or len(pair) != 2:
            raise _bad(file, place, "crash.validity-not-a-pair", pair=pair, name=name)
        low, high = (_number(file, value, place) for value in pair)
        if not low < high:
            raise _bad(file, place, "crash.no-range", low=low, high=high)
        ranges[name] = (low, high)
    return ranges


def _applies(file: TomlFile, given: Any) -> dict[str, tuple[str, ...]]:
    if not isinstance(given, dict):
        raise _bad(file, "applies", "crash.applies-not-a-table")
    for name, words in given.items():
        if not isinstance(words, list) or not words or not all(isinstance(w, str) for w in words):
            raise _bad(
                file, f"applies.{name}", "crash.categories-not-texts", words=words, name=name
            )
    return {name: tuple(words) for name, words in given.items()}


def _number(file: TomlFile, value: Any, key: str) -> float:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    # Nor an integer without a double, or a number whose square overflows.
    if not number or not -LARGEST <= value <= LARGEST:
        raise _bad(file, key, "crash.coefficient-not-a-number", value=value)
    return float(value)


def _text(file: TomlFile, table: Mapping[str, Any], key: str, prefix: str = "") -> str:
    value = table.get(key)
    if not isinstance(value, str) or not value.strip():
        code = {"table": "crash.table-missing", "unit": "crash.unit-missing"}
        said = {"name": key, "speeds": SPEEDS.keys()}
        raise _bad(file, f"{prefix}{key}", code.get(key, "crash.text-missing"), **said)
    return value


def _known(file: TomlFile, table: Mapping[str, Any], known: tuple[str, ...], prefix: str) -> None:
    for key in table:
        if key not in known:
            raise _bad(file, f"{prefix}{key}", "crash.no-such-key", word=key, known=known)


def _bad(file: TomlFile, key: str, code: str, **values: Any) -> ConfigError:
    path: list[str | int] = []
    for part in key.split("."):
        name, _, number = part.partition(" ")
        path += [name, int(number) - 1] if number.isdecimal() else [part]
    line = file.line(cast(KeyPath, tuple(path)))
    return ConfigError(code, file=file.path.name, line=line, quantity=key, data=values)
