"""High-speed cameras filming markers on a vehicle, and triangulation from two views."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import frames, rotation
from strapdown.errors import ConfigError, DataError
from strapdown.sensors.error_chain import child
from strapdown.sensors.triad_errors import Triad
from strapdown.simulation.motion import Motion, check_numbers
from strapdown.tables import GEODETIC

Array = NDArray[np.float64]

# Stream keys below the seed of a camera.
POSE, LENS, READING = range(3)


def film(
    motion: Motion,
    markers: Mapping[str, Triad],
    camera: Camera,
    *,
    impact: float,
    seed: int = 0,
    start: float | None = None,
    end: float | None = None,
) -> pd.DataFrame:
    """Simulate the image coordinates of markers on a vehicle.

    Parameters
    ----------
    motion : Motion
        Motion of the vehicle's origin, with a ``position`` (flat Earth) or a ``trajectory``.
    markers : dict
        Marker name and its position on the vehicle: forward, right, down from the origin, m.
    camera : Camera
        Nominal calibration; the true pose, focal length and distortion are drawn about it.
    impact : float, s
        Instant of the common trigger on the motion's clock. Stamps count from it. The scene frame
        has its origin at the vehicle's origin at that instant, with axes north, east, down there.
    seed : int
    start, end : float, s, optional
        On the motion's clock; default, the whole motion.

    Returns
    -------
    DataFrame
        Index ``time``, s, on the camera's clock; for each marker the columns ``<name>_u`` and
        ``<name>_v``, px, NaN where it is not visible; ``attrs["camera"]`` is the camera's name.

    Raises
    ------
    ConfigError
        No marker or no position is given, or fewer than two frames result; the message names the
        camera.
    """
    if not markers:
        raise ConfigError("simulation.camera-nothing-look", quantity="markers", name=camera.name)
    begin = 0.0 if start is None else start
    stop = motion.duration if end is None else end
    late = camera.clock_offset - impact
    first = math.ceil((begin + late) * camera.rate - 1e-6)
    last = math.floor((stop + late) * camera.rate + 1e-6)
    if not (0.0 <= begin < stop <= motion.duration and last > first):
        raise ConfigError(
            "simulation.camera-no-two-frames-motion",
            quantity="start, end",
            name=camera.name,
            begin=begin,
            stop=stop,
            duration=motion.duration,
        )
    stamps = np.arange(first, last + 1) / camera.rate
    place, q_nb = _scene(motion, np.clip(stamps - late, 0.0, motion.duration), impact)
    root = child(seed, zlib.crc32(camera.name.encode()))
    real, axes = _drawn(camera, root)
    columns: dict[str, Array] = {}
    for name, point in markers.items():
        seen = project(real, axes, place + rotation.rotate(q_nb, point))
        noise = _normal(seen.shape, root, READING, zlib.crc32(name.encode()))
        seen = seen + camera.reading_sd * noise
        columns[f"{name}_u"], columns[f"{name}_v"] = seen.T
    table = pd.DataFrame(columns, index=pd.Index(stamps, name="time"))
    table.attrs = {"camera": camera.name}
    return table


def paper_cameras(distance: float = 8.0) -> tuple[Camera, Camera]:
    """Return a top and a side camera as in the crash test of Tadic and Vukajlovic (2016).

    `distance` (m): distance from the vehicle's origin at the impact. Returns `top`, `side`: 1000
    frames/s and 1.3 megapixels are the paper's. Chosen here: distance, a lens of 1300 px with a
    barrel distortion calibrated to a tenth, readings to half a pixel, a pose known to 5 mm and 0.05
    deg, a focal length to 0.1 %. The side camera is in the west and looks east.
    """
    top = Camera(
        "top",
        (0.0, 0.0, -distance),
        (0.0, 0.0, 1.0),
        (1.0, 0.0, 0.0),
        1300.0,
        reading_sd=0.5,
        k1=-0.1,
        position_sd=0.005,
        angles_sd_deg=0.05,
        focal_sd=0.001,
        k1_sd=0.01,
    )
    west, east, up = (0.0, -distance, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)
    return top, replace(top, name="side", position=west, looking=east, up=up)


def _scene(motion: Any, time: Array, impact: float) -> tuple[Array, Array]:
    """Position of the vehicle's origin and attitude, in scene axes."""
    if hasattr(motion, "position"):
        origin = motion.position(np.array([impact]))
        return motion.position(time) - origin, motion.attitude(time)
    if not hasattr(motion, "trajectory"):
        raise ConfigError("simulation.motion-does-not-know", quantity="motion")
    here = motion.trajectory(np.array([impact]))[GEODETIC].to_numpy()
    place = motion.trajectory(time)[GEODETIC].to_numpy()
    # From local level at the vehicle to local level at the scene origin, through Earth axes.
    scene, there = frames.q_ne(*here[0, :2]), frames.q_ne(place[:, 0], place[:, 1])
    turn = rotation.compose(scene, rotation.conjugate(there))
    ned = frames.ned_from_geodetic(place, origin=here[0], ellipsoid=motion.ellipsoid)
    return ned, rotation.compose(turn, motion.attitude(time))


