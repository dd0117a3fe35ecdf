"""Simulated crash cases: crash, recorders, stated configuration, recordings and truth."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, check_choice
from strapdown.sensors.crash_unit import CrashUnit, Mounting
from strapdown.sensors.error_chain import child
from strapdown.simulation.cameras import Camera, film, paper_cameras, path_from_cameras
from strapdown.simulation.crash_motion import CRASHES, TABLES, CrashScenario
from strapdown.simulation.crash_recording import (
    RecorderDesign,
    RecorderTruth,
    paper_units,
    record_crash,
)
from strapdown.simulation.mounted_motion import point_path


@dataclass(frozen=True)
class CaseRecorder:
    """A recorder of a crash case.

    Attributes
    ----------
    design : RecorderDesign
        Construction and mounting.
    begins : float, s, optional
        Start of its record relative to the impact; default, the start of the motion.
    stated : Mounting, optional
        Mounting stated in the case file, if different from the design's.
    assumed_turn_sd_deg : float, optional
        Standard deviation of the vehicle's rotation in the crash, for a recorder without gyro.
    because : str
        Reason for that assumption.
    """

    design: RecorderDesign
    begins: float | None = None
    stated: Mounting | None = None
    assumed_turn_sd_deg: float | None = None
    because: str = ""


@dataclass(frozen=True)
class CrashCase:
    """A crash and its recorders.

    Attributes
    ----------
    usual : tuple of str
        Recorders used if none is named.
    remark : str
        Deliberate error in the case, for the case file; empty if there is none.
    """

    name: str
    summary: str
    crash: CrashScenario
    recorders: tuple[CaseRecorder, ...]
    usual: tuple[str, ...]
    remark: str = ""

    def chosen(self, names: Sequence[str] = ()) -> tuple[CaseRecorder, ...]:
        """Select recorders by name.

        `names`: names, in any letter case; ``all`` for every recorder; if empty, the usual ones.
        Returns in the order of the case. ConfigError: a name is unknown, or a recorder uses the
        gyro of another that is not selected.
        """
        known = {r.design.name: r for r in self.recorders}
        wanted = [n.upper() for n in names] or list(self.usual)
        for name in wanted:
            if name not in (*known, "ALL"):
                raise ConfigError(
                    "simulation.no-recorder",
                    quantity="--units",
                    name=self.name,
                    name_2=name,
                    word=name,
                    known=[*known, "all"],
                )
        taken = tuple(r for n, r in known.items() if n in wanted or "ALL" in wanted)
        there = {r.design.name for r in taken}
        for recorder in taken:
            lender = recorder.design.gyro_from
            if lender is not None and lender not in there:
                raise ConfigError(
                    "simulation.no-gyro-borrows-not-among",
                    quantity="--units",
                    name=recorder.design.name,
                    lender=lender,
                )
        return taken


# Start of the records of the paper's laboratory.
LAB_BEGINS = -0.1  # s
# Records with a short stationary stretch: the bias is determined no better than the sensor noise.
SHORT_REST = 0.3  # s
# Insufficient high range: half the peak acceleration of the wall impact at the floor.
LOW_CEILING = 16.0 * STANDARD_GRAVITY  # m/s²

_DESIGNS = {d.name: d for d in paper_units()}
_PAPER = (
    CaseRecorder(_DESIGNS["IMU1"]),
    CaseRecorder(_DESIGNS["IMU2"]),
    CaseRecorder(_DESIGNS["LAB1"], LAB_BEGINS),
    CaseRecorder(_DESIGNS["LAB2"], LAB_BEGINS),
)


def _turned(crash: CrashScenario) -> tuple[CaseRecorder, ...]:
    """The paper's recorders; IMU2 is yawed 20 deg to the right but stated as straight."""
    first, second, *others = _PAPER
    straight = second.design.mounting
    skew = replace(second.design, mounting=replace(straight, angles_deg=(0.0, 0.0, 20.0)))
    return (first, replace(second, design=skew, stated=straight), *others)


def _low_ceiling(crash: CrashScenario) -> tuple[CaseRecorder, ...]:
    """IMU1 and IMU2 of the paper with a high range that saturates early."""
    found = []
    for recorder in _PAPER[:2]:
        low, high = recorder.design.accelerometers
        held = replace(high, uncertainty=replace(high.uncertainty, full_scale=LOW_CEILING))
        design = replace(recorder.design, accelerometers=(low, held))
        found.append(replace(recorder, design=design))
    return tuple(found)


