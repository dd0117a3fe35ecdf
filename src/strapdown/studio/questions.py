"""Open points of a log, as questions with answers to choose from.

An answer sets keys of the table ``[log]``, or ``axes``; what the file itself suggests comes first.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from strapdown.config.toml_text import Asked, Offered
from strapdown.errors import Finding
from strapdown.formats.recording import PLACEHOLDERS
from strapdown.sensors.catalogue import SENSORS, load_sensor
from strapdown.units import ACCEL_UNITS, GYRO_UNITS, TIME_UNITS

#: Key of a table ``[log]`` of the studio that is of the fixes: their level over the ellipsoid, m.
HEIGHTS = "datum_height_m"
#: Keys of a table ``[log]`` of the studio: which of several files is meant, by its name; empty for
#: none of them.
ROLES = {"samples": "samples_file", "fixes": "fixes_file", "reference": "reference_file"}
#: Key of a table ``[log]`` of the studio with keys of single files, and their axes, by file name.
OF_FILES = "files"
#: Key of a table ``[log]`` of the studio: whether the sensor is on a shoe, as ``--foot``.
FOOT = "foot"
#: Findings about heights whose level only a person knows.
HEIGHTS_OPEN = (
    "io.height-level-not-stated",
    "io.height-over-sea-column",
    "io.heights-over-take-off",
)

#: Usual units of each key, the ones that are offered.
OFFERED: dict[str, list[str]] = {
    "gyro_unit": [unit for unit in ("rad/s", "deg/s", "mdeg/s", "deg/h") if unit in GYRO_UNITS],
    "accel_unit": [unit for unit in ("m/s2", "g", "mg", "-g", "-m/s2") if unit in ACCEL_UNITS],
    "time_unit": list(TIME_UNITS),
}
#: Usual orientations of a sensor: where its x, y and z point.
ORIENTATIONS = {
    "forward-right-down": "x forward, y right, z down",
    "forward-left-up": "x forward, y left, z up",
    "right-forward-up": "x right, y forward, z up (a phone flat on the dashboard)",
    "right-up-back": "x right, y up, z back (a phone upright in a holder)",
    "back-right-up": "x back, y right, z up",
    "left-back-up": "x left, y back, z up",
}
#: Codes of findings about axes that a log does not state.
AXES_OPEN = (
    "io.axes-not-stated",
    "io.axes-not-stated-z-up",
    "io.axes-not-stated-y-up",
    "io.axes-not-stated-other-up",
    "io.axes-upside-down",
)


def question_of(
    finding: Finding, answers: Mapping[str, str], file: str, columns: Mapping[str, str]
) -> dict[str, Any]:
    """Return an open question of a log.

    Parameters
    ----------
    answers : mapping
        Of all questions of the log, as inferred (`LogDiagnosis.answers`).
    columns : mapping
        Stated already; an answer about one column keeps the others.
    """
    triad = (finding.quantity or "").partition("_")[0]
    named = {q: a for q, a in answers.items() if q not in PLAIN and not q.endswith("_unit")}
    key = f"{triad}_unit"
    undecided = finding.code == "io.unit-undecided" and key in OFFERED
    if undecided or (key in answers and finding.code not in COLUMNS_OPEN):
        choices = list(_units(key, answers.get(key), finding))
        return _question(finding, file, key, choices, "text")
    if "repair" in answers and not (triad in named or finding.quantity in named):
        choices = [_choice("Leave out what cannot be used, and report it", {"repair": True})]
        return _question(finding, file, "repair", choices, None)
    if "rate" in answers and finding.code == "io.time-column-missing":
        return _question(finding, file, "rate_hz", [], "number", unit="Hz")
    own = {q: a for q, a in named.items() if q.partition("_")[0] == triad} or named
    choices = [_choice(_listed(own), {"columns": {**columns, **own}})] if own else []
    for name in finding.data.get("names", ()):
        label = {str(finding.quantity): str(name)}
        if finding.quantity and name not in own.values() and len(own) == 1:
            choices.append(_choice(_listed(label), {"columns": {**columns, **label}}))
    return _question(finding, file, "columns", choices, None)


#: Answers that are keys of their own.
PLAIN = ("repair", "rate")
#: Questions about which column is meant.
COLUMNS_OPEN = ("io.columns-ambiguous", "io.columns-by-words", "io.letter-g-open")


def axes_question(finding: Finding, file: str) -> dict[str, Any] | None:
    """Return the question how the sensor is mounted; None if the finding is about another thing."""
    if finding.code not in AXES_OPEN:
        return None
    choices = [_choice(text, {"axes": axes}) for axes, text in ORIENTATIONS.items()]
    return {**_question(finding, file, "axes", choices, "text"), "optional": True}


def heights_question(finding: Finding, file: str) -> dict[str, Any] | None:
    """Return the question for the level of heights; None if the finding is about another thing."""
    if finding.code not in HEIGHTS_OPEN:
        return None
    choices = []
    if finding.code != "io.heights-over-take-off":
        choices = [_choice("0: keep the heights as they are", {HEIGHTS: 0.0})]
    return _question(finding, file, HEIGHTS, choices, "number", unit="m")


def of_each(keys: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Divide keys into those of samples and those of fixes, without those of `ROLES`."""
    fixes = {HEIGHTS: keys[HEIGHTS]} if HEIGHTS in keys else {}
    others = (HEIGHTS, FOOT, OF_FILES, *ROLES.values())
    return {key: value for key, value in keys.items() if key not in others}, fixes


