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

__all__ = ["OF_THE_UNIT", "Value", "is_over_ground", "values_of"]

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


# Access to data of which nothing is certain.


def _at(node: Any, *path: str | int) -> Any:
    """Value at a place; None if there is none."""
    for part in path:
        if isinstance(node, dict):
            node = node.get(part)
        elif isinstance(node, list) and isinstance(part, int) and -len(node) <= part < len(node):
            node = node[part]
        else:
            return None
    return node


def _number(node: Any, *path: str | int) -> float | None:
    """A finite number at a place."""
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
    for key, share in shares.items():
        label = f"time with heading {key}"
        yield from _row(
            f"integrity.heading.{key}", "Integrity", label, _percent(share), "%", kind="share"
        )
    at_end = _word(integrity, "heading", "at_end")
    yield from _row("integrity.heading.at_end", "Integrity", "heading at the end", at_end)
    for name, one in _table(integrity, "quantities").items():
        share = _percent(_number(one, "share", "trusted"))
        label = f"time with {name.replace('_', ' ')} trusted"
        yield from _row(f"integrity.{name}.trusted", "Integrity", label, share, "%", kind="share")
    judged = shares_words({key: share for key, share in shares.items() if share is not None})
    note = f"{judged} of the time; final status: {at_end}" if judged and at_end else ""
    arm = any(
        _word(one, "code") == "navigation.lever-arm-zero" for one in _tables(data, "findings")
    )
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
        error = _number(one, "largest_horizontal_error_m")
        half = _number(one, "bound_95_m")
        yield from _row(f"outage_test.{k}.m", "Bounds", f"{label}, largest error", error, "m")
        yield from _row(f"outage_test.{k}.bound_m", "Bounds", f"{label}, its bound", half, "m")
    yield from _against(data)
    yield from _row(
        "path.travelled_m",
        "Path",
        "way over ground",
        _number(data, "trajectory", "travelled_m"),
        "m",
    )
    yield from _row("path.from_s", "Path", "begin", _number(data, "trajectory", "from_s"), "s")
    yield from _row("path.to_s", "Path", "end", _number(data, "trajectory", "to_s"), "s")
    for stage in ("coarse", "fine"):
        one = _table(data, "alignment", stage)
        yield from _angles(one, f"alignment.{stage}", "Alignment", f"{stage}, ")
    for name, one in _table(data, "sensors").items():
        label = name.replace("_", " ")
        yield from _row(
            f"sensors.{name}",
            OF_THE_UNIT,
            label,
            _number(one, "estimate"),
            _word(one, "unit") or "",
            half=_half(_number(one, "sd")),
            detail="bias" not in name,
        )
    for name, one in _table(data, "observations").items():
        for key, label, unit, kind in (
            ("epochs", "epochs", "", "count"),
            ("rejected", "rejected", "", "count"),
            ("rms_in_sd", "innovations, rms in their sd", "", "number"),
        ):
            value = _number(one, key)
            yield from _row(
                f"observations.{name}.{key}",
                "Measurements",
                f"{name}: {label}",
                value,
                unit,
                kind=kind,
            )


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
        near: dict[str, Any] = {"place": place, "at": time}
        yield from _row(
            "end.lat_deg", group, "latitude", lat, "deg", kind="lat", half=sd["north"], **near
        )
        yield from _row(
            "end.lon_deg", group, "longitude", lon, "deg", kind="lon", half=sd["east"], **near
        )
        bound = _number(end, "horizontal_bound_95_m")
        yield Value(
            "end.horizontal_m",
            group,
            "position, horizontal",
            None,
            "m",
            bound,
            bound,
            "horizontal",
            place,
            time,
        )
    yield from _row("end.alt_m", group, "height", alt, "m", half=sd["down"], at=time)
    for name, word in zip(VELOCITY, NED, strict=True):
        value, half = _number(end, f"{name}_m_per_s"), _half(_number(end, f"{name}_sd_m_per_s"))
        yield from _row(
            f"end.{name}_m_per_s", group, f"velocity {word}", value, "m/s", half=half, at=time
        )
    yield from _angles(end, "end", group, "", at=time)


