"""Crashes, and what is none, as motions of a car with exact truth.

The pole impact is that of Tadic and Vukajlovic (2016): its speed and offset are the paper's, its
other numbers are chosen, as are all those of the others; each is a parameter of the function that
makes it. The vehicle's origin is its centre of mass. No scenario has structural ringing: that is a
matter of the mounting (`MountedMotion`).
"""

from __future__ import annotations

from strapdown.errors import ConfigError
from strapdown.simulation.crash_course import CrashScenario
from strapdown.simulation.front_impacts import frontal_impact, oblique_impact, pole_impact
from strapdown.simulation.near_crashes import door_slam, hard_braking, kerb, pothole
from strapdown.simulation.other_impacts import rear_impact, rollover, side_impact, two_impacts

#: Each with its own parameters; the functions make others.
CRASHES: dict[str, CrashScenario] = {
    "pole": pole_impact(),
    "frontal": frontal_impact(),
    "oblique": oblique_impact(),
    "side": side_impact(),
    "rear": rear_impact(),
    "two-impacts": two_impacts(),
    "rollover": rollover(),
    "hard-braking": hard_braking(),
    "pothole": pothole(),
    "kerb": kerb(),
    "door-slam": door_slam(),
}


def find_crash(name: str) -> CrashScenario:
    """Return the crash, or what is none, of that name.

    Parameters
    ----------
    name : str

    Returns
    -------
    CrashScenario

    Raises
    ------
    ConfigError
        There is none; the message names the nearest.
    """
    if name not in CRASHES:
        raise ConfigError(
            "simulation.no-simulated-crash", quantity="crash", name=name, word=name, known=CRASHES
        )
    return CRASHES[name]
