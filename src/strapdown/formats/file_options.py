"""Options of the files that are written."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.errors import ConfigError, DataError, check_choice

__all__ = ["TUM_FRAMES", "FileOptions"]

#: Axes of a TUM file: name to (world axes, body axes).
TUM_FRAMES = {
    "enu": ("east, north, up at the origin", "forward, left, up"),
    "ned": ("north, east, down at the origin", "forward, right, down"),
    "ecef": ("earth-centered, earth-fixed", "forward, right, down"),
}

DIGITS = ("exact", "fixed")


@dataclass(frozen=True)
class FileOptions:
    """Options of files; each format uses those that apply to it.

    Attributes
    ----------
    name : str
        Title for people who open the file.
    ellipsoid : Ellipsoid
        Reference of the positions. KML and GeoJSON only support WGS 84.
    epoch : datetime, optional
        With time zone: the instant of time zero of a clock that does not say so. Without it no
        dates are written.
    geoid_undulation : float, optional, m
        Height of the geoid above the ellipsoid, for formats with heights over the sea.
    most_points : int
        Most points of a KML or GeoJSON file; a longer trajectory is thinned.
    tum_frame : {'enu', 'ned', 'ecef'}
        Axes of a TUM file.
    origin : tuple of float, optional
        Latitude and longitude in deg, height over the ellipsoid in m: origin of local axes; by
        default the first position.
    digits : {'exact', 'fixed'}
        For CSV: the fewest that reproduce each number, or a fixed number of decimals, which is
        faster.

    Raises
    ------
    ConfigError
        An option is out of its range.
    """

    name: str = "trajectory"
    ellipsoid: Ellipsoid = WGS84
    epoch: datetime | None = None
    geoid_undulation: float | None = None
    most_points: int = 10_000
    tum_frame: str = "enu"
    origin: tuple[float, float, float] | None = None
    digits: str = "exact"

    def __post_init__(self) -> None:
        if not isinstance(self.ellipsoid, Ellipsoid):
            raise ConfigError("io.no-ellipsoid", quantity="ellipsoid", ellipsoid=self.ellipsoid)
        if self.epoch is not None and not isinstance(self.epoch, datetime):
            raise ConfigError("io.no-datetime", quantity="epoch", epoch=self.epoch)
        if self.epoch is not None and self.epoch.utcoffset() is None:
            raise ConfigError("io.no-time-zone", quantity="epoch", isoformat=self.epoch.isoformat())
        # The geoid is within 110 m of the ellipsoid.
        if self.geoid_undulation is not None and not abs(self.geoid_undulation) < 200.0:
            raise ConfigError(
                "io.geoid-ellipsoid-none",
                quantity="geoid_undulation",
                geoid_undulation=self.geoid_undulation,
            )
        if not isinstance(self.most_points, int) or self.most_points < 2:
            raise ConfigError(
                "io.line-cannot-drawn-through-points",
                quantity="most_points",
                most_points=self.most_points,
            )
        check_choice(
            "io.no-frame-tum-file", TUM_FRAMES, quantity="tum_frame", tum_frame=self.tum_frame
        )
        if self.origin is not None and not (
            len(self.origin) == 3 and np.isfinite(self.origin).all() and abs(self.origin[0]) <= 90.0
        ):
            raise ConfigError("io.no-origin", quantity="origin", origin=list(self.origin))
        check_choice("io.digits-unknown", DIGITS, quantity="digits", digits=self.digits)

    def require_wgs84(self, form: str) -> None:
        """Refuse positions that a format would misinterpret.

        ConfigError: the ellipsoid is not WGS 84.
        """
        if self.ellipsoid != WGS84:
            raise ConfigError(
                "io.holds-places-wgs-alone-these",
                quantity="ellipsoid",
                form=form,
                name=self.ellipsoid.name,
            )

    def date(self, time: float) -> str:
        """Return date and time of day of an instant in UTC, to the microsecond.

        ConfigError: no epoch was given. DataError: the date is out of range.
        """
        if self.epoch is None:
            raise ConfigError("io.without-epoch-no-dates", quantity="epoch")
        try:
            at = self.epoch.astimezone(UTC) + timedelta(seconds=time)
        except (OverflowError, ValueError):
            at = None
        if at is None or not math.isfinite(time):
            raise DataError(
                "io.after-no-date", quantity="epoch", time=time, isoformat=self.epoch.isoformat()
            )
        return at.strftime("%Y-%m-%dT%H:%M:%S.%fZ")
