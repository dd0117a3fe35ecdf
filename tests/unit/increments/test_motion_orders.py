"""The orders that motion increments declare, fitted on a smooth motion of all axes.

And on coning, sculling and scrolling, where symmetry lets some fall faster.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from strapdown import rotation
from strapdown.errors import ConfigError
from strapdown.increments import ORDERS, motion_accuracy, motion_increments
from strapdown.simulation import Coning, Sculling

_spec = importlib.util.spec_from_file_location(
    "smooth_motion", Path(__file__).with_name("smooth_motion.py")
)
smooth = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(smooth)

START, LENGTH = 0.3, 2.4
# One pattern of steps a block, the same at every refinement: steps that grow alike when halved
# would hide what unequal ones cost.
PATTERNS = {1: (0.7, 1.3), 2: (0.7, 1.3), 3: (0.7, 1.5, 0.8), 4: (0.7, 1.3, 0.8, 1.2)}
KINDS = [pytest.param(*key, id="-".join(map(str, key))) for key in ORDERS]


def stamps(start, length, count, samples, equal):
    pattern = np.ones(1) if equal else np.array(PATTERNS[samples]) / np.mean(PATTERNS[samples])
    return start + np.concatenate([[0.0], np.cumsum(np.resize(pattern, count))]) * length / count


@pytest.fixture(scope="module")
def end():
    return smooth.truth(START, START + LENGTH)


@pytest.mark.parametrize("equal", [True, False], ids=["equal", "unequal"])
@pytest.mark.parametrize(("sampling", "samples", "interpolation"), KINDS)
def test_the_order_on_a_general_motion(sampling, samples, interpolation, equal, end):
    wrong = []
    for count in (48, 96):
        time = stamps(START, LENGTH, count, samples, equal)
        increments = motion_increments(smooth.imu_at(time, sampling), samples, interpolation)
        wrong.append(smooth.distance(smooth.compose(increments), end))
    slopes = np.log2(wrong[0] / wrong[1])
    declared = motion_accuracy(sampling, samples, interpolation)
    orders = (declared.attitude, declared.velocity, declared.position)
    # The next term is a block (up to 0.2 s) times rates of change of 3/s of the first, with
    # coefficients below a half; the nearest other order is 1 away. Truth is good to 1e-12, and the
    # smallest error here is 5e-10.
    assert slopes == pytest.approx(orders if equal else [declared.unequal] * 3, abs=0.15)


VIBRATIONS = {
    "coning": (Coning(10.0, 1.0, 3.0), [0]),
    "sculling": (Sculling(20.0, 5.0, 1.0, 3.0), [1, 2]),
    # In quadrature no velocity is left, and the distance is what the step's second integral gives.
    "scrolling": (Sculling(20.0, 5.0, 1.0, 3.0, phase=90.0), [2]),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", VIBRATIONS)
@pytest.mark.parametrize("equal", [True, False], ids=["equal", "unequal"])
@pytest.mark.parametrize(("sampling", "samples", "interpolation"), KINDS)
def test_the_order_on_vibrations(sampling, samples, interpolation, equal, name):
    motion, quantities = VIBRATIONS[name]

    def values(t):
        force = motion.shake(t) if isinstance(motion, Sculling) else np.zeros((len(t), 3))
        return np.hstack([motion.rate(t), force])

    def sums(t):
        force = motion.shake_sum(t) if isinstance(motion, Sculling) else np.zeros((len(t), 3))
        return np.hstack([motion.angle(t), force])

    wrong = []
    for count in (24, 48):
        time = stamps(0.0, 3.0, 3 * count, samples, equal)
        imu = smooth.imu_at(time, sampling, values, sums)
        end = time[-1:]
        back = rotation.conjugate(motion.attitude([0.0])[0])
        true = smooth.State(
            rotation.compose(back, motion.attitude(end)[0]),
            rotation.rotate(back, motion.velocity(end)[0]),
            rotation.rotate(back, motion.position(end)[0]),
        )
        found = smooth.compose(motion_increments(imu, samples, interpolation))
        wrong.append(smooth.distance(found, true)[quantities])
    slopes = np.log2(wrong[0] / wrong[1])
    declared = motion_accuracy(sampling, samples, interpolation)
    order = min(declared.attitude, declared.velocity, declared.position)
    # Blocks of up to 1/6 of a cycle: the next term is (2 pi/6)^2 of the first times a number
    # below a tenth. Symmetry may make it fall faster.
    assert (slopes >= (order if equal else declared.unequal) - 0.2).all()


@pytest.mark.parametrize(
    "wrong", [("instantaneous", 1, "constant"), ("mean", 2, "cubic"), ("mean", 5, "linear")]
)
def test_what_is_not_made_has_no_order(wrong):
    with pytest.raises(
        ConfigError,
        check=lambda refused: (
            refused.finding.code == "mechanization.no-motion-increments-made-samples"
        ),
    ):
        motion_accuracy(*wrong)
