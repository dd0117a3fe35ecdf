"""Alignments carried by the gyros."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2
from tests.coded import coded

sys.path.insert(0, str(Path(__file__).parent))

from stands import SITE, changed, chi_square, ideal, phi, rocking, unit

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.readiness import carry
from strapdown.errors import DataError


def true_at(truth, row, covariance=None):
    return Alignment(
        "stated", row / 50.0, truth[row], np.zeros((3, 3)) if covariance is None else covariance
    )


def test_there_and_back_without_errors():
    imu, truth = ideal(rocking(600.0), 50.0)
    for first, last in ((0, 30_000), (30_000, 0), (1234, 20_000), (77, 77)):
        found = carry(imu, true_at(truth, first), last / 50.0, SITE)
        assert found.time == imu.index[last]
        # Means of 0.02 s of a body that turns by 1.7 deg/s at the most: the two-sample form
        # leaves 1e-8 rad in 600 s.
        assert np.abs(phi(found, truth[last])).max() < 1e-7


def test_units_forward_and_backward():
    found = []
    start = np.diag([1e-10, 2e-10, 4e-10])
    for seed in range(30):
        imu, truth, sensors = unit(rocking(600.0), 50.0, seed)
        first, last = (0, 30_000) if seed % 2 else (30_000, 0)
        rng = np.random.default_rng(seed)
        off = rotation.quaternion_from_rotation_vector(rng.normal(0.0, np.sqrt(np.diagonal(start))))
        stated = true_at(truth, first, start)
        stated = replace(stated, q_nb=rotation.compose(off, truth[first]))
        found.append(chi_square(carry(imu, stated, last / 50.0, SITE, sensors), truth[last]))
    low, high = chi2.isf([1 - 1e-4, 1e-4], 90)
    assert low < sum(found) < high


def test_a_known_bias_is_taken_off():
    imu, truth = ideal(rocking(600.0), 50.0)
    bias = np.array([1e-5, -2e-5, 3e-5])
    columns = ["gyro_x", "gyro_y", "gyro_z"]
    wrong = changed(imu, **{c: imu[c] + b for c, b in zip(columns, bias, strict=True)})
    known = replace(true_at(truth, 0), gyro_bias=bias)
    assert np.abs(phi(carry(wrong, known, 600.0, SITE), truth[-1])).max() < 1e-7
    assert np.abs(phi(carry(wrong, true_at(truth, 0), 600.0, SITE), truth[-1])).max() > 1e-3


def test_what_is_known_besides_goes_along():
    imu, truth = ideal(rocking(600.0), 50.0)
    told = replace(true_at(truth, 0), heading_given=True, measured_latitude_deg=55.1)
    found = carry(imu, told, 600.0, SITE)
    assert found.heading_given
    assert found.measured_latitude_deg == 55.1


def test_an_instant_outside_of_the_record():
    imu, truth = ideal(rocking(600.0), 50.0)
    with pytest.raises(
        DataError,
        check=coded(
            "alignment.instant-outside-record",
            file="log.csv",
            quantity="time",
            time=601.0,
            stamps=0.0,
            stamps_2=600.0,
        ),
    ):
        carry(imu, true_at(truth, 0), 601.0, SITE)
    with pytest.raises(
        DataError,
        check=coded(
            "alignment.instant-outside-record",
            file="log.csv",
            quantity="time",
            time=-5.0,
            stamps=0.0,
            stamps_2=600.0,
        ),
    ):
        carry(imu, replace(true_at(truth, 0), time=-5.0), 10.0, SITE)
