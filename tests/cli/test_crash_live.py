"""`strapdown crash --live` and `--export`: the command itself, its bundle, and what follows."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

from strapdown.crash.watch import CrashLog
from strapdown.errors import ConfigError, DataError
from strapdown.formats.crash_records import read_crash_record
from strapdown.live.crash import CrashReception, recorder_of_case
from strapdown.live.sources import ReceivedLine, open_source
from strapdown.report.crash_live import watch_rows
from strapdown.report.verify import verify

CASE = """
title = "live"
[entry]
kind = "standstill"
[[units]]
name = "recorder"
angles_deg = [0.0, 0.0, 90.0]
angles_sd_deg = 1.0
[[units.accelerometers]]
path = "record.csv"
uncertainty = { full_scale_g = 50.0, bias_sd_mg = 20.0, scale_sd_ppm = 5000 }
"""
GYRO = """
[units.gyro]
path = "record.csv"
uncertainty = { bias_sd_deg_per_s = 1.0 }
"""


def samples():
    """A blow from the front, 36 km/h in 0.1 s, of a recorder whose x points to the right."""
    time = np.arange(1600) / 500
    rows = np.zeros((len(time), 6))
    rows[:, 5] = -9.80665
    pulse = (time >= 2.0) & (time < 2.1)
    # The forward axis of the vehicle is the -y of the recorder.
    rows[pulse, 4] = 50.0 * np.pi * np.sin(np.pi * (time[pulse] - 2.0) / 0.1)
    return np.column_stack([time, rows])


def line(row, kind="imu"):
    return ",".join([kind, *(repr(float(v)) for v in row)])


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE + GYRO)
    return path


def run(case, given, *options):
    """The command in a process of its own, which reads lines until they end."""
    return subprocess.run(
        [sys.executable, "-m", "strapdown", "crash", case.name, *options],
        cwd=case.parent,
        input=given,
        capture_output=True,
        text=True,
        check=False,
    )


def test_from_lines_to_the_bundle_and_to_the_next_case(case):
    rows = samples().tolist()
    given = [line(row) for row in rows]
    given.insert(100, "imu,1,2,3")
    given.insert(200, given[50])
    given += ["command,end", line([99.0] * 7)]
    done = run(case, "\n".join(given) + "\n", "--live", "-", "--out", "out", "--quiet")
    assert (done.returncode, done.stderr) == (0, "")
    found = [json.loads(text) for text in done.stdout.splitlines()]
    # What was written as it came is what a batch over the same rows finds, to the last digit.
    log = watch_rows(recorder_of_case(case), rows, 0.01)
    assert found == json.loads(json.dumps(log.lines))
    assert [found[0]["status"], found[-1]["status"]] == ["trigger", "ended"]
    assert found[-1]["pdof_clock"] == 12
    low, high = found[-1]["delta_v_m_per_s_bound"]
    assert low <= 10.0 <= high
    out = case.parent / "out"
    sealed = json.loads((out / "detections.json").read_text())
    assert sealed["estimates"] == found
    assert (sealed["events"], sealed["samples"], sealed["samples_refused"]) == (1, len(rows), 1)
    latency = json.loads((out / "latency.json").read_text())
    assert (latency["samples"], latency["not_used"]) == (len(rows), {"imu": 1, "time": 1})
    assert latency["processing"]["samples"] == len(rows)
    assert verify(out).verdict == "identical"
    record = read_crash_record(out / "record.csv")
    channel = next(c for c in record.channels if c.name.startswith("ay"))
    np.testing.assert_array_equal(channel.load()[1], np.array(rows)[:, 5])


def test_what_is_printed_is_the_processing_and_not_the_queue_of_a_file(case):
    rows = samples().tolist()
    done = run(case, "\n".join(line(row) for row in rows) + "\n", "--live", "-", "--out", "out")
    told = json.loads((case.parent / "out" / "latency.json").read_text())
    for name in ("median_ms", "largest_ms"):
        assert f"{told['processing'][name]:.3f}" in done.stderr
    assert f"{told['largest_ms']:.3f}" not in done.stderr


def test_without_a_gyro_and_with_datagrams_the_same_lines(case):
    case.write_text(CASE)
    options = recorder_of_case(case)
    written, warned = [], []
    got = CrashReception(CrashLog(options), Clock(), written.append, warned.append)
    for k, row in enumerate(samples()):
        # Rates that come all the same are not looked at.
        text = line(row[[0, 4, 5, 6]], "accel") if k % 2 else line(row)
        assert got.take(ReceivedLine(k, text, 0.0))
    assert json.loads(written[-1])["status"] == "ended"
    assert warned == []
    case.write_text(CASE + GYRO)
    other = CrashReception(CrashLog(recorder_of_case(case)), Clock(), written.append, warned.append)
    assert other.take(ReceivedLine(1, "accel,0.0,1,2,3", 0.0))
    assert other.rows.count == 0
    assert warned[0].data["reason"].code == "live.samples-without-gyro"
    assert other.take(ReceivedLine(2, "accel,0.0,1,2", 0.0))
    assert (got.unused, other.unused) == ({}, {"accel": 2})
    with pytest.raises(ConfigError, check=coded("live.not-a-source")):
        open_source("elsewhere", Clock(), sys.stdin)


class Clock:
    def now(self):
        return 0.0

    def wait_until(self, instant):
        """Never waits."""


def test_the_end_of_the_reader_ends_the_run(case):
    def closed(text):
        raise BrokenPipeError

    got = CrashReception(CrashLog(recorder_of_case(case)), Clock(), closed, print)
    taken = [got.take(ReceivedLine(k, line(row), 0.0)) for k, row in enumerate(samples())]
    assert all(taken[:1000])
    assert not taken[-1]


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (("--live", "-", "--json"), "leave out --json"),
        (("--live", "-", "--export", "a.c"), "leave out --export"),
        (("--every", "1"), "leave out --every"),
        (("case.toml", "--live", "-"), "not 2"),
        (("--export", "a.txt"), "a.txt"),
        (("--live", "-", "--every", "-1"), "--every"),
    ],
)
def test_options_that_do_not_fit_are_refused(case, run_cli, monkeypatch, options, code):
    monkeypatch.chdir(case.parent)
    with Path(os.devnull).open() as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        done = run_cli("crash", case.name, *options)
    assert done.code == 4
    assert code in done.err


def test_the_detection_is_written_as_c(case, run_cli, monkeypatch):
    monkeypatch.chdir(case.parent)
    assert run_cli("crash", case.name, "--export", "crash.c").code == 0
    text = (case.parent / "crash.c").read_text()
    errors = recorder_of_case(case).errors
    assert all(f"R({value!r})" in text for value in errors)
    assert run_cli("crash", case.name, "--export", "crash.c").code == 4, "it is there already"


def calibrated(path, errors, name="recorder"):
    """A result in which a drive determined errors: (quantity, of, axis, value, half-width)."""
    rows = [
        {
            "quantity": quantity,
            "of": of,
            "axis": axis,
            "by_drive": {"value": value, "low": value - half, "high": value + half},
        }
        for quantity, of, axis, value, half in errors
    ]
    answers = [{"recorder": name, "drive": {"errors": rows}}, {"recorder": "mean", "drive": None}]
    path.mkdir()
    (path / "crash.json").write_text(json.dumps({"answers": answers}))
    return path


def test_a_calibration_by_a_drive_is_taken_off(case, tmp_path):
    """Errors that are put into the samples are gone again, and the bound is what the drive left."""
    box, gyro = "recorder accelerometer", "recorder gyro"
    drive = calibrated(
        tmp_path / "drive",
        [
            ("accelerometer_scale_percent", box, "y", 2.0, 0.196),
            ("accelerometer_bias_m_per_s2", box, "x", 0.3, 0.0392),
            ("accelerometer_bias_m_per_s2", box, "y", 0.0, 0.0392),
            ("gyro_bias_deg_per_s", gyro, "z", 1.5, 0.196),
            ("gyro_scale_percent", gyro, "z", -1.0, 0.196),
            ("mounting_deg", "recorder", "z", 3.0, 0.392),
            ("accelerometer_scale_percent", "recorder of another", "y", 50.0, 0.1),
        ],
    )
    text = case.read_text()
    case.write_text(text.replace("5000 }", "5000, nonlinearity_bound_percent = 0.3 }"))
    plain, known = recorder_of_case(case), recorder_of_case(case, drive)
    true = samples()
    true[:, 3] = np.radians(40.0) * (true[:, 0] > 2.0)
    read = true.copy()
    # The unit is turned by 3 deg more about down, and reads its own errors in its own axes.
    c, s = np.cos(np.radians(3.0)), np.sin(np.radians(3.0))
    read[:, 4:6] = true[:, 4:6] @ np.array([[c, -s], [s, c]])
    read[:, 5] *= 1.02
    read[:, 4] += 0.3
    read[:, 3] = 0.99 * true[:, 3] + np.radians(1.5)
    exact, off, back = (
        watch_rows(options, rows.tolist(), 0.01).lines[-1]
        for options, rows in ((plain, true), (plain, read), (known, read))
    )
    for name in ("delta_v_forward_m_per_s", "delta_v_right_m_per_s", "pdof_deg"):
        assert abs(off[name] - exact[name]) > 0.1
        assert back[name] == pytest.approx(exact[name], abs=1e-9)
    # The worse of both axes is the one that the drive left as stated; with the nonlinearity.
    # 3 deg mix in a thousandth of the better one.
    assert known.errors[1] == pytest.approx(np.hypot(0.005, 0.003 / 3**0.5), rel=0.002)
    assert known.errors[4:] == pytest.approx(tuple(np.radians([0.2, 0.1])), rel=1e-3)
    assert known.variance < plain.variance
    both = calibrated(
        tmp_path / "both", [("accelerometer_scale_percent", box, a, 2.0, 0.196) for a in "xy"]
    )
    assert recorder_of_case(case, both).errors[1] == pytest.approx(
        np.hypot(0.001, 0.003 / 3**0.5), rel=0.002
    )
    # Without a nonlinearity nothing says that the scale factor of a drive holds in a crash.
    case.write_text(text)
    assert recorder_of_case(case, both).errors[1] == pytest.approx(0.005)
    assert recorder_of_case(case, both).scale[3:5] == pytest.approx((0.02, 0.02))


def test_what_is_no_calibration_of_the_recorder_is_refused(case, tmp_path, run_cli, monkeypatch):
    other = calibrated(tmp_path / "other", [], name="another")
    with pytest.raises(DataError, check=coded("live.calibration-of-others")):
        recorder_of_case(case, other)
    with pytest.raises(DataError, check=coded("live.no-calibration")):
        recorder_of_case(case, case)
    with pytest.raises(DataError, check=coded("live.no-calibration")):
        recorder_of_case(case, tmp_path / "nowhere")
    monkeypatch.chdir(case.parent)
    done = run_cli("crash", case.name, "--calibration", "other")
    assert (done.code, "--calibration" in done.err) == (4, True)
