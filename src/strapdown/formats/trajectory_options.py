"""What can be chosen about a trajectory's file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from strapdown.ellipsoids import WGS84, Ellipsoid
from strapdown.exceptions import ConfigError, DataError, nearest

__all__ = ["TUM_FRAMES", "TrajectoryFileOptions"]

#: Axes of a TUM file: name to (world axes, body axes).
TUM_FRAMES = {
    "enu": ("east, north, up at the origin", "forward, left, up"),
    "ned": ("north, east, down at the origin", "forward, right, down"),
    "ecef": ("earth-centred, earth-fixed", "forward, right, down"),
}

DIGITS = ("exact", "fixed")


@dataclass(frozen=True)
class TrajectoryFileOptions:
    """What can be chosen about a trajectory's file; each format takes what concerns it.

    Attributes
    ----------
    ellipsoid : Ellipsoid
        To which the places refer. KML and GeoJSON know WGS 84 alone.
    epoch : datetime, optional
        With its time zone: the instant at which the trajectory's time is zero. Without it no
        dates are written.
    geoid_undulation : float, optional, m
        Height of the geoid over the ellipsoid, taken off the heights of a KML file.
    most_points : int
        A KML or GeoJSON file has no more than this; a longer trajectory is thinned.
    tum_frame : {'enu', 'ned', 'ecef'}
        Axes of a TUM file.
    digits : {'exact', 'fixed'}
        Of a CSV: the fewest that give each number back, or a fixed number of decimals, which is
        faster.

    Raises
    ------
    ConfigError
        A choice is none.
    """

    ellipsoid: Ellipsoid = WGS84
    epoch: datetime | None = None
    geoid_undulation: float | None = None
    most_points: int = 10_000
    tum_frame: str = "enu"
    digits: str = "exact"

    def __post_init__(self) -> None:
        if not isinstance(self.ellipsoid, Ellipsoid):
            raise ConfigError(
                f"{self.ellipsoid!r} is no Ellipsoid",
                quantity="ellipsoid",
                remedy="give one, as ellipsoids.find_ellipsoid makes of a name",
            )
        if self.epoch is not None and not isinstance(self.epoch, datetime):
            raise ConfigError(
                f"{self.epoch!r} is no datetime",
                quantity="epoch",
                remedy="give one, as in datetime(2026, 3, 1, 12, tzinfo=UTC)",
            )
        if self.epoch is not None and self.epoch.utcoffset() is None:
            raise ConfigError(
                f"{self.epoch.isoformat()} has no time zone",
                quantity="epoch",
                remedy="give it one, as in datetime(2026, 3, 1, 12, tzinfo=UTC)",
            )
        # The geoid is nowhere farther than 110 m from the ellipsoid.
        if self.geoid_undulation is not None and not abs(self.geoid_undulation) < 200.0:
            raise ConfigError(
                f"a geoid {self.geoid_undulation:.9g} m from the ellipsoid is none",
                quantity="geoid_undulation",
                remedy="give height over the ellipsoid minus height over the sea, -110 to 90 m",
            )
        if not isinstance(self.most_points, int) or self.most_points < 2:
            raise ConfigError(
                f"a line cannot be drawn through {self.most_points} points",
                quantity="most_points",
                remedy="allow two or more",
            )
        if self.tum_frame not in TUM_FRAMES:
            raise ConfigError(
                f"'{self.tum_frame}' is no frame of a TUM file",
                quantity="tum_frame",
                remedy=nearest(str(self.tum_frame), TUM_FRAMES),
            )
        if self.digits not in DIGITS:
            raise ConfigError(
                f"'{self.digits}' is no way to write numbers",
                quantity="digits",
                remedy=nearest(str(self.digits), DIGITS),
            )

    def require_wgs84(self, form: str) -> None:
        """Refuse places that a format would take for others.

        Raises
        ------
        ConfigError
            The ellipsoid is another.
        """
        if self.ellipsoid != WGS84:
            raise ConfigError(
                f"{form} holds places of WGS 84 alone, and these refer to {self.ellipsoid.name}",
                quantity="ellipsoid",
                remedy="transform the places to WGS 84 first, or write csv or tum, which say "
                "what they refer to",
            )

    def date(self, time: float) -> str:
        """Date and time of day in UTC of an instant, to the microsecond.

        Raises
        ------
        ConfigError
            No epoch was given.
        DataError
            There is no such date.
        """
        if self.epoch is None:
            raise ConfigError(
                "without an epoch there are no dates",
                quantity="epoch",
                remedy="give the instant at which the trajectory's time is zero",
            )
        try:
            at = self.epoch.astimezone(UTC) + timedelta(seconds=time)
        except (OverflowError, ValueError):
            at = None
        if at is None or not math.isfinite(time):
            raise DataError(
                f"{time:.9g} s after {self.epoch.isoformat()} is no date",
                quantity="epoch",
                remedy="give the instant at which the trajectory's time is zero",
            )
        return at.strftime("%Y-%m-%dT%H:%M:%S.%fZ")
