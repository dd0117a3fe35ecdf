"""Units: factors with sources, spellings as people write them, and units of raw counts.

A value in SI is ``value * factor``. Magnetic fields are in µT; angles in radians, or in degrees
where a table has degrees (`ANGLES`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError

_DEGREE = math.pi / 180.0

#: Factors to rad/s.
GYRO_UNITS: dict[str, float] = {
    "rad/s": 1.0,
    "mrad/s": 1e-3,
    "deg/s": _DEGREE,
    "mdeg/s": 1e-3 * _DEGREE,
    "deg/h": _DEGREE / 3600.0,
    "rpm": 2.0 * math.pi / 60.0,
    "rev/s": 2.0 * math.pi,
    "deg/min": _DEGREE / 60.0,
    "rad/min": 1.0 / 60.0,
    "rad/h": 1.0 / 3600.0,
    "urad/s": 1e-6,
    "cdeg/s": 1e-2 * _DEGREE,
    "arcsec/s": _DEGREE / 3600.0,
    "arcmin/s": _DEGREE / 60.0,
    "gon/s": math.pi / 200.0,
}

#: Factors to m/s².
ACCEL_UNITS: dict[str, float] = {
    "m/s2": 1.0,
    "g": STANDARD_GRAVITY,
    "mg": 1e-3 * STANDARD_GRAVITY,
    "ft/s2": 0.3048,
    "cm/s2": 1e-2,
    "mm/s2": 1e-3,
    "mGal": 1e-5,
    "in/s2": 0.0254,
    "km/h/s": 1.0 / 3.6,
    "ug": 1e-6 * STANDARD_GRAVITY,
    # Sensors that report gravity instead of specific force, as iOS does.
    "-m/s2": -1.0,
    "-g": -STANDARD_GRAVITY,
}

#: Factors to rad and to m/s, of the increments of sensors that sum over each sample.
GYRO_SUMS: dict[str, float] = {"rad": 1.0, "deg": _DEGREE}
ACCEL_SUMS: dict[str, float] = {"m/s": 1.0, "g*s": STANDARD_GRAVITY}

#: Factors to µT.
MAG_UNITS: dict[str, float] = {
    "uT": 1.0,
    "nT": 1e-3,
    "gauss": 100.0,
    "mG": 0.1,
    "T": 1e6,
    "mT": 1e3,
}
#: Units of sensors that the numbers alone may show; others count where a file states them.
INFERRED = {
    "gyro": ("rad/s", "mrad/s", "deg/s", "mdeg/s", "deg/h"),
    "accel": ("m/s2", "g", "mg", "ft/s2", "-m/s2", "-g"),
    "mag": ("uT", "nT", "gauss", "mG", "T"),
}
#: Words of raw counts, which a file states instead of a unit.
COUNTS = {
    *("lsb", "lsbs", "count", "counts", "cts", "digit", "digits", "dn", "adc", "raw", "int16"),
    *("i16", "ticks"),
}

#: Of a magnetometer that is calibrated by the field where it was, whose strength is not stated.
RELATIVE_FIELDS: dict[str, float] = {"local_flux": 1.0}

#: Factors to s.
TIME_UNITS: dict[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}

#: Orders of day, month and year of dates, which are stated as a unit of time is.
DATE_ORDERS = ("d/m/y", "m/d/y")

#: Factors to degrees, the unit of angles in tables.
ANGLES: dict[str, float] = {
    "deg": 1.0,
    "rad": math.degrees(1.0),
    "cdeg": 1e-2,
    "1e-5 deg": 1e-5,
    "1e-6 deg": 1e-6,
    "1e-7 deg": 1e-7,
    "semicircles": 180.0 / 2.0**31,  # of 32 bits, in files of Garmin
}

# Mile, foot, inch and pound are those of the international agreement of 1959: 0.3048 m per foot,
# 0.45359237 kg per pound. A nautical mile is 1852 m (International Hydrographic Bureau, 1929).
#: Factors to m/s.
SPEEDS: dict[str, float] = {
    "m/s": 1.0,
    "km/h": 1.0 / 3.6,
    "mph": 0.44704,
    "ft/s": 0.3048,
    "ft/min": 0.3048 / 60.0,
    "cm/s": 1e-2,
    "mm/s": 1e-3,
    "kn": 1852.0 / 3600.0,
}

#: Factors to m.
LENGTHS: dict[str, float] = {
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "in": 0.0254,
    "ft": 0.3048,
    "km": 1e3,
}

#: Factors to N, and to Pa.
FORCES: dict[str, float] = {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605, "kip": 4448.2216152605}
#: Factors to N m, and to kg.
MOMENTS: dict[str, float] = {
    "N*m": 1.0,
    "kN*m": 1e3,
    "lbf*ft": 4.4482216152605 * 0.3048,
    "lbf*in": 4.4482216152605 * 0.0254,
}
MASSES: dict[str, float] = {"kg": 1.0, "lb": 0.45359237, "t": 1e3}
PRESSURES: dict[str, float] = {
    "Pa": 1.0,
    "hPa": 100.0,
    "kPa": 1000.0,
    "mbar": 100.0,
    "bar": 1e5,
    "atm": 101325.0,
    "mmHg": 101325.0 / 760.0,
    "inHg": 25.4 * 101325.0 / 760.0,
    "psi": 4.4482216152605 / 0.0254**2,
}


@dataclass(frozen=True)
class ShownUnits:
    """Units of a crash report: speeds, with another beside it, lengths, masses, impulse, energy."""

    speed: str
    beside: str
    length: str
    mass: str
    impulse: str = "kN s"
    energy: str = "kJ"


#: Systems that a case may choose.
SHOWN_UNITS: dict[str, ShownUnits] = {
    "metric": ShownUnits("km/h", "m/s", "m", "kg"),
    "si": ShownUnits("m/s", "km/h", "m", "kg"),
    "us": ShownUnits("mph", "ft/s", "ft", "lb", "lbf s", "ft lbf"),
}

#: Units of each quantity, with their factors.
FACTORS: dict[str, dict[str, float]] = {
    "acceleration": ACCEL_UNITS,
    "rate": GYRO_UNITS,
    "angle": ANGLES,
    "change of velocity": ACCEL_SUMS,
    "magnetic field": MAG_UNITS,
    "magnetic field, relative": RELATIVE_FIELDS,
    "time": TIME_UNITS,
    "velocity": SPEEDS,
    "displacement": LENGTHS,
    "force": FORCES,
    "moment": MOMENTS,
    "pressure": PRESSURES,
}
#: Quantities whose units a log, a table of positions and a crash record may state. Where two have
#: the same spelling, the first decides: kn is knots in a table, and kilonewtons in a crash record.
OF_LOGS = (
    *("rate", "acceleration", "change of velocity", "magnetic field", "magnetic field, relative"),
    *("time", "angle"),
)
OF_TABLES = ("time", "angle", "rate", "displacement", "velocity", "pressure")
OF_CRASHES = ("acceleration", "rate", "force", "velocity", "displacement", "time")

# Spellings without blanks and in lower case, by unit. A division in a name of a column is an
# underscore, with or without "per": `_forms` adds these.
_SPELLINGS = {
    "rad/s": "rad/s рад/с рад/сек rads radps "
    "rad/sec rads/s rads/sec radian/s radians/s radians/sec rad/second radians/second rad·s-1 "
    "rad*s^-1 rad.s-1 radsec 1/s*rad",
    "mrad/s": "mrad/s",
    "deg/s": "deg/s град/с град/сек °/с °/сек "
    "deg/sec degs degps dps °/s °/sec º/s º/sec degree/s degree/sec degrees/s "
    "degrees/sec deg/second degree/second degrees/second degsec grad/s d/s "
    "grader/s graden/s gradi/s grados/s graus/s derece/s",
    "mdeg/s": "mdeg/s mdps",
    "deg/h": "deg/h deg/hr °/h °/hr º/h dph deg/hour degrees/hour",
    "rpm": "rpm r/min rev/min revs/min tr/min u/min 1/min turns/min turn/min min^-1 min-1 об/мин",
    "rev/s": "rev/s revs/s rps r/s tr/s u/s turn/s turns/s turns/sec rev/sec об/с",
    "deg/min": "deg/min °/min º/min degrees/min degrees/minute",
    "rad/min": "rad/min",
    "rad/h": "rad/h rad/hr",
    "urad/s": "urad/s µrad/s μrad/s",
    "cdeg/s": "cdeg/s cdps 0.01deg/s 0.01°/s",
    "arcsec/s": "arcsec/s asec/s",
    "arcmin/s": "arcmin/s amin/s",
    "gon/s": "gon/s gons/s",
    "m/s2": "n/kg м/с2 м/с² м/с^2 м/сек2 "
    "m/s2 m/s^2 m/s² m/s**2 m/s/s m/sec2 m/sec^2 m/(s*s) m/s*s m/ss mss ms2 ms^2 ms-2 "
    "mps2 m_per_s_2 m·s-2 m*s^-2 meters/sec/sec meters/s2 meters/s^2 "
    "meters/secondsquared metres/secondsquared meters/second_squared",
    "ft/s2": "ft/s2 ft/s^2 ft/s² ft/s**2 ft/sec2 ft/sec^2 ft/s/s ft/sec/sec fps2 ftps2 feet/s2",
    "cm/s2": "cm/s2 cm/s^2 cm/s² cm/s**2 cm/sec2 cm/sec^2 cm/sec² cm/s/s gal gals",
    "mm/s2": "mm/s2 mm/s^2 mm/s² mm/s**2 mm/sec2 mm/sec^2 mm/s/s",
    "mGal": "mgal mgals milligal",
    "in/s2": "in/s2 in/s^2 in/s² in/s/s inch/s2 inch/s²",
    "km/h/s": "km/h/s kmh/s kph/s km/(h*s)",
    "ug": "ug µg μg micro-g microg",
    "g": "g g0 gs g's g`s g-force gn g_n gee gees earth-g standardgravity",
    "mg": "mg milli-g",
    "m/s": "m/s м/с м/сек m/sec mps m·s-1 meter/s meters/s meters/second metres/s metres/second",
    "g*s": "g*s g·s g_s",
    "km/h": "km/h км/ч км/час 公里/小时 km/hr kph kmh kmph km·h-1",
    "mph": "mph mi/h mi/hr mile/h miles/h miles/hour",
    "ft/s": "ft/s ft/sec fps feet/s",
    "ft/min": "ft/min fpm feet/min",
    "cm/s": "cm/s",
    "mm/s": "mm/s",
    "kn": "kn kt kts knot knots",
    "uT": "ut мктл µt μt microtesla",
    "nT": "nt nanotesla",
    "gauss": "gauss ga",
    "mG": "mgauss milligauss mga",
    "T": "tesla",
    "mT": "mt millitesla",
    "local_flux": "local_flux localflux local_flux*",
    "s": "s sec secs second seconds с сек секунд секунды",
    "ms": "ms msec msecs millis millisecond milliseconds мс миллисекунд миллисекунды 毫秒 ミリ秒",
    "us": "us µs μs usec usecs micros microsecond microseconds мкс микросекунд 微秒",
    "ns": "ns nsec nsecs nanosec nanosecs nanos nanosecond nanoseconds нс наносекунд 纳秒",
    "min": "min minutes",
    "deg": "deg ° degree degrees",
    "rad": "rad radian radians",
    "cdeg": "cdeg centideg centidegrees centidegree 0.01deg 1e-2deg deg*100 deg/100",
    "1e-5 deg": "1e-5deg dege5 deg*1e-5 10^-5deg deg*1e5",
    "1e-6 deg": "1e-6deg dege6 deg*1e-6 10^-6deg microdeg udeg µdeg μdeg deg*1e6",
    "1e-7 deg": "1e-7deg dege7 deg*1e-7 10^-7deg deg*1e7",
    "semicircles": "semicircles semicircle",
    "m": "m meter metre meters metres",
    "km": "km",
    "cm": "cm",
    "mm": "mm millimeter millimetre millimeters millimetres",
    "in": "in inch inches",
    "ft": "ft feet foot",
    "N": "n newton newtons nwt",
    "kN": "kn kilonewton kilonewtons",
    "lbf": "lbf lbs",
    "kip": "kip kips",
    "N*m": "n*m nm n-m n·m newtonmeter newtonmeters nwm",
    "kN*m": "kn*m knm kn-m kn·m",
    "lbf*ft": "lbf*ft lbf-ft lbfft ft-lbf ft-lb ftlb lb-ft lbft",
    "lbf*in": "lbf*in lbf-in lbfin in-lbf in-lb inlb lb-in lbin",
    "Pa": "pa pascal",
    "hPa": "hpa hectopascal",
    "kPa": "kpa kilopascal",
    "mbar": "mbar millibar mb",
    "bar": "bar",
    "atm": "atm",
    "mmHg": "mmhg torr",
    "inHg": "inhg",
    "psi": "psi",
}
# Powers of a second, with any separator of the factors: rad s^-1, m·s⁻².
_POWERS = {
    "rads-1": "rad/s",
    "mrads-1": "mrad/s",
    "degs-1": "deg/s",
    "°s-1": "deg/s",
    "ms-2": "m/s2",
    "cms-2": "cm/s2",
    "mms-2": "mm/s2",
    "ms-1": "m/s",
}
# One factor in brackets behind a division or a power: m/(s^2), rad/(s), m/s^(2).
_ENCLOSED = re.compile(r"([/^])\((\w+(?:\^?[\d²])?)\)")
_RAISED = str.maketrans({"⁻": "-", "−": "-", "¹": "1", "²": "2"})


def _forms(spelling: str) -> Iterable[str]:
    yield spelling
    # r_min is rather a least r than revolutions per minute.
    if "/" in spelling and not spelling.startswith(("1", "r/", "u/", "d/")):
        yield spelling.replace("/", "_")
        yield spelling.replace("/", "_per_")


_UNIT_OF: dict[str, dict[str, str]] = {
    quantity: {
        form: unit
        for unit in units
        for spelling in _SPELLINGS.get(unit, "").split()
        for form in _forms(spelling)
    }
    for quantity, units in FACTORS.items()
}


def find_unit(text: str, among: Sequence[str] = OF_LOGS) -> tuple[str, str] | None:
    """Parse the spelling of a unit.

    `text`: as ``rad/s``, ``[deg/s]``, ``m s^-2``, ``G's``, in any case. `among`: quantities that it
    may be of, of `FACTORS`; the first that has the spelling decides. Returns (str, str) or None,
    the quantity and the unit, in the spelling of this package.
    """
    if text.strip(" []()") == "T" and "magnetic field" in among:
        return "magnetic field", "T"  # a small letter is a time
    plain = re.sub(r"\s+per\s+", "/", text.strip().strip("[]").lower())
    plain = re.sub(r"\s+", "", plain)
    plain = _ENCLOSED.sub(r"\1\2", plain)
    bare = plain.strip("()")
    power = _POWERS.get(re.sub(r"[·*.^_]", "", bare.translate(_RAISED)))
    for word in (plain, bare):
        for quantity in among:
            if unit := _UNIT_OF[quantity].get(word):
                return quantity, unit
    return next(((q, power) for q in among if power in FACTORS[q]), None) if power else None


def unit_of(text: str, among: Sequence[str] = OF_LOGS) -> str | None:
    """Parse the spelling of a unit (`find_unit`). Returns in the spelling of this package."""
    found = find_unit(text, among)
    return found[1] if found else None


def si_of(text: str, among: Sequence[str] = OF_CRASHES) -> tuple[str, str, float] | None:
    """Parse the spelling of a unit (`find_unit`): its quantity, its SI unit, and the factor to it.

    None if the unit is not known.
    """
    found = find_unit(text, among)
    if found is None:
        return None
    units = FACTORS[found[0]]
    return found[0], next(u for u, factor in units.items() if factor == 1.0), units[found[1]]


def unit_words(words: Sequence[str], among: Sequence[str] = OF_LOGS) -> tuple[list[str], str]:
    """Split a unit off the end of the words of a name, the longest first: ``m s2``, ``rad s``.

    `words`: in lower case. Returns the words before it, and the unit; empty if there is none.
    """
    for take in (4, 3, 2, 1):
        if len(words) > take:
            spelled = "_".join(words[-take:])
            for quantity in among:
                if unit := _UNIT_OF[quantity].get(spelled):
                    return list(words[:-take]), unit
    return list(words), ""


#: Endings of names, in configurations and results, and how their units are shown.
ENDINGS = {
    "_m_per_s2": "m/s²",
    "_m_per_s": "m/s",
    "_km_per_h": "km/h",
    "_mm_per_s": "mm/s",
    "_rad_per_s": "rad/s",
    "_deg_per_s": "deg/s",
    "_deg_per_h": "deg/h",
    "_deg_per_sqrt_h": "deg/√h",
    "_m": "m",
    "_km": "km",
    "_mm": "mm",
    "_cm": "cm",
    "_s": "s",
    "_ms": "ms",
    "_h": "h",
    "_hz": "Hz",
    "_deg": "deg",
    "_rad": "rad",
    "_kg": "kg",
    "_n": "N",
    "_kn": "kN",
    "_kj": "kJ",
    "_ug": "µg",
    "_mg": "mg",
    "_g": "g",
    "_ut": "µT",
    "_pa": "Pa",
    "_ppm": "ppm",
    "_percent": "%",
}


def named_unit(name: str) -> tuple[str, str]:
    """Split a name into words and the unit of its ending: ``end_error_m``, end error and m.

    The unit is empty where the ending is none of `ENDINGS`, or the name is a unit alone.
    """
    ending = max((e for e in ENDINGS if name.endswith(e)), key=len, default="")
    words = name.removesuffix(ending)
    if not words or words.endswith(("_per", "_sqrt")):
        return name.replace("_", " "), ""
    return words.replace("_", " "), ENDINGS.get(ending, "")


# Units of raw counts, and units stated by the user.


_NUMBER = r"\d+(?:\.\d*)?(?:[eE][+-]?\d+)?"
# Counts per unit, as in deg/s/131; or units per count, as in 1/131 deg/s.
_PARTS = re.compile(rf"(?P<unit>.*[^\W\d_].*)/\s*(?P<counts>{_NUMBER})")
_TIMES = re.compile(rf"(?P<up>{_NUMBER})(?:\s*/\s*(?P<down>{_NUMBER}))?\s*[ *·]\s*(?P<unit>\D.*)")


def parse_unit(text: str, kind: str) -> str:
    """Check a unit that the user stated.

    `text`: a unit; for a gyro or an accelerometer also one of raw counts, as ``deg/s/131`` or
    ``g/16384`` (counts per unit), or ``1/131 deg/s`` or ``0.061 deg/s`` (units per count); for time
    also one of ticks, as ``s/32768`` or ``10 us``, or an order of dates (`DATE_ORDERS`). `kind`
    ({'gyro', 'accel', 'mag', 'time'}). Returns in the spelling of this package; `factor_of` has its
    factor. ConfigError: the text is not a unit of that kind.
    """
    known = {
        "gyro": {**GYRO_UNITS, **GYRO_SUMS},
        "accel": {**ACCEL_UNITS, **ACCEL_SUMS},
        "mag": MAG_UNITS,
        "time": TIME_UNITS,
    }[kind]
    unit = _word(text)
    if unit in known or (kind == "time" and unit in DATE_ORDERS):
        return unit
    counted = kind in ("gyro", "accel", "time")
    scale, of = _taken_apart(text) if counted else (None, "")
    if scale is None or (unit := _word(of)) not in known:
        raise ConfigError(
            "io.unknown-unit-or-counts" if counted else "io.unknown-unit",
            quantity=f"--{kind}-unit",
            word=text,
            known=known,
            example={"gyro": "deg/s/131", "accel": "g/16384", "time": "s/32768"}[kind],
        )
    counts = f"{1.0 / scale:g}"
    exact = math.isclose(float(counts) * scale, 1.0, rel_tol=1e-12)
    return f"{unit}/{counts}" if exact else f"{scale!r} {unit}"


def factor_of(unit: str, known: Mapping[str, float]) -> float:
    """Return the factor from a unit to SI.

    `unit`: as returned by `parse_unit`. `known`: factors of plain units.
    """
    if unit in known:
        return known[unit]
    scale, of = _taken_apart(unit)
    return float(scale or 1.0) * known[of]


def _word(text: str) -> str:
    """Return the unit of a text, or the text; for accelerometers also with the sign of iOS."""
    bare = text.strip()
    if bare.startswith("-") and (unit := unit_of(bare[1:])):
        return f"-{unit}"
    return unit_of(bare) or bare


def _taken_apart(text: str) -> tuple[float | None, str]:
    """Parse how much of which unit a count is; None if the text has no such form."""
    bare = text.strip()
    if match := _PARTS.fullmatch(bare):
        up, down, unit = 1.0, float(match["counts"]), match["unit"]
    elif match := _TIMES.fullmatch(bare):
        up, down, unit = float(match["up"]), float(match["down"] or 1.0), match["unit"]
    else:
        return None, ""
    scale = up / down if down > 0.0 else math.inf
    return (scale if 0.0 < scale < math.inf else None), unit