def _angles(
    one: Mapping[str, Any], key: str, group: str, head: str, **more: Any
) -> Iterator[Value]:
    for name in EULER:
        value, half = _number(one, f"{name}_deg"), _half(_number(one, f"{name}_sd_deg"))
        yield from _row(
            f"{key}.{name}_deg",
            group,
            f"{head}{name}",
            value,
            "deg",
            half=half,
            kind="angle",
            **more,
        )


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
                key = pattern.format(ending)
                more = {"detail": detail or what.startswith("95")}
                yield from _row(
                    f"against.{name}.{key}",
                    group,
                    f"{words}, {what}",
                    _number(one, key),
                    unit,
                    **more,
                )
        share = _percent(_number(one, "share_within_bound"))
        label = f"{words}, time within its bound"
        yield from _row(
            f"against.{name}.share", group, label, share, "%", kind="share", detail=detail
        )
    label = f"mean NEES (expected {_number(against, 'nees_of') or 0:g})"
    yield from _row("against.mean_nees", group, label, _number(against, "mean_nees"))
    points = _table(data, "control_points")
    for key, what in (("rms_m", "rms"), ("median_m", "median"), ("largest_m", "largest")):
        label = f"control points, {what}"
        yield from _row(f"control_points.{key}", group, label, _number(points, key), "m")


def _align(part: RunPart) -> Iterator[Value]:
    data = part.answer
    yield from _row("answer.verdict", "Answer", "verdict", _word(data, "trust", "verdict"))
    end = _number(data, "end", "time_s")
    yield from _row("end.time_s", "At the end", "time", end, "s")
    yield from _angles(_table(data, "end"), "end", "At the end", "", at=end)
    yield from _angles(_table(data, "coarse"), "coarse", "Coarse alignment", "")
    fine = _table(data, "fine")
    for name, unit in (("gyro_bias", "rad/s"), ("accel_bias", "m/s²")):
        key = f"{name}_{unit.replace('/', '_per_').replace('²', '2')}"
        spread = f"{name}_sd{key.removeprefix(name)}"
        for k, axis in enumerate("xyz"):
            label = f"{name.replace('_', ' ')} {axis}"
            yield from _row(
                f"fine.{name}_{axis}",
                OF_THE_UNIT,
                label,
                _number(fine, key, k),
                unit,
                half=_half(_number(fine, spread, k)),
            )
    other = _table(data, "compared_with")
    yield from _row("against.name", "Errors against the truth", "truth", _word(other, "name"))
    for k, name in enumerate(EULER):
        yield from _row(
            f"against.{name}_deg",
            "Errors against the truth",
            name,
            _number(other, "off_deg", name),
            "deg",
            half=_half(_number(other, "sd_deg", k)),
        )


# Attitude.


