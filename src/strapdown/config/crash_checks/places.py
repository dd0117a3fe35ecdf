"""Places on a vehicle: they lie on it, or a number is in another unit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from strapdown.config.crash_case import CaseSpec, VehicleSpec
from strapdown.config.crash_checks.written import Written
from strapdown.config.toml_lines import KeyPath
from strapdown.errors import Finding

__all__ = ["check_places"]

Corner = tuple[float, float]

#: How far beside the outline a place may lie: a bumper's camera, a mirror, a rough drawing.
BEYOND = 0.5  # m
#: And above or below the origin.
HIGHEST = 4.5  # m
LONGEST = 30.0  # m
#: So far from the origin a coordinate is likely in another unit.
LARGE = 10.0  # m
#: Beyond it no tape has measured.
MOST_SD = 2.0  # m
LIGHTEST, HEAVIEST = 20.0, 100_000.0  # kg
SMALLEST = 0.1  # m²


def check_places(spec: CaseSpec, written: Written) -> None:
    """Check the vehicle, and the places on it.

    Raises
    ------
    ConfigError
        Its sizes contradict each other or are none of a vehicle, or a place is far outside of it.
    """
    vehicle = spec.vehicle
    _sizes(vehicle, written)
    corners = _corners(vehicle)
    for path, place in _places(spec):
        _on_vehicle(path, place, corners, vehicle, written)
    sds = [(("units", k, "position_sd_m"), u.position_sd_m) for k, u in enumerate(spec.units)]
    for at, sd in [*sds, (("entry", "antenna_sd_m"), spec.entry.antenna_sd_m)]:
        if sd > MOST_SD:
            raise written.refuse(at, "config.position-sd-too-large", sd=sd)


def _sizes(vehicle: VehicleSpec, written: Written) -> None:
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
    # Half the sum of the cross products of neighbours (Gauss).
    following = [*corners[1:], corners[0]]
    pairs = zip(corners, following, strict=True)
    return 0.5 * math.fsum(x * v - u * y for (x, y), (u, v) in pairs)


def _corners(vehicle: VehicleSpec) -> list[Corner]:
    """The outline; where the origin may be anywhere in the vehicle, all that it may then be."""
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
