"""What the recorders and the cameras of a simulated crash deliver, and what really happened."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.sensors.crash_unit import CrashUnit
from strapdown.sensors.error_draws import child
from strapdown.simulation.camera import Camera
from strapdown.simulation.camera_path import path_from_cameras
from strapdown.simulation.cameras import film, paper_cameras
from strapdown.simulation.crash_cases import CaseRecorder, CrashCase
from strapdown.simulation.crash_course import CrashScenario
from strapdown.simulation.crash_recording import record_crash
from strapdown.simulation.recorder_design import RecorderDesign, RecorderTruth
from strapdown.simulation.vehicle_points import point_path

Array = NDArray[np.float64]

# After the impact: the path's 0.75 s, and what filters and late triggers need.
RECORDED = 0.85  # s
BEFORE, AFTER = 0.1, 0.75  # s, of the path, which the cameras film
TRUTH_STEP = 0.001  # s
# The image is 1300 px deep and 512 px high from its middle: what moves 1 m is seen whole from
# 2.5 m, and from 1 m farther where it comes nearer.
DISTANCES, NEAREST = 4.0, 8.0  # of the way that is filmed, and m
# A light gate of two beams.
SPEED_SD = 0.05  # m/s
# Draws like a recorder or a camera, by its name.
LIGHT_GATE = b"light gate"


@dataclass(frozen=True)
class EntryTruth:
    """How the vehicle came to the impact, and what is told of it.

    Attributes
    ----------
    speed : float, m/s
        Of the centre of mass over ground, exactly.
    told_speed, speed_sd : float, m/s
        As the light gate has it.
    heading_deg : float, deg
    slip_deg : float, deg
        Direction of travel less heading, in (-180, 180].
    """

    speed: float
    told_speed: float
    speed_sd: float
    heading_deg: float
    slip_deg: float


@dataclass(frozen=True, eq=False)
class RecordedUnit:
    """A recorder, what it wrote and what it really did."""

    recorder: CaseRecorder
    unit: CrashUnit = field(repr=False)
    truth: RecorderTruth


@dataclass(frozen=True, eq=False)
class RecordedCase:
    """Everything that comes of a simulated crash.

    Attributes
    ----------
    case : CrashCase
    units : tuple of RecordedUnit
    cameras : tuple of Camera
    camera_path : DataFrame
        As `path_from_cameras`, of the centre of mass, by time from the impact.
    truth : DataFrame
        As `point_path`, of the centre of mass, by time from the impact, each ms from 0.1 s before
        to 0.85 s after it; places count from that at the impact.
    entry : EntryTruth
    """

    case: CrashCase
    units: tuple[RecordedUnit, ...]
    cameras: tuple[Camera, ...]
    camera_path: pd.DataFrame = field(repr=False)
    truth: pd.DataFrame = field(repr=False)
    entry: EntryTruth


def record_case(
    case: CrashCase,
    units: Sequence[str] = (),
    *,
    rate: float | None = None,
    sampling: str = "instantaneous",
    seed: int = 0,
) -> RecordedCase:
    """Simulate a case.

    Parameters
    ----------
    case : CrashCase
    units : sequence of str
        As `CrashCase.chosen`.
    rate : float, Hz, optional
        Of the recorders that carry their own name of the paper, IMU1 and IMU2; the laboratory
        keeps its 10 kHz.
    sampling : {'instantaneous', 'mean'}
    seed : int
        Of everything that is drawn.

    Returns
    -------
    RecordedCase

    Raises
    ------
    ConfigError
        As `CrashCase.chosen` and `record_crash`.
    """
    motion, impact = case.crash.motion, case.crash.start
    end = min(motion.duration, impact + RECORDED)
    recorded = []
    for recorder in case.chosen(units):
        design = _at_rate(recorder.design, rate)
        begins = None if recorder.begins is None else max(0.0, impact + recorder.begins)
        unit, truth = record_crash(
            motion, design, impact=impact, seed=seed, start=begins, end=end, sampling=sampling
        )
        if recorder.stated is not None:
            unit = replace(unit, mounting=recorder.stated)
        recorded.append(RecordedUnit(replace(recorder, design=design), unit, truth))
    since = np.arange(-round(BEFORE / TRUTH_STEP), round((end - impact) / TRUTH_STEP) + 1)
    time = np.clip(impact + since * TRUTH_STEP, 0.0, end)
    exact = point_path(motion, (0.0, 0.0, 0.0), time, epoch=impact)
    exact.index = pd.Index(since * TRUTH_STEP, name="time")
    cameras = _cameras(exact)
    tracks = [
        film(
            motion,
            {"centre": (0.0, 0.0, 0.0)},
            camera,
            impact=impact,
            seed=seed,
            start=impact - BEFORE,
            end=min(motion.duration, impact + AFTER),
        )
        for camera in cameras
    ]
    path = path_from_cameras(tracks[0], tracks[1], cameras, marker="centre")
    return RecordedCase(case, tuple(recorded), cameras, path, exact, _entry(case.crash, seed))


def _at_rate(design: RecorderDesign, rate: float | None) -> RecorderDesign:
    """The recorder at another rate; a laboratory's, which borrows its gyro, as it is."""
    if rate is None or design.gyro_from is not None:
        return design
    return replace(
        design,
        accelerometers=tuple(replace(t, rate=rate) for t in design.accelerometers),
        gyro=None if design.gyro is None else replace(design.gyro, rate=rate),
        # A trigger is stamped with the sample in which it falls.
        trigger_sd=1.0 / rate / math.sqrt(12.0),
    )


def _cameras(truth: pd.DataFrame) -> tuple[Camera, Camera]:
    """The paper's, as far away as they must be to see all of it."""
    filmed = truth.loc[-BEFORE:AFTER, ["north", "east", "down"]].to_numpy()
    reach = float(np.linalg.norm(filmed, axis=1).max())
    return paper_cameras(max(NEAREST, math.ceil(DISTANCES * reach)))


def _entry(crash: CrashScenario, seed: int) -> EntryTruth:
    k = crash.motion.kinematics(np.array([crash.start]))
    north, east, _ = (float(v) for v in k.velocity[0])
    heading = float(rotation.euler_from_quaternion(k.q_nb)[0, 2])
    speed, slip, told = math.hypot(north, east), 0.0, 0.0
    if speed > 0.0:
        draw = np.random.Generator(np.random.PCG64(child(seed, zlib.crc32(LIGHT_GATE))))
        told = round(speed + SPEED_SD * float(draw.standard_normal()), 3)
        course = math.degrees(math.atan2(east, north))
        slip = float(rotation.within_half_turn(np.array([course - heading]))[0])
    return EntryTruth(speed, told, SPEED_SD, heading, slip)
