"""Position, velocity and attitude of a vehicle at one instant."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown._kernels.ned import nav_numbers
from strapdown.constants import Array
from strapdown.errors import DataError
from strapdown.tables import EULER, check_trajectory, places_of, trajectory_table
from strapdown.tables.checks import is_number


@dataclass(frozen=True, eq=False)
class NavState:
    """Position, velocity and attitude relative to local north-east-down.

    In radians, as the kernels need it; `from_degrees` takes degrees.

    Attributes
    ----------
    time : float, s
    lat, lon : float, rad
        Geodetic.
    alt : float, m
        Over the ellipsoid.
    v_n : ndarray, (3,), m/s
        Velocity relative to the Earth: north, east, down.
    q_nb : ndarray, (4,)
        Body forward-right-down to north-east-down, scalar first, unit norm.

    Raises
    ------
    DataError
        A number is not finite, the latitude is beyond a right angle, or `q_nb` is not a
        rotation.
    """

    time: float
    lat: float
    lon: float
    alt: float
    v_n: Array
    q_nb: Array

    def __post_init__(self) -> None:
        for name in ("time", "lat", "lon", "alt"):
            if not is_number(getattr(self, name)):
                raise DataError(
                    "mechanization.not-number", quantity=name, value=getattr(self, name)
                )
        v_n = _numbers(self.v_n, "v_n")
        if v_n.shape != (3,):
            raise DataError("mechanization.shape", quantity="v_n", shape=v_n.shape)
        numbers = {"time": self.time, "lat": self.lat, "lon": self.lon, "alt": self.alt}
        numbers |= dict(zip(("v_n north", "v_n east", "v_n down"), v_n.tolist(), strict=True))
        for name, value in numbers.items():
            if not math.isfinite(value):
                raise DataError("mechanization.not-finite-number", quantity=name, value=value)
        if abs(self.lat) > 0.5 * math.pi:
            raise DataError(
                "mechanization.latitude-longitude-exchanged"
                if abs(self.lat) <= math.pi and abs(self.lon) <= 0.5 * math.pi
                else "mechanization.latitude-in-degrees",
                quantity="lat",
                lat=self.lat,
            )
        if abs(self.lon) > 2.0 * math.pi:
            raise DataError(
                "mechanization.longitude-rad-more-than-full", quantity="lon", lon=self.lon
            )
        v_n.flags.writeable = False
        q_nb = _numbers(self.q_nb, "q_nb")
        if q_nb.shape != (4,):
            raise DataError("mechanization.shape-2", quantity="q_nb", shape=q_nb.shape)
        q_nb = rotation.normalise(q_nb)
        q_nb.flags.writeable = False
        object.__setattr__(self, "v_n", v_n)
        object.__setattr__(self, "q_nb", q_nb)

    @classmethod
    def of_numbers(cls, time: float, numbers: Array) -> NavState:
        """Make a state from numbers of a kernel: lat, lon of any turn, alt, v_n, q_nb, and others.

        The checks are those of the constructor, without what arrays of three and four numbers cost:
        a live system asks for its state after each sample.
        """
        own = np.empty(10)
        lat, lon, alt, good = nav_numbers(numbers, own)
        if not (good and math.isfinite(time)):
            return cls(time, lat, lon, alt, numbers[3:6], numbers[6:10])
        own.setflags(write=False)
        made = object.__new__(cls)
        v_n, q_nb = own[3:6], own[6:]
        fields = {"time": time, "lat": lat, "lon": lon, "alt": alt, "v_n": v_n, "q_nb": q_nb}
        object.__setattr__(made, "__dict__", fields)
        return made

    @property
    def numbers(self) -> Array:
        """The ten numbers of a kernel, as `of_numbers` takes them."""
        return np.array([self.lat, self.lon, self.alt, *self.v_n, *self.q_nb])

    @classmethod
    def from_degrees(
        cls,
        lat_deg: float,
        lon_deg: float,
        alt: float = 0.0,
        *,
        v_n: ArrayLike = (0.0, 0.0, 0.0),
        roll_deg: float = 0.0,
        pitch_deg: float = 0.0,
        heading_deg: float = 0.0,
        time: float = 0.0,
    ) -> NavState:
        """Make a state from angles in degrees.

        `lat_deg`, `lon_deg` (deg): geodetic, north and east positive. `alt` (m): over the
        ellipsoid. `v_n` ((3,), m/s): north, east, down. `roll_deg`, `pitch_deg`, `heading_deg`
        (deg). `time` (s).
        """
        angles = (lat_deg, lon_deg, roll_deg, pitch_deg, heading_deg)
        for name, value in zip(("lat_deg", "lon_deg", *EULER), angles, strict=True):
            if not is_number(value) or not math.isfinite(value):
                raise DataError("mechanization.not-finite-number-2", quantity=name, value=value)
        if abs(lat_deg) > 90.0:
            raise DataError(
                "mechanization.latitude-beyond-pole"
                if abs(lon_deg) <= 90.0
                else "mechanization.latitude-beyond-pole-2",
                quantity="lat_deg",
                lat_deg=lat_deg,
            )
        if abs(lon_deg) > 360.0:
            raise DataError(
                "mechanization.longitude-more-than-full-turn", quantity="lon_deg", lon_deg=lon_deg
            )
        return cls(
            time=time,
            lat=math.radians(lat_deg),
            lon=math.radians(lon_deg),
            alt=alt,
            v_n=_numbers(v_n, "v_n"),
            q_nb=rotation.quaternion_from_euler([roll_deg, pitch_deg, heading_deg]),
        )

    @classmethod
    def from_trajectory(cls, trajectory: pd.DataFrame, row: int = 0) -> NavState:
        """Return a state from a row of a Trajectory table.

        `row`: position of the row; negative from the end.
        """
        check_trajectory(trajectory)
        rows = len(trajectory)
        if not -rows <= row < rows:
            raise DataError(
                "mechanization.no-row-among",
                file=trajectory.attrs.get("source"),
                quantity="row",
                at_row=row,
                rows=rows,
            )
        at = trajectory.iloc[row]
        lat, lon, alt = places_of(trajectory.iloc[[row]])[0].tolist()
        return cls.from_degrees(
            lat,
            lon,
            alt,
            v_n=at[["VN", "VE", "VD"]].to_numpy(dtype=np.float64),
            roll_deg=float(at["roll"]),
            pitch_deg=float(at["pitch"]),
            heading_deg=float(at["heading"]),
            time=float(trajectory.index[row]),
        )

    @property
    def roll_pitch_heading(self) -> Array:
        """Attitude as 3-2-1 angles, (3,), deg."""
        return rotation.euler_from_quaternion(self.q_nb)

    def to_trajectory(self) -> pd.DataFrame:
        """Return the state as a Trajectory table of one row."""
        place = [math.degrees(self.lat), math.degrees(self.lon), self.alt]
        return trajectory_table(
            [self.time], [place], [self.v_n], [self.roll_pitch_heading], source=None
        )


def _numbers(values: ArrayLike, name: str) -> Array:
    try:
        return np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise DataError(
            "mechanization.these-no-numbers-2"
            if name == "v_n"
            else "mechanization.these-no-numbers-3",
            quantity=name,
            values=values,
        ) from None
