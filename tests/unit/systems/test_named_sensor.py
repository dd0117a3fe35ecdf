"""A sensor that is named far better than it is: the run with its grade explains the record."""

from __future__ import annotations

import pandas as pd
import pytest

from strapdown.config.navigation import NavigationSpec
from strapdown.navigation.integrity import likelihood_gain
from strapdown.systems.navigation_run import run_navigation

CODE = "navigation.sensor-contradicted"


def drive(named, real, repeat=True):
    place = {"lat_deg": 55.75, "lon_deg": 37.62, "alt_m": 150.0}
    turns = [
        step
        for k in range(4)
        for step in (
            {"do": "turn_left" if k % 2 else "turn_right", "angle_deg": 90.0, "radius_m": 40.0},
            {"do": "straight", "duration_s": 8.0},
        )
    ]
    table = {
        "simulation": {
            "rate_hz": 50.0,
            "seed": 11,
            "sensor": real,
            "motion": {
                "kind": "car",
                **place,
                "heading_deg": 30.0,
                "manoeuvres": [
                    {"do": "straight", "duration_s": 5.0},
                    {"do": "accelerate", "to_km_per_h": 40.0, "duration_s": 8.0},
                    *turns,
                ],
            },
            "gnss": {"gps": {"position_noise_m": 0.5, "velocity_noise_m_per_s": 0.05}},
        },
        "start": {
            **place,
            "v_ned_m_per_s": (0.0, 0.0, 0.0),
            "roll_deg": 0.0,
            "pitch_deg": 0.0,
            "heading_deg": 30.0,
            "position_sd_m": 1.0,
            "velocity_sd_m_per_s": 0.1,
            "tilt_sd_deg": 2.0,
            "heading_sd_deg": 2.0,
        },
        "sensors": {"sensor": named},
        "aiding": {
            "gps": {"kind": "gnss", "update_rule": {"kind": "adaptive", "influence": "igg3"}}
        },
        "trust": {"repeat": repeat},
    }
    return run_navigation(NavigationSpec.checked(table))


def test_a_phone_that_is_named_a_tactical_unit_is_contradicted():
    found = [f for f in drive("stim300", "mpu-6050").findings if f.code == CODE]
    assert len(found) == 1
    data = found[0].data
    assert (data["named"], data["grade"]) == ("stim300", "consumer-grade")
    assert data["gain"] > 20.0
    assert data["left"] <= data["rejected"]


@pytest.mark.parametrize(
    ("named", "real", "repeat"), [("stim300", "stim300", True), ("stim300", "mpu-6050", False)]
)
def test_a_right_name_is_not_contradicted_nor_is_a_run_that_is_not_repeated(named, real, repeat):
    assert not [f for f in drive(named, real, repeat).findings if f.code == CODE]


def test_the_likelihood_is_of_the_epochs_of_both_and_a_gross_error_does_not_rule_it():
    def record(nu, s):
        time = pd.Index([1.0, 2.0, 3.0][: len(nu)], name="time")
        return {"a": pd.DataFrame({"nu x": nu, "s x": s, "weight x": 1.0}, index=time)}

    gain, count = likelihood_gain(record([2.0, 2.0, 9.0], [1.0] * 3), record([2.0, 2.0], [4.0] * 2))
    # Each: half of 4 less 1 less ln 4.
    assert (gain, count) == (pytest.approx(3.0 - 1.3862943611), 2)
    one, _ = likelihood_gain(record([1e3], [1.0]), record([0.0], [1.0]))
    assert one == pytest.approx(12.5)
