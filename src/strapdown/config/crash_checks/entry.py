"""Checks of entry, options, references and positions of a crash case."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from strapdown.config.crash_case import CaseSpec, EntrySpec, VehicleSpec
from strapdown.config.crash_checks.units import check_names
from strapdown.config.crash_checks.written import Written
from strapdown.config.toml_file import KeyPath
from strapdown.errors import Finding

__all__ = ["check_entry", "check_options", "check_places", "check_references"]


# Above any car's speed on a road, and below most speeds in km/h entered as m/s.
FASTEST = 90.0  # m/s
MOST_ANGLE = 360.0  # deg
# Keys that each kind does not use; a value of zero is ignored.
_NO_USE = {
    "speed": ("path", "antenna_m", "antenna_sd_m"),
    "standstill": (
        "speed_m_per_s",
        "speed_sd_m_per_s",
        "time_s",
        "heading_deg",
        "heading_sd_deg",
        "slip_deg",
        "slip_sd_deg",
        "climb_sd_m_per_s",
        "path",
        "antenna_m",
        "antenna_sd_m",
    ),
    "gnss": (
        "speed_m_per_s",
        "speed_sd_m_per_s",
        "heading_deg",
        "heading_sd_deg",
        "slip_deg",
        "slip_sd_deg",
        "climb_sd_m_per_s",
    ),
}
_UNUSED = {
    "speed": "config.entry-speed-no-use",
    "standstill": "config.entry-standstill-no-use",
    "gnss": "config.entry-gnss-no-use",
}
_NEEDED = {
    "speed": {
        "speed_m_per_s": "config.entry-speed-missing",
        "speed_sd_m_per_s": "config.entry-speed-sd-missing",
        "source": "config.entry-source-missing",
    },
    "standstill": {},
    "gnss": {"path": "config.entry-fixes-missing"},
}


def check_entry(spec: CaseSpec, written: Written) -> None:
    """Check the entry.

    Raises
    ------
    ConfigError
        A value is missing, is not used by this kind, or is implausible.
    """
    entry = spec.entry
    for name in _NO_USE[entry.kind]:
        given = getattr(entry, name)
        if written.has("entry", name) and given not in (None, 0.0):
            raise written.contradiction(
                ("entry", name),
                ("entry", "kind"),
                _UNUSED[entry.kind],
                default=entry.kind,
                key=written.key("entry", name),
                kind=_kind_for(name),
            )
    for name, code in _NEEDED[entry.kind].items():
        given = getattr(entry, name)
        if given is None or (isinstance(given, str) and not given.strip()):
            raise written.missing(("entry", name), code)
    _sizes(entry, written)
    _instant(spec, written)


def _kind_for(name: str) -> str:
    return "gnss" if name.startswith(("path", "antenna")) else "speed"


def _sizes(entry: EntrySpec, written: Written) -> None:
    speed, sd = entry.speed_m_per_s, entry.speed_sd_m_per_s
    if speed is not None and abs(speed) > FASTEST:
        raise written.refuse(
            ("entry", "speed_m_per_s"), "config.entry-speed-too-large", speed=3.6 * speed
        )
    if entry.kind == "speed" and sd == 0.0:
        raise written.refuse(("entry", "speed_sd_m_per_s"), "config.entry-speed-sd-zero")
    if sd is not None and sd > FASTEST / 3.0:
        raise written.refuse(
            ("entry", "speed_sd_m_per_s"), "config.entry-speed-sd-too-large", sd=3.6 * sd
        )
    for name in ("heading_deg", "slip_deg"):
        if abs(getattr(entry, name)) > MOST_ANGLE:
            raise written.refuse(("entry", name), "config.angle-beyond-turn")
    for name in ("heading_sd_deg", "slip_sd_deg"):
        if getattr(entry, name) > MOST_ANGLE / 2.0:
            raise written.refuse(("entry", name), "config.angle-sd-too-large")


def _instant(spec: CaseSpec, written: Written) -> None:
    window, time = spec.options.window_s, spec.entry.time_s
    at, over = ("entry", "time_s"), ("options", "window_s")
    if spec.entry.kind == "standstill":
        return
    if window is not None and window[0] < window[1] and not window[0] <= time <= window[1]:
        first, second = (at, over) if written.has(*at) else (over, at)
        raise written.contradiction(first, second, "config.entry-outside-window", default=time)
    if not math.isclose(time, 0.0) and abs(time) > 600.0:
        raise written.refuse(at, "config.entry-far-from-trigger")


# Options: plausible windows, and available models.


# The path covers the crash, not the whole drive.
LONGEST_WINDOW = 60.0  # s
LONGEST_PEAK = 1.0  # s
#: On the Earth, from the equator at altitude to the poles.
GRAVITY = (9.7, 9.9)  # m/s²


def check_options(spec: CaseSpec, written: Written) -> None:
    """Check the options.

    Raises
    ------
    ConfigError
        A window or gravity is implausible, or a severity model is unknown.
    """
    _windows(spec, written)
    options = spec.options
    if not GRAVITY[0] < options.gravity_m_per_s2 < GRAVITY[1]:
        raise written.refuse(
            ("options", "gravity_m_per_s2"),
            "config.gravity-out-of-range",
            gravity_m_per_s2=options.gravity_m_per_s2,
        )
    for k, name in enumerate(options.severity or ()):
        _model(k, name, options.severity or (), written)


def _windows(spec: CaseSpec, written: Written) -> None:
    at, peak_at = ("options", "window_s"), ("options", "peak_window_s")
    window, peak = spec.options.window_s, spec.options.peak_window_s
    if peak > LONGEST_PEAK:
        raise written.refuse(peak_at, "config.peak-window-too-long", peak=peak)
    if window is not None:
        start, end = window
        if not start < end:
            raise written.refuse(at, "config.window-end-before-begin")
        if end - start > LONGEST_WINDOW:
            raise written.refuse(at, "config.window-too-long", end=end - start)
        if end <= 0.0:
            raise written.refuse(at, "config.window-before-trigger")
        if peak > end - start:
            first, second = (peak_at, at) if written.has(*peak_at) else (at, peak_at)
            raise written.contradiction(
                first, second, "config.peak-window-longer-than-window", default=peak
            )


def _model(number: int, name: str, names: Sequence[str], written: Written) -> None:
    # Models are loaded with the computation; a command that reads no case does not need them.
    from strapdown.crash.severity import SEVERITY_MODELS

    if name not in SEVERITY_MODELS:
        raise written.refuse(
            ("options", "severity", number),
            "config.unknown-severity-model",
            word=name,
            known=SEVERITY_MODELS,
        )
    if name in names[:number]:
        raise written.refuse(("options", "severity", number), "config.severity-model-repeated")


# References: either a path or a change of velocity.


_REFERENCES_NO_USE = {
    "path": ("delta_v_m_per_s", "delta_v_sd_m_per_s", "axis", "over_s"),
    "delta_v": ("path",),
}
_REFERENCES_NEEDED = {"path": "path", "delta_v": "delta_v_m_per_s"}
_REFERENCES_UNUSED = {
    "path": "config.reference-path-no-use",
    "delta_v": "config.reference-delta-v-no-use",
}
# Larger than any change of velocity in a road crash.
MOST = 90.0  # m/s


def check_references(spec: CaseSpec, written: Written) -> None:
    """Check the references.

    Raises
    ------
    ConfigError
        A value is missing or not used by its kind, or two references have one name.
    """
    check_names("references", [r.name for r in spec.references], written)
    for k, reference in enumerate(spec.references):
        at = ("references", k)
        for name in _REFERENCES_NO_USE[reference.kind]:
            if written.has(*at, name):
                raise written.contradiction(
                    (*at, name), (*at, "kind"), _REFERENCES_UNUSED[reference.kind]
                )
        needed = _REFERENCES_NEEDED[reference.kind]
        if getattr(reference, needed) is None:
            raise written.missing(
                (*at, needed), "config.reference-value-missing", kind=reference.kind
            )
        change = reference.delta_v_m_per_s
        if change is None:
            continue
        if abs(change) > MOST:
            raise written.refuse(
                (*at, "delta_v_m_per_s"), "config.delta-v-too-large", change=3.6 * change
            )
        if reference.axis == "resultant" and change < 0.0:
            raise written.contradiction(
                (*at, "delta_v_m_per_s"), (*at, "axis"), "config.resultant-with-sign"
            )
        if reference.over_s is not None and not reference.over_s[0] < reference.over_s[1]:
            raise written.refuse((*at, "over_s"), "config.reference-end-before-begin")


# Positions on a vehicle: within its outline; otherwise the unit is probably wrong.


Corner = tuple[float, float]

#: Largest distance of a position from the outline: a camera on a bumper, a mirror, a rough drawing.
BEYOND = 0.5  # m
#: Largest distance above or below the origin.
HIGHEST = 4.5  # m
LONGEST = 30.0  # m
#: Beyond this distance from the origin a coordinate is probably in another unit.
LARGE = 10.0  # m
#: Largest plausible standard deviation of a measured position.
MOST_SD = 2.0  # m
LIGHTEST, HEAVIEST = 20.0, 100_000.0  # kg
SMALLEST = 0.1  # m²


def check_places(spec: CaseSpec, written: Written) -> None:
    """Check the vehicle and the positions on it.

    Raises
    ------
    ConfigError
        Its sizes are contradictory or implausible, or a position is far outside the vehicle.
    """
    vehicle = spec.vehicle
    _sizes_places(vehicle, written)
    corners = _corners(vehicle)
    for path, place in _places(spec):
        _on_vehicle(path, place, corners, vehicle, written)
    sds = [(("units", k, "position_sd_m"), u.position_sd_m) for k, u in enumerate(spec.units)]
    for at, sd in [*sds, (("entry", "antenna_sd_m"), spec.entry.antenna_sd_m)]:
        if sd > MOST_SD:
            raise written.refuse(at, "config.position-sd-too-large", sd=sd)


def _sizes_places(vehicle: VehicleSpec, written: Written) -> None:
    at = "vehicle"
    if written.has(at, "outline_m"):
        for name in ("length_m", "width_m", "front_m"):
            if written.has(at, name):
                raise written.contradiction(
                    (at, name), (at, "outline_m"), "config.outline-and-size", name=name
                )
        _outline(vehicle.outline_m, written)
    for name in ("length_m", "width_m"):
        size = getattr(vehicle, name)
        if not 0.3 <= size <= LONGEST:
            raise written.refuse((at, name), "config.vehicle-size-out-of-range", size=size)
    if vehicle.front_m is not None and not 0.0 <= vehicle.front_m <= vehicle.length_m:
        raise written.contradiction(
            (at, "front_m"),
            (at, "length_m"),
            "config.origin-outside-vehicle",
            default=vehicle.length_m,
        )
    if vehicle.mass_kg is not None and not LIGHTEST <= vehicle.mass_kg <= HEAVIEST:
        raise written.refuse((at, "mass_kg"), "config.mass-out-of-range", mass_kg=vehicle.mass_kg)


def _outline(corners: Sequence[Corner], written: Written) -> None:
    at = ("vehicle", "outline_m")
    if len(corners) < 3:
        raise written.refuse(at, "config.outline-too-few-corners", count=len(corners))
    if max(math.dist(a, b) for a in corners for b in corners[:1]) > LONGEST:
        raise written.refuse(at, "config.outline-too-large")
    if abs(_area(corners)) < SMALLEST:
        raise written.refuse(at, "config.outline-area-too-small", area=abs(_area(corners)))


def _area(corners: Sequence[Corner]) -> float:
    # Half the sum of the cross products of neighbors (Gauss).
    following = [*corners[1:], corners[0]]
    pairs = zip(corners, following, strict=True)
    return 0.5 * math.fsum(x * v - u * y for (x, y), (u, v) in pairs)


def _corners(vehicle: VehicleSpec) -> list[Corner]:
    """The outline; with the origin anywhere in the vehicle, all positions it may then cover."""
    if vehicle.outline_m:
        return list(vehicle.outline_m)
    length, half = vehicle.length_m, 0.5 * vehicle.width_m
    if vehicle.front_m is None:
        return _rectangle(-length, length, 2.0 * half)
    return _rectangle(vehicle.front_m - length, vehicle.front_m, half)


def _rectangle(back: float, front: float, half: float) -> list[Corner]:
    return [(front, -half), (front, half), (back, half), (back, -half)]


def _places(spec: CaseSpec) -> Iterator[tuple[KeyPath, tuple[float, float, float]]]:
    yield ("point", "position_m"), spec.point.position_m
    for k, unit in enumerate(spec.units):
        yield ("units", k, "position_m"), unit.position_m
    if spec.entry.antenna_m is not None:
        yield ("entry", "antenna_m"), spec.entry.antenna_m


def _on_vehicle(
    path: KeyPath,
    place: tuple[float, float, float],
    corners: Sequence[Corner],
    vehicle: VehicleSpec,
    written: Written,
) -> None:
    forward, right, down = place
    beside = _outside((forward, right), corners)
    if beside <= BEYOND and abs(down) <= HIGHEST:
        return
    name = written.key(*path)
    units = [
        unit
        for part, unit in ((1000.0, "mm"), (100.0, "cm"))
        if name.endswith("_m")
        and max(abs(v) for v in place) >= LARGE
        and abs(down) / part <= HIGHEST
        and _outside((forward / part, right / part), corners) <= BEYOND
    ]
    hint = Finding("config.position-convention")
    if units:
        keys = [f"{name.removesuffix('_m')}_{unit}" for unit in units]
        hint = Finding("config.position-in-other-unit", units=units, keys=keys)
    if beside <= BEYOND:
        code = "config.position-below-origin" if down > 0 else "config.position-above-origin"
        raise written.refuse(path, code, distance=abs(down), hint=hint)
    data = {"distance": beside, "hint": hint}
    if vehicle.outline_m:
        line = written.file.line(("vehicle", "outline_m"))
        raise written.refuse(path, "config.position-outside-outline", outline_line=line, **data)
    data |= {"length": vehicle.length_m, "width": vehicle.width_m}
    stated = [n for n in ("length_m", "width_m", "front_m") if written.has("vehicle", n)]
    if not stated:
        raise written.refuse(path, "config.position-outside-default-size", **data)
    sizes = [written.said("vehicle", name) for name in stated]
    raise written.refuse(path, "config.position-outside-size", sizes=sizes, **data)


def _outside(place: Corner, corners: Sequence[Corner]) -> float:
    """Distance from a polygon, 0 within it, m."""
    sides = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    x, y = place
    crossings = sum(
        (b > y) != (d > y) and x < a + (y - b) / (d - b) * (c - a) for (a, b), (c, d) in sides
    )
    return 0.0 if crossings % 2 else min(_from_side(place, a, b) for a, b in sides)


def _from_side(place: Corner, begin: Corner, end: Corner) -> float:
    x, y = end[0] - begin[0], end[1] - begin[1]
    square = x * x + y * y
    along = (place[0] - begin[0]) * x + (place[1] - begin[1]) * y
    part = min(max(along / square, 0.0), 1.0) if square else 0.0
    return math.dist(place, (begin[0] + part * x, begin[1] + part * y))