def _drawn(camera: Camera, root: np.random.SeedSequence) -> tuple[Camera, Array]:
    """Draw the true camera and its axes."""
    moved = _normal((6,), root, POSE)
    turned = rotation.dcm_from_rotation_vector(np.radians(camera.angles_sd_deg) * moved[3:])
    lens = _normal((2,), root, LENS)
    x, y, z = (
        float(p + camera.position_sd * m) for p, m in zip(camera.position, moved[:3], strict=True)
    )
    real = replace(
        camera,
        position=(x, y, z),
        focal=camera.focal * (1.0 + camera.focal_sd * float(lens[0])),
        k1=camera.k1 + camera.k1_sd * float(lens[1]),
    )
    return real, turned @ camera.axes


def _normal(shape: tuple[int, ...], root: np.random.SeedSequence, *place: int) -> Array:
    generator = np.random.Generator(np.random.PCG64(child(root, *place)))
    return generator.standard_normal(shape)


# Camera model: projection and its inverse.


# Newton's error is squared at each step; a lens within its distortion limit needs few steps.
MOST_ITERATIONS = 30


@dataclass(frozen=True)
class Camera:
    """A stationary camera with its calibration.

    A point at distance d along the looking direction, a to the right and b below it, has ``x =
    a/d`` and ``y = b/d`` and appears ``focal x (1 + k1 r²)`` px to the right of and ``focal y (1 +
    k1 r²)`` px below the image center, ``r² = x² + y²``.

    Attributes
    ----------
    name : str
        Also selects the random stream: two cameras with one seed differ by it.
    position : triad, m
        North, east, down in the scene frame.
    looking : triad
        Direction north, east, down; any length.
    up : triad
        Direction that is up in the image, not parallel to `looking`.
    focal : float, px
    size : tuple of int, px
        Width and height.
    rate : float, Hz
        Frames fall on integer multiples of its inverse on the camera's own clock.
    reading_sd : float, px
        Standard deviation of each image coordinate of a marker.
    k1 : float
        Radial distortion coefficient.
    position_sd, angles_sd_deg : float, m and deg
        Standard deviations of each position coordinate and of each rotation about the camera axes.
    focal_sd : float
        Relative standard deviation of the focal length.
    k1_sd : float
        Standard deviation of the distortion after calibration.
    clock_offset : float, s
        Delay of the stamps, unknown to the evaluation.
    clock_sd : float, s
        Standard deviation that the evaluation assigns to a clock offset of zero.
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
        sds = "reading_sd position_sd angles_sd_deg focal_sd k1_sd clock_sd"
        check_numbers(
            self,
            positive="focal rate",
            not_negative=sds,
            finite="k1 clock_offset",
            file=self.name,
        )
        if min(self.size) < 1:
            raise ConfigError(
                "simulation.camera-size", quantity="size", name=self.name, value=self.size
            )
        length = np.linalg.norm(self.looking) * np.linalg.norm(self.up)
        across = np.linalg.norm(np.cross(self.looking, self.up))
        if not (np.isfinite(length) and length > 0.0 and across > 1e-6 * length):
            raise ConfigError("simulation.camera-up", quantity="up", name=self.name, value=self.up)

    @property
    def axes(self) -> Array:
        """Right, down and forward axes of the image as rows, north-east-down, (3, 3)."""
        forward = np.asarray(self.looking, dtype=np.float64)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(forward, right), forward])

    @property
    def widest(self) -> float:
        """Largest r that the lens images uniquely; infinite without barrel distortion."""
        return math.inf if self.k1 >= 0.0 else 1.0 / math.sqrt(-3.0 * self.k1)

    def pixels(self, points: ArrayLike) -> Array:
        """Project points to pixels.

        `points` ((n, 3), m): north, east, down. Returns (n, 2), px, to the right and down from the
        upper left corner; NaN behind the camera, beyond the range of the lens, and outside the
        image.
        """
        return project(self, self.axes, np.asarray(points, dtype=np.float64))

    def directions(self, pixels: ArrayLike) -> Array:
        """Convert pixels to x and y without distortion, (n, 2)."""
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
    """Project points into a camera whose axes have been rotated to `axes`; as `Camera.pixels`."""
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


# Triangulation of a marker's path from two cameras.


# The weights converge with the relative depth error, which each iteration at least squares.
ROUNDS = 4
# Velocity is differenced over this many frames either way, which reduces the reading noise.
SPAN = 10


def path_from_cameras(
    tracks_top: pd.DataFrame,
    tracks_side: pd.DataFrame,
    cameras: tuple[Camera, Camera],
    *,
    marker: str,
    central: float = math.inf,
) -> pd.DataFrame:
    """Triangulate the path of a marker from two views.

    `tracks_top`, `tracks_side`: as returned by `film`. `cameras`: cameras of the first and
    the second tracks, as calibrated. `marker`: marker to triangulate. `central` (px): radius about
    the image center beyond which readings are not used, because the residual distortion grows with
    its cube. Returns index ``time``, s, of the frames of the first camera at which both see the
    marker, not corrected for any offset; ``north east down`` in m in the scene frame; ``north_sd
    east_sd down_sd``, standard deviations in m; ``residual`` in px, root mean square residual of
    the four readings. The second camera's readings are interpolated linearly between its frames,
    which leaves 2e-5 m at 1000 frames/s and 130 m/s². DataError: a camera has not seen the marker,
    or never simultaneously with the other; the message names camera and marker. ConfigError:
    `central` is not positive, or the viewing directions are parallel.

    In each frame the position minimizes the squared differences between the four readings,
    corrected for distortion, and the projected position. The standard deviations combine those of
    the readings with those, common to all frames, that the cameras state for position, directions,
    focal length, distortion and clock, propagated to first order (`_of_calibration`). A clock error
    acts through the velocity of the path over 20 frames.
    """
    if not central > 0.0:
        raise ConfigError("simulation.px-leaves-no-image", quantity="central", central=central)
    top, side = cameras
    time, seen, _ = _readings(tracks_top, top, marker, central)
    other, also, whole = _readings(tracks_side, side, marker, central)
    time, seen, matched, part = _matched(time, seen, other, also, whole)
    if time.size == 0:
        raise DataError(
            "simulation.never-see-together",
            quantity="time",
            name=top.name,
            name_2=side.name,
            marker=marker,
        )
    views = [top.directions(seen), side.directions(matched)]
    # An interpolated reading carries the errors of two readings.
    shares = [np.ones(time.size), np.hypot(1.0 - part, part)]
    place, rows, residuals = _triangulated(views, cameras)
    covariance = _of_readings(rows, views, cameras, shares)
    covariance += _of_calibration(rows, views, cameras, _velocity(time, place))
    left = residuals * np.repeat([top.focal, side.focal], 2)
    table = pd.DataFrame(
        {
            **dict(zip(("north", "east", "down"), place.T, strict=True)),
            **{
                f"{axis}_sd": np.sqrt(covariance[:, k, k])
                for k, axis in enumerate(("north", "east", "down"))
            },
            "residual": np.sqrt((left * left).mean(axis=1)),
        },
        index=pd.Index(time, name="time"),
    )
    table.attrs = {"marker": marker, "cameras": (top.name, side.name)}
    return table


def _readings(
    tracks: pd.DataFrame, camera: Camera, marker: str, central: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Stamps and pixels of visible markers, and whether the next frame also saw the marker."""
    columns = [f"{marker}_u", f"{marker}_v"]
    if any(c not in tracks.columns for c in columns):
        raise DataError(
            "simulation.camera-no-marker",
            quantity="marker",
            name=camera.name,
            marker=marker,
            columns=[str(c)[:-2] for c in tracks.columns[::2]],
        )
    pixels = tracks[columns].to_numpy(dtype=np.float64)
    off = pixels - 0.5 * np.asarray(camera.size, dtype=np.float64)
    used = np.hypot(off[:, 0], off[:, 1]) <= central
    if not used.any():
        raise DataError(
            "simulation.camera-does-not-see-marker",
            quantity="marker",
            name=camera.name,
            marker=marker,
            central=central,
        )
    on = np.flatnonzero(used)
    return (
        tracks.index.to_numpy(dtype=np.float64)[on],
        pixels[on],
        np.append(np.diff(on) == 1, False),
    )


