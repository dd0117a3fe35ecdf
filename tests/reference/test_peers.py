"""Filters of other libraries on real recordings with optical truth, trials of BROAD.

The magnetometer is read from the file, in the sensor's axes: forward, left, up, as the gyro's
are taken. The samples are raw; no bias is removed. ``pytest -s`` prints the errors.
"""

from __future__ import annotations

from functools import cache

import h5py
import numpy as np
import pytest

from strapdown import read_log, rotation
from strapdown.attitude_algorithms import Quaternion, run_attitude
from strapdown.increments import increments_from_imu
from strapdown.peers import PEERS, run_peers
from strapdown.tables import MAG, QUATERNION

ROTATION = ["02_undisturbed_slow_rotation_B", "07_undisturbed_fast_rotation_B"]
TRANSLATION = "14_undisturbed_slow_translation_with_breaks_B"
PHONE = "27_disturbed_phone_vibration_B"
BROAD = [*ROTATION, TRANSLATION, PHONE]


@cache
def trial(path):
    """Samples from the first known attitude on, that attitude, and the truth that counts."""
    log = read_log(path)
    with h5py.File(path) as file:
        mag = file["imu_mag"][:] * [1.0, -1.0, -1.0]
    imu = log.imu.copy()
    assert len(imu) == len(mag)
    imu[MAG] = mag
    start = log.truth[QUATERNION].iloc[0].to_numpy()
    return imu.loc[log.truth.index[0] :], start, log.truth[log.scored]


def root_mean_square(angles):
    return float(np.sqrt((angles**2).mean()))


def errors(attitude, truth):
    """RMS of the whole error and of that of the inclination, deg."""
    known = truth[QUATERNION].to_numpy()
    found = attitude.loc[truth.index, QUATERNION].to_numpy()
    w, x, y, z = rotation.compose(known, rotation.conjugate(found)).T
    inclination = np.degrees(2.0 * np.arctan2(np.hypot(x, y), np.hypot(w, z)))
    whole = rotation.rotation_angle(found, known)
    return root_mean_square(whole), root_mean_square(inclination)


@pytest.mark.slow
@pytest.mark.parametrize("name", BROAD)
@pytest.mark.parametrize("peer", ["vqf", "ahrs:closed"])
def test_the_gyro_alone_is_our_quaternion_with_mean_rates(recordings, name, peer):
    imu, start, _ = trial(recordings(f"broad/{name}.hdf5"))
    ((_, _, theirs),), findings = run_peers([peer], imu, start, ["gyro"])
    assert findings == ()
    held = imu.copy()
    held.attrs = imu.attrs | {"sampling": "mean"}  # each sample over the step that ends at it
    ours = run_attitude(Quaternion(), increments_from_imu(held), start).attitude
    q = [table[QUATERNION].to_numpy() for table in (theirs, ours)]
    # 5e4 products, each rounded by up to 4e-16, twice: 4e-11 rad. Stamps up to 200 s make each
    # step uncertain by 3e-14 s; at 10 rad/s, unrelated: 3e-13 rad x sqrt(5e4) = 7e-11 rad.
    assert rotation.rotation_angle(*q).max() < np.degrees(4e-11 + 7e-11)


@pytest.mark.parametrize("name", BROAD)
def test_vqf_is_as_good_as_its_authors_say(recordings, name):
    """Published for such trials: some 1 to 3 deg, and 1 to 2 deg of inclination.

    An axis or a sign that is wrong costs tens of degrees. Trial 27 is disturbed by a phone, and
    its magnetic heading is bounded by that alone.
    """
    imu, start, truth = trial(recordings(f"broad/{name}.hdf5"))
    runs, findings = run_peers(["vqf"], imu, start, ["gyro+accel", "gyro+accel+mag"])
    assert findings == ()
    for label, aiding, attitude in runs:
        whole, inclination = errors(attitude, truth)
        print(f"{name} {label} {aiding}: {whole:.2f} deg, inclination {inclination:.2f} deg")
        assert inclination < 2.0
        assert whole < (10.0 if (name, aiding) == (PHONE, "gyro+accel+mag") else 5.0)


def bounded(recordings, name, words):
    imu, start, truth = trial(recordings(f"broad/{name}.hdf5"))
    runs, _ = run_peers(words, imu, start, ["gyro+accel", "gyro+accel+mag"])
    for label, aiding, attitude in runs:
        whole, inclination = errors(attitude, truth)
        print(f"{name} {label} {aiding}: {whole:.2f} deg, inclination {inclination:.2f} deg")
        # Untuned, on raw samples: inclination within twice the 1 to 2 deg, and 9D of the slow
        # trial, which the gyro alone leaves by 25 deg, within 5 deg.
        assert inclination < 5.0
        if aiding.endswith("mag") and name == ROTATION[0]:
            assert whole < 5.0


@pytest.mark.parametrize("name", BROAD)
def test_imufusion_has_our_axes(recordings, name):
    bounded(recordings, name, ["imufusion"])


@pytest.mark.slow
@pytest.mark.parametrize("name", BROAD)
def test_the_filters_of_ahrs_have_our_axes(recordings, name):
    bounded(recordings, name, [f"ahrs:{f}" for f in PEERS["ahrs"].filters])
