"""``python -m benchmarks.proposed [WORK …]``: navigation as proposed, beside as tuned and others.

As proposed is what ``strapdown init navigate`` writes, with what it asks the user to fill in: a
lever arm, that the car has wheels, a latitude. As tuned is a run that has the true figures of the
sensors, and the true start to the accuracy that the generator states; the others are the filters
of the measuring sticks beside the recordings, on the same data. Each cell is the root mean square
over the seeds; the ratio is the largest of any of them.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

import strapdown as sd
from benchmarks import kfgins, measure
from strapdown import frames, read_log
from strapdown.alignment.alignment import Site
from strapdown.alignment.inertial_frame import InertialFrame
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.uncertainty import ImuUncertainty

DATA, BENCH = kfgins.DATA, kfgins.BENCH.parent
SEEDS = (1, 2, 3, 4, 5)
#: A proposal costs at most so many times the error of a tuned run.
MOST = 1.5
#: And so many times its processor time, in the median of so many rounds.
TWICE, WITH_INIT, ROUNDS = 2.0, 3.0, 3
#: KF-GINS in C++ with 21 states, seed 1: as the measuring stick states it.
KF_GINS = {"pos_rms_H": 0.0084, "pos_rms_V": 0.0108, "roll_rms": 0.0005, "pitch_rms": 0.00061}
KF_GINS |= {"heading_rms": 0.0068}
#: Recorded car, five instants with wheels that do not slip: largest horizontal error, median, m,
#: as tuned and of python-ins, by the length of the outage, s (``docs/gnss.md``).
CAR = {10: (0.7, 0.7), 30: (8.7, 8.2), 60: (13.0, 10.0)}
#: From the first sample to the first outage, s.
SETTLED = 90.0
WHEELS = re.compile(r"^# (\[aiding\.no_slip\])\n# (kind = .*)\n# (mounting_sd_deg = .*)$", re.M)
DRIVE30 = """[log]
path = "imu.csv"
[sensors]
states = ["gyro_bias", "accel_bias"]
[sensors.gyro]
noise_density_deg_per_sqrt_h = {gyro_noise}
bias_sd_deg_per_h = {gyro_bias}
[sensors.accel]
noise_density_ug_per_sqrt_hz = {accel_noise}
bias_sd_ug = {accel_bias}
[start]
lat_deg = {i[0]}
lon_deg = {i[1]}
alt_m = {i[2]}
v_ned_m_per_s = [{i[3]}, {i[4]}, {i[5]}]
roll_deg = {i[6]}
pitch_deg = {i[7]}
heading_deg = {i[8]}
position_sd_m = {sd[0]}
velocity_sd_m_per_s = {sd[1]}
tilt_sd_deg = {sd[2]}
heading_sd_deg = {sd[3]}
[aiding.gnss]
kind = "gnss"
path = "fixes.csv"
"""


class Row(NamedTuple):
    """One error of one work: of each seed as proposed and as tuned, and of another filter."""

    work: str
    error: str
    proposed: tuple[float, ...]
    tuned: tuple[float, ...]
    other: str

    @property
    def ratio(self) -> float:
        """Largest ratio of the two."""
        pairs = zip(self.proposed, self.tuned, strict=True)
        return max((a / b for a, b in pairs), default=math.nan)


def strapdown(folder: Path, *words: str) -> str:
    """Run the command in a folder; return what it prints."""
    command = [sys.executable, "-m", "strapdown", *words]
    done = subprocess.run(command, cwd=folder, check=False, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)}: {done.stderr}")
    return done.stdout


def propose(folder: Path, *words: str, **filled: str) -> Path:
    """Write the proposed file of a log with its fixes, with keys filled in."""
    strapdown(folder, "init", "navigate", *words, "--out", "proposed.toml", "--force")
    file = folder / "proposed.toml"
    text = file.read_text(encoding="utf-8")
    for key, value in filled.items():
        text, count = re.subn(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.M)
        assert count == 1, key
    file.write_text(text, encoding="utf-8")
    return file


def navigate(folder: Path, name: str, *words: str) -> Path:
    """Navigate by a file of a folder; return the folder of the run."""
    strapdown(folder, "navigate", f"{name}.toml", "--out", name, "--force", *words)
    return folder / name


def drive30(seeds: tuple[int, ...]) -> Iterator[Row]:
    """Half an hour at 100 Hz with positions of 1 m a second, no velocity."""
    scores: dict[str, list[tuple[float, float]]] = {"proposed": [], "tuned": []}
    for seed in seeds:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            script, data = files_of_drive30(folder, seed)
            propose(folder, *LOGS)
            for how, found in scores.items():
                run = navigate(folder, how)
                track = pd.read_csv(run / "trajectory.csv", comment="#")
                place = track[["lat_deg", "lon_deg", "alt_m"]].to_numpy()
                at, heading = track["time_s"].to_numpy(), track["heading_deg"].to_numpy()
                told = script.errors(data, at, place, heading)
                found.append(tuple(float(x) for x in re.findall(r"RMS (\S+)", told)[:2]))
    for k, (what, theirs) in enumerate((("position, m", "0.56"), ("heading, deg", "0.24"))):
        mine, best = (tuple(s[k] for s in scores[how]) for how in scores)
        yield Row("half an hour, 1 m a second", what, mine, best, f"C filter: {theirs}")


#: Log and fixes that `files_of_drive30` writes.
LOGS = ("imu.csv", "fixes.csv")


def files_of_drive30(folder: Path, seed: int = 1) -> tuple[Any, Any]:
    """Write log, fixes and tuned file of a drive; return the script that made it, and its data."""
    spec = importlib.util.spec_from_file_location("drive30", BENCH / "drive30" / "drive30.py")
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.generate(seed, folder)
    data = np.load(folder / "drive30.npz")
    axes = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
    table = pd.DataFrame(data["imu"], columns=axes)
    table.insert(0, "time_s", data["time"])
    table.to_csv(folder / LOGS[0], index=False)
    fixes = pd.DataFrame(data["fix"], columns=["lat_deg", "lon_deg", "alt_m"])
    fixes.insert(0, "time_s", data["fix_time"])
    fixes[["sd_n_m", "sd_e_m", "sd_d_m"]] = 1.0
    fixes.to_csv(folder / LOGS[1], index=False)
    micro_g = 9.80665e-6
    text = DRIVE30.format(
        gyro_noise=60.0 * math.degrees(float(data["gyro_noise"])),
        accel_noise=float(data["accel_noise"]) / micro_g,
        gyro_bias=3600.0 * math.degrees(float(data["gyro_bias_sd"])),
        accel_bias=float(data["accel_bias_sd"]) / micro_g,
        i=data["init"].tolist(),
        sd=data["init_sd"].tolist(),
    )
    (folder / "tuned.toml").write_text(text, encoding="utf-8")
    return script, data


def hour(seeds: tuple[int, ...]) -> Iterator[Row]:
    """57 minutes at 200 Hz with positions of 1 cm a second, no velocity."""
    scores: dict[str, list[dict[str, float]]] = {"proposed": [], "tuned": []}
    for seed in seeds:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            kfgins.generate(folder, seed)
            fixes = "GNSS-RTK-sim.txt"
            arm = json.loads((folder / "init.json").read_text())["lever_frd_m"]
            filled = {"lever_arm_m": json.dumps(arm), "files": '["nav"]'}
            propose(folder, "Leador-A15-sim.txt", fixes, **filled)
            text = kfgins.written(folder, fixes).replace('kind = "full"', 'kind = "interval"')
            (folder / "tuned.toml").write_text(text, encoding="utf-8")
            for how, found in scores.items():
                found.append(evaluate(folder, navigate(folder, how)))
    for key, theirs in KF_GINS.items():
        mine, best = (tuple(s[key] for s in scores[how]) for how in scores)
        kind = key.split("_")
        what = {"H": "horizontal, m", "V": "vertical, m"}.get(kind[-1], f"{kind[0]}, deg")
        yield Row("57 min, 1 cm a second", what, mine, best, f"KF-GINS: {theirs:g}")


def evaluate(folder: Path, run: Path) -> dict[str, float]:
    """Scores by the script of the measuring stick, from five minutes after the start."""
    command = [sys.executable, str(kfgins.BENCH / "evaluate.py"), str(run / "trajectory.nav")]
    command += [str(folder / "truth.nav"), "--start", "456600", "--json"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    scores: dict[str, float] = json.loads(done.stdout)
    return scores


#: Log and fixes of the recorded car.
OF_CAR = tuple(str(DATA / "car_rtk" / f"part1_{n}.csv") for n in ("imu_frd_si", "gnss_rtk"))
#: The same run as tuned: the figures of `benchmarks.car_rtk`, from the first sample on.
CAR_TUNED = """[log]
path = "{log}"
[sensors]
states = ["gyro_bias", "gyro_drift", "accel_bias"]
[sensors.gyro]
noise_density_deg_per_sqrt_h = {gyro_noise}
bias_sd_deg_per_h = 180.0
bias_instability_deg_per_h = [44.0, 440.0, 11.0]
correlation_time_s = 20.0
[sensors.accel]
noise_density_ug_per_sqrt_hz = {accel_noise}
bias_sd_ug = 15000.0
[start]
lat_deg = {lat}
lon_deg = {lon}
alt_m = {alt}
roll_deg = {roll}
pitch_deg = {pitch}
heading_deg = 0.0
position_sd_m = 1.0
tilt_sd_deg = 4.0
heading_sd_deg = 10.0
[aiding.gnss]
kind = "gnss"
path = "{fixes}"
lever_arm_m = [0.0, -0.05, 0.0]
time_offset_s = -0.135
time_offset_sd_s = 0.1
time_offset_drift_s_per_sqrt_s = 1e-3
velocity_delay_s = 0.125
least_position_sd_m = 0.03
least_velocity_sd_m_per_s = 0.05
"""


def files_of_car(folder: Path) -> None:
    """Write the tuned file of the recorded car."""
    from benchmarks.car_rtk import recording

    made = recording(DATA / "car_rtk")
    gyro, accel = np.split(made.noise, 2)
    lat, lon, alt = made.fixes[0, 1:4].tolist()
    text = CAR_TUNED.format(
        log=OF_CAR[0],
        fixes=OF_CAR[1],
        gyro_noise=(60.0 * np.degrees(gyro)).tolist(),
        accel_noise=(accel / 9.80665e-6).tolist(),
        lat=lat,
        lon=lon,
        alt=alt,
        roll=made.roll,
        pitch=made.pitch,
    )
    (folder / "tuned.toml").write_text(text, encoding="utf-8")


def times() -> Iterator[measure.Row]:
    """Processor time as proposed over that as tuned, with and without `init`, for `make bench`."""
    works = (
        ("half an hour, 1 m a second", files_of_drive30, LOGS),
        ("recorded car", files_of_car, OF_CAR),
    )
    for what, files, logs in works:
        if lacking := kfgins.missing():
            yield measure.Row(f"{what}, as proposed", against="as tuned", missing=lacking)
            continue
        spent: dict[str, list[float]] = {"init": [], "proposed": [], "tuned": []}
        with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
            folder = Path(name)
            files(folder)
            init = ("init", "navigate", *logs, "--out", "proposed.toml", "--force")
            for number in range(ROUNDS + 1):
                new = {"init": measure.strapdown(*init, folder=folder)}
                for how in ("proposed", "tuned"):
                    words = ("navigate", f"{how}.toml", "--out", how, "--force", "-q")
                    new[how] = measure.strapdown(*words, folder=folder)
                if number:
                    for how, used in new.items():
                        spent[how].append(used.seconds)
        ours, tuned = tuple(spent["proposed"]), tuple(spent["tuned"])
        yield measure.Row(f"{what}, as proposed", ours, "as tuned", tuned, "s", TWICE)
        both = tuple(a + b for a, b in zip(spent["init"], ours, strict=True))
        yield measure.Row(
            f"{what}, proposed and its init", both, "as tuned", tuned, "s", TWICE, WITH_INIT
        )


def car(seeds: tuple[int, ...]) -> Iterator[Row]:
    """Ten outages of a recorded car with wheels that do not slip."""
    del seeds
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = propose(folder, *OF_CAR)
        text, count = WHEELS.subn(r"\1\n\2\n\3", file.read_text(encoding="utf-8"))
        assert count == 1
        begin = float(np.loadtxt(OF_CAR[0], delimiter=",", max_rows=1)[0]) + SETTLED
        told = f"[withhold]\nlengths_s = {[float(k) for k in CAR]}\nfrom_s = {begin}\n"
        file.write_text(f"{text}\n{told}places = 5\n", encoding="utf-8")
        run = navigate(folder, "proposed")
        outages = json.loads((run / "navigation.json").read_text())["gnss_outage_tests"]
    for length, (tuned, theirs) in CAR.items():
        own = [one for one in outages if round(one["to_s"] - one["from_s"]) == length]
        errors, bounds = (
            [one[key] for one in own] for key in ("largest_horizontal_error_m", "bound_95_m")
        )
        what = f"{length} s without fixes, m (95 % bound {np.median(bounds):.2g})"
        error = (float(np.median(errors)),)
        yield Row("recorded car, wheels", what, error, (tuned,), f"python-ins: {theirs:g}")


def phone(seeds: tuple[int, ...]) -> Iterator[Row]:
    """A phone on a motorway, 60 s, against the pose of its camera and receiver."""
    del seeds
    log = DATA / "phone_comma2k19"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        propose(folder, str(log))
        run = navigate(folder, "proposed")
        track = pd.read_csv(run / "trajectory.csv", comment="#")
    fixes = sd.read(log)["gnss"]
    time = np.load(log / "global_pose__frame_times.npy")
    pose = frames.geodetic_from_ecef(np.load(log / "global_pose__frame_positions.npy"))
    off = []
    for at, place in (
        (track["time_s"].to_numpy(), track[["lat_deg", "lon_deg", "alt_m"]].to_numpy()),
        (fixes.index.to_numpy(), fixes[["lat", "lon", "alt"]].to_numpy()),
    ):
        seen = (time > at[0]) & (time < at[-1])
        here = np.column_stack([np.interp(time[seen], at, column) for column in place.T])
        pairs = zip(here, pose[seen], strict=True)
        apart = np.array([frames.place_difference(a[None], b)[0, :2] for a, b in pairs])
        off.append(float(np.sqrt(np.mean(np.square(apart).sum(axis=1)))))
    yield Row("phone, motorway", "horizontal, m", (off[0],), (), f"fixes alone: {off[1]:.3g}")


def foot(seeds: tuple[int, ...]) -> Iterator[Row]:
    """A unit on a shoe over 62 control points; no value is fitted, so proposed is tuned."""
    del seeds
    log = DATA / "foot" / "SensorConnectData_32_LLIO.mat"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = propose(folder, str(log), "--foot", lat_deg="41.0")
        points = f"\n[control_points]\npath = '{log}'\n"
        file.write_text(file.read_text(encoding="utf-8") + points, encoding="utf-8")
        for what, words in (("filter", ()), ("smoothed", ("--smooth",))):
            run = navigate(folder, "proposed", *words)
            told = json.loads((run / "navigation.json").read_text())["control_points"]
            error = (float(told["rms_m"]),)
            yield Row("walk, unit on a shoe", f"control points, {what}, m", error, (), "")


def ring_laser(seeds: tuple[int, ...]) -> Iterator[Row]:
    """A parked vehicle: heading after 900 s, against the alignment of the whole record."""
    del seeds
    log = DATA / "rlg_static" / "part1_first900s.imu"
    off = {}
    site = Site(34.246048, 108.909664, 380.0)
    sensors = ImuUncertainty.of_sensor(load_sensor("hg9900"))
    known = InertialFrame("end").align(read_log(log).imu, site, sensors).roll_pitch_heading[2]
    for how, words in (("proposed", ()), ("tuned", ("--sensor", "hg9900"))):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            propose(folder, str(log), *words)
            track = pd.read_csv(navigate(folder, "proposed") / "trajectory.csv", comment="#")
        off[how] = abs(float(track["heading_deg"].iloc[-1]) - known)
    yield Row("ring lasers, parked", "heading, deg", (off["proposed"],), (off["tuned"],), "")


WORKS: dict[str, Callable[[tuple[int, ...]], Iterator[Row]]] = {
    "drive30": drive30,
    "kfgins": hour,
    "car_rtk": car,
    "comma2k19": phone,
    "foot": foot,
    "rlg": ring_laser,
}


def table(rows: Iterator[Row]) -> str:
    """Rows as a table of the manual."""

    def cell(values: tuple[float, ...]) -> str:
        size = math.sqrt(sum(x * x for x in values) / len(values)) if values else math.nan
        return f"{size:.3g}" if values else "–"

    out = ["| | error | as proposed | as tuned | ratio | others |", "|---|---|---|---|---|---|"]
    for one in rows:
        ratio = f"{one.ratio:.2f}" if one.tuned else "–"
        cells = (one.work, one.error, cell(one.proposed), cell(one.tuned), ratio, one.other)
        out.append(f"| {' | '.join(cells)} |")
    return "\n".join(out)


def main() -> None:
    """Print the table of some works, or of all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("work", nargs="*", choices=[*WORKS, []], help="default: all")
    parser.add_argument("--seeds", default=",".join(map(str, SEEDS)))
    given = parser.parse_args()
    seeds = tuple(int(s) for s in given.seeds.split(","))
    print(table(row for name in given.work or WORKS for row in WORKS[name](seeds)))


if __name__ == "__main__":
    main()
