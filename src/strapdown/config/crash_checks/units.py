"""Checks of the recorders of a case: names, positions, gyros, assumptions and sensors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from strapdown.config.crash_case import AssumedSpec, CaseSpec, TriadSpec, UnitSpec
from strapdown.config.crash_checks.written import Written
from strapdown.config.toml_file import KeyPath
from strapdown.constants import ACCEL_UNITS, GYRO_UNITS, TIME_UNITS
from strapdown.errors import ConfigError, StrapdownError

__all__ = [
    "check_assumed",
    "check_names",
    "check_ranges",
    "check_sensor",
    "check_triads",
    "check_units",
]


MOST_ANGLE = 360.0  # deg
STEEPEST = 90.0  # deg
#: A common trigger with a larger standard deviation cannot synchronize clocks.
MOST_TRIGGER_SD = 0.5  # s


def check_units(spec: CaseSpec, written: Written) -> None:
    """Check the units except for their triads.

    Raises
    ------
    ConfigError
        A position is missing, values are contradictory, or a borrowed gyro does not exist.
    """
    check_names("units", [unit.name for unit in spec.units], written)
    _triggered(spec, written)
    for k, unit in enumerate(spec.units):
        _placed(k, unit, written)
        _gyro(k, spec, written)
        _levelled(k, unit, written)
        _rest(k, spec, written)
        if spec.options.clock == "trigger" and unit.trigger_sd_s > MOST_TRIGGER_SD:
            raise written.refuse(
                ("units", k, "trigger_sd_s"),
                "config.trigger-sd-too-large",
                trigger_sd_s=unit.trigger_sd_s,
            )
        check_assumed(k, spec, written)


def check_names(several: str, names: Sequence[str], written: Written) -> None:
    """Refuse duplicate names.

    Parameters
    ----------
    several : str
        Key of the tables.
    names : sequence of str
    written : Written
    """
    seen: dict[str, int] = {}
    for k, name in enumerate(names):
        same = " ".join(name.split()).casefold()
        if same in seen:
            raise written.contradiction(
                (several, k, "name"),
                (several, seen[same], "name"),
                "config.name-repeated",
            )
        seen[same] = k


def _triggered(spec: CaseSpec, written: Written) -> None:
    without = [k for k, unit in enumerate(spec.units) if unit.trigger_s is None]
    if without and spec.options.clock == "trigger":
        raise written.missing(("units", without[0], "trigger_s"), "config.trigger-missing")
    if len(without) == len(spec.units):
        raise written.missing(("units", 0, "trigger_s"), "config.no-unit-with-trigger")


def _placed(k: int, unit: UnitSpec, written: Written) -> None:
    for name, code in (
        ("position_m", "config.unit-position-missing"),
        ("position_sd_m", "config.unit-position-sd-missing"),
    ):
        if not written.has("units", k, name):
            raise written.missing(("units", k, name), code)
    if any(abs(angle) > MOST_ANGLE for angle in unit.angles_deg):
        raise written.refuse(("units", k, "angles_deg"), "config.angles-beyond-turn")
    if unit.angles_sd_deg > STEEPEST:
        raise written.refuse(("units", k, "angles_sd_deg"), "config.mounting-sd-too-large")


def _gyro(k: int, spec: CaseSpec, written: Written) -> None:
    unit, at = spec.units[k], ("units", k, "gyro_from")
    lender = unit.gyro_from
    if lender is None:
        return
    if unit.gyro is not None:
        raise written.contradiction(at, ("units", k, "gyro"), "config.gyro-and-lender")
    if lender == unit.name:
        raise written.contradiction(at, ("units", k, "name"), "config.lender-is-borrower")
    lenders = [n for n, other in enumerate(spec.units) if other.name == lender]
    with_gyro = [other.name for other in spec.units if other.gyro is not None]
    if not lenders:
        code = "config.unknown-unit-with-gyro" if with_gyro else "config.unknown-unit-no-gyro"
        raise written.refuse(at, code, word=lender, known=with_gyro)
    if spec.units[lenders[0]].gyro is None:
        code = "config.lender-without-gyro" if with_gyro else "config.no-unit-with-gyro"
        raise written.contradiction(
            at, ("units", lenders[0], "name"), code, word=lender, known=with_gyro
        )


def _levelled(k: int, unit: UnitSpec, written: Written) -> None:
    level, sd = ("units", k, "levelling_deg"), ("units", k, "levelling_sd_deg")
    if unit.levelling_deg is not None and unit.levelling_sd_deg is None:
        raise written.missing(sd, "config.levelling-sd-missing", said=written.said(*level))
    if unit.levelling_deg is None and unit.levelling_sd_deg is not None:
        raise written.missing(level, "config.levelling-missing", said=written.said(*sd))
    if unit.levelling_deg is not None and max(abs(a) for a in unit.levelling_deg) > STEEPEST:
        raise written.refuse(level, "config.levelling-too-steep")
    if unit.levelling_sd_deg is not None and unit.levelling_sd_deg > STEEPEST:
        raise written.refuse(sd, "config.levelling-sd-too-large")


def _rest(k: int, spec: CaseSpec, written: Written) -> None:
    unit, at = spec.units[k], ("units", k, "rest_s")
    if unit.rest_s is None:
        return
    start, end = unit.rest_s
    if not start < end:
        raise written.refuse(at, "config.rest-end-before-begin")
    if end > 0.0:
        raise written.refuse(at, "config.rest-after-trigger", end=end)
    entry, speed = spec.entry, ("entry", "speed_m_per_s")
    if entry.kind == "speed" and entry.speed_m_per_s and end > entry.time_s:
        raise written.contradiction(
            at,
            ("entry", "time_s"),
            "config.rest-after-entry",
            default=entry.time_s,
            said=written.said(*speed),
        )


# Assumptions of a recorder: for every missing axis, and for no other.


AXES = ("x", "y", "z")
MOST_TURN = 45.0  # deg
MOST_CHANGE = 60.0  # m/s
LONGEST = 10.0  # s


def check_assumed(k: int, spec: CaseSpec, written: Written) -> None:
    """Check the assumptions of a unit on missing axes.

    Raises
    ------
    ConfigError
        An axis is missing without an assumption, or the reverse.
    """
    unit = spec.units[k]
    no_force, no_turn = _forces_missing(k, unit, written), _turns_missing(unit)
    assumed = unit.assumed or AssumedSpec()
    if no_force and assumed.delta_v_sd_m_per_s is None:
        raise written.file.refuse(
            ("units", k, "accelerometers", 0, "channels"),
            "config.axis-not-measured",
            axes=no_force,
        )
    if no_turn and assumed.turn_sd_deg is None:
        no_gyro = unit.gyro is None
        raise written.file.refuse(
            ("units", k) if no_gyro else ("units", k, "gyro", "channels"),
            "config.no-gyro" if no_gyro else "config.turn-axis-not-measured",
            axes=no_turn,
        )
    if unit.assumed is not None:
        _check_table(k, unit, assumed, written, bool(no_force), bool(no_turn))


def _check_table(
    k: int, unit: UnitSpec, assumed: AssumedSpec, written: Written, force: bool, turn: bool
) -> None:
    at = ("units", k, "assumed")
    measured = "gyro" if unit.gyro is not None else "gyro_from"
    for name, missing, other, most in (
        ("turn_sd_deg", turn, measured, MOST_TURN),
        ("delta_v_sd_m_per_s", force, "accelerometers", MOST_CHANGE),
    ):
        given = getattr(assumed, name)
        if given is None:
            continue
        if not missing:
            raise written.contradiction(
                (*at, name), ("units", k, other), "config.assumed-though-measured"
            )
        sizes = given if isinstance(given, tuple) else (given,)
        if max(sizes) > most:
            raise written.refuse((*at, name), "config.assumed-sd-too-large", most=most)
    if not force and not turn:
        raise written.contradiction(at, ("units", k, measured), "config.nothing-to-assume")
    if not assumed.because.strip():
        raise written.missing((*at, "because"), "config.reason-of-assumption-missing")
    start, end = assumed.over_s
    if not 0.0 < end - start <= LONGEST:
        raise written.refuse((*at, "over_s"), "config.assumed-span-out-of-range", end=end - start)


def _forces_missing(k: int, unit: UnitSpec, written: Written) -> list[str]:
    first = _missing(unit.accelerometers[0])
    for n, triad in enumerate(unit.accelerometers[1:], start=1):
        if _missing(triad) != first:
            raise written.contradiction(
                ("units", k, "accelerometers", n, "channels"),
                ("units", k, "accelerometers", 0, "channels"),
                "config.range-axes-differ",
            )
    return first


def _turns_missing(unit: UnitSpec) -> list[str]:
    if unit.gyro is not None:
        return _missing(unit.gyro)
    return [] if unit.gyro_from is not None else list(AXES)


def _missing(triad: TriadSpec) -> list[str]:
    return [axis for axis in AXES if axis not in triad.channels]


# Triads of a case: each channel once, its unit, and its uncertainty.


_UNITS = {"accel": ACCEL_UNITS, "gyro": GYRO_UNITS}
_OTHER = {"accel": "gyro", "gyro": "accel"}


def check_triads(spec: CaseSpec, written: Written) -> None:
    """Check channels, units and sensors.

    Raises
    ------
    ConfigError
        A channel is used twice, a unit does not fit the triad, a sensor is unknown, its uncertainty
        is not stated, or a wide range precedes a narrow one.
    """
    used: dict[tuple[str, str], KeyPath] = {}
    for at, kind, triad in _triads(spec):
        _channels(at, triad, used, written)
        _unit(at, kind, triad, written)
        check_sensor(at, kind, triad, written)
    for k, unit in enumerate(spec.units):
        check_ranges(k, unit, written)


def _triads(spec: CaseSpec) -> Iterator[tuple[KeyPath, str, TriadSpec]]:
    for k, unit in enumerate(spec.units):
        for n, triad in enumerate(unit.accelerometers):
            yield ("units", k, "accelerometers", n), "accel", triad
        if unit.gyro is not None:
            yield ("units", k, "gyro"), "gyro", unit.gyro


def _channels(
    at: KeyPath, triad: TriadSpec, used: dict[tuple[str, str], KeyPath], written: Written
) -> None:
    if not triad.channels:
        raise written.missing((*at, "channels"), "config.channels-missing")
    for axis, channel in triad.channels.items():
        path = (*at, "channels", axis)
        name = channel.removeprefix("-").strip()
        if not name:
            raise written.refuse(path, "config.sign-without-channel")
        if name == triad.time:
            raise written.contradiction(path, (*at, "time"), "config.time-as-axis")
        before = used.setdefault((triad.path, name), path)
        if before != path:
            gyro = "gyro" in at and "gyro" in before
            raise written.contradiction(
                path,
                before,
                "config.gyro-channel-used-twice" if gyro else "config.channel-used-twice",
            )


def _unit(at: KeyPath, kind: str, triad: TriadSpec, written: Written) -> None:
    # Unit spellings of other programs are part of the readers, loaded only where a case is read.
    from strapdown.formats.columns import unit_of

    if triad.unit is not None:
        unit = unit_of(triad.unit) or triad.unit
        if unit in _UNITS[_OTHER[kind]]:
            raise written.refuse(
                (*at, "unit"),
                "config.gyro-unit-of-accelerometers"
                if kind == "accel"
                else "config.accelerometer-unit-of-gyro",
                units=_UNITS[kind],
            )
    if triad.time_unit is not None:
        unit = unit_of(triad.time_unit) or triad.time_unit
        if unit not in TIME_UNITS:
            raise written.refuse(
                (*at, "time_unit"),
                "config.unknown-time-unit",
                word=triad.time_unit,
                known=TIME_UNITS,
            )


# Uncertainty and range of the sensors of a case: the lowest range comes first.


Triple = tuple[float, float, float]


def check_sensor(at: KeyPath, kind: str, triad: TriadSpec, written: Written) -> None:
    """Check the stated errors of a triad.

    Parameters
    ----------
    at : tuple
        Path of the triad.
    kind : {'accel', 'gyro'}
    triad : TriadSpec
    written : Written

    Raises
    ------
    ConfigError
        Errors are not stated, the sensor is unknown or has no such triad, or a key of the
        uncertainty is unknown, given in two units, or has an invalid number.
    """
    if triad.sensor is None and not triad.uncertainty:
        raise written.missing((*at, "sensor"), "config.uncertainty-missing")
    if triad.sensor is not None:
        _known_sensor(at, kind, triad.sensor, written)
    _known_keys(at, kind, triad.uncertainty, written)


def check_ranges(k: int, unit: UnitSpec, written: Written) -> None:
    """Refuse accelerometers of a unit that are not in the order of their ranges.

    Raises
    ------
    ConfigError
        A wider range precedes a narrower one.
    """
    triads = unit.accelerometers
    for n in range(1, len(triads)):
        before, after = _full_scale(triads[n - 1]), _full_scale(triads[n])
        if before is None or after is None:
            continue
        if any(b > a for a, b in zip(after, before, strict=True)):
            raise written.contradiction(
                ("units", k, "accelerometers", n, *_range_key(triads[n])),
                ("units", k, "accelerometers", n - 1, *_range_key(triads[n - 1])),
                "config.ranges-not-ascending",
                before=_in_g(before),
                after=_in_g(after),
            )


def _known_sensor(at: KeyPath, kind: str, name: str, written: Written) -> None:
    # The catalogue is loaded only with a case.
    from strapdown.sensors.catalogue import SENSORS, load_sensor

    path = (*at, "sensor")
    if name.lower() not in SENSORS and not name.lower().endswith(".toml"):
        raise written.refuse(path, "config.unknown-sensor", word=name, known=SENSORS)
    try:
        sensor = load_sensor(name)
    except StrapdownError as error:
        part = error.finding.quantity
        code = "config.sensor-key-refused" if part else "config.sensor-refused"
        raise written.refuse(path, code, part=part, reason=error.finding) from None
    except (RecursionError, OSError, ValueError) as error:
        raise written.refuse(path, "config.sensor-unreadable", error=type(error).__name__) from None
    if not any(figure.key.startswith(f"{kind}.") for figure in sensor.sources):
        raise written.refuse(
            path,
            "config.sensor-without-gyro"
            if kind == "gyro"
            else "config.sensor-without-accelerometers",
        )


def _known_keys(
    at: KeyPath, kind: str, stated: Mapping[str, float | Triple], written: Written
) -> None:
    from strapdown.sensors.catalogue import KEYS
    from strapdown.sensors.uncertainty import SENSOR_UNCERTAINTY_FACTS as FACTS
    from strapdown.sensors.uncertainty import SPREADS

    known = {n: k for n, k in KEYS[kind].items() if k.quantity in SPREADS or k.quantity in FACTS}
    by: dict[str, str] = {}
    for name, given in stated.items():
        path = (*at, "uncertainty", name)
        if name not in known:
            raise written.file.refuse(path, "config.unknown-key", word=name[:100], known=known)
        quantity = known[name].quantity
        if quantity in by:
            raise written.contradiction(
                path,
                (*at, "uncertainty", by[quantity]),
                "config.uncertainty-in-two-units",
                property=quantity.replace("_", " "),
            )
        by[quantity] = name
        _fits(path, quantity, given, written)


def _fits(path: KeyPath, quantity: str, given: float | Triple, written: Written) -> None:
    numbers = given if isinstance(given, tuple) else (given,)
    error: ConfigError | None = None
    if min(numbers) < 0.0:
        error = written.refuse(path, "config.negative-uncertainty")
    elif quantity in ("full_scale", "bandwidth") and min(numbers) == 0.0:
        error = written.refuse(path, "config.zero-uncertainty")
    elif quantity == "bandwidth" and len(numbers) != 1:
        error = written.refuse(path, "config.bandwidth-by-axis")
    if error is not None:
        raise error


def _range_key(triad: TriadSpec) -> KeyPath:
    return ("uncertainty", "full_scale_g") if "full_scale_g" in triad.uncertainty else ("sensor",)


def _full_scale(triad: TriadSpec) -> Triple | None:
    """As stated or from the sensor, g; None if unknown."""
    from strapdown.sensors.catalogue import load_sensor

    stated = triad.uncertainty.get("full_scale_g")
    if stated is not None:
        return stated if isinstance(stated, tuple) else (stated, stated, stated)
    if triad.sensor is None:
        return None
    figures = load_sensor(triad.sensor).sources
    return next((f.value for f in figures if f.key == "accel.full_scale_g"), None)


def _in_g(values: Triple) -> str:
    return f"{values[0]:g}" if len(set(values)) == 1 else f"[{', '.join(f'{v:g}' for v in values)}]"
