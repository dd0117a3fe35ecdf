"""How much springs and tires yield is found."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import chi2
from tests.aided_drives import CarriedMotion, drive, estimate, gnss_of, navigator_of, run
from tests.coded import coded

from strapdown import rotation
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError
from strapdown.navigation.measurements.gnss import Gnss
from strapdown.navigation.measurements.vehicle import NoSlip

#: Pitch of the body by the force along it, deg/g: nose up as it gains speed.
DIVE = 3.0
#: Half of the interval of a difference for the rate of pitch, s.
HALF = 1e-3


@dataclass(frozen=True)
class DivingMotion(CarriedMotion):
    """A course whose body pitches on its springs by the force along it."""

    def pitch(self, time):
        """Of the body in its path, rad: by the force in its own axes, which pitch with it."""
        k = self.motion.kinematics(np.clip(time, 0.0, self.duration))
        forward = rotation.rotate(k.q_nb, [1.0, 0.0, 0.0])
        force = (forward * (k.acceleration - [0.0, 0.0, STANDARD_GRAVITY])).sum(axis=-1)
        yields = np.radians(DIVE)
        return yields * force / STANDARD_GRAVITY / (1.0 - yields)

    def kinematics(self, time):
        k = self.motion.kinematics(time)
        angle = self.pitch(time)
        rate = (self.pitch(time + HALF) - self.pitch(time - HALF)) / (2.0 * HALF)
        zero = np.zeros_like(angle)
        turn = rotation.quaternion_from_euler(np.column_stack([zero, np.degrees(angle), zero]))
        return replace(
            k,
            q_nb=rotation.compose(k.q_nb, turn),
            turning=rotation.rotate(rotation.conjugate(turn), k.turning)
            + np.column_stack([zero, rate, zero]),
            angles=None,
            swinging=None,
        )


MOTION = DivingMotion(drive())
#: Until then the drive has gained and lost speed, and turned to both sides, s.
UNTIL = 66.0
NOISE = NoSlip(name="wheels", mounting_sd_deg=(2.0, 2.0), lateral_sd=0.01, vertical_sd=0.02)
#: The force is a mean over the interval, of which an old one would tell of another dive.
STATE = replace(
    NOISE,
    compliance_sd_deg_per_g=(4.0, DIVE),
    slip_deg_per_g=1.2,
    dive_deg_per_g=0.3 * DIVE,
    interval=0.2,
)
SEEDS = range(5)


def driven(aid, seed):
    navigator = navigator_of((Gnss(name="gnss"), aid))
    state, _ = run(navigator, MOTION, seed, {"gnss": gnss_of(MOTION, seed)}, until=UNTIL)
    return navigator, state


@pytest.mark.slow
def test_slip_and_dive_are_found_within_what_is_said():
    """Squares of the errors over their covariances: one in a hundred is outside of this."""
    total = 0.0
    for seed in SEEDS:
        navigator, state = driven(STATE, seed)
        found, P = estimate(navigator, state, "wheels.compliance")
        off = found - np.radians([0.0, DIVE])
        total += off @ np.linalg.solve(P, off)
        assert np.degrees(np.sqrt(P[1, 1])) < 0.5 * DIVE
    assert total < chi2.ppf(0.99, 2 * len(SEEDS))


def test_one_of_them_alone_and_none():
    alone = replace(NOISE, compliance_sd_deg_per_g=(0.0, 2.0))
    assert alone.states()[-1].block.labels == ("dive",)
    assert [one.block.name for one in NOISE.states()] == ["wheels.mounting"]
    with pytest.raises(
        ConfigError, check=coded("navigation.no-numbers-from", quantity="compliance_sd_deg_per_g")
    ):
        replace(NOISE, compliance_sd_deg_per_g=(-1.0, 0.0))
