"""Every file of strangers by the command that a person would type, as the manual's table says.

`make strangers` writes docs/strangers.md anew; read the difference before you commit it.
"""

from __future__ import annotations

import os
import re
import shlex

import numpy as np
import pytest
from tests.recorded import ROOT

from strapdown.errors import Finding

PAGE = ROOT / "docs" / "strangers.md"
HEAD = """# Files from other programs

41 files of loggers, phones, receivers, simulators and data sets, from public repositories (MIT,
BSD, Apache-2.0). `make strangers` runs the command for each and compares it with this page. For
your own file run `strapdown doctor FILE`, and see [formats](formats.md).

Given as *log*: `strapdown init navigate FILE`; *gyro*: `strapdown attitude FILE`; *fixes*:
`strapdown doctor FILE`; *beside*: `strapdown init navigate LOG --gnss FILE`. *Asked* OPTION:
refused once; the proposed command, with this option, runs. A code alone: refused, because the file
lacks what the command needs or is of another format; [messages](messages.md) has the remedy.

"""
#: Under the table: tests/reference/test_strangers_navigated.py holds these numbers.
TAIL = """
## Against the solutions in the files

Logs navigated as proposed. A heading that the log does not show is taken from its solution.

| file | solution | result |
|---|---|---|
| `px4_ulg` | EKF2 of PX4, 6.5 s on the pad | down within 0.08° (stated: 5.8°, 95 %) |
| `apdm` | orientation of the Opal, 8 s at rest | down within 0.20° (stated: 5.8°) |
| `gnss_ins_sim` | its truth, 10 s | position, velocity, roll, pitch within 95 % bounds ¹ |
| `ardupilot` | EKF of ArduPilot, 45 samples in motion | down 2.8° off (stated: 6.0°) |
| `rosbag1_loc` | orientation of its AHRS | specific force up within 0.1° ² |

¹ Its heading contradicts its gyro, as `doctor` reports.
² Navigated at 30 Hz, roll and pitch are off by 2.6° RMS (stated: 0.9°, 95 %), and the run rejects
its heading 91 % of the time.
"""
#: What a person knows of his file: a log, a gyro alone, fixes, a trajectory, attitudes.
LOG = "init navigate {}"
GYRO = "attitude {} --algorithms quaternion"
FIXES = "doctor {}"
BESIDE = "init navigate LOG --gnss {}"
GIVEN_AS = {LOG: "log", GYRO: "gyro", FIXES: "fixes", BESIDE: "beside"}
COMMANDS = {
    "apdm/imuData01.csv": LOG,
    "ardupilot/test.BIN": LOG,
    "bennyhui": GYRO,
    "bennyhui/Accelerometer.csv": LOG,
    "bennyhui/Gyroscope.csv": GYRO,
    "betaflight/error-recovery.bbl": LOG,
    "dji/p4_rtk.SRT": FIXES,
    "garmin_fit/garmin-edge-820-bike.fit": FIXES,
    "garmin_fit/garmin-fr935-cr.fit": FIXES,
    "gnss_ins_sim": LOG,
    "gnss_ins_sim/gyro-0.csv": LOG,
    "gnsslogger/pixel6.txt": LOG,
    "gnsslogger_raw/pseudoranges_log_2016_06_30_21_26_07.txt": FIXES,
    "gopro/hero7.raw": LOG,
    "gopro/merged.json": LOG,
    "gpx/around-visnjan-with-car.gpx": FIXES,
    "gsdc/Pixel4_ground_truth.csv": FIXES,
    "gsdc/device_gnss.csv": FIXES,
    "gsdc/gnss_log.txt": LOG,
    "gtsam/KittiGps_converted.txt": BESIDE,
    "gtsam/imuAndGPSdata.csv": LOG,
    "gtsam/quadraped_imu_data.csv": LOG,
    "matlab_mobile/imu_orientation.csv": LOG,
    "nmea/MTV.Local1.SPAN.20200206-181434.gga": FIXES,
    "novatel_span/ins2.bag": GYRO,
    "novatel_span/ins2.gps": LOG,
    "openimu/z1.raw": LOG,
    "px4_ulg/sample_log_small.ulg": LOG,
    "pyins/gnss.csv": FIXES,
    "rosbag1_loc/test1.bag": LOG,
    "rtklib_pos/geonet_F5.pos": FIXES,
    "rtklib_pos/rtklib_rtk_result.pos": FIXES,
    "sbet/2-points.sbet": LOG,
    "sbf/sbfdata.log": FIXES,
    "sensorlogger_dr": LOG,
    "sensorlogger_dr/Gyroscope.csv": GYRO,
    "sensorlogger_dr/Location.csv": FIXES,
    "smartloc/tu_chemnitz_berlin_1_raw.csv": FIXES,
    "ubx/pygpsdata-SF-calibration.log": FIXES,
    "xio/short_walk.csv": LOG,
    "xsens_mtw/MT_012005D6_009-001_00B421ED.txt": LOG,
}


