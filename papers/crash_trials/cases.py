"""Crashes of every kind, drawn at random."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from strapdown.crash import Entry
from strapdown.sensors import CrashUnit, TriadUncertainty, child
from strapdown.simulation import (
    CrashScenario,
    RecorderDesign,
    RecorderTruth,
    Ringing,
    Setting,
    crash_scenario,
    paper_units,
    record_crash,
)

Draw = Callable[[np.random.Generator], CrashScenario]


def _setting(rng: np.random.Generator) -> Setting:
    # Short, but with rest enough to be found as one: what is long is the waiting.
    return Setting(
        heading_deg=float(rng.uniform(0.0, 360.0)),
        stand=2.6,
        towing=5.0,
        coast=0.4,
        friction=float(rng.uniform(0.2, 0.4)),
        after=0.85,
    )


def _pole(rng: np.random.Generator) -> CrashScenario:
    return crash_scenario(
        "pole",
        entry_speed=rng.uniform(5.0, 12.0),
        offset=rng.uniform(-0.6, 0.6),
        restitution=rng.uniform(0.05, 0.2),
        length=rng.uniform(0.09, 0.14),
        pitch_deg=rng.uniform(-3.0, 0.0),
        setting=_setting(rng),
    )


def _frontal(rng: np.random.Generator) -> CrashScenario:
    return crash_scenario(
        "frontal",
        entry_speed=rng.uniform(8.0, 16.0),
        restitution=rng.uniform(0.05, 0.2),
        length=rng.uniform(0.09, 0.13),
        pitch_deg=rng.uniform(-4.0, 0.0),
        setting=_setting(rng),
    )


def _oblique(rng: np.random.Generator) -> CrashScenario:
    return crash_scenario(
        "oblique",
        entry_speed=rng.uniform(8.0, 15.0),
        direction_deg=rng.choice([-1.0, 1.0]) * rng.uniform(15.0, 50.0),
        arm=rng.uniform(-0.4, 0.4),
        restitution=rng.uniform(0.05, 0.2),
        length=rng.uniform(0.10, 0.14),
        pitch_deg=rng.uniform(-3.0, 0.0),
        setting=_setting(rng),
    )


def _side(rng: np.random.Generator) -> CrashScenario:
    return crash_scenario(
        "side",
        entry_speed=rng.uniform(4.0, 12.0),
        change=rng.uniform(4.0, 9.0),
        direction_deg=rng.choice([-1.0, 1.0]) * rng.uniform(70.0, 110.0),
        arm=rng.uniform(-0.4, 0.4),
        length=rng.uniform(0.08, 0.11),
        roll_deg=rng.uniform(-4.0, 4.0),
        setting=_setting(rng),
    )


def _rear(rng: np.random.Generator) -> CrashScenario:
    return crash_scenario(
        "rear",
        entry_speed=rng.uniform(1.0, 6.0),
        change=rng.uniform(4.0, 8.0),
        offset=rng.uniform(-0.4, 0.4),
        length=rng.uniform(0.10, 0.14),
        pitch_deg=rng.uniform(0.0, 2.5),
        setting=_setting(rng),
    )


#: Makers of crashes by their kind: speeds of 1 to 16 m/s, changes of 3 to 19 m/s, pulses of 80 to
#: 140 ms, all headings.
DRAWN: dict[str, Draw] = {
    "pole": _pole,
    "frontal": _frontal,
    "oblique": _oblique,
    "side": _side,
    "rear": _rear,
}


# ==================================================================================================
# One simulated crash: drawn from what is stated, and from what nobody was told
# ==================================================================================================

# Places below the seed of a case.
CASE, RECORDER = range(2)
# After the impact: the path's 0.75 s, and what filters and late triggers need.
RECORDED = 0.85  # s
# Where in a car a recorder may be: forward, right, down from its center of mass, m.
CABIN = ((-1.0, 1.0), (-0.7, 0.7), (-0.3, 0.3))


def paper_design(name: str = "IMU1") -> RecorderDesign:
    """Return a recorder of the paper.

    Parameters
    ----------
    name : str

    Raises
    ------
    ValueError
        There is none of that name.
    """
    designs = {d.name: d for d in paper_units()}
    if name not in designs:
        raise ValueError(f"unknown recorder '{name}'; known: {', '.join(designs)}")
    return designs[name]


@dataclass(frozen=True)
class Untold:
    """What acts on a case and is in no budget.

    Attributes
    ----------
    ringing : tuple of (amplitude, frequency, decay), m/s², Hz, s
        Each begins within 10 ms after the impact, in a direction that is drawn.
    nonlinearity : float
        Standard deviation of the second order of every accelerometer beside what is told,
        relative to full scale.
    trigger_sd : float, s
        Of the trigger, beside what is told.
    """

    ringing: tuple[tuple[float, float, float], ...] = ()
    nonlinearity: float = 0.0
    trigger_sd: float = 0.0


@dataclass(frozen=True)
class TrialPriors:
    """What the cases of a trial are drawn from, and what their bounds are told.

    Attributes
    ----------
    kinds : tuple of str
        Of crashes, as `drawn_scenarios.DRAWN`, all alike often.
    design : RecorderDesign
        Errors, trigger and true mounting are drawn from its uncertainties. Where it sits and how
        it is turned is drawn for each case: anywhere in the cabin, at any heading, up to 10 deg
        from level.
    speed_sd : float, m/s
        Of the entry speed.
    slip_sd_deg, heading_sd_deg : float, deg
        Of the direction of travel against the heading, and of the heading.
    """

    kinds: tuple[str, ...] = tuple(DRAWN)
    design: RecorderDesign = field(default_factory=paper_design)
    speed_sd: float = 0.05
    slip_sd_deg: float = 0.5
    heading_sd_deg: float = 0.5

    def __post_init__(self) -> None:
        for kind in self.kinds:
            if kind not in DRAWN:
                raise ValueError(f"unknown kind of crash '{kind}'; known: {', '.join(DRAWN)}")


@dataclass(frozen=True, eq=False)
class TrialCase:
    """One crash, the record of a unit, and what is told of it.

    Attributes
    ----------
    number : int
    scenario : CrashScenario
    unit : CrashUnit
    entry : Entry
        In north-east-down, at the impact.
    recorder : RecorderTruth
        What the unit really did.
    """

    number: int
    scenario: CrashScenario
    unit: CrashUnit
    entry: Entry
    recorder: RecorderTruth


def draw_case(
    number: int,
    seed: int,
    priors: TrialPriors | None = None,
    untold: Untold | None = None,
) -> TrialCase:
    """Draw a case.

    Parameters
    ----------
    number : int
    seed : int
        Of the trial; the same number of the same seed is the same case, whatever else is run.
        What is untold has streams of its own: the rest of a case is the same without it.
    priors : TrialPriors, optional
    untold : Untold, optional

    Returns
    -------
    TrialCase
    """
    priors, untold = priors or TrialPriors(), untold or Untold()
    rng = np.random.Generator(np.random.PCG64(child(seed, number, CASE)))
    scenario = DRAWN[priors.kinds[int(rng.integers(len(priors.kinds)))]](rng)
    place = [float(rng.uniform(low, high)) for low, high in CABIN]
    turn = [float(rng.uniform(low, high)) for low, high in ((-10, 10), (-10, 10), (0, 360))]
    mounting = replace(
        priors.design.mounting,
        position=(place[0], place[1], place[2]),
        angles_deg=(turn[0], turn[1], turn[2]),
    )
    entry = _entry(scenario, priors, rng)
    start = scenario.start + rng.uniform(0.0, 0.01)
    ringing = []
    for amplitude, frequency, decay in untold.ringing:
        x, y, z = (float(v) for v in rng.standard_normal(3))
        ringing.append(Ringing(start, amplitude, frequency, decay, (x, y, z)))
    root = int(child(seed, number, RECORDER).generate_state(1, np.uint64)[0])
    unit, recorder = record_untold(
        scenario, replace(priors.design, mounting=mounting), untold, root, tuple(ringing)
    )
    return TrialCase(number, scenario, unit, entry, recorder)


def record_untold(
    scenario: CrashScenario,
    design: RecorderDesign,
    untold: Untold,
    seed: int,
    ringing: tuple[Ringing, ...] = (),
) -> tuple[CrashUnit, RecorderTruth]:
    """Record a crash by a recorder that is worse than it says.

    Parameters
    ----------
    scenario : CrashScenario
        Its start is the trigger; recorded from its beginning to 0.85 s after that.
    design : RecorderDesign
        What is told.
    untold : Untold
        But for its ringing.
    seed : int
    ringing : tuple of Ringing
    """
    really = replace(
        design,
        trigger_sd=float(np.hypot(design.trigger_sd, untold.trigger_sd)),
        accelerometers=tuple(
            replace(t, uncertainty=_bent(t.uncertainty, untold.nonlinearity))
            for t in design.accelerometers
        ),
    )
    unit, truth = record_crash(
        scenario.motion,
        really,
        impact=scenario.start,
        seed=seed,
        end=min(scenario.motion.duration, scenario.start + RECORDED),
        ringing=ringing,
    )
    accelerometers = tuple(
        replace(t, uncertainty=design.told(k)) for k, t in enumerate(unit.accelerometers)
    )
    told = replace(unit, accelerometers=accelerometers, trigger_sd=design.trigger_sd)
    return told, truth


def _bent(uncertainty: TriadUncertainty, more: float) -> TriadUncertainty:
    x, y, z = np.hypot(uncertainty.axis("nonlinearity_2"), more).tolist()
    return replace(uncertainty, nonlinearity_2=(x, y, z))


def _entry(scenario: CrashScenario, priors: TrialPriors, rng: np.random.Generator) -> Entry:
    """What is told of the entry: the truth and an error that is drawn."""
    motion = scenario.motion
    k = motion.kinematics(np.array([scenario.start]))
    north, east, _ = k.velocity[0]
    by_speed, by_slip, by_heading = rng.standard_normal(3)
    origin = motion.origin
    return Entry.from_speed(
        float(np.hypot(north, east)) + priors.speed_sd * float(by_speed),
        priors.speed_sd,
        heading_deg=motion.heading_deg + priors.heading_sd_deg * float(by_heading),
        heading_sd_deg=priors.heading_sd_deg,
        slip_deg=priors.slip_sd_deg * float(by_slip),
        slip_sd_deg=priors.slip_sd_deg,
        lat_deg=origin.lat_deg,
        lon_deg=origin.lon_deg,
        alt=origin.alt,
    )
