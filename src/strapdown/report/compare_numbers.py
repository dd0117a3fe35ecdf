"""The numbers of a sealed result that are compared, each with its unit and its 95 % bound.

A result is what a file says, which somebody may have written by hand: every value is looked at
before it is used, and what has another form than strapdown writes is left out.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from strapdown.constants import TWO_SIDED_95
from strapdown.navigation.heading_integrity import STATUSES
from strapdown.report.compare_folders import LONGEST, RunPart
from strapdown.report.crash_case import in_si
from strapdown.report.values import AXES, shares_words
from strapdown.tables import EULER, NED, VELOCITY
from strapdown.units import SPEEDS

#: Group of what is a property of the unit that recorded, and no error of the result.
OF_THE_UNIT = "Estimated sensor errors"
Place = tuple[float, float, float]


@dataclass(frozen=True)
class Value:
    """One number, or word, of a result.

    Attributes
    ----------
    key : str
        The same for the same quantity in every result.
    value : float, str or None
        In SI and degrees; None of a quantity that has a bound alone.
    unit : str
    below, above : float or None
        Half widths of the 95 % bound, below and above the value; infinite where it is open.
    kind : str
        ``number``; ``angle``, whose difference is within half a turn; ``word``; ``count``;
        ``share`` in %; ``lat``, ``lon`` and ``horizontal``: differences and bounds are in m.
    place : tuple of float, optional
        Latitude and longitude in deg, height in m, of these.
    at : float, optional
        Instant that it belongs to, s: values of different instants have no difference.
    detail : bool
        Whether a short list leaves it out.
    note : str
        What its bound leaves out or rests on, or how it was judged; empty without a remark.
    """

    key: str
    group: str
    label: str
    value: float | str | None
    unit: str = ""
    below: float | None = None
    above: float | None = None
    kind: str = "number"
    place: Place | None = field(default=None, repr=False)
    at: float | None = None
    detail: bool = False
    note: str = ""


def values_of(part: RunPart) -> Iterator[Value]:
    """Yield the numbers of a result; of a command without a list here, all that its JSON has.

    DataError: its JSON is damaged or missing.
    """
    found = NUMBERS.get(str(part.manifest["command"]))
    if found is not None:
        yield from found(part)
    else:
        yield from _every(part.answer, "", 0)


# Access to data of an unknown form.


def _at(node: Any, *path: str | int) -> Any:
    """Value at a path; None if there is none."""
    for part in path:
        if isinstance(node, dict):
            node = node.get(part)
        elif isinstance(node, list) and isinstance(part, int) and -len(node) <= part < len(node):
            node = node[part]
        else:
            return None
    return node


def _number(node: Any, *path: str | int) -> float | None:
    """A finite number at a path."""
    found = _at(node, *path)
    if isinstance(found, bool) or not isinstance(found, int | float):
        return None
    try:
        value = float(found)
    except OverflowError:
        return None
    return value if math.isfinite(value) else None


def _word(node: Any, *path: str | int) -> str | None:
    found = _at(node, *path)
    if isinstance(found, bool):
        return "yes" if found else "no"
    return found[:LONGEST] if isinstance(found, str) else None


def _table(node: Any, *path: str | int) -> dict[str, Any]:
    found = _at(node, *path)
    return found if isinstance(found, dict) else {}


def _tables(node: Any, *path: str | int) -> list[dict[str, Any]]:
    found = _at(node, *path)
    return [one for one in found if isinstance(one, dict)] if isinstance(found, list) else []


def _half(sd: float | None) -> float | None:
    return None if sd is None or sd < 0.0 else TWO_SIDED_95 * sd


def _row(
    key: str, group: str, label: str, value: float | str | None, unit: str = "", **more: Any
) -> Iterator[Value]:
    """Yield a value if there is one; `half`: half width of its bound on both sides."""
    half = more.pop("half", None)
    if half is not None:
        more |= {"below": half, "above": half}
    if isinstance(value, str):
        more["kind"] = "word"
    if value is not None:
        yield Value(key, group, label, value, unit, **more)


def _rows(
    node: Any, key: str, group: str, *rows: tuple[str, str, str], **more: Any
) -> Iterator[Value]:
    """Yield the numbers of a table by their names, labels and units; `key`: before the names."""
    for name, label, unit in rows:
        yield from _row(f"{key}{name}", group, label, _number(node, name), unit, **more)


def _within(node: Any, key: str) -> dict[str, float]:
    """Half widths to the ends ``low`` and ``high`` of a table with a value; open where null."""
    value, low, high = (_number(node, key, name) for name in ("value", "low", "high"))
    if value is None or (low is None and high is None):
        return {}
    return {
        "below": math.inf if low is None else max(0.0, value - low),
        "above": math.inf if high is None else max(0.0, high - value),
    }


# Navigation and alignment.


def _navigate(part: RunPart) -> Iterator[Value]:
    data = part.answer
    integrity = part.json("verdict.json")
    yield from _row("answer.verdict", "Answer", "verdict", _word(data, "trust", "verdict"))
    shares = {key: _number(integrity, "heading", "share", key) for key in STATUSES}
    of_time = [(f"heading.{key}", f"heading {key}", share) for key, share in shares.items()]
    at_end = _word(integrity, "heading", "at_end")
    trusted = [
        (f"{name}.trusted", f"{name.replace('_', ' ')} trusted", _number(one, "share", "trusted"))
        for name, one in _table(integrity, "quantities").items()
    ]
    for rows in (of_time, trusted):
        for key, words, share in rows:
            key, label = f"integrity.{key}", f"time with {words}"
            yield from _row(key, "Integrity", label, _percent(share), "%", kind="share")
        if rows is of_time:
            yield from _row("integrity.heading.at_end", "Integrity", "heading at the end", at_end)
    judged = shares_words({key: share for key, share in shares.items() if share is not None})
    note = f"{judged} of the time; final status: {at_end}" if judged and at_end else ""
    codes = [_word(one, "code") for one in _tables(data, "findings")]
    arm = "navigation.lever-arm-zero" in codes
    of_arm = "without the lever arm, taken as zero" if arm else ""
    notes = {"end.heading_deg": note, "end.horizontal_m": of_arm}
    for number in _state(_table(data, "end")):
        yield replace(number, note=notes.get(number.key, ""))
    largest = _number(integrity, "position", "largest_bound_95_m")
    label = "largest 95 % bound, horizontal"
    yield from _row("bounds.largest_horizontal_m", "Bounds", label, largest, "m")
    for k, one in enumerate(_tables(data, "gnss_outage_tests"), start=1):
        begin = _number(one, "from_s")
        label = f"outage test {k}" if begin is None else f"outage test from {begin:.6g} s"
        for key, name, words in (
            ("m", "largest_horizontal_error_m", "largest error"),
            ("bound_m", "bound_95_m", "its bound"),
        ):
            key, words = f"outage_test.{k}.{key}", f"{label}, {words}"
            yield from _row(key, "Bounds", words, _number(one, name), "m")
    yield from _against(data)
    yield from _rows(
        _table(data, "trajectory"),
        "path.",
        "Path",
        ("travelled_m", "way over ground", "m"),
        ("from_s", "begin", "s"),
        ("to_s", "end", "s"),
    )
    for stage in ("coarse", "fine"):
        one = _table(data, "alignment", stage)
        yield from _angles(one, f"alignment.{stage}", "Alignment", f"{stage}, ")
    for name, one in _table(data, "sensors").items():
        value, unit, half = _number(one, "estimate"), _word(one, "unit"), _half(_number(one, "sd"))
        more = {"half": half, "detail": "bias" not in name}
        label = name.replace("_", " ")
        yield from _row(f"sensors.{name}", OF_THE_UNIT, label, value, unit or "", **more)
    for name, one in _table(data, "observations").items():
        group, key = "Measurements", f"observations.{name}."
        counts = (("epochs", f"{name}: epochs", ""), ("rejected", f"{name}: rejected", ""))
        yield from _rows(one, key, group, *counts, kind="count")
        label = f"{name}: innovations, rms in their sd"
        yield from _rows(one, key, group, ("rms_in_sd", label, ""))


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def _state(end: Mapping[str, Any]) -> Iterator[Value]:
    """Position, velocity and attitude at the end of a run."""
    group, time = "At the end", _number(end, "time_s")
    yield from _row("end.time_s", group, "time", time, "s")
    lat, lon, alt = (_number(end, key) for key in ("lat_deg", "lon_deg", "alt_m"))
    sd = {n: _half(_number(end, f"{n}_sd_m")) for n in NED}
    if lat is not None and lon is not None and alt is not None:
        place = (lat, lon, alt)
        for kind, label, value, half in (
            ("lat", "latitude", lat, sd["north"]),
            ("lon", "longitude", lon, sd["east"]),
        ):
            more: dict[str, Any] = {"kind": kind, "half": half, "place": place, "at": time}
            yield from _row(f"end.{kind}_deg", group, label, value, "deg", **more)
        bound = _number(end, "horizontal_bound_95_m")
        label = "position, horizontal"
        ends = (bound, bound, "horizontal", place, time)
        yield Value("end.horizontal_m", group, label, None, "m", *ends)
    yield from _row("end.alt_m", group, "height", alt, "m", half=sd["down"], at=time)
    for name, word in zip(VELOCITY, NED, strict=True):
        half = _half(_number(end, f"{name}_sd_m_per_s"))
        row = (f"{name}_m_per_s", f"velocity {word}", "m/s")
        yield from _rows(end, "end.", group, row, half=half, at=time)
    yield from _angles(end, "end", group, "", at=time)


def _angles(
    one: Mapping[str, Any], key: str, group: str, head: str, **more: Any
) -> Iterator[Value]:
    for name in EULER:
        half, row = _half(_number(one, f"{name}_sd_deg")), (f"{name}_deg", f"{head}{name}", "deg")
        yield from _rows(one, f"{key}.", group, row, half=half, kind="angle", **more)


#: Endings of the keys of a score, with words.
SCORES = (
    ("rms_{}", "rms"),
    ("largest_{}", "largest"),
    ("bound_95_rms_{}", "95 % bound, rms"),
)
_UNITS = {"m": "m", "m_per_s": "m/s", "deg": "deg"}
_WORDS = dict(zip(VELOCITY, (f"velocity {word}" for word in NED), strict=True))
#: Errors that a short list has.
MAIN_ERRORS = ("horizontal", "down", "heading")


def _against(data: Mapping[str, Any]) -> Iterator[Value]:
    """Errors against a truth, and at control points."""
    against = _table(data, "against")
    group = "Errors against the truth"
    yield from _row("against.name", group, "truth", _word(against, "name"))
    for name, one in _table(against, "errors").items():
        words, detail = _WORDS.get(name, name), name not in MAIN_ERRORS
        for ending, unit in _UNITS.items():
            for pattern, what in SCORES:
                row = (pattern.format(ending), f"{words}, {what}", unit)
                short = detail or what.startswith("95")
                yield from _rows(one, f"against.{name}.", group, row, detail=short)
        share = _percent(_number(one, "share_within_bound"))
        label, more = f"{words}, time within its bound", {"kind": "share", "detail": detail}
        yield from _row(f"against.{name}.share", group, label, share, "%", **more)
    label = f"mean NEES (expected {_number(against, 'nees_of') or 0:g})"
    yield from _rows(against, "against.", group, ("mean_nees", label, ""))
    points = [
        (f"{name}_m", f"control points, {name}", "m") for name in ("rms", "median", "largest")
    ]
    yield from _rows(_table(data, "control_points"), "control_points.", group, *points)


def _align(part: RunPart) -> Iterator[Value]:
    data = part.answer
    yield from _row("answer.verdict", "Answer", "verdict", _word(data, "trust", "verdict"))
    end = _number(data, "end", "time_s")
    yield from _row("end.time_s", "At the end", "time", end, "s")
    yield from _angles(_table(data, "end"), "end", "At the end", "", at=end)
    yield from _angles(_table(data, "coarse"), "coarse", "Coarse alignment", "")
    fine = _table(data, "fine")
    for name, unit in (("gyro_bias", "rad/s"), ("accel_bias", "m/s²")):
        ending = unit.replace("/", "_per_").replace("²", "2")
        for k, axis in enumerate("xyz"):
            value, sd = (_number(fine, f"{name}{of}_{ending}", k) for of in ("", "_sd"))
            label = f"{name.replace('_', ' ')} {axis}"
            key, half = f"fine.{name}_{axis}", _half(sd)
            yield from _row(key, OF_THE_UNIT, label, value, unit, half=half)
    other, group = _table(data, "compared_with"), "Errors against the truth"
    yield from _row("against.name", group, "truth", _word(other, "name"))
    for k, name in enumerate(EULER):
        value, half = _number(other, "off_deg", name), _half(_number(other, "sd_deg", k))
        yield from _row(f"against.{name}_deg", group, name, value, "deg", half=half)


# Attitude.


def _attitude(part: RunPart) -> Iterator[Value]:
    data = part.answer
    answer = _table(data, "answer")
    group = "Answer"
    for key in ("verdict", "algorithm"):
        yield from _row(f"answer.{key}", group, key, _word(answer, key))
    rates = (("rate_hz", "lowest rate", "Hz"), ("dropped_hz", "lowest rate, decimated", "Hz"))
    yield from _rows(answer, "answer.", group, *rates)
    label, value = "shortest time within the tolerance", _number(answer, "holding", "shortest_s")
    yield from _row("answer.holding_s", group, label, value, "s")
    of_record = ("rate_hz", "rate of the record", "Hz")
    yield from _rows(_table(data, "clock"), "record.", group, of_record)
    for one in _tables(data, "algorithms"):
        name = _word(one, "algorithm") or "?"
        head = f"algorithms.{name}."
        for score in _tables(one, "scores"):
            against = _word(score, "against") or "?"
            for key, words in (
                ("error_deg", "at the end"),
                ("rms_deg", "rms"),
                ("max_deg", "largest"),
            ):
                place, row = f"{head}{against}.", (key, f"{name}, {words}", "deg")
                detail = key == "error_deg"
                yield from _rows(score, place, f"Errors against {against}", row, detail=detail)
        final = _table(one, "final")
        angles = [(f"{axis}_deg", f"{name}, {axis}", "deg") for axis in EULER]
        more: dict[str, Any] = {"kind": "angle", "at": _number(final, "time_s"), "detail": True}
        yield from _rows(final, f"{head}final.", "Attitude at the end", *angles, **more)
        for key, words in (("own_deg", "algorithm error"), ("sensor_deg", "sensor error")):
            value, label = _number(one, "share", key, "max"), f"{name}, {words}, largest"
            yield from _row(head + key, "Shares of the error", label, value, "deg", detail=True)
    for one in _tables(data, "sweep"):
        name, rate = _word(one, "algorithm") or "?", _number(one, "rate_hz")
        meaning = MEANINGS.get(_word(one, "meaning") or "")
        if rate is None or meaning is None:
            continue
        value, label = _number(one, "error_deg"), f"{name} at {rate:.6g} Hz"
        group = f"Errors by algorithm and rate, samples {meaning}"
        key = f"sweep.{meaning}.{name}.{rate:.6g}"
        yield from _row(key, group, label, value, "deg", detail=True)


#: Parts of a lower rate.
MEANINGS = {"sum": "averaged", "drop": "decimated"}


# Crash.


def _crash(part: RunPart) -> Iterator[Value]:
    data = in_si(part.answer)
    main, answers = _word(data, "main"), _tables(data, "answers")
    agree = _word(data, "comparison", "agree")
    found = _at(data, "on_assumption")
    assumed = [w for w in BY_ASSUMPTION if isinstance(found, list) and w in found]
    yield from _row("answer.recorder", "Answer", "result by", main)
    yield from _row("answer.agree", "Answer", "recorders agree", agree)
    for answer in answers:
        events = _tables(answer, "events")
        if _word(answer, "recorder") == main:
            for event in events:
                number = f"{_number(event, 'event') or 0:g}"
                group = f"Impact {number}" if len(events) > 1 else "Impact"
                key = f"main.event.{number}"
                is_main = _number(event, "event") == _number(answer, "main_event")
                rests = {f"{key}.{BY_ASSUMPTION[w]}" for w in assumed if is_main}
                for row in _impact(event, key, group):
                    yield replace(row, note="by assumption") if row.key in rests else row
            yield from _crash_path(answer, is_over_ground(data))
    recorders = {_word(one, "name") for one in _tables(data, "case", "units")}
    for answer in answers if len(recorders) > 1 else ():
        own, main_event = _word(answer, "recorder"), _number(answer, "main_event")
        if own not in recorders:
            continue  # their mean
        for event in _tables(answer, "events"):
            if _number(event, "event") == main_event:
                yield from _force(event, f"recorders.{own}", "Each recorder", f"{own}, ")
    for one in _tables(data, "severity"):
        model, outcome = _word(one, "model") or "?", _word(one, "outcome") or ""
        words = f"{outcome}, {_word(one, 'source') or model}"
        label, key = _of_main(one, words, f"severity.{model}", main)
        more = {
            k: 100.0 * v
            for k, v in _within({"": one | {"value": one.get("probability")}}, "").items()
        }
        value = _percent(_number(one, "probability"))
        alone = _at(one, "model_uncertainty_in_bound") is False
        note = "the bound is of delta-V alone, not of the model" if alone and more else ""
        yield from _row(key, "Severity", label, value, "%", **more, note=note)
    indices = _tables(data, "indices")
    several = Counter((_word(one, "index"), _word(one, "of")) for one in indices)
    alike = Counter(tuple(_word(one, k) for k in ("index", "of", "standard")) for one in indices)
    for one in indices:
        name, unit = _word(one, "index") or "?", _word(one, "unit") or ""
        # One index by two standards, or by the sensors of two sets of channels, is two numbers.
        index, of, standard = (_word(one, k) for k in ("index", "of", "standard"))
        if several[index, of] > alike[index, of, standard]:
            name = f"{name}, {standard or '?'}"
        channels = _at(one, "channels")
        if alike[index, of, standard] > 1 and isinstance(channels, list):
            name = f"{name}, channels {', '.join(map(str, channels))}"
        label, key = _of_main(one, name, f"indices.{name}", main)
        factor, unit = (SPEEDS["mph"], "m/s") if unit == "mph" else (1.0, unit)
        value = _number(one, "value")
        value = None if value is None else factor * value
        more = {k: factor * v for k, v in _within({"": one}, "").items()}
        yield from _row(key, "Severity", label, value, unit, **more)
    yield from _deformation(_table(data, "deformation"), main)
    closure = _table(data, "closure")
    for key, label, unit in CLOSURE:
        value, more = _number(closure, key, "value"), _within(closure, key)
        yield from _row(f"closure.{key}", "The collision", label, value, unit, **more)
    for one in _tables(data, "references"):
        name, consistent = _word(one, "reference") or "?", _word(one, "consistent")
        yield from _row(f"references.{name}", "References", f"{name}: consistent", consistent)


def _deformation(found: Mapping[str, Any], main: str | None) -> Iterator[Value]:
    """Crush by each recorder, and what a stated residual crush gives."""
    group = "Deformation"
    for one in _tables(found, "crush"):
        label, key = _of_main({"of": _word(one, "recorder")}, "crush", "deformation.crush_m", main)
        more = _within(one, "depth_m")
        if _at(one, "at_least") is True:
            more["above"] = math.inf
        yield from _row(key, group, label, _number(one, "depth_m", "value"), "m", **more)
    for name, label, unit in (
        ("energy_of_residual_crush_j", "energy from residual crush", "J"),
        ("energy_equivalent_speed_m_per_s", "energy-equivalent speed", "m/s"),
    ):
        value = _number(found, name, "value")
        yield from _row(f"deformation.{name}", group, label, value, unit, **_within(found, name))


def _of_main(one: Mapping[str, Any], label: str, key: str, main: str | None) -> tuple[str, str]:
    """Label and key of a quantity of a recorder: without its name if it is the main result."""
    of = _word(one, "of") or ""
    return (label, key) if of in ("", main) else (f"{label}, {of}", f"{key}.{of}")


#: Numbers of an impact whose bound may rest on an assumption, by their names in ``on_assumption``.
BY_ASSUMPTION = {"delta-V": "delta_v_m_per_s", "direction of force": "pdof_deg"}
CLOSURE = (
    ("closing_speed_m_per_s", "closing speed", "m/s"),
    ("separation_speed_m_per_s", "separation speed", "m/s"),
    ("restitution", "restitution", ""),
    ("impulse_n_s", "impulse", "N s"),
    ("energy_lost_j", "energy lost", "J"),
)


def _force(event: Mapping[str, Any], key: str, group: str, head: str) -> Iterator[Value]:
    """Size and direction of the change of velocity of an impact."""
    change, end = _table(event, "body", "event"), "_m_per_s"
    value = _number(change, f"resultant{end}", "value")
    more: dict[str, Any] = _within(change, f"resultant{end}")
    yield from _row(f"{key}.delta_v{end}", group, f"{head}delta-V", value, "m/s", **more)
    force = _table(change, "direction_of_force")
    value = _number(force, "horizontal_deg")
    low, high = _number(force, "low_deg"), _number(force, "high_deg")
    more = {"kind": "angle"}
    told = _at(force, "undetermined") is not True
    if told and value is not None and low is not None and high is not None:
        more |= {"below": (value - low) % 360.0, "above": (high - value) % 360.0}
    label = f"{head}direction of force (PDOF)"
    yield from _row(f"{key}.pdof_deg", group, label, value, "deg", **more)


def _impact(event: Mapping[str, Any], key: str, group: str) -> Iterator[Value]:
    change, end = _table(event, "body", "event"), "_m_per_s"
    yield from _force(event, key, group, "")
    clock = _at(change, "direction_of_force", "clock")
    if (hours := _number(clock)) is not None:
        clock = f"{hours:g} o'clock"
    said = clock[:LONGEST] if isinstance(clock, str) else None
    yield from _row(f"{key}.clock", group, "clock direction", said)
    yield from _row(f"{key}.type", group, "type", _word(event, "type"))
    for axis in ("forward", "right", "down"):
        name = f"{axis}{end}"
        value, more = _number(change, name, "value"), _within(change, name)
        yield from _row(f"{key}.delta_v_{name}", group, f"delta-V {axis}", value, "m/s", **more)
    peak = ("peak_m_per_s2", "peak acceleration", "m/s²")
    yield from _rows(event, f"{key}.", group, peak)
    for name, words in (("onset", "begin"), ("contact_end", "end")):
        half, row = _half(_number(event, f"{name}_sd_s")), (f"{name}_s", f"{words} of the contact")
        yield from _rows(event, f"{key}.", group, (*row, "s"), half=half)


def is_over_ground(data: Mapping[str, Any]) -> bool:
    """Whether the path of a crash is along north and east, as `values.over_ground`."""
    entry = _table(data, "case", "entry")
    return entry.get("kind") == "gnss" or bool(entry.get("heading_deg"))


def _crash_path(answer: Mapping[str, Any], ground: bool) -> Iterator[Value]:
    path = _table(answer, "path")
    time = _number(path, "end_s")
    group = "End of the path"
    yield from _row("path.end_s", group, "time", time, "s")
    units = (
        dict.fromkeys(NED, ("m", "m"))
        | dict.fromkeys(VELOCITY, ("m_per_s", "m/s"))
        | dict.fromkeys(EULER, ("deg", "deg"))
    )
    axes = NED if ground else AXES
    words = dict(zip(NED, axes, strict=True))
    words |= dict(zip(VELOCITY, (f"velocity {w}" for w in axes), strict=True))
    for name, (ending, unit) in units.items():
        one = f"{name}_{ending}"
        # Positions in other axes are other quantities.
        key = f"path.end.{'' if ground or name in EULER else 'vehicle.'}{one}"
        label, value = words.get(name, name), _number(path, "end", one, "value")
        more: dict[str, Any] = {"kind": "angle" if unit == "deg" else "number", "at": time}
        more |= _within(_table(path, "end"), one)
        yield from _row(key, group, label, value, unit, **more)


# Outages and sensors.

#: Share of a variance, %, that a short list leaves out.
SMALL = 1.0


def _outage(part: RunPart) -> Iterator[Value]:
    data = part.answer
    group = "At the end of the outage"
    yield from _rows(data, "", group, ("outage_s", "duration of the outage", "s"))
    yield from _rows(
        _table(data, "at_the_end"),
        "at_the_end.",
        group,
        ("horizontal_95_m", "horizontal drift, 95 %", "m"),
        ("along_sd_m", "along, sd", "m"),
        ("across_sd_m", "across, sd", "m"),
        ("vertical_sd_m", "vertical, sd", "m"),
        ("speed_sd_m_per_s", "speed, sd", "m/s"),
        ("heading_sd_deg", "heading, sd", "deg"),
    )
    for one in _tables(data, "budget", "sources"):
        name = _word(one, "source") or "?"
        share = _percent(_number(one, "share", "horizontal"))
        label, more = f"{name}, share of the variance", {"kind": "share"}
        detail = abs(share or 0.0) < SMALL
        key, group = f"budget.{name}.share", "Sources of the drift"
        yield from _row(key, group, label, share, "%", detail=detail, **more)
    group, outages = "Outages tried", _table(data, "outages")
    yield from _rows(outages, "outages.", group, ("equal_length", "outages", ""), kind="count")
    yield from _rows(data, "", group, ("probability", "probability of drifts as large", ""))


def _allan(part: RunPart) -> Iterator[Value]:
    record = _table(part.answer, "record")
    yield from _rows(record, "record.", "Record", ("rate_hz", "rate", "Hz"))
    for channel, one in _table(part.answer, "channels").items():
        base = "rad/s" if channel.startswith("gyro") else "m/s²"
        units = {"N": f"{base}/√Hz", "Q": f"{base}·s", "K": f"{base}/√s", "R": f"{base}/s"}
        units["T"] = "s"
        terms, group = _table(one, "terms"), channel.replace("_", " ")
        for name in terms:
            value, unit = _number(terms, name, "value"), units.get(name, base)
            key, label = f"{channel}.{name}", f"{channel}: {name}"
            yield from _row(key, group, label, value, unit, **_within(terms, name))


def _calibrate(part: RunPart) -> Iterator[Value]:
    data = part.answer
    yield from _rows(data, "", "Record", ("rests", "rests", ""), kind="count")
    yield from _rows(data, "", "Record", ("excess", "residuals beyond noise, factor", ""))
    for name, one in _table(data, "parameters").items():
        unit = next((u for head, u in _CALIBRATED.items() if name.startswith(head)), "")
        label, value, half = name.replace("_", " "), _number(one, "value"), _number(one, "sd")
        key, group = f"parameters.{name}", "Errors of the sensor"
        yield from _row(key, group, label, value, unit, half=_half(half))


_CALIBRATED = {
    "gyro_bias": "rad/s",
    "gyro_scale": "1",
    "gyro_misalignment": "rad",
    "g_sensitivity": "(rad/s)/(m/s²)",
    "accel_bias": "m/s²",
    "accel_scale": "1",
    "accel_misalignment": "rad",
}


def _extrinsics(part: RunPart) -> Iterator[Value]:
    for name, one in _table(part.answer, "estimates").items():
        unit = (_word(one, "unit") or "").replace("m/s2", "m/s²")
        label, value, half = name.replace("_", " "), _number(one, "value"), _number(one, "bound")
        yield from _row(f"estimates.{name}", "Estimates", label, value, unit, half=half)


def _doctor(part: RunPart) -> Iterator[Value]:
    for k, log in enumerate(_tables(part.answer, "logs"), start=1):
        group, head = f"Log {k}", f"logs.{k}."
        yield from _row(f"{head}name", group, "name", _word(log, "name"))
        for use, one in _table(log, "fit").items():
            yield from _row(f"{head}fit.{use}", group, f"fit for {use}", _word(one, "answer"))
        for key in ("questions", "faults", "notes"):
            count = float(len(_tables(log, key)))
            yield from _row(head + key, group, key, count, kind="count")
        for one in _tables(log, "streams"):
            name = _word(one, "name") or "?"
            key = f"{head}streams.{name}."
            yield from _rows(one, key, group, ("rows", f"{name}: rows", ""), kind="count")
            ends = (("rate_hz", "rate", "Hz"), ("from_s", "begin", "s"), ("to_s", "end", "s"))
            yield from _rows(one, key, group, *((n, f"{name}: {w}", u) for n, w, u in ends))


#: Of the commands whose numbers have names and bounds.
NUMBERS: dict[str, Callable[[RunPart], Iterator[Value]]] = {
    "navigate": _navigate,
    "align": _align,
    "attitude": _attitude,
    "crash": _crash,
    "outage": _outage,
    "allan": _allan,
    "calibrate": _calibrate,
    "extrinsics": _extrinsics,
    "doctor": _doctor,
}

# Any other result: every number of its JSON, by its path.

#: Deepest path, and longest list, of such a result.
DEEPEST, MOST = 8, 12
#: Keys that describe a result.
ABOUT = ("findings", "conventions", "configuration", "schema", "strapdown")
#: Units by the endings of keys.
ENDINGS = {
    "_m_per_s2": "m/s²",
    "_rad_per_s": "rad/s",
    "_deg_per_s": "deg/s",
    "_m_per_s": "m/s",
    "_deg": "deg",
    "_hz": "Hz",
    "_m": "m",
    "_s": "s",
}


def _every(node: Any, place: str, depth: int) -> Iterator[Value]:
    if depth > DEEPEST:
        return
    if isinstance(node, dict):
        for key, item in node.items():
            if depth or key not in ABOUT:
                yield from _every(item, f"{place}.{key}" if place else key, depth + 1)
    elif isinstance(node, list):
        for name, item in zip(_names(node), node[:MOST], strict=False):
            yield from _every(item, f"{place}[{name}]", depth + 1)
    elif (value := _number(node)) is not None:
        unit = next((u for ending, u in ENDINGS.items() if place.endswith(ending)), "")
        group, _, label = place.partition(".")
        yield Value(place, group if label else "", label or place, value, unit)


def _names(items: list[Any]) -> list[str]:
    """Names of the tables of a list, by which they are paired; without names their numbers."""
    for key in ("name", "key"):
        names = [_word(one, key) for one in items]
        if all(names) and len(set(names)) == len(names):
            return [str(name) for name in names]
    return [str(k + 1) for k in range(len(items))]
