"""Text exports of Xsens MT Manager (MTi, MTx, MTw Awinda) and of Xsens DOT.

Lines of ``//`` at the top, among them ``// Update Rate: 100.0Hz``; then names as ``PacketCounter
SampleTimeFine Acc_X … Gyr_X … Mag_X …``. Acceleration (with gravity) is in m/s², rates in rad/s for
an MTi or MTw and deg/s for a DOT, the magnetic field in units of that at the factory (MTw Awinda
User Manual, table of exported data). ``SampleTimeFine`` counts 0.1 ms in an MTi (MTi User Manual,
section "Time stamp (Sample Time Fine)") and 1 µs in a DOT (Xsens DOT User Manual, section 4.2.5);
it has 32 bits, and ``PacketCounter`` 16 or 32. Where ``SampleTimeFine`` is empty in every row, the
counter and the update rate are the stamps.
"""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats import csv
from strapdown.formats.arrays import numbers
from strapdown.formats.columns import read_name
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs, head
from strapdown.units import TIME_UNITS

COUNTER, STAMP = "PacketCounter", "SampleTimeFine"
TRIADS = {"Gyr": ("gyro", "rad/s"), "Acc": ("accel", "m/s2")}
_RATE = re.compile(r"//\s*Update Rate:\s*([\d.]+)\s*Hz", re.I)
# Ticks of the two clocks, in µs, and relative tolerance of the stated rate.
TICKS = (100, 1)
LEAST_AGREEMENT = 0.2
# Range of sampling rates of this maker's sensors.
RATES = (1.0, 2000.0)  # Hz
HEAD = 4096  # bytes


def _has_names(path: Path) -> bool:
    """Whether the names are under the comments at the top of a table."""
    if not csv.detect(path):
        return False
    for line in head(path, HEAD).splitlines():
        fields = set(csv.fields_of(line, csv.separator_of(line)))
        if {COUNTER, STAMP} & fields:
            return any({f"{t}_{a}" for a in "XYZ"} <= fields for t in TRIADS)
    return False


detect = Signs(text=f"{COUNTER}|{STAMP}", also=_has_names)


def read(path: Path) -> RawLog:
    """Read rates and specific force, with stamps from the counters.

    Returns
    -------
    RawLog
        Stamps in µs of ``SampleTimeFine``; without it, of ``PacketCounter`` and the stated
        rate.

    Raises
    ------
    DataError
        The file is damaged, or the tick of the clock is not known.
    """
    data = path.read_bytes()
    raw = csv.parse(data, path.name, (path,))
    if missing := [f"Gyr_{a}" for a in "XYZ" if f"Gyr_{a}" not in raw.columns]:
        raise DataError(
            "io.xsens-columns-missing", file=path.name, quantity="gyro", missing=missing
        )
    match = _RATE.search(data[:HEAD].decode("utf-8-sig", "replace"))
    rate = float(match[1]) if match else None
    rate = rate if rate else None
    stated: dict[str, tuple[str, str | None]] = {
        f"{name}_{axis}": (f"{triad}_{axis.lower()}", unit)
        for name, (triad, unit) in TRIADS.items()
        for axis in "XYZ"
        if f"{name}_{axis}" in raw.columns
    }
    findings = list(raw.findings)
    if "Mag_X" in raw.columns:
        findings.append(
            Finding("io.xsens-mag-not-used", file=path.name, quantity="mag", severity="note")
        )
    columns = dict(raw.columns)
    source, stamps = _stamps(raw, rate, findings)
    if source is not None:
        columns[source] = stamps
        stated[source] = ("time", "us")
    # By the usual step, for a counter that wraps is unwrapped.
    in_us = source == STAMP and _usual_step(stamps) == _usual_step(raw.columns[STAMP])
    if source is None or in_us:
        # A DOT, which counts µs, writes deg/s; without its preamble the numbers have to show it.
        unit = "deg/s" if _is_of_dot(raw) else None
        stated |= {f"Gyr_{axis}": (f"gyro_{axis.lower()}", unit) for axis in "XYZ"}
    return dataclasses.replace(raw, columns=columns, stated=stated, rate=rate, findings=findings)