def _attitude(part: RunPart) -> Iterator[Value]:
    data = part.answer
    answer = _table(data, "answer")
    group = "Answer"
    yield from _row("answer.verdict", group, "verdict", _word(answer, "verdict"))
    yield from _row("answer.algorithm", group, "algorithm", _word(answer, "algorithm"))
    yield from _row("answer.rate_hz", group, "lowest rate", _number(answer, "rate_hz"), "Hz")
    label = "lowest rate, decimated"
    yield from _row("answer.dropped_hz", group, label, _number(answer, "dropped_hz"), "Hz")
    label = "shortest time within the tolerance"
    yield from _row("answer.holding_s", group, label, _number(answer, "holding", "shortest_s"), "s")
    yield from _row(
        "record.rate_hz", group, "rate of the record", _number(data, "clock", "rate_hz"), "Hz"
    )
    for one in _tables(data, "algorithms"):
        name = _word(one, "algorithm") or "?"
        for score in _tables(one, "scores"):
            against = _word(score, "against") or "?"
            for key, words in (
                ("error_deg", "at the end"),
                ("rms_deg", "rms"),
                ("max_deg", "largest"),
            ):
                yield from _row(
                    f"algorithms.{name}.{against}.{key}",
                    f"Errors against {against}",
                    f"{name}, {words}",
                    _number(score, key),
                    "deg",
                    detail=key == "error_deg",
                )
        for axis in EULER:
            yield from _row(
                f"algorithms.{name}.final.{axis}_deg",
                "Attitude at the end",
                f"{name}, {axis}",
                _number(one, "final", f"{axis}_deg"),
                "deg",
                kind="angle",
                at=_number(one, "final", "time_s"),
                detail=True,
            )
        for key, words in (("own_deg", "algorithm error"), ("sensor_deg", "sensor error")):
            yield from _row(
                f"algorithms.{name}.{key}",
                "Shares of the error",
                f"{name}, {words}, largest",
                _number(one, "share", key, "max"),
                "deg",
                detail=True,
            )
    for one in _tables(data, "sweep"):
        name, rate = _word(one, "algorithm") or "?", _number(one, "rate_hz")
        meaning = MEANINGS.get(_word(one, "meaning") or "")
        if rate is None or meaning is None:
            continue
        yield from _row(
            f"sweep.{meaning}.{name}.{rate:.6g}",
            f"Errors by algorithm and rate, samples {meaning}",
            f"{name} at {rate:.6g} Hz",
            _number(one, "error_deg"),
            "deg",
            detail=True,
        )


#: What a lower rate is made of.
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
        factor = SPEEDS["mph"] if unit == "mph" else 1.0
        value = _number(one, "value")
        more = {k: factor * v for k, v in _within({"": one}, "").items()}
        yield from _row(
            key,
            "Severity",
            label,
            None if value is None else factor * value,
            "m/s" if unit == "mph" else unit,
            **more,
        )
    yield from _deformation(_table(data, "deformation"), main)
    closure = _table(data, "closure")
    for key, label, unit in CLOSURE:
        value = _number(closure, key, "value")
        yield from _row(
            f"closure.{key}", "The collision", label, value, unit, **_within(closure, key)
        )
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
    clock = _clock(_table(change, "direction_of_force"))
    yield from _row(f"{key}.clock", group, "clock direction", clock)
    yield from _row(f"{key}.type", group, "type", _word(event, "type"))
    for axis in ("forward", "right", "down"):
        name = f"{axis}{end}"
        value = _number(change, name, "value")
        more = _within(change, name)
        yield from _row(f"{key}.delta_v_{name}", group, f"delta-V {axis}", value, "m/s", **more)
    peak = _number(event, "peak_m_per_s2")
    yield from _row(f"{key}.peak_m_per_s2", group, "peak acceleration", peak, "m/s²")
    for name, words in (("onset", "begin"), ("contact_end", "end")):
        time, half = _number(event, f"{name}_s"), _half(_number(event, f"{name}_sd_s"))
        yield from _row(f"{key}.{name}_s", group, f"{words} of the contact", time, "s", half=half)


def _clock(force: Mapping[str, Any]) -> str | None:
    value = _at(force, "clock")
    if isinstance(value, str):
        return value[:LONGEST]
    number = _number(force, "clock")
    return None if number is None else f"{number:g} o'clock"


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
        yield from _row(
            # Positions in other axes are other quantities.
            f"path.end.{one}" if ground or name in EULER else f"path.end.vehicle.{one}",
            group,
            words.get(name, name),
            _number(path, "end", one, "value"),
            unit,
            kind="angle" if unit == "deg" else "number",
            at=time,
            **_within(_table(path, "end"), one),
        )


# Outages and sensors.

#: Share of a variance, %, that a short list leaves out.
SMALL = 1.0


