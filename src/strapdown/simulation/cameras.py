"""High-speed cameras that film markers on a vehicle, and what becomes of two views."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import frames, rotation
from strapdown.errors import ConfigError
from strapdown.sensors.error_draws import child
from strapdown.sensors.triad_errors import Triad
from strapdown.simulation.camera import Camera, project
from strapdown.simulation.camera_path import path_from_cameras
from strapdown.simulation.motion import Motion
from strapdown.tables import GEODETIC

__all__ = ["Camera", "film", "paper_cameras", "path_from_cameras"]

Array = NDArray[np.float64]

# Places below the seed of a camera.
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
    """Film markers on a vehicle.

    Parameters
    ----------
    motion : Motion
        Of the vehicle's origin, with a ``position`` (flat Earth) or a ``trajectory``.
    markers : dict
        Name, and place on the vehicle: forward, right, down from its origin, m.
    camera : Camera
        Its true pose, focal length and distortion are drawn about what it tells.
    impact : float, s
        Instant of the common trigger on the motion's clock. Stamps count from it, and the
        frame of the scene has its origin where the vehicle's origin is then, its axes north,
        east, down there.
    seed : int
    start, end : float, s, optional
        On the motion's clock; the whole motion, if not given.

    Returns
    -------
    DataFrame
        Index ``time``, s, on the camera's clock; for each marker the columns ``<name>_u`` and
        ``<name>_v``, px, NaN where it is not seen; ``attrs["camera"]`` is the camera's name.

    Raises
    ------
    ConfigError
        There is no marker or no place, or fewer than two frames; the message names the camera.
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
    """Give a top and a side camera as in the crash test of Tadic and Vukajlovic (2016).

    Parameters
    ----------
    distance : float, m
        From the vehicle's origin at the impact.

    Returns
    -------
    top, side : Camera
        1000 frames/s and 1.3 megapixels are the paper's. Chosen: distance, a lens of 1300 px
        with a barrel distortion of which the calibration leaves a tenth, readings to half a
        pixel, a pose known to 5 mm and 0.05 deg, a focal length to 0.1 %. The side camera stands
        in the west and looks east.
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
    """Place of the vehicle's origin and attitude, in the axes of the scene."""
    if hasattr(motion, "position"):
        origin = motion.position(np.array([impact]))
        return motion.position(time) - origin, motion.attitude(time)
    if not hasattr(motion, "trajectory"):
        raise ConfigError("simulation.motion-does-not-know", quantity="motion")
    here = motion.trajectory(np.array([impact]))[GEODETIC].to_numpy()
    place = motion.trajectory(time)[GEODETIC].to_numpy()
    # From the level at the vehicle to that of the scene, through the Earth's axes.
    scene, there = frames.q_ne(*here[0, :2]), frames.q_ne(place[:, 0], place[:, 1])
    turn = rotation.compose(scene, rotation.conjugate(there))
    ned = frames.ned_from_geodetic(place, origin=here[0], ellipsoid=motion.ellipsoid)
    return ned, rotation.compose(turn, motion.attitude(time))


def _drawn(camera: Camera, root: np.random.SeedSequence) -> tuple[Camera, Array]:
    """The camera as it really is, and its axes."""
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
