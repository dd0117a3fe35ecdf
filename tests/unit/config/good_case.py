"""A case that can be read, and ways to change its file."""

from __future__ import annotations

from pathlib import Path

from strapdown.config.crash_case import CaseSpec

TEXT = """\
title = "Impact on a pole"
number = "2016-07"
author = "A. Investigator"

[vehicle]
mass_kg = 1300
length_m = 4.2
width_m = 1.7
front_m = 2.0

[point]
name = "center of mass"
position_m = [0.0, 0.0, 0.0]

[entry]
kind = "speed"
speed_km_per_h = 25.2
speed_sd_km_per_h = 0.36
source = "speed trap"

[[units]]
name = "IMU1"
position_mm = [600, -500, 200]
position_sd_m = 0.01
angles_deg = [0, 0, 0]
angles_sd_deg = 1.0
trigger_s = 6.9
trigger_sd_ms = 1.4

[[units.accelerometers]]
name = "low-g"
path = "imu1.csv"
channels = { x = "ax", y = "ay", z = "-az" }
unit = "g"
uncertainty = { full_scale_g = 8, bias_sd_mg = 20 }

[[units.accelerometers]]
name = "high-g"
path = "imu1.csv"
channels = { x = "hx", y = "hy", z = "hz" }
unit = "g"
uncertainty = { full_scale_g = [100, 50, 50], bias_sd_mg = 700 }

[units.gyro]
path = "imu1.csv"
channels = { x = "gx", y = "gy", z = "gz" }
unit = "deg/s"
sensor = "mpu-6050"

[[units]]
name = "IMU2"
position_m = [-1.2, 0.4, 0.1]
position_sd_m = 0.02
trigger_s = 0
gyro_from = "IMU1"

[[units.accelerometers]]
path = "imu2.csv"
channels = { x = 1, y = 2, z = 3 }
sensor = "lis302dlh"

[[references]]
kind = "path"
name = "cameras"
path = "cameras.csv"

[[references]]
kind = "delta_v"
name = "barrier"
delta_v_km_per_h = -26
over_ms = [0, 115]

[options]
window_s = [-0.1, 0.75]
severity = ["wang_2022_front_mais3"]
"""
FILES = ("imu1.csv", "imu2.csv", "cameras.csv")


def write(folder: Path, *changes: tuple[str, str], text: str = TEXT) -> Path:
    """The case in a folder, with pieces of it replaced once."""
    for name in FILES:
        (folder / name).write_text("")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "case.toml"
    path.write_text(text, encoding="utf-8")
    return path


def read(folder: Path, *changes: tuple[str, str]) -> CaseSpec:
    return CaseSpec.read(write(folder, *changes))
