"""Units of a laboratory crash test: channels by sensor position, and the unused ones."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.config.toml_text import Page, instant, plain, string
from strapdown.constants import GYRO_UNITS, STANDARD_GRAVITY
from strapdown.errors import ConfigError, DataError
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.formats.crash_samples import mean_accelerations_of
from strapdown.formats.named_columns import read_reference_path
from strapdown.systems.crash_draft.parts import Clock, Part, Skipped

__all__ = ["KnownPath", "as_accelerations", "known_path", "laboratory_parts", "reference_tables"]


Array = NDArray[np.float64]

_AXIS_WORD = re.compile(r"(?<![A-Za-z])([XYZ])[RGL]?(?![A-Za-z])(?:[ -]?AXIS)?", re.I)
_FAILED = ("failed", "no data", "questionable", "meaningless")
# Accelerometers of crash laboratories, after calibration by SAE J211. Zeroed channels have lost
# gravity with their bias.
LABORATORY = {"bias_sd_mg": 1020.0, "scale_sd_percent": 1.0, "misalignment_sd_deg": 1.0}
LABORATORY_GYRO = {"bias_sd_deg_per_s": 1.0, "scale_sd_percent": 1.0, "misalignment_sd_deg": 1.0}


def laboratory_parts(path: str, record: CrashRecord) -> tuple[list[Part], list[Skipped]]:
    """Find the triads of a test: one per sensor position on the vehicle, of primary channels.

    Parameters
    ----------
    path : str
        As in the case.
    record : CrashRecord
        Its channels state quantity, axis, position and body.

    Returns
    -------
    parts : list of Part
    skipped : list of Skipped
        Failed and redundant channels, and those of other bodies.
    """
    places: dict[tuple[str, str], list[CrashChannel]] = {}
    skipped: list[Skipped] = []
    elsewhere: dict[str, list[str]] = {}
    for channel in record.channels:
        if channel.quantity not in ("acceleration", "rate") or not channel.axis:
            what = (
                channel.quantity if channel.quantity not in ("acceleration", "rate") else "no axis"
            )
            elsewhere.setdefault(f"no sensor of a vehicle's motion ({what})", []).append(
                channel.name
            )
        elif channel.body != "vehicle":
            elsewhere.setdefault(f"it moves with the {channel.body}", []).append(channel.name)
        elif failure := _failure(channel):
            skipped.append(Skipped(path, f"channel {channel.name}", failure, (channel.name,)))
        else:
            places.setdefault((channel.quantity, _place(channel)), []).append(channel)
    for why, names in elsewhere.items():
        skipped.append(Skipped(path, f"channels {', '.join(names)}", why, tuple(names)))
    parts = []
    for (quantity, place), channels in places.items():
        part, unread = _part(path, quantity, place, channels)
        skipped += unread
        if part is not None:
            parts.append(part)
    return parts, skipped


def _place(channel: CrashChannel) -> str:
    """Sensor position without the axis, common to the channels of one block."""
    return " ".join(_AXIS_WORD.sub(" ", channel.place).split()).strip(" ,-") or "vehicle"


def _failure(channel: CrashChannel) -> str:
    told = next((r for r in channel.remarks if any(f in r.lower() for f in _FAILED)), "")
    return f"the laboratory says so: {told}" if told else ""


def _is_primary(channel: CrashChannel) -> bool:
    return "redundant" not in channel.remarks


def _part(
    path: str, quantity: str, place: str, channels: Sequence[CrashChannel]
) -> tuple[Part | None, list[Skipped]]:
    skipped: list[Skipped] = []
    chosen: dict[str, CrashChannel] = {}
    curves: dict[str, tuple[Array, Array]] = {}
    spare: list[str] = []
    for channel in sorted(channels, key=lambda c: not _is_primary(c)):
        axis = channel.axis.lstrip("-")
        if axis in chosen:
            spare.append(channel.name)
            continue
        try:
            curves[axis] = channel.load()
        except DataError as error:
            skipped.append(Skipped(path, f"channel {channel.name}", error.finding, (channel.name,)))
            continue
        chosen[axis] = channel
    if spare:
        why = f"redundant at '{place}'; to use it, write it in place of the primary one"
        skipped.append(Skipped(path, f"channels {', '.join(spare)}", why, tuple(spare)))
    if not chosen:
        return None, skipped
    axes = [a for a in "xyz" if a in chosen]
    time = curves[axes[0]][0]
    values = np.full((time.size, 3), np.nan)
    for axis in axes:
        sign = -1.0 if chosen[axis].axis.startswith("-") else 1.0
        values[:, "xyz".index(axis)] = sign * np.interp(time, *curves[axis])
    step = float(np.median(np.diff(time))) if time.size > 1 else math.nan
    first = chosen[axes[0]]
    scales = [c.full_scale for c in chosen.values() if c.full_scale]
    kind = STANDARD_GRAVITY if quantity == "acceleration" else GYRO_UNITS["deg/s"]
    name = "full_scale_g" if quantity == "acceleration" else "full_scale_deg_per_s"
    uncertainty = dict(LABORATORY if quantity == "acceleration" else LABORATORY_GYRO)
    if scales:
        uncertainty[name] = round(min(scales) / kind, 6)
    notes = [
        f"{a} is channel {chosen[a].name}: {'; '.join(chosen[a].remarks)}"
        + (f"; {chosen[a].low_pass}" if chosen[a].low_pass else "")
        for a in axes
    ]
    return (
        Part(
            path,
            quantity,
            {a: ("-" if chosen[a].axis.startswith("-") else "") + chosen[a].name for a in axes},
            Clock("", "s", "the record has its own", step, 1.0 / step),
            first.unit,
            "axes and unit by the record",
            time,
            values,
            label=place,
            zeroed=quantity == "acceleration",
            sampling="",
            named=True,
            place=place,
            uncertainty=uncertainty,
            basis="of a sensor of a crash laboratory, calibrated by SAE J211; zeroed before the "
            "impact, so that gravity is in its bias; its full scale is that of the record",
            notes=tuple(notes),
        ),
        skipped,
    )


# Delta-v of event data recorders, converted to accelerations.


# 49 CFR 563.8, Table III: delta-v is recorded to ±10 %.
RECORDER = {"scale_bound_percent": 10.0, "misalignment_sd_deg": 2.0}


def as_accelerations(part: Part) -> Part:
    """Mean accelerations over the intervals of a table of delta-v.

    Parameters
    ----------
    part : Part
        Of kind ``velocity``, with values in m/s.
    """
    time = part.time
    from_zero = bool(0.0 < time[0] <= 1.5 * (time[1] - time[0]))
    columns, stamps = [], time
    for k in range(3):
        stamps, mean = mean_accelerations_of(time, part.values[:, k], from_zero=from_zero)
        columns.append(mean)
    return replace(
        part,
        kind="acceleration",
        time=stamps,
        values=np.column_stack(columns),
        zeroed=True,
        sampling="",
        uncertainty=RECORDER,
        basis="what 49 CFR 563.8 asks of a recorder: 10 % of the change of velocity",
        notes=(*part.notes, "changes of velocity; mean accelerations are made of them"),
    )


# A path measured by another instrument among the records: a reference for the result.


# A path that counts from the trigger contains it within this.
LONGEST = 10.0  # s


@dataclass(frozen=True)
class KnownPath:
    """Path as named in the case.

    Attributes
    ----------
    path : str
    name : str
    start, end : float, s
    """

    path: str
    name: str
    start: float
    end: float

    @property
    def at_trigger(self) -> bool:
        """Whether its time may count from the trigger."""
        return self.start <= 0.0 <= self.end and self.end - self.start < LONGEST


def known_path(path: str, record: CrashRecord) -> KnownPath | None:
    """Read a record as the path of a point, if it has time, north, east and down.

    Parameters
    ----------
    path : str
        As in the case.
    record : CrashRecord
    """
    if len(record.files) != 1 or not {"north", "east", "down"} <= _words(record):
        return None
    try:
        table: pd.DataFrame = read_reference_path(record.path)
    except (ConfigError, DataError):
        return None
    return KnownPath(path, record.path.stem, float(table.index[0]), float(table.index[-1]))


def _words(record: CrashRecord) -> set[str]:
    return {
        c.name.lower().split("[")[0].split("(")[0].split("_m")[0].strip() for c in record.channels
    }


def reference_tables(page: Page, paths: list[KnownPath]) -> None:
    """One table per path; commented out where its time does not count from the trigger."""
    for one in paths:
        page.blank()
        page.say(
            f"---- '{plain(one.name)}' is a path, and no record of a recorder: the answers are "
            "held against it, and do not use it."
        )
        lines = (
            "[[references]]",
            'kind = "path"',
            f"name = {string(one.name)}",
            'source = ""                         # how it was measured, as you like',
            f"path = {string(one.path)}",
        )
        if one.at_trigger:
            page.say("assumed: its time counts from the trigger, its place is that of the point")
            page.lines += lines
            continue
        page.say(
            f"Its time goes from {instant(one.start)} to {instant(one.end)} s, and must count from "
            "the trigger: make a copy whose time does, name it here, and take the # away."
        )
        page.lines += [f"# {line}" for line in lines]
