"""Named scenarios: Alexiev's generated gyro data, and further motions.

The figures of the paper are illegible in the scan. Shapes follow captions and text; numbers are
chosen here, except those of Fig. 4, which the text gives. Every scenario except coning is at rest
at its start and end, for 1.5 s or more.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from strapdown.errors import ConfigError
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.coning import Coning
from strapdown.simulation.hand_motions import INTENSIVE, PHONE, TABLE_TO_TABLE, Handling
from strapdown.simulation.motion import Motion, Pulse, PulseMotion
from strapdown.simulation.smooth_random import SmoothRandom

X, Y, Z = 0, 1, 2
_QUARTER_TURN = 1.5707963267948966  # rad
# About ten times that of a phone, to be visible in a plot: 0.01 rad/s at 100 Hz.
_NOISE = 0.001  # rad/s/√Hz
_BEYOND = "beyond the paper"


@dataclass(frozen=True)
class Scenario:
    """A motion with exactly known attitude, and the errors of its sensors.

    Attributes
    ----------
    title : str
    origin : str
        Source in Alexiev (2021), or that the scenario is not from the paper.
    motion : Motion
    errors : ImuErrors
    references : tuple of str
        Known attitude at some instants, in the syntax of `--reference`, as for a recording without
        other truth.
    """

    title: str
    origin: str
    motion: Motion
    errors: ImuErrors = field(default_factory=ImuErrors)
    references: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """Source of the scenario, with the name of the paper where it applies."""
        return self.origin if self.origin == _BEYOND else f"Alexiev 2021, {self.origin}"


_TWO_AXES = (Pulse(X, 2.0, 4.0, 0.8), Pulse(Y, 3.0, 5.0, -0.6))
_THREE_AXES = (Pulse(X, 2.0, 5.0, 0.3), Pulse(Y, 2.5, 4.5, 0.7), Pulse(Z, 3.0, 4.0, 1.5))
_HOME = "end same as start"


def _fig5(scale: float) -> PulseMotion:
    # On the grid of 100 Hz but off that of 5 Hz, like unsynchronized pulses.
    return PulseMotion(
        (
            Pulse(X, 2.07, 3.53, 0.10 * scale),
            Pulse(Y, 2.51, 4.13, -0.05 * scale),
            Pulse(Z, 2.93, 3.77, 0.15 * scale),
        ),
        7.0,
    )


SCENARIOS: dict[str, Scenario] = {
    "alexiev-fig2a": Scenario(
        "one axis",
        "Fig. 2a",
        PulseMotion((Pulse(Z, 2.0, 4.0, 1.0),), 6.0),
    ),
    "alexiev-sequence": Scenario(
        "three axes in sequence, a quarter turn about each",
        "Section 4, rotations that do not overlap in time",
        PulseMotion(
            (
                Pulse(X, 2.0, 3.0, _QUARTER_TURN),
                Pulse(Y, 4.0, 5.0, _QUARTER_TURN),
                Pulse(Z, 6.0, 7.0, _QUARTER_TURN),
            ),
            9.0,
        ),
    ),
    "alexiev-fig2b": Scenario("two axes overlapping", "Fig. 2b", PulseMotion(_TWO_AXES, 7.0)),
    "alexiev-fig2c": Scenario(
        "three axes overlapping with different intensity",
        "Fig. 2c",
        PulseMotion(_THREE_AXES, 7.0),
    ),
    "alexiev-fig2d": Scenario(
        "three axes overlapping, with noise",
        "Fig. 2d",
        PulseMotion(_THREE_AXES, 7.0),
        ImuErrors(TriadErrors(noise_density=_NOISE)),
    ),
    "alexiev-fig2e": Scenario(
        "two axes overlapping, with noise and bias",
        "Fig. 2e",
        PulseMotion(_TWO_AXES, 7.0),
        ImuErrors(TriadErrors(noise_density=_NOISE, bias=(0.02, -0.03, 0.01))),
    ),
    "alexiev-fig2f": Scenario(
        "two axes overlapping, with noise and a different trend on each axis",
        "Fig. 2f",
        PulseMotion(_TWO_AXES, 7.0),
        ImuErrors(TriadErrors(noise_density=_NOISE, trend=(0.01, -0.02, 0.005))),
    ),
    "alexiev-fig4": Scenario(
        "through a pitch near 90°: x 0.1 rad/s and y 2 rad/s, both on [2 s, 3 s)",
        "Fig. 4",
        PulseMotion((Pulse(X, 2.0, 3.0, 0.1), Pulse(Y, 2.0, 3.0, 2.0)), 5.0),
    ),
    "alexiev-fig4-closed": Scenario(
        "Fig. 4 with pulses closed at their end, [2 s, 3 s]: one sample too many",
        "Fig. 4, the other reading of its interval",
        PulseMotion((Pulse(X, 2.0, 3.0, 0.1, True), Pulse(Y, 2.0, 3.0, 2.0, True)), 5.0),
    ),
    "alexiev-fig5": Scenario(
        "three axes overlapping, turns of 5° to 8°: what a rate of 5 Hz or 100 Hz makes of it",
        "Fig. 5",
        _fig5(1.0),
    ),
    "alexiev-fig5-large": Scenario(
        "Fig. 5 with ten times the rates, turns of 46° to 84°",
        "Fig. 5, where its statement on the naive sum ends",
        _fig5(10.0),
    ),
    "alexiev-fig6": Scenario(
        "by hand, as fast as it can be: the same pose at 5 s and at 9 s, whatever came between",
        "Fig. 6, whose log was of 20 Hz",
        TABLE_TO_TABLE,
        references=("9 same as 5",),
    ),
    "intensive": Scenario(
        "up to 4.5 turns a second about axes that never stay, back to the same pose",
        "Section 4, highly intensive rotations",
        INTENSIVE,
        references=(_HOME,),
    ),
    "coning": Scenario(
        "coning as under vibration, half-angle 1° at 10 Hz",
        _BEYOND,
        Coning(half_angle=1.0, frequency=10.0, duration=60.0),
    ),
    "coning-slow": Scenario(
        "coning as a hand wobbles, half-angle 5° at 0.5 Hz",
        _BEYOND,
        Coning(half_angle=5.0, frequency=0.5, duration=60.0),
    ),
    "smooth-random": Scenario(
        "smooth random rotation and translation, 0.1 to 2 Hz, 60 °/s and 1 m/s² rms",
        _BEYOND,
        SmoothRandom(duration=60.0, seed=1, rms_rate=60.0, rms_acceleration=1.0, band=(0.1, 2.0)),
        references=(_HOME,),
    ),
    "gestures": Scenario(
        "a phone taken up, tilted, turned and put back in the same place, five times",
        _BEYOND,
        PHONE,
        references=("6 same as start", "13 same as start", "20.6 same as start", _HOME),
    ),
    "handling": Scenario(
        "ten minutes of taking a phone up and putting it back in the same place",
        _BEYOND,
        Handling(duration=600.0, seed=1),
        references=(_HOME,),
    ),
}


def find_scenario(name: str) -> Scenario:
    """Return the scenario with that name.

    Raises
    ------
    ConfigError
        The name is unknown; the message gives the nearest.
    """
    if name not in SCENARIOS:
        raise ConfigError(
            "simulation.no-scenario", quantity="scenario", name=name, word=name, known=SCENARIOS
        )
    return SCENARIOS[name]