@pytest.fixture
def coded_findings(monkeypatch):
    """Put the code of a finding before its text, for which logic has no other way out."""
    whole = Finding.text

    def text(self, words="python"):
        return f"<{self.code}> {whole(self, words)}"

    monkeypatch.setattr(Finding, "text", text)


@pytest.fixture
def stationary_log(tmp_path):
    """Twenty seconds at rest: the LOG of files that have none."""
    rng = np.random.default_rng(8)
    time = np.arange(0.0, 20.0, 0.01)
    values = np.hstack(
        [rng.normal(0.0, 1e-3, (time.size, 3)), rng.normal((0, 0, -9.8), 1e-2, (time.size, 3))]
    )
    names = [f"gyro_{a}_rad_s" for a in "xyz"] + [f"accel_{a}_m_s2" for a in "xyz"]
    head = ",".join(["time_s", *names])
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([time, values]), delimiter=",", header=head, comments="")
    return path


def read_of(out):
    """Samples with their rate, and fixes, as the command says what it found."""
    log = re.search(r"^  (?!log\.csv)\S+: (\d+) samples, .* s, (.* Hz)$", out, re.M)
    fixes = re.search(r": \d+ of (\d+) fixes within the log$|^ gnss +(\d+) ", out, re.M)
    parts = [f"{log[1]} samples, {log[2]}"] if log else []
    return "; ".join(parts + ([f"{fixes[1] or fixes[2]} fixes"] if fixes else []))


def result_of(run_cli, words):
    """How often a command was refused; what the last refusal said, or None; and what was read."""
    for refusals in range(2):
        done = run_cli(*words)
        assert "Traceback" not in done.err
        if done.code == 0:
            return refusals, None, read_of(done.out)
        assert done.code in (3, 4), done.err
        proposed = re.search(r"As inferred: strapdown (.*)", done.err)
        if proposed is None or refusals:
            return refusals, done.err, ""
        words = shlex.split(proposed[1])
    raise AssertionError(done.err)


def row_of(name, command, refusals, said, flags, read):
    if said is None:
        result = [f"asked `{flags}`"] if refusals else []
        result += [read] if read else []
        return f"| `{name}` | {GIVEN_AS[command]} | {'; '.join(result) or 'read'} |\n"
    code = re.search(r"<([a-z-]+\.[a-z0-9-]+)>", said)[1]
    lines = [line.strip() for line in said.splitlines() if "As inferred" not in line]
    assert len(". ".join(lines)) < 700, "a message that nobody reads to its end"
    return f"| `{name}` | {GIVEN_AS[command]} | `{code}` |\n"


@pytest.mark.slow
def test_the_table_of_the_manual(recordings, run_cli, tmp_path, coded_findings, stationary_log):
    zoo = recordings("zoo")
    rows, counts = [], {}
    for number, (name, command) in enumerate(COMMANDS.items()):
        words = [
            str(stationary_log) if w == "LOG" else w.format(str(zoo / name))
            for w in command.split()
        ]
        out = tmp_path / f"{number}.toml" if command.startswith("init") else tmp_path / f"{number}"
        asked = [*words, "--out", str(out)]
        refusals, said, read = result_of(run_cli, asked)
        flags = ""
        if refusals and said is None:
            first = run_cli(*asked[:-2], "--out", str(tmp_path / "again.toml")).err
            proposed = re.search(r"As inferred: strapdown (.*)", first)[1]
            flags = shlex.join(shlex.split(proposed)[len(asked) :])
        row = row_of(name, command, refusals, said, flags, read)
        result = "refused" if said else "after one refusal" if refusals else "at once"
        counts[result] = counts.get(result, 0) + 1
        rows.append(row)
    total = ", ".join(f"{count} {result}" for result, count in sorted(counts.items()))
    page = f"{HEAD}Of {len(rows)} commands: {total}.\n\n"
    page += "| file | as | result |\n|---|---|---|\n" + "".join(rows) + TAIL
    if os.environ.get("STRAPDOWN_WRITE_STRANGERS"):
        PAGE.write_text(page, encoding="utf-8")
    assert page == PAGE.read_text(encoding="utf-8"), "run `make strangers`, read the difference"