def _outage(part: RunPart) -> Iterator[Value]:
    data = part.answer
    group = "At the end of the outage"
    yield from _row("outage_s", group, "duration of the outage", _number(data, "outage_s"), "s")
    for key, label, unit in (
        ("horizontal_95_m", "horizontal drift, 95 %", "m"),
        ("along_sd_m", "along, sd", "m"),
        ("across_sd_m", "across, sd", "m"),
        ("vertical_sd_m", "vertical, sd", "m"),
        ("speed_sd_m_per_s", "speed, sd", "m/s"),
        ("heading_sd_deg", "heading, sd", "deg"),
    ):
        yield from _row(f"at_the_end.{key}", group, label, _number(data, "at_the_end", key), unit)
    for one in _tables(data, "budget", "sources"):
        name = _word(one, "source") or "?"
        share = _percent(_number(one, "share", "horizontal"))
        yield from _row(
            f"budget.{name}.share",
            "Sources of the drift",
            f"{name}, share of the variance",
            share,
            "%",
            kind="share",
            detail=abs(share or 0.0) < SMALL,
        )
    yield from _row(
        "outages.equal_length",
        "Outages tried",
        "outages",
        _number(data, "outages", "equal_length"),
        kind="count",
    )
    yield from _row(
        "probability",
        "Outages tried",
        "probability of drifts as large",
        _number(data, "probability"),
    )


def _allan(part: RunPart) -> Iterator[Value]:
    data = part.answer
    yield from _row("record.rate_hz", "Record", "rate", _number(data, "record", "rate_hz"), "Hz")
    for channel, one in _table(data, "channels").items():
        base = "rad/s" if channel.startswith("gyro") else "m/s²"
        units = {
            "N": f"{base}/√Hz",
            "Q": f"{base}·s",
            "K": f"{base}/√s",
            "R": f"{base}/s",
            "T": "s",
        }
        for name in _table(one, "terms"):
            yield from _row(
                f"{channel}.{name}",
                channel.replace("_", " "),
                f"{channel}: {name}",
                _number(one, "terms", name, "value"),
                units.get(name, base),
                **_within(_table(one, "terms"), name),
            )


def _calibrate(part: RunPart) -> Iterator[Value]:
    data = part.answer
    yield from _row("rests", "Record", "rests", _number(data, "rests"), kind="count")
    yield from _row("excess", "Record", "residuals beyond noise, factor", _number(data, "excess"))
    for name, one in _table(data, "parameters").items():
        unit = next((u for head, u in _CALIBRATED.items() if name.startswith(head)), "")
        yield from _row(
            f"parameters.{name}",
            "Errors of the sensor",
            name.replace("_", " "),
            _number(one, "value"),
            unit,
            half=_half(_number(one, "sd")),
        )


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
        yield from _row(
            f"estimates.{name}",
            "Estimates",
            name.replace("_", " "),
            _number(one, "value"),
            unit,
            half=_number(one, "bound"),
        )


def _doctor(part: RunPart) -> Iterator[Value]:
    for k, log in enumerate(_tables(part.answer, "logs"), start=1):
        group = f"Log {k}"
        yield from _row(f"logs.{k}.name", group, "name", _word(log, "name"))
        for use, one in _table(log, "fit").items():
            yield from _row(f"logs.{k}.fit.{use}", group, f"fit for {use}", _word(one, "answer"))
        for key in ("questions", "faults", "notes"):
            yield from _row(
                f"logs.{k}.{key}", group, key, float(len(_tables(log, key))), kind="count"
            )
        for one in _tables(log, "streams"):
            name = _word(one, "name") or "?"
            head = f"logs.{k}.streams.{name}"
            yield from _row(
                f"{head}.rows", group, f"{name}: rows", _number(one, "rows"), kind="count"
            )
            for key, label, unit in (
                ("rate_hz", "rate", "Hz"),
                ("from_s", "begin", "s"),
                ("to_s", "end", "s"),
            ):
                yield from _row(f"{head}.{key}", group, f"{name}: {label}", _number(one, key), unit)


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

# Any other result: every number of its JSON, by its place.

#: Deepest place, and longest list, of such a result.
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
