"""Column names of positions and velocities in tables of fixes and of trajectories."""

from __future__ import annotations

from strapdown.formats.quantity_columns import ANGLES, LENGTHS, SPEEDS, Quantity

__all__ = ["GEODETIC_QUANTITIES"]

_HEADS = ("v", "vel", "velocity", "speed")


def _velocities(letter: str, word: str) -> tuple[str, ...]:
    return tuple(h + e for h in _HEADS for e in (letter, word)) + tuple(word + h for h in _HEADS)


#: Degrees, meters over the ellipsoid, meters per second; velocity up is negative velocity down.
GEODETIC_QUANTITIES: dict[str, Quantity] = {
    "lat": Quantity(("lat", "latitude"), ANGLES),
    "lon": Quantity(("lon", "lng", "long", "longitude"), ANGLES),
    "alt": Quantity(
        (
            "alt",
            "altitude",
            "h",
            "hgt",
            "height",
            "hell",
            "altell",
            "heightell",
            "ellipsoidalheight",
            "heightellipsoid",
            "altitudeellipsoid",
        ),
        LENGTHS,
    ),
    "VN": Quantity(_velocities("n", "north"), SPEEDS),
    "VE": Quantity(_velocities("e", "east"), SPEEDS),
    "VD": Quantity(_velocities("d", "down"), SPEEDS, _velocities("u", "up")),
}
