"""Units of gyro, accelerometer and magnetometer: stated, named, or inferred."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.body_axes import mirrored
from strapdown.formats.columns import parse_axes, says_increment
from strapdown.formats.find_columns import AXES, Column
from strapdown.formats.inference import Inference, Signals, infer_signals
from strapdown.formats.judge import UNITS, inferred_unit, report_contradictions
from strapdown.formats.numbers import numbers
from strapdown.formats.recording import RawLog, ReadOptions
from strapdown.formats.summed import OPEN, SUMS
from strapdown.formats.unit_words import parse_unit

__all__ = ["left_out", "told_by_numbers", "units_of_triads", "values_of_triads"]


Array = NDArray[np.float64]


def told_by_numbers(
    raw: RawLog,
    found: dict[str, Column],
    options: ReadOptions,
    values: dict[str, Array],
    ticks: NDArray[Any] | None,
    dated: bool,
) -> dict[str, Inference]:
    """Run the inference on the numbers; skipped for a gyro alone with a stated unit.

    Parameters
    ----------
    raw : RawLog
    found : dict of str to Column
    options : ReadOptions
    values : dict of str to ndarray, (n, 3)
        From `values_of_triads`.
    ticks : ndarray or None, (n,)
        Stamps as in the file.
    dated : bool
        Whether they were dates, now converted to ns.

    Returns
    -------
    dict of str to Inference
        By quantity.
    """
    if set(values) == {"gyro"} and _stated_unit(found, "gyro", options):
        return {}
    unit = "ns" if dated else None
    if ticks is not None and not dated:
        asked = options.time_unit
        unit = parse_unit(asked, "time") if asked else found["time"].unit
    signals = Signals(
        ticks,
        values["gyro"],
        values.get("accel"),
        values.get("mag"),
        time_unit=unit,
        rate=options.rate or raw.rate,
    )
    return {i.quantity: i for i in infer_signals(signals)}


def units_of_triads(
    raw: RawLog,
    found: dict[str, Column],
    options: ReadOptions,
    values: dict[str, Array],
    said: dict[str, Inference],
    findings: list[Finding],
) -> dict[str, tuple[str, str]]:
    """Return the unit of each usable triad, with the reason.

    Parameters
    ----------
    raw : RawLog
    found : dict of str to Column
    options : ReadOptions
    values : dict of str to ndarray, (n, 3)
    said : dict of str to Inference
        From `told_by_numbers`.
    findings : list of Finding
        Dropped triads, inferences and contradictions are appended.

    Returns
    -------
    dict of str to (str, str)

    Raises
    ------
    DataError
        The unit of the gyro is not known.
    """
    units: dict[str, tuple[str, str]] = {}
    asked: set[str] = set()
    for triad, block in values.items():
        stated = _stated_unit(found, triad, options)
        if stated is None or _asked_unit(triad, options):
            asked.add(triad)
        try:
            if stated is None:
                _refuse_open(raw, found, triad)
            units[triad] = stated or inferred_unit(triad, said, block, raw.name, findings)
        except DataError as error:
            if triad == "gyro":
                raise
            findings.append(left_out(raw, triad, error))
    mirror = options.axes is not None and mirrored(*parse_axes(options.axes))
    plain = {t: u for t, (u, _) in units.items()}
    report_contradictions(said, plain, asked, mirror, raw.name, findings)
    return units


def _refuse_open(raw: RawLog, found: dict[str, Column], triad: str) -> None:
    """Refuse a unit that the file leaves open: the numbers cannot decide between f and -f.

    Raises
    ------
    DataError
    """
    column = found[f"{triad}_x"]
    unit = column.unit
    if unit is None and says_increment(column.source):
        unit = OPEN[triad]
    if unit and " or " in unit:
        raise DataError(
            "io.file-leaves-open-whether", file=raw.name, quantity=triad, unit=unit, triad=triad
        )


def _asked_unit(triad: str, options: ReadOptions) -> str | None:
    """Return the unit stated by the user."""
    return {"gyro": options.gyro_unit, "accel": options.accel_unit}.get(triad)


def _stated_unit(
    found: dict[str, Column], triad: str, options: ReadOptions
) -> tuple[str, str] | None:
    asked = _asked_unit(triad, options)
    if asked:
        return parse_unit(asked, triad), f"stated by --{triad}-unit"
    columns = [found[f"{triad}_{a}"] for a in AXES]
    units = {c.unit for c in columns}
    known = set(UNITS[triad])
    # Degrees often mean degrees per second: only a name that states increments is trusted.
    if all(says_increment(c.source) for c in columns):
        known |= set(SUMS[triad])
    unit = columns[0].unit
    if len(units) == 1 and unit is not None and unit in known:
        stated = columns[0].why == "stated by the file"
        return unit, "stated by the file" if stated else "in its name"
    return None


# Values of gyro, accelerometer and magnetometer as in a file.

# Unusable triads are dropped, except the gyro, which suffices for an attitude.
OPTIONAL = ("accel", "mag")


def values_of_triads(
    raw: RawLog, found: dict[str, Column], findings: list[Finding]
) -> dict[str, Array]:
    """Return the raw values of each usable triad.

    Parameters
    ----------
    raw : RawLog
    found : dict of str to Column
    findings : list of Finding
        Dropped triads are appended.

    Returns
    -------
    dict of str to ndarray, (n, 3)

    Raises
    ------
    DataError
        The values of the gyro cannot be used.
    """
    values = {"gyro": _triad(raw, found, "gyro")}
    for triad in OPTIONAL:
        if not any(f"{triad}_{a}" in found for a in AXES):
            continue
        missing = [f"{triad}_{a}" for a in AXES if f"{triad}_{a}" not in found]
        if missing:
            findings.append(_not_used(raw, triad, "io.left-out-without-axes", missing=missing))
            continue
        try:
            block = _triad(raw, found, triad)
        except DataError as error:
            findings.append(left_out(raw, triad, error))
            continue
        empty = int((~np.isfinite(block)).any(axis=1).sum())
        if not np.isfinite(block).any():
            findings.append(_not_used(raw, triad, "io.left-out-without-number"))
        elif triad == "mag" and empty:
            findings.append(_not_used(raw, triad, "io.left-out-rows-without-number", count=empty))
        else:
            values[triad] = block
    return values


def _not_used(raw: RawLog, triad: str, code: str, **data: Any) -> Finding:
    return Finding(code, file=raw.name, quantity=triad, severity="note", **data)


def _triad(raw: RawLog, found: dict[str, Column], triad: str) -> Array:
    parts = [numbers(raw, found[f"{triad}_{a}"], f"{triad}_{a}") for a in AXES]
    return np.column_stack(parts).astype(np.float64, copy=False)


def left_out(raw: RawLog, triad: str, error: DataError) -> Finding:
    """Make the finding that a triad is not used, with the reason."""
    return Finding(
        "io.left-out-unusable",
        file=raw.name,
        row=error.finding.row,
        quantity=triad,
        reason=error.finding,
    )
