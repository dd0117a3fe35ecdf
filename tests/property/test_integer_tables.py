"""Tables of whole numbers: read as they say, or refused; never by a reader of another format.

A seeded generator writes what microcontrollers print: raw counts and milli-units under usual names,
or under none, with pauses in the stamps, constant columns, small ranges and further columns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import strapdown as sd
from strapdown.errors import StrapdownError
from strapdown.formats import read_raw, reader_of
from strapdown.units import ACCEL_UNITS, GYRO_UNITS, factor_of

SEEDS = [*range(30), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(30, 120))]
TICKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
QUANTITIES = ["time", *(f"{triad}_{axis}" for triad in ("accel", "gyro") for axis in "xyz")]
#: Names of time, with what a step counts in s.
TIMES = [
    ("t_us", 1e-6),
    ("time_ms", 1e-3),
    ("time", 1e-3),
    ("millis", 1e-3),
    ("timestamp", 1e-6),
    ("timestamp_ns", 1e-9),
    ("Time [ms]", 1e-3),
]
#: Names of specific force and of rate by axis, their units, and whether the names state these.
STYLES = [
    ("a{}_mg", "g{}_mdps", "mg", "mdeg/s", True),
    ("accel_{}_mg", "gyro_{}_mdps", "mg", "mdeg/s", True),
    ("a{}", "g{}", "g/16384", "deg/s/131", False),
    ("acc_{}", "gyr_{}", "g/8192", "deg/s/32.8", False),
    ("AcX AcY AcZ", "GyX GyY GyZ", "g/16384", "deg/s/131", False),
    ("a{}", "w{}", "mg", "mdeg/s", False),
]
MORE = ["count", "temp", "mode", "id", "sensor", "state", "flag"]


@dataclass(frozen=True)
class Table:
    """A table as written, and what its numbers are."""

    text: str
    ending: str
    time: np.ndarray  # (n,) s
    accel: np.ndarray  # (n, 3) m/s²
    gyro: np.ndarray  # (n, 3) rad/s
    units: dict[str, str]
    columns: dict[str, str]
    header: bool
    stated: bool


def table(seed: int) -> Table:
    """Write the table of a seed."""
    rng = np.random.default_rng([20, seed])
    n = int(rng.integers(60, 400))
    accels, gyros, accel_unit, gyro_unit, stated = STYLES[rng.integers(len(STYLES))]
    per_accel = factor_of(accel_unit, ACCEL_UNITS)
    per_gyro = factor_of(gyro_unit, GYRO_UNITS)
    name, tick = TIMES[rng.integers(len(TIMES))]
    step = float(rng.choice([0.004, 0.01, 0.02, 0.05]))
    seconds = step * np.arange(1, n + 1)
    for _ in range(rng.integers(0, 3)):
        seconds[rng.integers(5, n - 5) :] += rng.choice([1.5, 4.0, 30.0])
    stamps = np.rint(seconds / tick).astype(np.int64)
    level = rng.permutation([9.80665, 0.0, 0.0]) * rng.choice([-1, 1], 3)
    swing = float(rng.choice([0.0, 0.02, 0.3]))
    phase = 2 * np.pi * seconds[:, None] / 3.0 + rng.uniform(0, 6, 3)
    accel = np.rint((level + swing * np.sin(phase)) / per_accel + rng.normal(0, 2, (n, 3)))
    turn = float(rng.choice([0.0, 0.01, 0.5])) * np.sin(phase + 1)
    gyro = np.rint(turn / per_gyro + rng.integers(-6, 7, 3) + rng.normal(0, 1.2, (n, 3)))
    if rng.random() < 0.3:  # a dead axis, or one of small range
        dead = rng.integers(3)
        gyro[:, dead] = rng.choice([0, 1, 2, 3, 4])
    if rng.random() < 0.3:  # small whole numbers that may be taken for kinds
        accel[:, rng.integers(3)] = rng.choice([1, 2, 4, 9, 10, 16], n)
    names = [accels.format(a) for a in "xyz"] if "{}" in accels else accels.split()
    turns = [gyros.format(a) for a in "xyz"] if "{}" in gyros else gyros.split()
    groups = [(names, accel), (turns, gyro)]
    if rng.random() < 0.4:
        groups = groups[::-1]
    columns = {n_: v for held, block in groups for n_, v in zip(held, block.T, strict=True)}
    cells = {name: stamps, **columns}
    for more in rng.choice(MORE, rng.integers(0, 3), replace=False):
        values = {
            "count": np.arange(n),
            "temp": np.full(n, rng.integers(1, 40)),
            "mode": rng.choice([1, 4], n),
            "id": np.full(n, rng.choice([1, 3, 4])),
            "sensor": rng.choice([1, 2, 4], n),
            "state": np.full(n, 4),
            "flag": rng.integers(0, 2, n),
        }[str(more)]
        place = rng.integers(0, 3)
        items = list(cells.items())
        items.insert([0, 1, len(items)][place], (str(more), values))
        cells = dict(items)
    separator = "," if " " in name else str(rng.choice([",", ";", "\t", " ", ", "]))
    header = bool(rng.random() < 0.75)
    lines = [separator.join(cells)] if header else []
    block = np.column_stack([v.astype(np.int64) for v in cells.values()])
    lines += [separator.join(map(str, row)) for row in block.tolist()]
    return Table(
        "\n".join(lines) + "\n",
        str(rng.choice([".csv", ".txt", ".log", ".dat"])),
        (stamps - stamps[0]) * tick,
        accel * per_accel,
        gyro * per_gyro,
        {"accel": accel_unit, "gyro": gyro_unit, "time": {v: k for k, v in TICKS.items()}[tick]},
        {
            q: str(list(cells).index(n_) + 1)
            for q, n_ in zip(QUANTITIES, [name, *names, *turns], strict=True)
        },
        header,
        stated,
    )


def _differs(imu, wrote: Table) -> list[str]:
    """List what a reading has otherwise than the table."""
    if len(imu) != len(wrote.time):
        return [f"{len(imu)} rows of {len(wrote.time)}"]
    time = imu.index.to_numpy() - imu.index[0]
    out = [] if np.allclose(time, wrote.time, atol=1e-6) else ["time"]
    for triad, true in (("gyro", wrote.gyro), ("accel", wrote.accel)):
        names = [f"{triad}_{a}" for a in "xyz"]
        read = imu[names].to_numpy() if names[0] in imu.columns else None
        if read is None and any("accel" in f"{f.code} {f.quantity}" for f in imu.findings):
            continue
        if read is None or not np.allclose(read, true, rtol=1e-6, atol=1e-9):
            out.append(triad)
    if any(name.startswith("mag_") for name in imu.columns):
        out.append("a magnetometer")
    return out


@pytest.mark.parametrize("seed", SEEDS)
def test_a_table_of_whole_numbers_is_read_as_it_says_or_refused(seed, tmp_path):
    wrote = table(seed)
    path = tmp_path / f"log{wrote.ending}"
    path.write_text(wrote.text)
    # Fixes of KF-GINS have seven numbers a row, too; inertial sensors in them are a text table.
    assert reader_of(path)[0] in ({"csv"} if wrote.header else {"csv", "kf-gins-fixes"})
    assert len(next(iter(read_raw(path).columns.values()))) == len(wrote.time)
    columns = None if wrote.header else wrote.columns
    # All that a person knows of the log is stated, then less and less.
    ways = [
        {"units": wrote.units, "columns": columns},
        {"units": {"time": wrote.units["time"]}, "columns": columns},
        {"columns": columns},
        {},
    ]
    for given in ways:
        try:
            imu = sd.read_imu(path, **given)
        except StrapdownError as error:
            assert given != ways[0], error
            continue
        assert not _differs(imu, wrote), given
