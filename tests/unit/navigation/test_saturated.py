"""What a sensor at the end of its range cuts off is not known from there on."""

import math

import numpy as np
import pytest

from strapdown.navigation.preprocessing import RangeState, ends_of
from strapdown.sensors.uncertainty import ImuUncertainty, TriadUncertainty

END = 4.0
SENSORS = ImuUncertainty(
    TriadUncertainty(bias=1e-4, full_scale=END, quantization=1e-3),
    TriadUncertainty(bias=1e-2, full_scale=math.inf),
)


def parabola(top=5.0, half=0.1, step=0.002):
    """A gyro that would reach `top`; it is cut off at `END`."""
    time = np.arange(-0.3, 0.3, step)
    true = top * (1.0 - (time / half) ** 2 * (1.0 - END / top))
    values = np.zeros((len(time), 6))
    values[:, 1] = np.clip(true, -END + 0.5, END)
    return time, values, true


def test_what_is_missing_of_a_parabola_is_its_deviation():
    time, values, true = parabola()
    _, holes = ends_of(SENSORS).advance(RangeState(), time, values)
    length = np.array([hole.length for hole in holes])
    variance = np.array([hole.rate_sd for hole in holes]) * length[:, None]
    total = np.sqrt(np.square(variance).sum(axis=0))
    missing = np.clip(true - END, 0.0, None).sum() * 0.002
    # The slope is of the step before the end, and the end within a step: 2 h / T = 2 % of each,
    # and the squared time twice that.
    assert total[1] == pytest.approx(missing, rel=0.08)
    # About the other axes half of its square.
    assert total[[0, 2]] == pytest.approx(0.5 * total[1] ** 2, rel=0.02)
    assert not any(hole.force_sd.any() for hole in holes)


@pytest.mark.parametrize("cuts", [(1,), (97, 98, 101, 150, 151), (100, 200)])
def test_pieces_give_the_same_as_the_whole(cuts):
    time, values, _ = parabola()
    ends = ends_of(SENSORS)
    _, whole = ends.advance(RangeState(), time, values)
    state, holes = RangeState(), []
    for t, v in zip(np.split(time, cuts), np.split(values, cuts), strict=True):
        state, some = ends.advance(state, t, v)
        holes += some
    assert len(holes) == len(whole) > 90
    for one, other in zip(holes, whole, strict=True):
        assert (one.begin, one.end) == (other.begin, other.end)
        assert one.rate_sd.tolist() == other.rate_sd.tolist()


def test_nothing_is_at_an_end_that_is_not_stated():
    assert ends_of(ImuUncertainty(TriadUncertainty(), TriadUncertainty())) is None
    time, values, _ = parabola()
    values[:, 1] = 2.0 * END  # of another sensor than the one that is stated
    assert ends_of(SENSORS).advance(RangeState(), time, values)[1] == ()
