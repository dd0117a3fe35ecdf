"""One channel of a crash test of the NHTSA database: what its header row says, and its samples."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.constants import ACCEL_UNITS, GYRO_UNITS
from strapdown.errors import DataError

KMH = 1.0 / 3.6
#: Units as the database writes them: what they are in SI, and the factor. Only units whose
#: meaning is beyond doubt; another one is refused when its channel is read.
UNITS: dict[str, tuple[str, float]] = {
    "G'S": ("m/s2", ACCEL_UNITS["g"]),
    "G": ("m/s2", ACCEL_UNITS["g"]),
    "M/S2": ("m/s2", 1.0),
    "DPS": ("rad/s", GYRO_UNITS["deg/s"]),
    "DEG/SEC": ("rad/s", GYRO_UNITS["deg/s"]),
    "RAD/S": ("rad/s", 1.0),
    "NWT": ("N", 1.0),
    "N": ("N", 1.0),
    "NWM": ("N*m", 1.0),
    "NM": ("N*m", 1.0),
    "MM": ("m", 1e-3),
    "KPH": ("m/s", KMH),
}
TIMES: dict[str, float] = {"SEC": 1.0, "MSEC": 1e-3}
# Stamps have six decimals: two steps may so differ by 1 µs.
STAMP_ROUNDING = 1.1e-6  # s
# A row of two numbers is shorter; a file that is far larger is not what its header says.
LONGEST_ROW = 64  # bytes


@dataclass(frozen=True)
class Channel:
    """A channel as its header row describes it; `table` reads its samples when first asked.

    Attributes
    ----------
    vehicle : int
        Number of the vehicle in the test; 0 for the barrier.
    number : int
        Number of the curve, and of its file.
    kind : str
        The database's code of the sensor: AC accelerometer, AV angular velocity, LC load cell,
        DS displacement.
    occupant : str
        Code of the seat (01 driver, 02 front passenger), or NA.
    location : str
        Code of the place: HDCG head, FLLR floor left rear, ENGN engine.
    axis : str
        XL, YL, ZL local to the part; XG, YG, ZG of the vehicle.
    time_unit, unit : str
        As recorded.
    prefilter_hz : float, Hz
        Of the analogue filter before sampling; NaN where not stated.
    maker, calibrated : str
    rating : float
        Full scale, in the recorded unit; NaN where not stated.
    used_percent : float, %
        Of the rating, as the laboratory stated it.
    initial_velocity : float, m/s
        Of the part along the axis before the impact, with the sign of the file: positive for
        a vehicle that drives forward; NaN where not stated.
    first, last : int
        Numbers of the first and last sample, counted from the impact.
    interval : float, s
    status : str
        The database's code: AM as measured, CF channel failed, NO no data.
    primary : bool
        P, not R for redundant.
    comment : str
    path : Path or None
        File of the samples; None where the folder has none.
    """

    vehicle: int
    number: int
    kind: str
    occupant: str
    location: str
    axis: str
    time_unit: str
    unit: str
    prefilter_hz: float
    maker: str
    calibrated: str
    rating: float
    used_percent: float
    initial_velocity: float
    first: int
    last: int
    interval: float
    status: str
    primary: bool
    comment: str
    path: Path | None

    @property
    def name(self) -> str:
        """Number and comment, for messages and tables."""
        return f"channel {self.number} ({self.comment})"

    @property
    def present(self) -> bool:
        """Whether the folder holds its samples."""
        return self.path is not None

    @property
    def samples(self) -> int:
        """Samples that the header promises."""
        return self.last - self.first + 1

    @property
    def si_unit(self) -> str:
        """Unit of `table`.

        Raises
        ------
        DataError
            The recorded unit is not known.
        """
        return self._si()[0]

    @property
    def rating_si(self) -> float:
        """Full scale in the unit of `table`."""
        return self.rating * self._si()[1]

    @cached_property
    def table(self) -> pd.DataFrame:
        """Samples in SI: index ``time`` in s from the impact, column ``value``.

        Accelerations are as recorded: the channels are zeroed before the impact, so gravity at
        rest is not in them.

        Raises
        ------
        DataError
            There is no file; it is empty, cut, or not what the header says; a value is no
            finite number; time does not advance; the unit is not known.
        """
        time, values = self.recorded
        assert self.path is not None
        unit, factor = self._si()
        table = pd.DataFrame(
            {"value": values * factor}, index=pd.Index(time, name="time"), copy=False
        )
        table.attrs = {"source": self.path.name, "unit": unit, "sampling": "instantaneous"}
        return table

    @cached_property
    def recorded(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Stamps in s from the impact, and samples in the unit as recorded.

        Raises
        ------
        DataError
            As `table`, but of the unit.
        """
        if self.path is None:
            raise DataError(
                "io.listed-header-file-not-folder",
                quantity=f"channel {self.number}",
                name=self.name,
            )
        if self.time_unit not in TIMES:
            raise DataError(
                "io.time-unit-not-known",
                file=self.path.name,
                quantity="time",
                time_unit=self.time_unit,
                word=self.time_unit,
                known=TIMES,
            )
        pairs = _read_pairs(self)
        time = pairs[:, 0] * TIMES[self.time_unit]
        _check_time(self, time)
        return time, pairs[:, 1].copy()

    def _si(self) -> tuple[str, float]:
        if self.unit.upper() not in UNITS:
            raise DataError(
                "io.unit-not-known",
                file=self.path.name if self.path else None,
                quantity=f"channel {self.number}",
                unit=self.unit,
                name=self.name,
                word=self.unit.upper(),
                known=UNITS,
            )
        return UNITS[self.unit.upper()]


