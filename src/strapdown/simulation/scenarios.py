"""Alexiev's generated gyro data as named scenarios.

The figures of the paper did not survive scanning, so that the shapes are those of the
captions and the text, and the numbers are chosen here, except for Fig. 4, whose numbers the
text gives. Every scenario rests for the first and the last two seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from strapdown.exceptions import ConfigError, nearest
from strapdown.sensors.triad_errors import ImuErrors, TriadErrors
from strapdown.simulation.motion import Pulse, PulseMotion

X, Y, Z = 0, 1, 2
_QUARTER_TURN = 1.5707963267948966  # rad
# Some ten times that of a phone, so that it shows in a plot: 0.01 rad/s at 100 Hz.
_NOISE = 0.001  # rad/s/√Hz


@dataclass(frozen=True)
class Scenario:
    """A motion with an exactly known attitude, and the errors of the sensors that measure it.

    Attributes
    ----------
    title : str
    origin : str
        Where in the paper it stands.
    motion : PulseMotion
    errors : ImuErrors
    """

    title: str
    origin: str
    motion: PulseMotion
    errors: ImuErrors = field(default_factory=ImuErrors)


_TWO_AXES = (Pulse(X, 2.0, 4.0, 0.8), Pulse(Y, 3.0, 5.0, -0.6))
_THREE_AXES = (Pulse(X, 2.0, 5.0, 0.3), Pulse(Y, 2.5, 4.5, 0.7), Pulse(Z, 3.0, 4.0, 1.5))

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
}


def find_scenario(name: str) -> Scenario:
    """Return the scenario of that name.

    Parameters
    ----------
    name : str

    Returns
    -------
    Scenario

    Raises
    ------
    ConfigError
        There is none; the message names the nearest.
    """
    if name not in SCENARIOS:
        raise ConfigError(
            f"'{name}' is no scenario", quantity="scenario", remedy=nearest(name, SCENARIOS)
        )
    return SCENARIOS[name]
