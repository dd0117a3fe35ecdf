"""A drive of 57 minutes by the command, as near to the truth as KF-GINS came on the same data.

A recorded RTK track; 200 Hz increments of a tactical unit whose biases and scale factors fade over
hours. Generator, scores and the figures of KF-GINS (C++, 21 states) are those of the measuring
sticks beside the recordings.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
DATA = Path(os.environ.get("STRAPDOWN_DATA", ROOT / "../shared/data")).resolve()
BENCH = DATA.parent / "bench" / "kfgins"
SCORED_FROM = "456600"
#: Within so much of each figure, and half of its last digit.
WITHIN = 1.03
# Seed 1: horizontal and vertical place in m, attitude in deg.
KF_GINS = {
    "pos_rms_H": 0.0084,
    "pos_max_H": 0.0252,
    "pos_rms_V": 0.0108,
    "pos_max_V": 0.0532,
    "roll_rms": 0.00050,
    "pitch_rms": 0.00061,
    "heading_rms": 0.0068,
}
#: Of 45 outages of 60 s the largest horizontal error, m.
OUTAGES = {"median": 0.295, "rms": 0.341, "worst": 0.591}
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


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Folder of the generated drive."""
    pytest.importorskip("pyins")
    pytest.importorskip("scipy")
    if not BENCH.exists():
        pytest.skip(f"no {BENCH}: set STRAPDOWN_DATA to the folder beside the measuring sticks")
    folder = tmp_path_factory.mktemp("kfgins")
    script = [sys.executable, str(BENCH / "generate.py"), "1", str(folder)]
    subprocess.run([*script, str(BENCH / "GNSS-RTK.txt")], check=True, capture_output=True)
    return folder


def written(folder, fixes):
    """Text of a file for a table of fixes."""
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


def scored(folder, out, outages=()):
    """Scores of a run by the script of the measuring stick."""
    more = [word for name in outages for word in ("--outages", str(folder / name))]
    command = [sys.executable, str(BENCH / "evaluate.py"), str(out / "trajectory.nav")]
    command += [str(folder / "truth.nav"), "--start", SCORED_FROM, "--json", *more]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def navigated(folder, fixes):
    """Folder of a run by the command."""
    name = fixes.removesuffix(".txt")
    file, out = folder / f"{name}.toml", folder / name
    file.write_text(written(folder, fixes))
    command = [sys.executable, "-m", "strapdown", "navigate", str(file), "--out", str(out)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return out


@pytest.mark.slow
def test_every_figure_is_that_of_kf_gins_or_better(drive):
    scores = scored(drive, navigated(drive, "GNSS-RTK-sim.txt"))
    for name, theirs in KF_GINS.items():
        # Their figures are rounded to the fourth or the fifth digit.
        half = 5e-6 if name in ("roll_rms", "pitch_rms") else 5e-5
        assert scores[name] <= WITHIN * (theirs + half), name


@pytest.mark.slow
def test_45_outages_cost_no_more(drive):
    largest = []
    for k in ("0", "60", "120"):
        out = navigated(drive, f"GNSS-RTK-sim_outage{k}.txt")
        scores = scored(drive, out, [f"outages{k}.txt"])
        largest += [row[2] for row in scores["outages"]]
        (out / "trajectory.nav").unlink()
    largest = np.array(largest)
    assert len(largest) == 45
    ours = {
        "median": np.median(largest),
        "rms": np.sqrt(np.mean(largest**2)),
        "worst": largest.max(),
    }
    for name, theirs in OUTAGES.items():
        assert ours[name] <= WITHIN * (theirs + 5e-4), (name, ours)
