"""Trial of the heading light: simulated drives with truth, sound and with faults.

    python benchmarks/heading_light.py [SEEDS [SCENARIO ...]]

For each scenario: seconds by light and by whether the heading was within what green promises.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.aiding.heading import Heading
from strapdown.config.choice import make_choice
from strapdown.config.navigation import NavigationSpec
from strapdown.config.navigation_checks import given_of, uncertainty_of
from strapdown.config.navigation_file import navigation_spec
from strapdown.config.slots import SLOTS
from strapdown.evaluation.heading_light import COLOURS
from strapdown.navigation.navigator import with_states
from strapdown.systems.progress import silent
from strapdown.systems.sins.build import make_chain
from strapdown.systems.sins.chain import Chain
from strapdown.systems.sins.drive import run_batch
from strapdown.systems.sins.source import NavigationSource, read_navigation_source
from strapdown.systems.sins.trust import trust_of
from strapdown.tables import ACCEL, GYRO, POSITION_SD, VELOCITY_SD

LIMIT = 3.0
KNOWN = 1.0  # deg, stated of the heading at the start
SENSORS = ("adis16495-1", "adis16470", "stim300", "hg1700")


@dataclass
class Case:
    """A drive that is about to be run; a fault changes it."""

    table: dict[str, object]
    rng: np.random.Generator
    heading_error: float
    imu: Callable[[pd.DataFrame], pd.DataFrame] = lambda imu: imu
    tables: Callable[[dict[str, pd.DataFrame]], dict[str, pd.DataFrame]] = lambda t: t
    chain: Callable[[Chain], Chain] = lambda c: c
    truth_turned: float = 0.0
    extra: Callable[[pd.DataFrame], dict[str, pd.DataFrame]] = lambda truth: {}


def drive(rng: np.random.Generator) -> list[dict[str, object]]:
    """Some four minutes of straights, bends, stops, in an order of their own."""
    out: list[dict[str, object]] = [
        {"do": "straight", "duration_s": float(rng.uniform(5.0, 40.0))},
    ]
    for _ in range(6):
        kind = rng.integers(5)
        radius = float(rng.uniform(30.0, 120.0))
        if kind == 0:
            angle = float(rng.uniform(30.0, 120.0))
            out.append({"do": "turn_left", "angle_deg": angle, "radius_m": radius})
        elif kind == 1:
            angle = float(rng.uniform(30.0, 120.0))
            out.append({"do": "turn_right", "angle_deg": angle, "radius_m": radius})
        elif kind == 2:
            speed = float(rng.uniform(7.0, 20.0))
            out.append({"do": "accelerate", "to_m_per_s": speed, "duration_s": 8.0})
        out.append({"do": "straight", "duration_s": float(rng.uniform(10.0, 50.0))})
    return out


def nominal(seed: int) -> Case:
    rng = np.random.default_rng([seed, 77])
    heading = float(rng.uniform(0.0, 360.0))
    table: dict[str, object] = {
        "simulation": {
            "rate_hz": 50.0,
            "seed": seed,
            "motion": {
                "kind": "car",
                "lat_deg": 55.75,
                "lon_deg": 37.62,
                "alt_m": 150.0,
                "heading_deg": heading,
                "speed_m_per_s": float(rng.uniform(8.0, 16.0)),
                "manoeuvres": drive(rng),
            },
            "gnss": {
                "rtk": {
                    "rate_hz": 1.0,
                    "position_noise_m": float(rng.choice([0.03, 0.5, 1.5])),
                    "velocity_noise_m_per_s": float(rng.choice([0.03, 0.1])),
                }
            },
        },
        "sensors": {"sensor": str(rng.choice(SENSORS))},
        "aiding": {"rtk": {"kind": "gnss"}},
        "coarse": {"kind": "none"},
        "fine": {"kind": "none"},
        "trust": {"repeat": False, "heading_limit_deg": LIMIT},
    }
    return Case(table, rng, float(KNOWN * rng.standard_normal()))


def wrong_heading(seed: int) -> Case:
    case = nominal(seed)
    case.heading_error = float(case.rng.choice([-1.0, 1.0]) * case.rng.uniform(4.0, 15.0))
    return case


def no_manoeuvre(seed: int) -> Case:
    case = wrong_heading(seed)
    case.table["simulation"]["motion"]["manoeuvres"] = [{"do": "straight", "duration_s": 200.0}]
    return case


def outliers(seed: int) -> Case:
    case = nominal(seed)
    case.table["simulation"]["gnss"]["rtk"]["outlier_share"] = 0.1
    case.table["simulation"]["gnss"]["rtk"]["outlier_size"] = float(case.rng.uniform(10.0, 60.0))
    if seed % 2:
        case.table["aiding"]["rtk"]["update_rule"] = {
            "kind": "adaptive",
            "influence": "igg3",
            "scale": {"lowest": 1.0},
        }
    return case


def biased_sensor(seed: int) -> Case:
    """Gyros and accelerometers off by ten times what is stated."""
    case = nominal(seed)
    sensors = uncertainty_of(navigation_spec(started(case)))
    gyro = 10.0 * np.asarray(sensors.gyro.axis("bias")) * case.rng.standard_normal(3)
    accel = 5.0 * np.asarray(sensors.accel.axis("bias")) * case.rng.standard_normal(3)

    def imu(table: pd.DataFrame) -> pd.DataFrame:
        table = table.copy()
        table[GYRO] += gyro
        table[ACCEL] += accel
        return table

    case.imu = imu
    return case


def noise_times_three(seed: int) -> Case:
    case = nominal(seed)

    def tables(told: dict[str, pd.DataFrame]) -> dict[str, pd.DataFrame]:
        table = told["rtk"].copy()
        table[[*POSITION_SD, *VELOCITY_SD]] /= 3.0
        return {**told, "rtk": table}

    case.tables = tables
    return case


def gnss_drift(seed: int) -> Case:
    """Errors of places that last a minute, which nobody told."""
    case = nominal(seed)
    case.table["simulation"]["gnss"]["rtk"]["position_drift_m"] = 1.5
    return case


def offset_heading(seed: int) -> Case:
    """Two antennas whose heading is off by degrees, and stated to half of one."""
    case = nominal(seed)
    offset = float(case.rng.choice([-1.0, 1.0]) * case.rng.uniform(4.0, 15.0))

    def extra(truth: pd.DataFrame) -> dict[str, pd.DataFrame]:
        rows = truth.iloc[:: max(1, round(1.0 / float(np.median(np.diff(truth.index)))))]
        heading = rows["heading"].to_numpy() + offset + 0.5 * case.rng.standard_normal(len(rows))
        out = pd.DataFrame(
            {"heading": heading % 360.0, "heading_sd": np.full(len(rows), 0.5)}, index=rows.index
        )
        return {"antennas": out}

    case.extra = extra
    case.chain = with_aid(Heading(name="antennas"))
    return case


def wrong_mounting(seed: int) -> Case:
    """A unit that is turned in its vehicle, whose constraint says that it is not."""
    case = nominal(seed)
    turned = float(case.rng.choice([-1.0, 1.0]) * case.rng.uniform(4.0, 12.0))
    C = rotation.dcm_from_euler([0.0, 0.0, -turned])

    def imu(table: pd.DataFrame) -> pd.DataFrame:
        table = table.copy()
        for axes in (GYRO, ACCEL):
            table[axes] = table[axes].to_numpy() @ C.T
        return table

    case.imu, case.truth_turned = imu, turned
    case.table["aiding"]["wheels"] = {"kind": "no_slip"}
    return case


def with_aid(aid: Heading) -> Callable[[Chain], Chain]:
    def added(chain: Chain) -> Chain:
        navigator = chain.navigator
        aids = (*navigator.aids, aid)
        return replace(
            chain,
            navigator=replace(navigator, aids=aids, filter=with_states(navigator.filter, (aid,))),
        )

    return added


def started(case: Case) -> dict[str, object]:
    motion = case.table["simulation"]["motion"]
    heading = motion["heading_deg"]
    speed = motion["speed_m_per_s"]
    return {
        **case.table,
        "start": {
            "lat_deg": motion["lat_deg"],
            "lon_deg": motion["lon_deg"],
            "alt_m": motion["alt_m"],
            "v_ned_m_per_s": [
                speed * float(np.cos(np.radians(heading))),
                speed * float(np.sin(np.radians(heading))),
                0.0,
            ],
            "roll_deg": 0.0,
            "pitch_deg": 0.0,
            "heading_deg": (heading + case.heading_error) % 360.0,
            "position_sd_m": 1.0,
            "velocity_sd_m_per_s": 0.1,
            "tilt_sd_deg": 0.5,
            "heading_sd_deg": KNOWN,
        },
    }


def run(case: Case) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Light, error of the heading in deg, and bound of the run, second by second."""
    spec: NavigationSpec = navigation_spec(started(case))
    source: NavigationSource = read_navigation_source(spec)
    sensors = uncertainty_of(spec)
    imu = case.imu(source.imu)
    imu.attrs = dict(source.imu.attrs)
    tables = case.tables(dict(source.tables))
    for name, table in tables.items():
        table.attrs = dict(source.tables[name].attrs)
    tables |= case.extra(source.truth)
    chain = case.chain(make_chain(spec, sensors))
    recorder = make_choice(spec.recorder, SLOTS["recorder"], given_of(spec))
    record = run_batch(chain, imu, tables, recorder).record
    light = trust_of(spec, chain, sensors, imu, tables, record, silent).light.table
    time = light.index.to_numpy()
    own = np.interp(
        time, record.trajectory.index, np.unwrap(np.radians(record.trajectory["heading"]))
    )
    true = np.interp(time, source.truth.index, np.unwrap(np.radians(source.truth["heading"])))
    error = rotation.within_half_turn(np.degrees(own - true) - case.truth_turned)
    return light["light"].to_numpy(), error, light["bound"].to_numpy()


