"""Crashes with the recorders that write them: what is true, and what is said of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError
from strapdown.sensors.crash_unit import Mounting
from strapdown.simulation.crash_course import CrashScenario
from strapdown.simulation.crash_scenarios import CRASHES
from strapdown.simulation.paper_recorders import paper_units
from strapdown.simulation.recorder_design import RecorderDesign

__all__ = ["CASES", "CaseRecorder", "CrashCase", "find_case"]


@dataclass(frozen=True)
class CaseRecorder:
    """A recorder of a case.

    Attributes
    ----------
    design : RecorderDesign
        How it is built and mounted.
    begins : float, s, optional
        From the impact, where its record begins; with the motion, if not given.
    stated : Mounting, optional
        What the case file says of its mounting, where that is not its design's.
    assumed_turn_sd_deg : float, optional
        Of a recorder without gyro: by how much the vehicle may have turned in the crash.
    because : str
        Why that is assumed.
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
    name, summary : str
    crash : CrashScenario
    recorders : tuple of CaseRecorder
    usual : tuple of str
        Names of the recorders that write, if none is named.
    remark : str
        What is wrong on purpose, for the case file; empty, where nothing is.
    """

    name: str
    summary: str
    crash: CrashScenario
    recorders: tuple[CaseRecorder, ...]
    usual: tuple[str, ...]
    remark: str = ""

    def chosen(self, names: Sequence[str] = ()) -> tuple[CaseRecorder, ...]:
        """Recorders by their names.

        Parameters
        ----------
        names : sequence of str
            Of recorders, in any case; ``all`` for every one; the usual ones, if empty.

        Returns
        -------
        tuple of CaseRecorder
            In the order of the case.

        Raises
        ------
        ConfigError
            There is no such recorder, or one borrows the gyro of another that is not named.
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


# The paper's laboratory recorded from here on.
LAB_BEGINS = -0.1  # s
# Of the records with a short rest: in which no bias is found to better than the sensor's noise.
SHORT_REST = 0.3  # s
# Of a high range that is none: half of what the impact on a wall comes to on the floor.
LOW_CEILING = 16.0 * STANDARD_GRAVITY  # m/s²


def _paper() -> tuple[CaseRecorder, ...]:
    designs = {d.name: d for d in paper_units()}
    return (
        CaseRecorder(designs["IMU1"]),
        CaseRecorder(designs["IMU2"]),
        CaseRecorder(designs["LAB1"], LAB_BEGINS),
        CaseRecorder(designs["LAB2"], LAB_BEGINS),
    )


def _turned() -> tuple[CaseRecorder, ...]:
    """The paper's, of which IMU2 sits 20 deg to the right and is said to sit straight."""
    first, second, *others = _paper()
    straight = second.design.mounting
    skew = replace(second.design, mounting=replace(straight, angles_deg=(0.0, 0.0, 20.0)))
    return (first, replace(second, design=skew, stated=straight), *others)


def _low_ceiling() -> tuple[CaseRecorder, ...]:
    """IMU1 and IMU2 of the paper, whose high range ends early."""
    found = []
    for recorder in _paper()[:2]:
        low, high = recorder.design.accelerometers
        held = replace(high, uncertainty=replace(high.uncertainty, full_scale=LOW_CEILING))
        design = replace(recorder.design, accelerometers=(low, held))
        found.append(replace(recorder, design=design))
    return tuple(found)


def _short_rest(crash: CrashScenario) -> tuple[CaseRecorder, ...]:
    """IMU1 and IMU2 of the paper, switched on just before the car is towed."""
    begins = min(p.start for p in crash.motion.pulses) - SHORT_REST - crash.start
    return tuple(replace(r, begins=begins) for r in _paper()[:2])


def _no_gyro() -> tuple[CaseRecorder, ...]:
    """IMU1 of the paper without its gyro."""
    one = _paper()[0]
    return (
        replace(
            one,
            design=replace(one.design, gyro=None),
            assumed_turn_sd_deg=2.0,
            because="full width against a wall at a right angle: nothing turns the car",
        ),
    )


_IMUS = ("IMU1", "IMU2")
_SPECIAL = (
    CrashCase(
        "tadic-pole",
        "the paper's impact on a pole, by its four platforms",
        CRASHES["pole"],
        _paper(),
        (*_IMUS, "LAB1", "LAB2"),
    ),
    CrashCase(
        "side-disagree",
        "struck on the left; two recorders disagree, for one sits 20 deg off what is said",
        CRASHES["side"],
        _turned(),
        _IMUS,
        "IMU2 really sits turned by 20 deg to the right (angles_deg = [0, 0, 20]), and this file "
        "says that it sits straight: the comparison of the recorders must find that.",
    ),
    CrashCase(
        "saturated",
        "against a wall at 56 km/h; the high range ends at 16 g, half of what it should",
        CRASHES["frontal"],
        _low_ceiling(),
        _IMUS,
        "The high ranges end at 16 g, and the crash is beyond: what is cut off is missing from "
        "delta-V and path, and no bound knows how much. The report must say so.",
    ),
    CrashCase(
        "short-rest",
        "the pole again, by recorders that were switched on 0.3 s before the car was towed",
        CRASHES["pole"],
        _short_rest(CRASHES["pole"]),
        _IMUS,
        "The stationary stretch is too short to find biases and attitude well: wider bounds, and "
        "a limitation that says so.",
    ),
    CrashCase(
        "no-gyro",
        "against a wall at 56 km/h, by one recorder without gyro",
        CRASHES["frontal"],
        _no_gyro(),
        ("IMU1",),
        "The recorder has no gyro: that the car did not turn by more than is stated below is an "
        "assumption, and the report must say so.",
    ),
)
#: Every crash with the paper's recorders, and some where something is the matter.
CASES: dict[str, CrashCase] = {
    **{name: CrashCase(name, c.summary, c, _paper(), _IMUS) for name, c in CRASHES.items()},
    **{case.name: case for case in _SPECIAL},
}


def find_case(name: str) -> CrashCase:
    """Return the case of that name.

    Raises
    ------
    ConfigError
        There is none; the message names the nearest.
    """
    if name not in CASES:
        raise ConfigError(
            "simulation.no-simulated-crash", quantity="crash", name=name, word=name, known=CASES
        )
    return CASES[name]
