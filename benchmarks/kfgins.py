"""A drive of 57 min with 200 Hz increments and a fix a second, and its configuration.

The recorded RTK track and the generator are those of the measuring sticks beside the recordings.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

DATA = Path(os.environ.get("STRAPDOWN_DATA", Path(__file__).parents[2] / "shared/data")).resolve()
BENCH = DATA.parent / "bench" / "kfgins"
FILE = """[log]
path = "{folder}/Leador-A15-sim.txt"
from_s = {begin}
[sensors]
states = ["gyro_bias", "accel_bias", "gyro_scale", "accel_scale"]
[sensors.gyro]
noise_density_deg_per_sqrt_h = {gyro_noise}
bias_sd_deg_per_h = {gyro_bias}
scale_sd_ppm = {scale}
[sensors.accel]
noise_density_m_per_s_per_sqrt_h = {accel_noise}
bias_sd_ug = {accel_bias}
scale_sd_ppm = {scale}
[states]
gyro_bias = {{ correlation_time_s = {time} }}
accel_bias = {{ correlation_time_s = {time} }}
gyro_scale = {{ correlation_time_s = {time} }}
accel_scale = {{ correlation_time_s = {time} }}
[start]
lat_deg = {lla[0]}
lon_deg = {lla[1]}
alt_m = {lla[2]}
v_ned_m_per_s = {v_ned}
roll_deg = {rph_deg[0]}
pitch_deg = {rph_deg[1]}
heading_deg = {rph_deg[2]}
position_sd_m = {position_sd}
velocity_sd_m_per_s = {velocity_sd}
tilt_sd_deg = {attitude_sd[0]}
heading_sd_deg = {attitude_sd[2]}
[recorder]
kind = "full"
[aiding.gnss]
kind = "gnss"
path = "{folder}/{fixes}"
lever_arm_m = {arm}
[output]
files = ["nav"]
"""


def missing() -> str:
    """What is missing to generate the drive, in words; empty where nothing is."""
    if not BENCH.exists():
        return f"no {BENCH}: set STRAPDOWN_DATA to the folder beside the measuring sticks"
    try:
        import pyins  # noqa: F401
    except ImportError:
        return "python-ins is not installed (the extra 'test')"
    return ""


def generate(folder: Path, seed: int = 1) -> None:
    """Write the drive of a seed into a folder."""
    script = [sys.executable, str(BENCH / "generate.py"), str(seed), str(folder)]
    subprocess.run([*script, str(BENCH / "GNSS-RTK.txt")], check=True, capture_output=True)


def written(folder: Path, fixes: str) -> str:
    """Text of the file of a run with a table of fixes."""
    told = json.loads((folder / "init.json").read_text())
    sd = told["init_sd"]
    return FILE.format(
        folder=folder.as_posix(),
        fixes=fixes,
        # The sample whose interval ends there is the first.
        begin=told["start"] - 0.0049,
        gyro_noise=told["arw_deg_sqrt_h"],
        accel_noise=told["vrw_m_s_sqrt_h"],
        gyro_bias=told["gyro_bias_deg_h"],
        accel_bias=told["accel_bias_mgal"] * 1e-5 / 9.80665e-6,
        scale=told["scale_ppm"],
        time=told["corr_time_h"] * 3600.0,
        lla=told["lla"],
        v_ned=told["v_ned"],
        rph_deg=told["rph_deg"],
        position_sd=sd["pos_m"],
        velocity_sd=sd["vel_m_s"],
        attitude_sd=sd["rph_deg"],
        arm=told["lever_frd_m"],
    )