def _matched(
    time: Array, seen: Array, other: Array, also: Array, whole: NDArray[np.bool_]
) -> tuple[Array, Array, Array, Array]:
    """Interpolate the second view to the stamps of the first, with the fraction of a frame."""
    before = np.clip(np.searchsorted(other, time + 1e-9, side="right") - 1, 0, None)
    after = np.minimum(before + 1, other.size - 1)
    gap = np.where(after > before, other[after] - other[before], 1.0)
    part = (time - other[before]) / gap
    # Ignore intervals within the rounding of a stamp.
    part = np.where(np.abs(time - other[before]) < 1e-9, 0.0, part)
    there = (part == 0.0) | ((part > 0.0) & (part <= 1.0) & whole[before])
    between = also[before] + part[:, None] * (also[after] - also[before])
    return time[there], seen[there], between[there], part[there]


def _triangulated(views: list[Array], cameras: tuple[Camera, Camera]) -> tuple[Array, Array, Array]:
    """Positions, derivatives of the four directions by position (n, 4, 3), residuals (n, 4)."""
    rows, offsets = [], []
    for xy, camera in zip(views, cameras, strict=True):
        axes = camera.axes
        for k in range(2):
            rows.append(axes[k] - xy[:, k, None] * axes[2])
            offsets.append(rows[-1] @ np.asarray(camera.position))
    a, b = np.stack(rows, axis=1), np.stack(offsets, axis=1)
    weight = np.ones_like(b)
    place = np.empty((len(b), 3))
    for _ in range(ROUNDS):
        wa, wb = a * weight[..., None], b * weight
        try:
            place = np.linalg.solve(
                np.einsum("nij,nik->njk", wa, wa), np.einsum("nij,ni->nj", wa, wb)[..., None]
            )[..., 0]
        except np.linalg.LinAlgError:
            raise ConfigError("simulation.cameras-look-along-line", quantity="cameras") from None
        depths = [(place - np.asarray(c.position)) @ c.axes[2] for c in cameras]
        weight = 1.0 / np.repeat(np.stack(depths, axis=1), 2, axis=1)
    residuals = np.einsum("nij,nj->ni", a, place) - b
    return place, a * weight[..., None], residuals * weight


