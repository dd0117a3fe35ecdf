"""One drive with truth, run and judged, for the trial of the heading status."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec, make_filter
from strapdown.frames import place_difference
from strapdown.navigation.integrity import QUANTITIES, IntegrityReport, assess_integrity
from strapdown.navigation.measurements.heading import Heading
from strapdown.navigation.navigator import with_states
from strapdown.navigation.pipeline import NavigationPipeline
from strapdown.navigation.record import NavigationRecord
from strapdown.navigation.replay import run_batch
from strapdown.progress import silent
from strapdown.systems.navigation_run import make_chain
from strapdown.systems.navigation_source import NavigationSource, read_navigation_source
from strapdown.tables import GEODETIC, VELOCITY

LIMIT = 3.0
KNOWN = 1.0  # deg, stated of the heading at the start


@dataclass
class Case:
    """A drive that is about to be run; a fault changes it.

    One that aligns itself has a table of its site, and no state at its start.
    """

    table: dict[str, object]
    rng: np.random.Generator
    heading_error: float
    imu: Callable[[pd.DataFrame], pd.DataFrame] = lambda imu: imu
    tables: Callable[[dict[str, pd.DataFrame]], dict[str, pd.DataFrame]] = lambda t: t
    chain: Callable[[NavigationPipeline], NavigationPipeline] = lambda c: c
    truth_turned: float = 0.0
    extra: Callable[[pd.DataFrame], dict[str, pd.DataFrame]] = lambda truth: {}
    aligns: bool = False


def with_aid(aid: Heading) -> Callable[[NavigationPipeline], NavigationPipeline]:
    def added(chain: NavigationPipeline) -> NavigationPipeline:
        navigator = chain.navigator
        aids = (*navigator.aids, aid)
        return replace(
            chain,
            navigator=replace(navigator, aids=aids, filter=with_states(navigator.filter, (aid,))),
        )

    return added


def add_antennas(case: Case, offset: float, name: str = "antennas") -> None:
    """Two antennas once a second, off by some degrees and stated to half of one."""
    before, told = case.chain, case.extra

    def extra(truth: pd.DataFrame) -> dict[str, pd.DataFrame]:
        rows = truth.iloc[:: max(1, round(1.0 / float(np.median(np.diff(truth.index)))))]
        heading = rows["heading"].to_numpy() + offset + 0.5 * case.rng.standard_normal(len(rows))
        out = pd.DataFrame(
            {"heading": heading % 360.0, "heading_sd": np.full(len(rows), 0.5)}, index=rows.index
        )
        return {**told(truth), name: out}

    case.extra = extra
    case.chain = lambda chain: with_aid(Heading(name=name))(before(chain))


def started(case: Case) -> dict[str, object]:
    if case.aligns:
        return case.table
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


@dataclass
class Judged:
    """Status, and whether the error is beyond what trusted promises, of each second of a run.

    `bound`: of the heading, deg. `others`: status and errors beyond, by the name of a quantity.
    """

    light: np.ndarray
    wrong: np.ndarray
    bound: np.ndarray
    others: dict[str, tuple[np.ndarray, np.ndarray]]


#: Innovations of a trusted quantity scatter at most twice as much as predicted; and the 99 % points
#: of chi-square of one and of two components.
TWICE, SURE = 2.0, {1: 6.635, 2: 9.210}


def others(
    record: NavigationRecord, report: IntegrityReport, truth: pd.DataFrame
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Status of position and velocity, and errors beyond twice their bound of 99 %."""
    rows = record.trajectory
    kept = truth.iloc[np.searchsorted(truth.index, rows.index - 1e-6).clip(0, len(truth) - 1)]
    off = pd.DataFrame(
        np.column_stack(
            [
                place_difference(rows[GEODETIC].to_numpy(), kept[GEODETIC].to_numpy()),
                rows[VELOCITY].to_numpy() - kept[VELOCITY].to_numpy(),
            ]
        ),
        index=rows.index,
        columns=["north", "east", "down", *VELOCITY],
    )
    out = {}
    for one in report.quantities:
        columns = QUANTITIES[one.name][1]
        time = one.table.index.to_numpy()
        square = np.zeros(len(time))
        for column in columns:
            error = np.interp(time, off.index, off[column])
            square += np.square(error / np.interp(time, record.sd.index, record.sd[column]))
        out[one.name] = (one.table["status"].to_numpy(), square > TWICE**2 * SURE[len(columns)])
    return out


def run(case: Case) -> Judged:
    """Navigate and judge, second by second."""
    spec: NavigationSpec = NavigationSpec.checked(started(case))
    source: NavigationSource = read_navigation_source(spec)
    sensors = sensors_of(spec)
    imu = case.imu(source.imu)
    imu.attrs = dict(source.imu.attrs)
    tables = case.tables(dict(source.tables))
    for name, table in tables.items():
        table.attrs = dict(source.tables[name].attrs)
    tables |= case.extra(source.truth)
    chain = case.chain(make_chain(spec, sensors))
    recorder = spec.recorder.make(ellipsoid=spec.ellipsoid)
    ran = run_batch(chain, imu, tables, recorder)
    record = ran.record
    limits = (spec.trust.heading_limit_deg, spec.trust.heading_red_deg)
    filter_ = make_filter(spec, sensors)
    report = assess_integrity(chain, filter_, imu, tables, ran, limits, spec.trust.repeat, silent)
    status = report.heading.table
    time = status.index.to_numpy()
    own = np.interp(
        time, record.trajectory.index, np.unwrap(np.radians(record.trajectory["heading"]))
    )
    true = np.interp(time, source.truth.index, np.unwrap(np.radians(source.truth["heading"])))
    error = rotation.within_half_turn(np.degrees(own - true) - case.truth_turned)
    return Judged(
        status["status"].to_numpy(),
        np.abs(error) > LIMIT,
        status["bound"].to_numpy(),
        others(record, report, source.truth),
    )
