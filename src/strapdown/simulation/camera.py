"""A camera that stands still: what it sees of a point, and back."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown.errors import ConfigError
from strapdown.sensors.triad_errors import Triad

Array = NDArray[np.float64]

# Newton squares the error at each step; a lens that bends less than its limit needs few.
MOST_ITERATIONS = 30


@dataclass(frozen=True)
class Camera:
    """A camera that stands still, as its calibration tells it.

    A point at the distance d along the looking direction, and a to the right of and b below it,
    has ``x = a/d`` and ``y = b/d``, and is seen ``focal x (1 + k1 r²)`` px to the right of and
    ``focal y (1 + k1 r²)`` px below the middle of the image, ``r² = x² + y²``.

    Attributes
    ----------
    name : str
        Two cameras of one seed differ by it.
    position : triad, m
        North, east, down in the frame of the scene.
    looking : triad
        Direction north, east, down; its length does not count.
    up : triad
        Direction that is up in the image, not along `looking`.
    focal : float, px
    size : tuple of int, px
        Width and height.
    rate : float, Hz
        Frames fall on whole multiples of its inverse on the camera's own clock.
    reading_sd : float, px
        Of each coordinate of a marker in a frame.
    k1 : float
        Radial distortion.
    position_sd, angles_sd_deg : float, m and deg
        Of each coordinate of the position, and of each turn about the camera's axes.
    focal_sd : float
        Relative.
    k1_sd : float
        What the calibration leaves of the distortion.
    clock_offset : float, s
        By how much its stamps are late; the evaluation does not know it.
    clock_sd : float, s
        How well the evaluation knows that it is zero.

    Raises
    ------
    ConfigError
        A number is out of range, or there is no direction up.
    """

    name: str
    position: Triad
    looking: Triad
    up: Triad
    focal: float
    size: tuple[int, int] = (1280, 1024)
    rate: float = 1000.0
    reading_sd: float = 0.0
    k1: float = 0.0
    position_sd: float = 0.0
    angles_sd_deg: float = 0.0
    focal_sd: float = 0.0
    k1_sd: float = 0.0
    clock_offset: float = 0.0
    clock_sd: float = 0.0

    def __post_init__(self) -> None:
        for name in ("focal", "rate"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise _refused(self, name, getattr(self, name), "simulation.camera-not-positive")
        spreads = ("position_sd", "angles_sd_deg", "focal_sd", "k1_sd", "clock_sd")
        for name in ("reading_sd", *spreads):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise _refused(self, name, getattr(self, name), "simulation.camera-negative")
        for name in ("k1", "clock_offset"):
            if not math.isfinite(getattr(self, name)):
                raise _refused(self, name, getattr(self, name), "simulation.camera-not-finite")
        if min(self.size) < 1:
            raise _refused(self, "size", self.size, "simulation.camera-size")
        length = np.linalg.norm(self.looking) * np.linalg.norm(self.up)
        across = np.linalg.norm(np.cross(self.looking, self.up))
        if not (np.isfinite(length) and length > 0.0 and across > 1e-6 * length):
            raise _refused(self, "up", self.up, "simulation.camera-up")

    @property
    def axes(self) -> Array:
        """Right, down and forward of the image as rows, north-east-down, (3, 3)."""
        forward = np.asarray(self.looking, dtype=np.float64)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(forward, right), forward])

    @property
    def widest(self) -> float:
        """Greatest r that the lens shows only once; infinite without barrel distortion."""
        return math.inf if self.k1 >= 0.0 else 1.0 / math.sqrt(-3.0 * self.k1)

    def pixels(self, points: ArrayLike) -> Array:
        """Where points are seen.

        Parameters
        ----------
        points : array_like, (n, 3), m
            North, east, down.

        Returns
        -------
        ndarray, (n, 2), px
            To the right and down from the upper left corner; NaN behind the camera, beyond what
            the lens shows, and outside of the image.
        """
        return project(self, self.axes, np.asarray(points, dtype=np.float64))

    def directions(self, pixels: ArrayLike) -> Array:
        """Turn pixels back to x and y, free of distortion, (n, 2)."""
        seen = (np.asarray(pixels, dtype=np.float64) - _middle(self)) / self.focal
        if self.k1 == 0.0:
            return seen
        bent = np.hypot(seen[:, 0], seen[:, 1])
        r = bent.copy()
        for _ in range(MOST_ITERATIONS):
            step = (r * (1.0 + self.k1 * r * r) - bent) / (1.0 + 3.0 * self.k1 * r * r)
            r = np.minimum(r - step, self.widest)
            if not np.nanmax(np.abs(step), initial=0.0) > 1e-15:
                break
        return np.asarray(seen / (1.0 + self.k1 * r * r)[:, None], dtype=np.float64)


def project(camera: Camera, axes: Array, points: Array) -> Array:
    """Where a camera whose axes have been turned to `axes` sees points; as `Camera.pixels`."""
    away = (points - np.asarray(camera.position)) @ axes.T
    depth = np.where(away[:, 2] > 0.0, away[:, 2], np.nan)
    xy = away[:, :2] / depth[:, None]
    r2 = (xy * xy).sum(axis=1)
    seen = _middle(camera) + camera.focal * xy * (1.0 + camera.k1 * r2)[:, None]
    outside = (seen < 0.0).any(axis=1) | (seen > np.asarray(camera.size)).any(axis=1)
    seen[outside | (r2 >= camera.widest**2)] = np.nan
    return np.asarray(seen, dtype=np.float64)


def _middle(camera: Camera) -> Array:
    return 0.5 * np.asarray(camera.size, dtype=np.float64)


def _refused(camera: Camera, quantity: str, value: object, code: str) -> ConfigError:
    return ConfigError(code, quantity=quantity, name=camera.name, value=value)