SCENARIOS: dict[str, Callable[[int], Case]] = {
    "as stated": nominal,
    "wrong start heading": wrong_heading,
    "wrong start, no manoeuvre": no_manoeuvre,
    "outliers": outliers,
    "sensors 5 to 10 times": biased_sensor,
    "fixes 3 times noisier": noise_times_three,
    "fixes that wander": gnss_drift,
    "heading aid offset": offset_heading,
    "wrong mounting": wrong_mounting,
}


def main(seeds: int, names: list[str]) -> None:
    print(
        "scenario | drives | seconds | green | amber | red | good that are green | false green |"
        " wrong that the bound believes | wrong: green amber red"
    )
    total = np.zeros((3, 2), dtype=int)
    for name in names or SCENARIOS:
        table, believed, drives = np.zeros((3, 2), dtype=int), 0, set()
        failed = 0
        for seed in range(seeds):
            try:
                light, error, bound = run(SCENARIOS[name](seed))
            except Exception as error_:  # a drive that the run refuses has no light
                failed += 1
                print("  ", name, seed, type(error_).__name__, error_)
                continue
            wrong = np.abs(error) > LIMIT
            for colour in range(3):
                for bad in range(2):
                    table[colour, bad] += int(((light == colour) & (wrong == bool(bad))).sum())
            believed += int((wrong & (bound <= LIMIT)).sum())
            if ((light == 0) & wrong).any():
                drives.add(seed)
        total += table
        row(name, seeds - failed, table, believed)
        if drives:
            print("   false green in drives", sorted(drives))
    row("all", 0, total, 0)


def row(name: str, drives: int, table: np.ndarray, believed: int) -> None:
    seconds = table.sum()
    share = table.sum(axis=1) / max(seconds, 1)
    good = table[0, 0] / max(table[:, 0].sum(), 1)
    false = table[0, 1] / max(table[0].sum(), 1)
    print(
        f"{name} | {drives} | {seconds} | {share[0]:.1%} | {share[1]:.1%} | {share[2]:.1%}"
        f" | {good:.1%} | {false:.2%} | {believed / max(seconds, 1):.1%}"
        f" | within {table[:, 0].tolist()} beyond {table[:, 1].tolist()}",
        flush=True,
    )
    assert len(COLOURS) == 3


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20, sys.argv[2:])
