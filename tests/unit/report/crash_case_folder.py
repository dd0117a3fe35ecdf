"""What a person reads in a simulated case's folder, without the package's own readers."""

from __future__ import annotations

import csv
import math
import tomllib
from dataclasses import replace

import numpy as np
import pandas as pd

from strapdown import CrashOptions, CrashUnit, Entry, Mounting, RecordedTriad, reconstruct_crash
from strapdown.config.crash_case import CaseSpec
from strapdown.sensors.catalogue import KEYS, load_sensor
from strapdown.sensors.uncertainty import SPREADS, uncertainty_of
from strapdown.tables import ACCEL, GYRO


def read_spec(folder):
    return CaseSpec(**tomllib.loads((folder / "case.toml").read_text(encoding="utf-8")))


def reconstruct(folder):
    """The case of a folder, by the function of the library."""
    spec = read_spec(folder)
    entry = None
    if spec.entry.kind == "speed":
        entry = Entry.from_speed(
            spec.entry.speed_m_per_s,
            spec.entry.speed_sd_m_per_s,
            time=spec.entry.time_s,
            heading_deg=spec.entry.heading_deg,
            slip_deg=spec.entry.slip_deg,
            slip_sd_deg=spec.entry.slip_sd_deg,
        )
    return reconstruct_crash(
        [unit(folder, u) for u in spec.units],
        entry,
        CrashOptions(
            point=spec.point.position_m,
            rate=spec.options.rate_hz,
            sampling=spec.options.sampling,
            clock=spec.options.clock,
            gravity=spec.options.gravity_m_per_s2,
        ),
    )


def unit(folder, spec):
    return CrashUnit(
        spec.name,
        tuple(triad(folder, t, "accel") for t in spec.accelerometers),
        None if spec.gyro is None else triad(folder, spec.gyro, "gyro"),
        Mounting(spec.position_m, spec.angles_deg, spec.position_sd_m, spec.angles_sd_deg),
        spec.gyro_from,
        spec.trigger_s,
        spec.trigger_sd_s,
    )


def triad(folder, spec, kind):
    columns = read_columns(folder / spec.path)
    values = np.column_stack([columns[spec.channels[a]] for a in "xyz"])
    if kind == "gyro":
        values = np.radians(values)
    table = pd.DataFrame(
        values,
        index=pd.Index(columns[spec.time], name="time"),
        columns=GYRO if kind == "gyro" else ACCEL,
    )
    table.attrs = {"sampling": spec.sampling, "source": spec.path}
    return RecordedTriad(table, uncertainty(spec, kind), spec.name)


def read_columns(path):
    """Columns of a text table, each number to the double nearest to it."""
    with path.open(encoding="utf-8", newline="") as stream:
        head, *rows = csv.reader(stream)
    numbers = np.array(rows, dtype=np.float64)
    return {name: numbers[:, k] for k, name in enumerate(head)}


def uncertainty(spec, kind):
    """The data sheet's, and what the case has instead."""
    told = uncertainty_of(load_sensor(spec.sensor), kind)
    for name, value in spec.uncertainty.items():
        key = KEYS[kind][name]
        part = math.sqrt(3.0) if key.spread == "bound" else 1.0
        numbers = np.atleast_1d(value) * key.factor / part
        given = tuple(numbers.tolist()) if numbers.size == 3 else float(numbers[0])
        told = replace(told, **{SPREADS.get(key.quantity, key.quantity): given})
    return told
