"""Formatting of report numbers: rounded by their bound, with their unit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING

from strapdown.constants import DEG_PER_HOUR, MICRO_G, STANDARD_GRAVITY, TWO_SIDED_95
from strapdown.ellipsoids import WGS84
from strapdown.units import FORCES, LENGTHS, MASSES, MOMENTS, SHOWN_UNITS, SPEEDS, ShownUnits

if TYPE_CHECKING:
    from strapdown.config.crash_case import CaseSpec
    from strapdown.crash.case import CaseResult
    from strapdown.crash.delta_v_bound import VelocityChange
    from strapdown.crash.pdof import AngleInterval


#: km/h per m/s.
KMH = 3.6
#: Units in which crash results are shown: `shown_in`.
SHOWN: ContextVar[ShownUnits] = ContextVar("shown units", default=SHOWN_UNITS["metric"])
# Numbers of a unit in one of SI; of km/h 3.6 to the last bit.
_PER = {"km/h": 3.6} | {u: 1.0 / f for u, f in (SPEEDS | LENGTHS | MASSES).items() if u != "km/h"}
# Of an impulse, N s, and an energy, J; with decimals of about the same size.
_PER_SUM = {
    "kN s": (1e-3, 2),
    "kJ": (1e-3, 1),
    "lbf s": (1.0 / FORCES["lbf"], 0),
    "ft lbf": (1.0 / MOMENTS["lbf*ft"], 0),
}
#: Name of the recorders' mean, in every table and chart.
MEAN = "mean of the recorders"
#: Axes of a vehicle.
AXES = ("forward", "right", "down")
MINUS = "\u2212"
# No-break space between a number, its bound and their unit.
GAP = "\u00a0"
# Significant digits of a bound; its value is rounded to the same decimal.
DIGITS = 2
# Decimals of a value at most.
MOST = 6
# Decimals of a latitude or longitude, deg: a centimeter; and its length along a meridian.
PLACES = 7
METERS_PER_DEG = math.radians(WGS84.semi_major_axis)
#: Instead of the bound of a quantity of which the error model has no state.
NOT_ESTIMATED = "not estimated"


def plain(value: float, places: int) -> str:
    """Format a number with fixed decimals, a real minus sign, and zero without a sign.

    A dash for NaN or infinity.
    """
    if not math.isfinite(value):
        return "–"
    text = f"{value:.{places}f}"
    if float(text) == 0.0:
        text = text.removeprefix("-")
    return text.replace("-", MINUS)


def decimals(size: float, digits: int = 3, *, least: int = 0, most: int = 6) -> int:
    """Return the decimals with which a size has so many digits; two for a size without digits."""
    if not (math.isfinite(size) and size > 0.0):
        return 2
    # Of the rounded size: 0.996 to two digits is 1.0, not 1.00.
    exponent = int(f"{size:.{digits - 1}e}".rpartition("e")[2])
    return min(most, max(least, digits - 1 - exponent))


def about(value: float, half: float, unit: str) -> str:
    """Format a value with the half width of its bound.

    `value`, `half`: in the given unit. As ``7.34 ± 0.27 m/s``, with no-break spaces: `bounded`.
    """
    said, bound = bounded(value, half)
    if not bound:
        said, bound = plain(value, 2), f"±{GAP}–"
    return f"{said}{GAP}{bound}" + (unit if unit == "°" else GAP + unit if unit else "")


def bounded(value: float, below: float, above: float | None = None) -> tuple[str, str]:
    """Format a value and its bound, all to two digits of the bound: the one way for both.

    `below`, `above`: half widths of the bound, in the unit of the value; `above` is `below` if not
    given, and infinite ends are open. Returns: ``("63.8", "± 2.5")``; ``("0.0000", "± 0.0031")``;
    ``("63.8", "+∞ −2.5")``; the bound is empty if both ends are open, and the value then to four
    digits.
    """
    above = below if above is None else above
    ends = [half for half in (below, above) if math.isfinite(half)]
    if not ends:
        return plain(value, decimals(abs(value), 4)), ""
    least = min((half for half in ends if half > 0.0), default=0.0)
    said = _rounded(value, decimals(least, DIGITS, least=-MOST, most=MOST))
    if len(ends) == 2 and math.isclose(below, above, rel_tol=0.02):
        return said, f"±{GAP}{half_words(below)}"
    up, down = ("∞" if math.isinf(half) else half_words(half) for half in (above, below))
    return said, f"+{up} {MINUS}{down}"


def on_ground(deg: float, half: float | None) -> tuple[str, str]:
    """Format a latitude or longitude, deg, to two digits of its bound, which is in m.

    `half`, m: half width of the bound along the ground; without one to a centimeter. Returns:
    ``("37.725491°", "± 1.2")``; the bound is empty without one.
    """
    if half is None:
        return f"{plain(deg, PLACES)}°", ""
    finest = decimals(half / METERS_PER_DEG, DIGITS, least=2, most=PLACES + 2)
    return f"{plain(deg, finest)}°", f"±{GAP}{half_words(half)}"


def half_words(half: float) -> str:
    """Format a half width of a bound to two digits."""
    if 0.0 < half < 0.1**MOST:
        return f"{half:.1e}".replace("-", MINUS)
    return _rounded(half, decimals(half, DIGITS, least=-MOST, most=MOST + 1))


def _rounded(value: float, places: int) -> str:
    """Format a number rounded to decimals, or to tens, hundreds … where these are negative."""
    return plain(round(value, places) if places < 0 else value, max(places, 0))


def heading_shown(deg: float, half: float) -> float:
    """Return a heading, deg, from 0 to below 360 as `about` shows it: 359.9 ± 16 is 0 ± 16."""
    return round(deg, decimals(half, DIGITS, most=MOST)) % 360.0


def plus_minus(half: float, unit: str) -> str:
    """Format the half width of a bound alone: ``± 0.27 m/s``."""
    text = about(0.0, half, unit)
    return text[text.index("±") :]


@contextmanager
def shown_in(system: str) -> Iterator[None]:
    """Show crash results in a system of `units.SHOWN_UNITS`."""
    token = SHOWN.set(SHOWN_UNITS[system])
    try:
        yield
    finally:
        SHOWN.reset(token)


def speed_unit() -> str:
    """Unit in which speeds are shown."""
    return SHOWN.get().speed


def speed_factor(unit: str | None = None) -> float:
    """Speed in the shown unit, or in another one, of 1 m/s."""
    return _PER[unit or SHOWN.get().speed]


def length_unit() -> str:
    """Unit in which lengths are shown."""
    return SHOWN.get().length


def length_factor() -> float:
    """Length in the shown unit of 1 m."""
    return _PER[SHOWN.get().length]


def mass_words(mass: float) -> str:
    """Format a mass in kg."""
    unit = SHOWN.get().mass
    return f"{plain(_PER[unit] * mass, 0)} {unit}" if unit != "kg" else f"{mass:g} kg"


def impulse_shown() -> tuple[float, int, str]:
    """Factor to the shown unit of impulses of 1 N s, its decimals, and the unit."""
    unit = SHOWN.get().impulse
    return *_PER_SUM[unit], unit


def energy_shown() -> tuple[float, int, str]:
    """Factor to the shown unit of energies of 1 J, its decimals, and the unit."""
    unit = SHOWN.get().energy
    return *_PER_SUM[unit], unit


def length_about(value: float, half: float) -> str:
    """Format a length in m with its bound."""
    factor = length_factor()
    return about(factor * value, factor * half, length_unit())


def speed(value: float, half: float) -> str:
    """Format a speed in m/s with its bound."""
    factor = speed_factor()
    return about(factor * value, factor * half, speed_unit())


def speed_words(value: float, unit: str | None = None) -> str:
    """Format a speed in m/s without its bound, in the shown unit or another one."""
    return f"{plain(speed_factor(unit) * value, 1)} {unit or speed_unit()}"


def speed_both(value: float) -> str:
    """Format a speed in m/s in the unit beside, and in the shown one: ``6.9 m/s (24.9 km/h)``."""
    return f"{speed_words(value, SHOWN.get().beside)} ({speed_words(value)})"


def speed_range(value: float, half: float) -> str:
    """Format the bound of a speed in m/s as a range, and the speed in the unit beside."""
    factor, beside = speed_factor(), SHOWN.get().beside
    places = decimals(factor * half, DIGITS, most=MOST)
    low, high = factor * (value - half), factor * (value + half)
    ends = f"{plain(low, places)} to {plain(high, places)}{GAP}{speed_unit()} with 95{GAP}%"
    other = speed_factor(beside)
    return f"{ends}; {about(other * value, other * half, beside)}"


def change_words(change: VelocityChange, *, unit: str = "") -> str:
    """Format the resultant of a change of velocity: ``at least 28.4 km/h`` if it is a part."""
    unit = unit or speed_unit()
    scale = speed_factor(unit)
    value, half = scale * change.resultant, scale * change.resultant_bound
    if not change.at_least:
        return about(value, half, unit)
    places = decimals(half, DIGITS, most=MOST)
    return f"at least{GAP}{plain(value, places)}{GAP}{unit}"


def change_range(change: VelocityChange) -> str:
    """Format the bound of the resultant of a change of velocity; without upper end of a part."""
    if not change.at_least:
        return speed_range(change.resultant, change.resultant_bound)
    factor = speed_factor()
    places = decimals(factor * change.resultant_bound, DIGITS, most=MOST)
    low = plain(factor * change.resultant_range[0], places)
    return f"above {low}{GAP}{speed_unit()} with 95{GAP}%, without an upper bound"


def component_words(change: VelocityChange) -> tuple[str, str, str, str]:
    """Format the components and the resultant of a change of velocity, without unit.

    A component of which a part is missing: ``-28.4 ± 0.8 or beyond``.
    """
    factor = speed_factor()
    x, y, z = (
        about(factor * v, factor * h, "") + (" or beyond" if is_open else "")
        for v, h, is_open in zip(
            change.delta_v.vector.tolist(), change.bound.half_width, change.open_axes, strict=True
        )
    )
    return x, y, z, resultant_words(change)


def resultant_words(change: VelocityChange) -> str:
    """Format the resultant of a change of velocity, without unit."""
    factor = speed_factor()
    said = about(factor * change.resultant, factor * change.resultant_bound, "")
    return f"at least {said}" if change.at_least else said


def instant(time: float) -> str:
    """Format an instant or a duration in s, to a tenth of a millisecond."""
    text = plain(time, 4).rstrip("0").rstrip(".")
    return f"{'0' if text == MINUS + '0' else text}{GAP}s"


def angle_range(interval: AngleInterval) -> str:
    """Format the bound of a direction."""
    if interval.undetermined:
        return "not determined: no direction is excluded with 95 %"
    return f"{plain(interval.low_deg, 1)}° to {plain(interval.high_deg, 1)}° with 95{GAP}%"


def three_digits(value: float) -> str:
    """Format a number to three digits."""
    if value == 0.0 or not math.isfinite(value):
        return "0"
    return plain(value, decimals(abs(value)))


def probability_words(value: float) -> str:
    """Format a probability to two digits."""
    return "below 0.0001" if value < 1e-4 else f"{value:.2g}"


def moment(time: float) -> str:
    """Describe an instant: ``0.7 ms before the trigger``."""
    if abs(time) < 5e-5:
        return "the trigger"
    return f"{plain(1e3 * abs(time), 1)}{GAP}ms {'before' if time < 0.0 else 'after'} the trigger"


def recorder(name: str, result: CaseResult) -> str:
    """Return the name of an answer as it is shown: of its recorder, or of the mean."""
    combined = result.reconstruction.combined
    return MEAN if combined is not None and name == combined.name else name


def side_words(forward: float, right: float) -> str:
    """Return the direction of a delta-V or a displacement in words: ``backward``."""
    ahead = "forward" if forward > 0.0 else "backward"
    aside = "to the right" if right > 0.0 else "to the left"
    if abs(forward) > 2.5 * abs(right):
        return ahead
    if abs(right) > 2.5 * abs(forward):
        return aside
    return f"{ahead} and {aside}"


def over_ground(result: CaseResult) -> bool:
    """Whether a heading is known, so that the path is given over ground."""
    return has_heading(result.spec)


def has_heading(spec: CaseSpec) -> bool:
    """Whether a case states a heading, or fixes give it."""
    entry = spec.entry
    return entry.kind == "gnss" or (entry.kind == "speed" and bool(entry.heading_deg))


def axis_names(result: CaseResult) -> tuple[str, str, str]:
    """Return the names of the axes of the path."""
    return ("north", "east", "down") if over_ground(result) else AXES


def spaced(text: str) -> str:
    """Return a text with ordinary spaces, for searching instead of typesetting."""
    return text.replace(GAP, " ")


# Numbers of a navigation run: distances and bounds in convenient units.


_MG = 1e-3 * MICRO_G


def shown_unit(unit: str, size: float) -> tuple[float, str]:
    """Conversion factor and display unit for states of a given size."""
    if unit == "rad/s":
        slow = size * DEG_PER_HOUR < 1000.0
        return (DEG_PER_HOUR, "deg/h") if slow else (math.degrees(1.0), "deg/s")
    if unit == "m/s²":
        micro = size * MICRO_G < 1000.0
        return (MICRO_G, "µg") if micro else (_MG, "mg")
    if unit == "1":
        return (1e6, "ppm") if size < 1e-2 else (100.0, "%")
    if unit in ("rad", "rad/g"):
        return math.degrees(1.0), unit.replace("rad", "deg")
    if unit == "(rad/s)/(m/s²)":
        return DEG_PER_HOUR * STANDARD_GRAVITY, "deg/h/g"
    return 1.0, unit


def length_words(metres: float) -> str:
    """Format a length: ``0.021 m``, ``13.4 m``, ``388 m``, ``2.41 km``."""
    size = abs(metres)
    if not math.isfinite(size):
        return "–"
    if size >= 1e5:
        return f"{plain(1e-3 * metres, 0)}{GAP}km"
    if size >= 1000.0:
        return f"{plain(1e-3 * metres, 2 if size < 1e4 else 1)}{GAP}km"
    places = 0 if size >= 99.95 else 1 if size >= 10.0 else 2 if size >= 1.0 else 3
    return f"{plain(metres, places)}{GAP}m"


def duration_words(seconds: float) -> str:
    """Format a duration: ``221 s``, ``30 min 5 s``, ``1 h 12 min``."""
    if seconds < 10.0:
        return f"{plain(seconds, 2)}{GAP}s"
    whole = round(seconds)
    if whole < 600:
        return f"{plain(seconds, 1)}{GAP}s" if whole < 100 else f"{whole}{GAP}s"
    if whole < 7200:
        rest = f" {whole % 60}{GAP}s" if whole % 60 else ""
        return f"{whole // 60}{GAP}min{rest}"
    rest = f" {whole % 3600 // 60}{GAP}min" if whole % 3600 // 60 else ""
    return f"{whole // 3600}{GAP}h{rest}"


def half(sd: float) -> float:
    """Half width of the 95 % interval."""
    return TWO_SIDED_95 * float(sd)


def share_words(share: float) -> str:
    """Format a share: ``97.4 %``; never rounded to 0 % or 100 %."""
    if not math.isfinite(share):
        return "–"
    places = 0 if share in (0.0, 1.0) else 1
    value = 100.0 * share if share in (0.0, 1.0) else min(99.9, max(0.1, 100.0 * share))
    return f"{plain(value, places)}{GAP}%"


def shares_words(shares: Mapping[str, float]) -> str:
    """Format the shares that are not zero by their names: ``trusted 60 %, unverified 40 %``."""
    return ", ".join(f"{name} {share_words(one)}" for name, one in shares.items() if one > 0.0)


# Numbers of an alignment.


def stamp(time: float) -> str:
    """Format a time stamp to a hundredth of a second: ``243298.01 s``."""
    return f"{plain(time, 2).rstrip('0').rstrip('.')}{GAP}s"


def rate_words(rate: float) -> str:
    """Format a rate in rad/s in deg/h, or in deg/s if large."""
    if rate * DEG_PER_HOUR < 3600.0:
        return f"{small(rate * DEG_PER_HOUR)} deg/h"
    return f"{small(math.degrees(rate))} deg/s"


def force_words(force: float) -> str:
    """Format a specific force in m/s² in µg, or in mg if large."""
    micro = force * MICRO_G
    return f"{micro:.3g} µg" if micro < 1e4 else f"{1e-3 * micro:.3g} mg"


def small(value: float) -> str:
    """Format a small number to two digits."""
    size = abs(value)
    if not math.isfinite(size):
        return "–"
    return plain(value, decimals(size, 2, least=1, most=5))
