"""What a person states of a triad, in the keys of the catalogue."""

from __future__ import annotations

import math

import pytest

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import stated_uncertainty, uncertainty_of


def test_stated_in_units_of_the_keys() -> None:
    made = stated_uncertainty(
        "accel", {"bias_sd_mg": 20.0, "full_scale_g": [2.0, 3.0, 4.0], "scale_bound_percent": 3.0}
    )
    assert made.axis("bias") == pytest.approx([0.02 * STANDARD_GRAVITY] * 3, rel=1e-15)
    assert made.axis("full_scale") == pytest.approx(
        [2.0 * STANDARD_GRAVITY, 3.0 * STANDARD_GRAVITY, 4.0 * STANDARD_GRAVITY], rel=1e-15
    )
    # A uniform distribution within ±b has the standard deviation b/√3.
    assert made.axis("scale") == pytest.approx([0.03 / math.sqrt(3.0)] * 3, rel=1e-15)
    turn = stated_uncertainty("gyro", {"bias_sd_deg_per_s": 2.0, "bandwidth_hz": 140.0})
    assert turn.axis("bias") == pytest.approx([math.radians(2.0)] * 3, rel=1e-15)
    assert turn.bandwidth == 140.0


def test_what_is_not_stated_is_the_sensors() -> None:
    sensor = load_sensor("lis302dlh")
    made = stated_uncertainty("accel", {"scale_sd_percent": 1.0}, sensor)
    whole = uncertainty_of(sensor, "accel")
    assert made.axis("scale") == (0.01, 0.01, 0.01) != whole.axis("scale")
    assert made.axis("bias") == whole.axis("bias")
    assert stated_uncertainty("accel", {}, sensor) == whole


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        (
            {"bias_sd_mgs": 20.0},
            "uncertainty, bias_sd_mgs: unknown key\n  Remedy: did you mean 'bias_sd_mg'?",
        ),
        (
            {"bias_sd_mg": 20.0, "bias_bound_mg": 40.0},
            "uncertainty, bias_bound_mg: it states the same as bias_sd_mg",
        ),
        ({"bias_sd_mg": -1.0}, "bias: "),
        ({"correlation_time_s": 1.0}, "unknown key"),
    ],
)
def test_refused(stated: dict[str, float], message: str) -> None:
    with pytest.raises(ConfigError) as error:
        stated_uncertainty("accel", stated)
    assert message in str(error.value)