def _short_rest(crash: CrashScenario) -> tuple[CaseRecorder, ...]:
    """IMU1 and IMU2 of the paper, switched on just before the tow."""
    begins = min(p.start for p in crash.motion.pulses) - SHORT_REST - crash.start
    return tuple(replace(r, begins=begins) for r in _PAPER[:2])


def _no_gyro(crash: CrashScenario) -> tuple[CaseRecorder, ...]:
    """IMU1 of the paper without its gyro."""
    return (
        replace(
            _PAPER[0],
            design=replace(_PAPER[0].design, gyro=None),
            assumed_turn_sd_deg=2.0,
            because="full width against a wall at a right angle: nothing turns the car",
        ),
    )


_RECORDERS: dict[str, Callable[[CrashScenario], tuple[CaseRecorder, ...]]] = {
    "side-disagree": _turned,
    "saturated": _low_ceiling,
    "short-rest": _short_rest,
    "no-gyro": _no_gyro,
}


def _case(name: str, table: Mapping[str, Any]) -> CrashCase:
    crash = CRASHES[table["crash"]]
    recorders = _RECORDERS[name](crash) if name in _RECORDERS else _PAPER
    usual = tuple(table["usual"])
    return CrashCase(name, table["summary"], crash, recorders, usual, table.get("remark", ""))


#: Every crash with the paper's recorders, and the cases of ``crashes.toml``.
CASES: dict[str, CrashCase] = {
    **{n: CrashCase(n, c.summary, c, _PAPER, ("IMU1", "IMU2")) for n, c in CRASHES.items()},
    **{name: _case(name, table) for name, table in TABLES["cases"].items()},
}


def find_case(name: str) -> CrashCase:
    """Return the case with that name.

    Raises
    ------
    ConfigError
        The name is unknown; the message gives the nearest.
    """
    check_choice("simulation.no-simulated-crash", CASES, quantity="crash", name=name)
    return CASES[name]


# Data that recorders and cameras of a simulated crash deliver, with the truth.


Array = NDArray[np.float64]

# After the impact: 0.75 s of path, plus the margin for filters and late triggers.
RECORDED = 0.85  # s
BEFORE, AFTER = 0.1, 0.75  # s, interval filmed by the cameras
TRUTH_STEP = 0.001  # s
# From its center the image spans 1300 px in depth and 512 px in height: a motion of 1 m is fully
# visible from 2.5 m, plus 1 m where the vehicle approaches.
DISTANCES, NEAREST = 4.0, 8.0  # multiple of the filmed displacement, and m
# Light gate with two beams.
SPEED_SD = 0.05  # m/s
# Random stream key, by name as for a recorder or a camera.
LIGHT_GATE = b"light gate"


@dataclass(frozen=True)
class EntryTruth:
    """True state of the vehicle at the impact, and its measured speed.

    Attributes
    ----------
    speed : float, m/s
        Exact speed of the center of mass over ground.
    told_speed, speed_sd : float, m/s
        Speed measured by the light gate, and its standard deviation.
    heading_deg : float, deg
    slip_deg : float, deg
        Direction of travel minus heading, in (-180, 180].
    """

    speed: float
    told_speed: float
    speed_sd: float
    heading_deg: float
    slip_deg: float


@dataclass(frozen=True, eq=False)
class RecordedUnit:
    """A recorder, its record and its true errors."""

    recorder: CaseRecorder
    unit: CrashUnit = field(repr=False)
    truth: RecorderTruth


@dataclass(frozen=True, eq=False)
class RecordedCase:
    """All data of a simulated crash.

    Attributes
    ----------
    camera_path : DataFrame
        As `path_from_cameras`, for the center of mass, by time from the impact.
    truth : DataFrame
        As `point_path`, for the center of mass, by time from the impact, each ms from 0.1 s before
        to 0.85 s after it; positions are relative to the position at the impact.
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
        Sample rate of IMU1 and IMU2 of the paper; the laboratory recorder keeps its 10 kHz.
    sampling : {'instantaneous', 'mean'}
    seed : int
        Seed of all random draws.

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
    """Return the recorder at another rate; a laboratory recorder, with borrowed gyro, unchanged."""
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
    """The paper's cameras, at the distance needed to see the whole motion."""
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
