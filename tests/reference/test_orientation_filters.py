"""Orientation filters of the project against vqf with its defaults: recorded and simulated motions.

The constants of the model are from data sheets and from trials 07 and 27 of BROAD; its errors in
trials 02 and 14 were looked at while the model was made. ``pytest -s`` prints the errors.
"""

from __future__ import annotations

import numpy as np
import pytest
from tests.hand_motions import KINDS, record
from tests.recorded import DATA, without
from tests.reference.test_peers import BROAD, trial

from strapdown import rotation
from strapdown.api.attitude import compare_attitude
from strapdown.attitude_comparison.options import AttitudeOptions
from strapdown.orientation_filters import make_filter, run_filter
from strapdown.peers import align_heading, available_peers, run_peers
from strapdown.tables import ACCEL, GYRO, MAG, QUATERNION

needs_vqf = pytest.mark.skipif("vqf" not in available_peers(), reason="vqf is not installed")

#: The optical reference's own tilt, deg: the mean error of every filter in all trials without
#: motion. Differences of an inclination below a third of it mean nothing.
REFERENCE_TILT = 0.27


def parts(q, truth):
    """Root mean square of the whole error, its inclination and its heading, deg."""
    e = np.abs(rotation.compose(q, rotation.conjugate(truth)))
    whole = 2.0 * np.arccos(np.clip(e[:, 0], 0.0, 1.0))
    tilt = 2.0 * np.arctan2(np.hypot(e[:, 1], e[:, 2]), np.hypot(e[:, 0], e[:, 3]))
    heading = 2.0 * np.arctan2(e[:, 3], e[:, 0])
    return np.degrees([np.sqrt(np.mean(x**2)) for x in (whole, tilt, heading)])


def both(imu, start, rows, truth, magnetic):
    """Errors of error-state, complementary and vqf on one record, with the same samples."""
    columns = GYRO + ACCEL + (MAG if magnetic else [])
    aiding = "gyro+accel+mag" if magnetic else "gyro+accel"
    ((_, _, table),), _ = run_peers(["vqf"], imu, start, [aiding])
    found = [
        run_filter(make_filter(name), imu[columns], sampling="mean").q_nb
        for name in ("error-state", "complementary")
    ]
    found.append(table[QUATERNION].to_numpy())
    if not magnetic:
        found = [align_heading(q, truth[0], rows[0]) for q in found]
    return np.array([parts(q[rows], truth) for q in found])


def on_broad(name, magnetic):
    path = DATA / "broad" / f"{name}.hdf5"
    if not path.is_file():
        without(path.name)
    imu, start, truth = trial(path)
    truth = truth[truth.index >= imu.index[0]]
    rows = np.searchsorted(imu.index, truth.index)
    return both(imu, start, rows, truth[QUATERNION].to_numpy(), magnetic)


@needs_vqf
@pytest.mark.parametrize("magnetic", [True, False])
@pytest.mark.parametrize("half", ["counted", "tuned"])
def test_error_state_against_vqf_on_recordings(half, magnetic):
    names = [n for n in BROAD if (n[:2] in ("02", "14")) == (half == "counted")]
    errors = np.array([on_broad(name, magnetic) for name in names])
    for name, (ours, cheap, theirs) in zip(names, errors, strict=True):
        print(f"\n{name[:2]} {'9D' if magnetic else '6D'} {ours} {cheap} {theirs}")
    ours, cheap, theirs = np.sqrt(np.mean(np.square(errors), axis=0))
    # In 27 a phone at the sensor turns the field by 7 deg for every filter alike.
    whole = 1.0 if half == "counted" or not magnetic else 1.03
    assert ours[0] <= whole * theirs[0]
    assert ours[2] <= whole * theirs[2]
    assert ours[1] <= theirs[1] + REFERENCE_TILT / 3.0
    # The one of fewest operations: within three times the inclination.
    assert cheap[1] <= 3.0 * theirs[1]


@needs_vqf
@pytest.mark.slow
@pytest.mark.parametrize("disturbed", [False, True])
def test_error_state_against_vqf_on_simulated_motions(disturbed):
    """Unknown biases of 0.1 to 2 deg/s, from 5 s on; the same samples for both."""
    inclinations = []
    for kind in KINDS:
        errors = []
        for seed in range(12):
            made = record(kind, seed, disturbed=disturbed)
            rows = np.arange(500, len(made.imu))
            errors.append(both(made.imu, made.q_nb[0], rows, made.q_nb[rows], True))
        ours, cheap, theirs = np.sqrt(np.mean(np.square(errors), axis=0))
        print(f"\n{kind} {'disturbed' if disturbed else ''} {ours} {cheap} {theirs}")
        assert ours[0] <= theirs[0]
        inclinations.append((ours[1], theirs[1]))
    # Over all kinds; of 12 motions of one kind, half of whose errors are those of three, an
    # inclination says less than a heading.
    mine, other = np.sqrt(np.mean(np.square(inclinations), axis=0))
    assert mine <= 1.05 * other


def test_the_comparison_runs_them_by_default():
    path = DATA / "broad" / f"{BROAD[0]}.hdf5"
    if not path.is_file():
        without(path.name)
    bench = compare_attitude(path, ["quaternion"], options=AttitudeOptions(rates_hz=[100.0]))
    assert [(p.peer, p.aiding) for p in bench.peers][:2] == [
        ("strapdown error-state", "gyro+accel"),
        ("strapdown complementary", "gyro+accel"),
    ]
    for peer in bench.peers:
        assert peer.errors.heading_deg < peer.errors.rms_deg < 10.0
        # At the samples, and at the stamps of the truth between them.
        assert peer.errors.rms_deg == pytest.approx(peer.scores[0].rms_deg, rel=1e-3)
        assert peer.errors.inclination_deg < 1.0
        assert peer.cost.memory > 0
        # Single precision: less than a hundredth of the error.
        assert peer.single_deg < 0.02
        if "error-state" in peer.peer:
            assert min(peer.errors.covered) > 0.95
        else:
            assert peer.errors.covered is None