def _gain(rows: Array) -> Array:
    """Sensitivity of the position to each direction error, (n, 3, 4)."""
    normal = np.einsum("nij,nik->njk", rows, rows)
    return np.asarray(np.linalg.solve(normal, rows.transpose(0, 2, 1)), dtype=np.float64)


def _of_readings(
    rows: Array, views: list[Array], cameras: tuple[Camera, Camera], shares: list[Array]
) -> Array:
    sds = []
    for xy, camera, share in zip(views, cameras, shares, strict=True):
        # The lens stretches by 1 + k1 r² across r and 1 + 3 k1 r² along it; the mean is used.
        stretch = 1.0 + 2.0 * camera.k1 * (xy * xy).sum(axis=1)
        sds += [camera.reading_sd / camera.focal / stretch * share] * 2
    spread = _gain(rows) * np.stack(sds, axis=1)[:, None, :]
    return np.asarray(np.einsum("nij,nkj->nik", spread, spread), dtype=np.float64)


def _of_calibration(
    rows: Array, views: list[Array], cameras: tuple[Camera, Camera], velocity: Array
) -> Array:
    """Position covariance from the stated calibration uncertainty of the cameras.

    With the directions ``x, y`` of a camera: a rotation e about its axes right, down, forward moves
    them by ``e2 (1 + x²) - e1 x y - e3 y`` and ``-e1 (1 + y²) + e2 x y + e3 x``; a relative change
    of the focal length by ``x, y`` times it; a change of k1 by ``x r², y r²`` times it; a camera
    shift by minus that of the position; a clock delay by minus the velocity.
    """
    gain = _gain(rows)
    total = np.zeros((len(rows), 3, 3))
    for k, (xy, camera) in enumerate(zip(views, cameras, strict=True)):
        x, y = xy.T
        r2, none, one = x * x + y * y, np.zeros_like(x), np.ones_like(x)
        turn = math.radians(camera.angles_sd_deg)
        own = rows[:, 2 * k : 2 * k + 2]
        shift = camera.position_sd * own.transpose(2, 0, 1)
        causes = [
            turn * np.stack([-x * y, -(one + y * y)], axis=1),
            turn * np.stack([one + x * x, x * y], axis=1),
            turn * np.stack([-y, x], axis=1),
            camera.focal_sd * np.stack([x, y], axis=1),
            camera.k1_sd * np.stack([x * r2, y * r2], axis=1),
            camera.clock_sd * np.einsum("nij,nj->ni", own, velocity),
            *shift,
        ]
        for cause in causes:
            whole = np.stack([none] * 4, axis=1)
            whole[:, 2 * k : 2 * k + 2] = cause
            moved = np.einsum("nij,nj->ni", gain, whole)
            total += moved[:, :, None] * moved[:, None, :]
    return total


def _velocity(time: Array, place: Array) -> Array:
    if time.size < 2:
        return np.zeros_like(place)
    at = np.arange(time.size)
    low, high = np.maximum(at - SPAN, 0), np.minimum(at + SPAN, time.size - 1)
    return np.asarray((place[high] - place[low]) / (time[high] - time[low])[:, None])