def _read_pairs(channel: Channel) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    path = channel.path
    assert path is not None
    size = path.stat().st_size
    if size == 0:
        raise DataError("io.file-empty-4", file=path.name, quantity=f"channel {channel.number}")
    if size > LONGEST_ROW * (channel.samples + 1):
        raise DataError(
            "io.bytes-too-many-samples-header",
            file=path.name,
            quantity=f"channel {channel.number}",
            size=size,
            samples=channel.samples,
        )
    lines = path.read_bytes().decode("ascii", "replace").splitlines()
    out = np.empty((len(lines), 2))
    for k, line in enumerate(lines):
        fields = line.split()
        try:
            time, value = (float(text) for text in fields)
        except ValueError:
            raise DataError(
                "io.not-time-value",
                file=path.name,
                row=k + 1,
                quantity=f"channel {channel.number}",
                at_line=line[:60],
            ) from None
        if not (math.isfinite(time) and math.isfinite(value)):
            raise DataError(
                "io.not-finite-number-3",
                file=path.name,
                row=k + 1,
                quantity="time" if not math.isfinite(time) else f"channel {channel.number}",
                strip=line.strip()[:60],
            )
        out[k] = time, value
    if len(lines) != channel.samples:
        cut = len(lines) < channel.samples
        raise DataError(
            "io.samples-header-row-says" if cut else "io.samples-header-row-says-2",
            file=path.name,
            row=len(lines) if cut else channel.samples + 1,
            quantity=f"channel {channel.number}",
            count=len(lines),
            samples=channel.samples,
            first=channel.first,
            last=channel.last,
        )
    return out


def _check_time(channel: Channel, time: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    assert channel.path is not None
    steps = np.diff(time)
    back = np.flatnonzero(steps <= 0.0)
    if back.size:
        k = int(back[0]) + 1
        raise DataError(
            "io.time-goes-4",
            file=channel.path.name,
            row=k + 1,
            quantity="time",
            time=time[k - 1],
            time_2=time[k],
        )
    expected = channel.interval * (channel.first + np.arange(time.size))
    off = np.flatnonzero(np.abs(time - expected) > STAMP_ROUNDING)
    if off.size:
        k = int(off[0])
        raise DataError(
            "io.stamp-header-sample-every",
            file=channel.path.name,
            row=k + 1,
            quantity="time",
            time=time[k],
            first=channel.first + k,
            interval=channel.interval * 1000000.0,
            expected=expected[k],
        )
