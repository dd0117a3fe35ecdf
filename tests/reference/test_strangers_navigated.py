"""Logs of strangers, navigated as proposed, against the solution that the vendor wrote beside."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from strapdown.ellipsoids import WGS84

pytestmark = pytest.mark.slow

#: 95 % of the length of an error of two equal normal components, in their standard deviation.
RADIUS_95 = np.sqrt(-2.0 * np.log(0.05))


def navigated(run_cli, folder, log, *flags, **answers):
    """Trajectory and its standard deviations, as proposed; `answers` fill what is asked."""
    case, out = folder / "n.toml", folder / "n"
    assert run_cli("init", "navigate", str(log), *flags, "--out", str(case)).code == 0
    text = case.read_text(encoding="utf-8")
    for key, value in answers.items():
        text, count = re.subn(rf'^{key} = "\?"', f"{key} = {value}", text, flags=re.M)
        assert count == 1, key
    case.write_text(text, encoding="utf-8")
    done = run_cli("navigate", str(case), "--out", str(out))
    assert done.code == 0, done.err
    track, sd = (pd.read_csv(out / f"{n}.csv", comment="#") for n in ("trajectory", "sd"))
    at = track["time_s"]
    return track, pd.DataFrame({n: np.interp(at, sd["time_s"], sd[n]) for n in sd})


def down(track):
    """Down in body axes by roll and pitch."""
    roll, pitch = np.radians(track["roll_deg"]), np.radians(track["pitch_deg"])
    return np.column_stack(
        [-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)]
    )


def apart(track, time, vertical):
    """Angle in deg between down and that of the vendor ((n, 3), at `time`), interpolated."""
    its = np.column_stack([np.interp(track["time_s"], time, v) for v in vertical.T])
    its /= np.linalg.norm(its, axis=1)[:, None]
    return np.degrees(
        np.arctan2(
            np.linalg.norm(np.cross(down(track), its), axis=1), (down(track) * its).sum(axis=1)
        )
    )


def within_its_bound(angle, sd):
    spread = np.sqrt(0.5 * (sd["roll_sd_deg"] ** 2 + sd["pitch_sd_deg"] ** 2))
    return angle < RADIUS_95 * spread


def test_a_px4_log_against_ekf2(recordings, run_cli, tmp_path):
    """6.5 s at rest; EKF2's roll and pitch, read by pyulog. Heading is EKF2's: nothing shows it."""
    pyulog = pytest.importorskip("pyulog")
    path = recordings("zoo") / "px4_ulg" / "sample_log_small.ulg"
    track, sd = navigated(run_cli, tmp_path, path, heading_deg=14.0, sd_deg=5.0)
    data = next(d.data for d in pyulog.ULog(str(path)).data_list if d.name == "vehicle_attitude")
    q = Rotation.from_quat(np.column_stack([data[f"q[{k}]"] for k in (1, 2, 3, 0)]))
    angle = apart(track, data["timestamp"] * 1e-6, q.inv().apply([0.0, 0.0, 1.0]))
    # Two filters of one sensor at rest: they differ by what each makes of the biases of the
    # accelerometers; 0.08 deg at most here, and 1.4 mg is the noise of the means over a second.
    assert angle.max() < 0.2
    assert within_its_bound(angle, sd).all()
    assert np.ptp(track["lat_deg"]) * 111e3 < 2.0  # the copter is on its pad


def test_an_ardupilot_log_against_its_ekf(recordings, run_cli, tmp_path):
    """A second of a take-off roll with 45 samples: within the wide bound of such a levelling."""
    mavutil = pytest.importorskip("pymavlink.mavutil")
    path = recordings("zoo") / "ardupilot" / "test.BIN"
    track, sd = navigated(
        run_cli,
        tmp_path,
        path,
        "--gnss-datum-height",
        "0",
        sensor='"consumer-grade"',
        heading_deg=337.1,
        sd_deg=5.0,
    )
    log, rows = mavutil.mavlink_connection(str(path)), []
    while (message := log.recv_match(type="ATT")) is not None:
        rows.append((message.TimeUS * 1e-6, message.Yaw, message.Pitch, message.Roll))
    log.close()
    time, *euler = np.array(rows).T
    q = Rotation.from_euler("ZYX", np.transpose(euler), degrees=True)
    angle = apart(track, time, q.inv().apply([0.0, 0.0, 1.0]))
    assert within_its_bound(angle, sd).all()


def test_an_opal_against_its_own_orientation(recordings, run_cli, tmp_path):
    """8 s of the APDM Opal at rest, z up; its quaternion turns sensor axes to a frame with z up."""
    path = recordings("zoo") / "apdm" / "imuData01.csv"
    track, sd = navigated(
        run_cli, tmp_path, path, lat_deg=0.0, lon_deg=0.0, heading_deg=0.0, sd_deg=5.0
    )
    table = pd.read_csv(path, skiprows=2, index_col=False)
    table = table[pd.to_numeric(table["Time"], errors="coerce").notna()].astype(float)
    names = [f"Static/Orientation/{n}" for n in ("X", "Y", "Z", "Scalar")]
    up = Rotation.from_quat(table[names].to_numpy()).inv().apply([0.0, 0.0, 1.0])
    angle = apart(track, table["Time"].to_numpy(), -up)
    assert within_its_bound(angle, sd).all()
    assert angle.max() < 0.5


def test_gnss_ins_sim_against_its_truth(recordings, run_cli, tmp_path):
    """At latitude, longitude, height, speed, roll and pitch of zero.

    Its heading is no truth of these samples: it stays zero, and the gyro turns by 359.8 deg.
    """
    path = recordings("zoo") / "gnss_ins_sim"
    track, sd = navigated(
        run_cli, tmp_path, path, lat_deg=0.0, lon_deg=0.0, heading_deg=0.0, sd_deg=5.0
    )
    truth = [
        np.loadtxt(path / f"{name}.csv", delimiter=",", skiprows=1)
        for name in ("ref_pos", "ref_vel", "ref_att_euler")
    ]
    assert not any(np.any(values) for values in truth)
    errors = {
        "north_sd_m": np.radians(track["lat_deg"]) * WGS84.semi_major_axis,
        "east_sd_m": np.radians(track["lon_deg"]) * WGS84.semi_major_axis,
        "down_sd_m": -track["alt_m"],
        **{f"{v}_sd_m_s": track[f"{v}_m_s"] for v in ("VN", "VE", "VD")},
        **{f"{a}_sd_deg": track[f"{a}_deg"] for a in ("roll", "pitch")},
    }
    for name, error in errors.items():
        assert (np.abs(error) < 1.96 * sd[name]).all(), name


def test_the_ahrs_of_a_husky_levels_what_is_read(recordings):
    """Rates at 30 Hz of a robot that shakes: navigation says itself that its heading is rejected.

    So what is compared is what was read: the unit's own attitude (ROS REP 103, z up) turns the
    specific force as read into gravity, upward.
    """
    rosbags = pytest.importorskip("rosbags.highlevel")
    import strapdown as sd

    path = recordings("zoo") / "rosbag1_loc" / "test1.bag"
    imu = sd.read_imu(path, axes="x,y,z")
    with rosbags.AnyReader([path]) as bag:
        topics = [c for c in bag.connections if c.topic == "/imu/data"]
        q = [bag.deserialize(raw, c.msgtype).orientation for c, _, raw in bag.messages(topics)]
    attitude = Rotation.from_quat([(o.x, o.y, o.z, o.w) for o in q])
    force = attitude.apply(imu[["accel_x", "accel_y", "accel_z"]].to_numpy(copy=True)).mean(axis=0)
    assert len(imu) == len(q)
    # The unit takes accelerations of its motion for gravity over minutes only: 0.1 deg is 17 mm/s2.
    assert np.abs(force[:2]).max() < 0.017
    assert force[2] == pytest.approx(9.80, abs=0.05)