def of_file(
    keys: Mapping[str, Any], axes: str | None, name: str
) -> tuple[dict[str, Any], str | None]:
    """Return the keys and the axes of one file: as stated of all files, and of this one."""
    own = dict(keys.get(OF_FILES, {}).get(name, {}))
    own_axes = own.pop("axes", None)
    common = {key: value for key, value in keys.items() if key != OF_FILES}
    return {**common, **own}, own_axes or axes


def role_question(role: str, names: Sequence[str], *, none: str = "") -> dict[str, Any]:
    """Return the question which of several files has a role.

    Parameters
    ----------
    role : str
        Of `ROLES`.
    names : sequence of str
        Of the files that could have it.
    none : str
        Label of the answer that none has it; without it there is no such answer.
    """
    finding = Finding(f"studio.which-{role}", severity="error", data={"names": list(names)})
    key = ROLES[role]
    choices = [_choice(name, {key: name}) for name in names]
    choices += [_choice(none, {key: ""})] if none else []
    return {**_question(finding, "", key, choices, None), "file": None}


def either_question(name: str) -> dict[str, Any]:
    """Return the question whether a trajectory is the fixes, or what the result is held against."""
    finding = Finding("studio.fixes-or-reference", severity="error", file=name)
    fixes, reference = ROLES["fixes"], ROLES["reference"]
    choices = [
        _choice("Its positions are the fixes", {fixes: name}),
        _choice("It is a reference, to hold the result against", {fixes: "", reference: name}),
    ]
    return _question(finding, name, fixes, choices, None)


def offered_question(offered: Offered) -> dict[str, Any]:
    """Return the question whether a table that is a comment applies."""
    values = {f"{offered.table}.{key}": value for key, value in offered.values.items()}
    return {
        **_blank("studio.offered", offered.what, next(iter(values))),
        "choices": [_choice(offered.label, values)],
    }


def foot_question(foot: bool) -> dict[str, Any]:
    """Return the question whether the sensor is on a shoe, whose answer is proposed anew."""
    finding = Finding("studio.on-foot" if foot else "studio.on-foot-or-not", severity="note")
    label = "No, propose for a vehicle" if foot else "Yes, it is on a shoe"
    choices = [_choice(label, {FOOT: None if foot else True})]
    return {**_question(finding, "", FOOT, choices, None), "file": None}


#: Usual answers to open values of a configuration; a unit is one of angular rates in a gyro.
USUAL: dict[str, Sequence[Any]] = {
    "time_unit": ("s", "ms", "us"),
    "speed_unit": ("km/h", "mph", "m/s"),
    "force_unit": ("N", "kN", "lbf", "kip"),
    "unit": ("m/s2", "g"),
    "gyro.unit": ("deg/s", "rad/s"),
    "angles_deg": (0, 90, 180, -90),
}


def open_question(
    asked: Asked, key: str, unit: str, count: int, example: str = ""
) -> dict[str, Any]:
    """Return the question for a value of a proposed configuration that only a person knows.

    `count`: numbers that it has, where it is a list.
    """
    *_, table, name = ("", *key.split("."))
    usual = USUAL.get(f"{table}.{name}", USUAL.get(name, ())) if count == 1 else ()
    if key == "sensors.sensor":
        usual = [one for one in SENSORS if load_sensor(one).grade != "crash"]
    return {
        **_blank("config.open-value", asked.what, key),
        "choices": [_choice(f"{one} {unit}".strip(), {key: one}) for one in usual],
        "line": asked.line,
        "free": "number" if unit else "text",
        "unit": unit,
        "count": count,
        "example": example,
    }


def _blank(code: str, text: str, key: str) -> dict[str, Any]:
    """Return a question of a proposed configuration, without answers."""
    return {"code": code, "text": text, "key": key, "choices": [], "free": None, "unit": None}


def _units(key: str, inferred: str | None, finding: Finding) -> Iterator[dict[str, Any]]:
    shares: Any = finding.data.get("choices", ())
    said = [str(f.data["value"]) for f in shares if isinstance(f, Finding) and "value" in f.data]
    likely = [] if inferred is None or inferred in PLACEHOLDERS else [inferred]
    usual = OFFERED.get(key, [])
    for unit in dict.fromkeys(likely + said + usual):
        if unit != "None":
            yield {**_choice(unit, {key: unit}), **({"likely": True} if unit in likely else {})}


def _choice(label: str, values: Mapping[str, Any]) -> dict[str, Any]:
    return {"label": label, "set": dict(values)}


def _listed(columns: Mapping[str, str]) -> str:
    return ", ".join(f"{quantity}: {name}" for quantity, name in columns.items())


def _question(
    finding: Finding,
    file: str,
    key: str,
    choices: list[dict[str, Any]],
    free: str | None,
    unit: str | None = None,
) -> dict[str, Any]:
    return {
        "code": finding.code,
        "text": finding.sentence("studio"),
        "remedy": finding.advice("studio"),
        "file": file,
        "key": key,
        "choices": choices,
        "free": free,
        "unit": unit,
    }