def _usual_step(stamps: NDArray[Any]) -> float:
    return float(np.median(np.diff(stamps.astype(np.float64)))) if stamps.size > 1 else 0.0


def _stamps(
    raw: RawLog, rate: float | None, findings: list[Finding]
) -> tuple[str | None, NDArray[Any]]:
    """Return stamps in µs, and the column that they come from."""
    if STAMP in raw.columns and not _is_empty(raw.columns[STAMP]):
        ticks = _unwrapped(raw, STAMP, (32,), findings)
        tick = 1 if _is_of_dot(raw) else _tick(raw, ticks, rate or _rate_by_other_clock(raw))
        if tick != 1:
            findings.append(
                Finding(
                    "io.xsens-tick",
                    file=raw.name,
                    quantity="time",
                    severity="note",
                    column=STAMP,
                    tick_us=tick,
                )
            )
        return STAMP, ticks * tick
    if rate is None or COUNTER not in raw.columns:
        return None, np.empty(0)
    count = _unwrapped(raw, COUNTER, (16, 32), findings)
    findings.append(
        Finding(
            "io.stamps-over-hz-top-file",
            file=raw.name,
            quantity="time",
            severity="note",
            counter=COUNTER,
            rate=rate,
        )
    )
    return COUNTER, np.asarray((count - count[0]) * (1e6 / rate))


def _is_of_dot(raw: RawLog) -> bool:
    """Whether the preamble is that of the application of a DOT."""
    return any(line.startswith("DeviceTag") for line in raw.above)


def _rate_by_other_clock(raw: RawLog) -> float | None:
    """Return the rate, Hz, by a further column of the table that is a clock of a known unit."""
    for name, values in raw.columns.items():
        said = read_name(name)
        if name == STAMP or said.quantity != "time" or values.dtype.kind not in "iuf":
            continue
        length = float(values[-1] - values[0]) * TIME_UNITS.get(said.unit or "", 0.0)
        if length > 0.0:
            return (values.size - 1) / length
    return None


def _is_empty(stamps: NDArray[Any]) -> bool:
    """Whether a column is in the header alone."""
    if stamps.dtype.kind == "f":
        return bool(np.isnan(stamps).all())
    return stamps.dtype.kind == "O" and not any(str(s).strip() for s in stamps)


def _unwrapped(
    raw: RawLog, name: str, widths: tuple[int, ...], findings: list[Finding]
) -> NDArray[Any]:
    """Unwrap a counter that overflows."""
    count = numbers(raw, name, "time")
    if count.dtype.kind not in "iu":
        return count
    count = count.astype(np.int64)
    steps = np.diff(count)
    for bits in widths:
        if count.size and int(count.max()) < 2**bits:
            falls = np.flatnonzero(steps < -(2 ** (bits - 1)))
            if falls.size:
                count[1:] += np.cumsum(steps < -(2 ** (bits - 1))) * 2**bits
                findings.append(
                    Finding(
                        "io.wrapped-bits-all-undone",
                        file=raw.name,
                        row=raw.row(int(falls[0]) + 1),
                        quantity="time",
                        severity="note",
                        name=name,
                        bits=bits,
                        size=falls.size,
                    )
                )
            break
    return count


def _tick(raw: RawLog, ticks: NDArray[Any], rate: float | None) -> int:
    """Determine the tick in µs: the one that matches the stated rate, or a plausible one."""
    step = float(np.median(np.diff(ticks))) if ticks.size > 1 else 0.0
    if not step > 0.0:
        return TICKS[0]
    found = {tick: 1e6 / (step * tick) for tick in TICKS}
    if rate is not None:
        fits = [t for t, r in found.items() if abs(r / rate - 1.0) <= LEAST_AGREEMENT]
    else:
        fits = [t for t, r in found.items() if RATES[0] <= r <= RATES[1]]
    if len(fits) == 1:
        return fits[0]
    raise DataError(
        "io.xsens-tick-undecided" if rate is None else "io.xsens-tick-against-rate",
        file=raw.name,
        quantity=STAMP,
        step=step,
        rate_hz=rate,
        choices=[
            Finding("io.choice-of-tick", severity="note", rate_hz=r, tick_us=tick)
            for tick, r in found.items()
        ],
    )
