"""Which wrong statement explains a contradicted run: hypotheses side by side, by likelihood."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from strapdown.errors import Finding, StrapdownError
from strapdown.navigation.integrity import (
    GAIN_EACH,
    LEAST_GAIN,
    MOST,
    likelihood_gain,
    rejected_percent,
)
from strapdown.navigation.measurements.gnss import LARGEST_OFFSET, Gnss
from strapdown.navigation.modes import KnownStart, Navigation
from strapdown.navigation.navigator import with_aids
from strapdown.navigation.pipeline import NavigationPipeline, with_aid
from strapdown.navigation.record import NavigationRecord, innovation_labels, state_of_row
from strapdown.navigation.recorder import IntervalRecorder
from strapdown.navigation.replay import run_batch
from strapdown.progress import Progress
from strapdown.tables import ACCEL, GNSS, GYRO, POSITION_SD, TRAJECTORY, VELOCITY_SD, usable
from strapdown.tables.checks import Array, index_of, source_of, values_of, view_of

#: Standard deviations of a lever arm, m, and of a clock, s, that nobody knows.
ARM, CLOCK = 3.0, 1.0
#: Factor on the standard deviations of fixes that are at fault.
FAULT = 30.0
#: Factors on the standard deviations of all fixes of a receiver.
NOISIER = (1.5, 10.0)
#: A time offset, s, over which a run is repeated about it, to compare fixes and motion anew; and by
#: how many standard deviations a clock has stepped.
CONTINUED, STEPPED = 0.05, 5.0
#: A longer record is tested by its part around the worst stretch, s; of which so much is before it.
LONGEST, PART, BEFORE = 360.0, 300.0, 0.6
#: Of many more fixes than these, hypotheses are tested with some, evenly: that takes less time.
FIXES = 360
#: Standard deviations at the begin of that part: position, m, velocity, m/s, tilt and heading, deg.
BEGIN_SD = 10.0, 1.0, 5.0, 20.0
#: Part of the misfit of the run that an explanation leaves at most, and part of the components that
#: two runs must have in common. Axes that are turned about the vertical are tested without one.
LEAVES, COMMON = 0.5, 0.5
#: Hypotheses that are listed after the best.
NEXT = 2
#: Digits of stamps, s, by which epochs of two runs are those of one fix.
DIGITS = 6

#: Findings by which no bound of the run holds, and all of which one is named.
REFUTING = (
    "navigation.blame-lever-arm",
    "navigation.blame-axes",
    "navigation.blame-gyros",
    "navigation.blame-clock",
    "navigation.blame-clock-step",
)
BLAMES = (
    *REFUTING,
    "navigation.blame-noise",
    "navigation.blame-stretch",
    "navigation.sensor-contradicted",
)

_I = np.eye(3)
#: Axes forward, right, down of gyros and accelerometers by those that are taken to be these.
_RIGHT, _DOWN = np.diag([1.0, -1.0, 1.0]), np.diag([1.0, 1.0, -1.0])
_QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
TRIADS: dict[str, tuple[Array, Array]] = {
    "a mirrored triad": (_RIGHT, _RIGHT),
    "a reversed vertical gyro": (_DOWN, _I),
    "reversed gyros": (-_I, _I),
}
TURNED: dict[str, tuple[Array, Array]] = {
    "axes turned by 90°": (_QUARTER, _QUARTER),
    "axes turned by 180°": (_QUARTER @ _QUARTER,) * 2,
    "axes turned by −90°": (_QUARTER.T, _QUARTER.T),
}


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A pipeline with one statement changed.

    Attributes
    ----------
    name : str
        As it is listed.
    code : str
        Of the finding that names it.
    parameters : int
        Numbers that it has free.
    tables : mapping of str to DataFrame
        Its measurements.
    turned : tuple of ndarray or None
        Matrices of its gyros and accelerometers.
    data : mapping
        Of its finding.
    """

    name: str
    code: str
    chain: NavigationPipeline
    parameters: int
    tables: Mapping[str, pd.DataFrame]
    turned: tuple[Array, Array] | None = None
    data: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Tested:
    """A hypothesis and how it explains the measurements.

    Attributes
    ----------
    gain : float
        In the logarithm of the likelihood over the run, less half the logarithm of the number of
        components for each free number (Schwarz, Annals of Statistics 6 (1978) 461).
    count : int
        Number of components compared.
    left : float
        Misfit of its run (`misfit`).
    """

    hypothesis: Hypothesis
    gain: float
    count: int
    record: NavigationRecord
    left: float


def blame(
    asked: NavigationPipeline,
    chain: NavigationPipeline,
    coarser: Sequence[tuple[str, NavigationPipeline]],
    named: str | None,
    imu: pd.DataFrame,
    tables: Mapping[str, pd.DataFrame],
    record: NavigationRecord,
    progress: Progress,
) -> tuple[Finding, ...]:
    """Name what explains a contradicted run best, with its evidence.

    The run is repeated with one statement changed at a time: lever arm, clock, axes, grade of the
    sensors, noise of the receiver, a stretch at fault. Each is compared with the run by the
    likelihood of the innovations of the same fixes, rejected ones included. A long record is
    tested by a part, and fast fixes by some of them.

    Parameters
    ----------
    asked, chain : NavigationPipeline
        As specified, and as it ran at last, with what its repetitions found.
    coarser : sequence of (str, NavigationPipeline)
        As specified, with coarser grades of sensors by their names, the best first.
    named : str or None
        Sensor that is specified.
    imu : DataFrame
        Imu table.
    tables : mapping of str to DataFrame
        By name of the measurement.
    record : NavigationRecord
        Of the filter of `chain`.
    progress : callable
        Called with a stage and its completed share.

    Returns
    -------
    tuple of Finding
        One; none where no hypothesis explains the measurements much better than the run, or where
        these are not so far from it that one could.
    """
    if not contradicted(record):
        return ()
    stretch = _worst(record, chain)
    bench = whole = _Bench(asked, chain, imu, tables, record, progress)
    if float(imu.index[-1] - imu.index[0]) > LONGEST:
        bench = bench.part(stretch)
    begin, end = float(bench.imu.index[0]), float(bench.imu.index[-1])
    thinned = {name: _thinned(table, begin, end) for name, table in tables.items()}
    if any(len(table) < len(tables[name]) for name, table in thinned.items()):
        bench = replace(bench, tables=thinned)
    if bench is not whole:
        try:
            record = bench.run(bench.chain, bench.tables, None, "as it is", 0.0)
            bench = replace(bench, record=record)
        except StrapdownError:
            return ()
    tested: list[Tested] = []
    aid = _receiver(chain, tables)
    hypotheses = [] if aid is None else _of_receiver(bench, aid, stretch, tables[aid.name])
    for k, one in enumerate(hypotheses):
        tested += bench.test(one, k / (len(hypotheses) + 1))
    for grade, other in coarser:
        tested += bench.test(_of_grade(bench, named, grade, other), 1.0)
    allowed = LEAVES * misfit(bench.record)
    if aid is not None and not any(one.left < allowed for one in tested):
        for name, matrices in TURNED.items():
            tested += bench.test(_of_axes(bench, name, matrices), 1.0)
    # One that leaves most of it explains nothing, though it may do so better than the run.
    tested.sort(key=lambda one: (one.left >= allowed, -one.gain))
    if not tested or tested[0].left >= allowed or tested[0].gain < _enough(tested[0].count):
        return ()
    return (_named(tested, bench, aid),)


def contradicted(record: NavigationRecord) -> bool:
    """Whether fixes are so far from a run that an explanation could be much better.

    Of what one leaves half at most, half is to be enough.
    """
    return misfit(record) >= _enough(_count(record)) / LEAVES


def misfit(record: NavigationRecord) -> float:
    """Return by how much innovations are larger than predicted, in the logarithm of likelihood.

    Of observations that scatter less than predicted nothing is subtracted. It is what a better
    explanation could gain at most without smaller bounds.
    """
    found = 0.0
    for table in record.innovations.values():
        size = _squares(table)
        found += max(0.5 * float(np.sum(size - 1.0, where=np.isfinite(size))), 0.0)
    return found


@dataclass(frozen=True, eq=False)
class _Bench:
    """What all hypotheses have in common."""

    asked: NavigationPipeline
    chain: NavigationPipeline
    imu: pd.DataFrame
    tables: Mapping[str, pd.DataFrame]
    record: NavigationRecord
    progress: Progress

    def part(self, stretch: tuple[float, float] | None) -> _Bench:
        """Return the same over the part of a record around a stretch, from a state of the run."""
        time = index_of(self.record.trajectory)
        middle = 0.5 * sum(stretch) if stretch is not None else float(time[-1])
        row = int(time.searchsorted(min(middle - BEFORE * PART, float(time[-1]) - PART)))
        begin = float(time[row])
        within = (self.imu.index >= begin - 1e-6) & (self.imu.index <= begin + PART)
        imu = self.imu[within]
        imu.attrs = dict(self.imu.attrs)
        place, speed, tilt, heading = BEGIN_SD
        start = KnownStart(
            state_of_row(view_of(self.record.trajectory, TRAJECTORY)[row]),
            position_sd=(place,) * 3,
            velocity_sd=(speed,) * 3,
            attitude_sd_deg=(tilt, tilt, heading),
            at_first_sample=True,
        )

        def begun(chain: NavigationPipeline) -> NavigationPipeline:
            return replace(chain, modes=(Navigation(),), start=start, commands=(), drift=None)

        return replace(self, asked=begun(self.asked), chain=begun(self.chain), imu=imu)

    def run(
        self,
        chain: NavigationPipeline,
        tables: Mapping[str, pd.DataFrame],
        turned: tuple[Array, Array] | None,
        name: str,
        share: float,
    ) -> NavigationRecord:
        """Run the filter alone."""
        imu = self.imu
        if turned is not None:
            imu = imu.copy()
            imu.attrs = dict(self.imu.attrs)
            for columns, matrix in zip((GYRO, ACCEL), turned, strict=True):
                imu[columns] = values_of(self.imu, columns) @ matrix.T
        bare = replace(chain, navigator=replace(chain.navigator, smoother=None))
        own = self.chain
        return run_batch(
            replace(bare, start=own.start, modes=own.modes, commands=own.commands),
            imu,
            tables,
            IntervalRecorder(rate_hz=1.0),
            lambda *_: self.progress(f"testing what is wrong: {name}", share),
            chunk=60.0,
        ).record

    def test(self, one: Hypothesis, share: float) -> list[Tested]:
        """Compare a hypothesis with the run; nothing where it cannot be run."""
        try:
            record = self.run(one.chain, one.tables, one.turned, one.name, share)
            if one.code == "navigation.blame-clock":
                one, record = self._about_offset(one, record, share)
        except StrapdownError:
            return []
        own, its = (
            by_stamp(x.innovations, c) for x, c in ((self.record, self.chain), (record, one.chain))
        )
        gain, count = likelihood_gain(own, its)
        if count < COMMON * _count(self.record):
            return []
        gain -= 0.5 * one.parameters * math.log(count)
        return [Tested(one, gain, count, record, misfit(record))]

    def _about_offset(
        self, one: Hypothesis, record: NavigationRecord, share: float
    ) -> tuple[Hypothesis, NavigationRecord]:
        """Run once more about a large offset, of the clock before it stepped."""
        aid = next(x for x in one.chain.navigator.aids if x.name == one.data["name"])
        assert isinstance(aid, Gnss)
        error = record.sensors[f"{aid.name}.time_offset_t"]
        first = error[error.index < one.data.get("since", math.inf)]
        if not len(first) or abs(float(first.iloc[-1])) < CONTINUED:
            return one, record
        aid = replace(aid, time_offset=aid.time_offset - float(first.iloc[-1]))
        one = replace(one, chain=with_aid(one.chain, aid))
        return one, self.run(one.chain, one.tables, None, one.name, share)


def _of_receiver(
    bench: _Bench, aid: Gnss, stretch: tuple[float, float] | None, fixes: pd.DataFrame
) -> list[Hypothesis]:
    """Hypotheses about a receiver: what it states, its `fixes`, and axes beside its motion."""
    tables, table = bench.tables, bench.tables[aid.name]
    named = {"name": aid.name}
    clock = replace(aid, time_offset_sd=max(CLOCK, aid.time_offset_sd))
    stepped: dict[str, Any] = dict(named)
    if stretch is not None and stretch[0] > float(bench.record.trajectory.index[0]) + 1.0:
        stepped["since"] = stretch[0]
        unsure = (*aid.clock_unsure, (stretch[0] + aid.time_offset, CLOCK))
        clock = replace(clock, clock_unsure=unsure)
    arm = replace(_as_asked(bench, aid), lever_arm_sd=ARM)
    size = np.concatenate([_squares(t).ravel() for t in _of_aid(bench.record, aid)])
    factor = float(np.clip(math.sqrt(np.nanmean(size)), *NOISIER)) if len(size) else NOISIER[0]
    noisier = replace(
        aid,
        position_sd_factor=factor * aid.position_sd_factor,
        velocity_sd_factor=factor * aid.velocity_sd_factor,
    )
    out = [
        Hypothesis(
            "lever arm",
            "navigation.blame-lever-arm",
            with_aid(bench.asked, arm),
            3,
            tables,
            data=named,
        ),
        Hypothesis(
            "clock",
            "navigation.blame-clock",
            with_aid(bench.chain, clock),
            len(stepped),
            tables,
            data=stepped,
        ),
        *(_of_axes(bench, name, matrices) for name, matrices in TRIADS.items()),
        Hypothesis(
            "noise of the receiver",
            "navigation.blame-noise",
            with_aid(bench.chain, noisier),
            1,
            tables,
            data={**named, "factor": factor},
        ),
    ]
    if stretch is None:
        return out
    rows, within = (
        (stamps >= stretch[0] - 1e-3) & (stamps <= stretch[1] + 1e-3)
        for stamps in (index_of(of) - aid.time_offset for of in (fixes, table))
    )
    doubted = table.copy()
    doubted.attrs = dict(table.attrs)
    doubted.loc[within, [*POSITION_SD, *VELOCITY_SD]] *= FAULT
    data = {**named, "since": stretch[0], "until": stretch[1], "rows": int(rows.sum())}
    told = {**tables, aid.name: doubted}
    name = "a stretch of fixes"
    return [*out, Hypothesis(name, "navigation.blame-stretch", bench.chain, 3, told, data=data)]


def _as_asked(bench: _Bench, aid: Gnss) -> Gnss:
    """Return a receiver as specified, with a clock that may be what the run took it for, or not."""
    own = bench.asked.navigator.by_name[aid.name]
    assert isinstance(own, Gnss)
    found = abs(aid.time_offset - own.time_offset)
    return replace(own, time_offset_sd=min(max(own.time_offset_sd, found), LARGEST_OFFSET))


def _of_axes(bench: _Bench, name: str, matrices: tuple[Array, Array]) -> Hypothesis:
    chain = bench.asked
    for aid in bench.chain.navigator.aids:
        if isinstance(aid, Gnss):
            chain = with_aid(chain, _as_asked(bench, aid))
    own = str(bench.imu.attrs.get("sensor_axes", "x,y,z")).split(",")
    sensor = np.array([[(-1.0 if w[0] == "-" else 1.0) * (w[-1] == x) for x in "xyz"] for w in own])
    gyro, accel = (matrix @ sensor for matrix in matrices)
    data: dict[str, Any] = {
        "name": name,
        "gyro_matrix": str(_whole(gyro)),
        "accel_matrix": str(_whole(accel)),
    }
    data["axes"] = ",".join(
        ("-" if row.sum() < 0.0 else "") + "xyz"[int(np.abs(row).argmax())] for row in accel
    )
    code = "navigation.blame-axes" if np.array_equal(gyro, accel) else "navigation.blame-gyros"
    return Hypothesis(name, code, chain, 1, bench.tables, matrices, data)


def _of_grade(
    bench: _Bench, named: str | None, grade: str, other: NavigationPipeline
) -> Hypothesis:
    """Another grade of sensors, with what was found of the fixes as it ran."""
    aids = tuple(
        replace(_as_asked(bench, aid), displaced=aid.displaced) if isinstance(aid, Gnss) else aid
        for aid in bench.chain.navigator.aids
    )
    navigator = replace(with_aids(other.navigator, aids), wrong=bench.chain.navigator.wrong)
    chain = replace(other, navigator=navigator, drift=bench.chain.drift)
    return Hypothesis(
        f"sensors of {grade}",
        "navigation.sensor-contradicted",
        chain,
        1,
        bench.tables,
        data={"named": named, "grade": grade},
    )


def _named(ranked: list[Tested], bench: _Bench, aid: Gnss | None) -> Finding:
    """Finding of the best hypothesis, with what it found and how the others do."""
    best, ranked = ranked[0], [ranked[0], *sorted(ranked[1:], key=lambda x: -x.gain)]
    one, record = best.hypothesis, best.record
    data: dict[str, Any] = {
        **one.data,
        "gain": best.gain,
        "count": best.count,
        "rejected": rejected_percent(bench.record),
        "left": rejected_percent(record),
        "scatter": _scatter(bench.record),
        "scatter_left": _scatter(record),
        "hypotheses": [x.hypothesis.name for x in ranked],
        "gains": [x.gain for x in ranked],
        "listed": [f"{x.hypothesis.name} {x.gain:+.0f}" for x in ranked[1 : 1 + NEXT]] or ["none"],
    }
    code, quantity = one.code, "axes"
    own = None if aid is None else one.chain.navigator.by_name[aid.name]
    name = "" if own is None else f"{own.name}.time_offset_t"
    if isinstance(own, Gnss) and name in record.sensors:
        late, late_sd = own.time_offset - record.sensors[name], record.sensors_sd[name]
        data |= {"offset": float(late.iloc[-1]), "offset_sd": float(late_sd.iloc[-1])}
    if code == "navigation.blame-lever-arm":
        assert isinstance(own, Gnss)
        quantity, names = "lever_arm", [f"{own.name}.lever_arm_{axis}" for axis in "xyz"]
        error, sd = (of[names].iloc[-1].to_numpy() for of in (record.sensors, record.sensors_sd))
        data |= {
            "stated": [round(x, 3) for x in own.lever_arm],
            "arm": [round(x, 3) for x in (np.asarray(own.lever_arm) - error).tolist()],
            "sd": [round(x, 3) for x in sd.tolist()],
            "off": float(np.linalg.norm(error)),
        }
    elif code == "navigation.blame-clock":
        quantity, before = "time", late[late.index < data.get("since", -math.inf)]
        if len(before):
            data["before"] = float(before.iloc[-1])
            moved = abs(data["offset"] - data["before"])
            if moved > max(CONTINUED, STEPPED * data["offset_sd"]):
                code = "navigation.blame-clock-step"
    elif code == "navigation.sensor-contradicted":
        quantity = "sensors"
    elif aid is not None and code in ("navigation.blame-noise", "navigation.blame-stretch"):
        quantity = "lat, lon, alt"
    of_fixes = aid is not None and quantity in ("lever_arm", "time", "lat, lon, alt")
    source = source_of(bench.tables[aid.name] if aid is not None and of_fixes else bench.imu)
    return Finding(code, file=source, quantity=quantity, data=data)


def _thinned(table: pd.DataFrame, begin: float, end: float) -> pd.DataFrame:
    """Return a table of fixes with about `FIXES` positions and velocities of a time at most."""
    if not set(GNSS) <= set(table.columns):
        return table
    time, kept = index_of(table), np.zeros(len(table), dtype=bool)
    for columns in (POSITION_SD[:2], VELOCITY_SD[:2]):
        rows = np.flatnonzero(usable(table, columns))
        count = int(np.sum((time[rows] >= begin) & (time[rows] <= end)))
        kept[rows[:: max(1, count // FIXES)]] = True
    thinned = table[kept]
    thinned.attrs = dict(table.attrs)
    return thinned


def _receiver(chain: NavigationPipeline, tables: Mapping[str, pd.DataFrame]) -> Gnss | None:
    """The first receiver with fixes."""
    aids = (one for one in chain.navigator.aids if type(one) is Gnss and one.name in tables)
    return next(aids, None)


def _of_aid(record: NavigationRecord, aid: Gnss) -> list[pd.DataFrame]:
    return [t for name, t in record.innovations.items() if name.rpartition(".")[0] == aid.name]


def by_stamp(
    innovations: Mapping[str, pd.DataFrame], chain: NavigationPipeline
) -> dict[str, pd.DataFrame]:
    """Innovations by the stamps of their fixes: their instants are those of a clock in doubt."""
    out = {}
    for name, table in innovations.items():
        aid = chain.navigator.by_name.get(name.rpartition(".")[0])
        stamps = index_of(table) + float(getattr(aid, "time_offset", 0.0))
        out[name] = table.set_axis(pd.Index(np.round(stamps, DIGITS), name="time"))
    return out


def _worst(record: NavigationRecord, chain: NavigationPipeline) -> tuple[float, float] | None:
    """Return the stretch of fixes that gains most by errors that are larger by `FAULT`, s.

    The largest sum over epochs that follow each other (Kadane). None without one, and where it is
    most of the run.
    """
    aids = [one for one in chain.navigator.aids if isinstance(one, Gnss)]
    parts = [t for aid in aids[:1] for t in _of_aid(record, aid)]
    if not parts:
        return None
    gains = pd.concat(
        [pd.Series(np.nansum(0.5 * _squares(t) - math.log(FAULT), axis=1), t.index) for t in parts]
    ).sort_index()
    time, sums = index_of(gains.to_frame()), np.concatenate([[0.0], np.cumsum(gains.to_numpy())])
    lowest = np.minimum.accumulate(sums[:-1])
    last = int(np.argmax(sums[1:] - lowest))
    first = int(np.argmin(sums[: last + 1]))
    if sums[last + 1] <= sums[first] or last + 1 - first > 0.5 * len(time):
        return None
    return float(time[first]), float(time[last])


def _squares(table: pd.DataFrame) -> Array:
    """Squares of normalized innovations, as a likelihood counts them, (n, k)."""
    labels = innovation_labels(table)
    nu, s = (values_of(table, [f"{part} {label}" for label in labels]) for part in ("nu", "s"))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(s > 0.0, np.minimum(np.square(nu) / s, MOST), np.nan)


def _scatter(record: NavigationRecord) -> float:
    """Root mean square of the normalized innovations."""
    parts = [_squares(table).ravel() for table in record.innovations.values()]
    return math.sqrt(float(np.nanmean(np.concatenate(parts)))) if parts else math.nan


def _count(record: NavigationRecord) -> int:
    return sum(int(np.isfinite(_squares(t)).sum()) for t in record.innovations.values())


def _enough(count: int) -> float:
    """Gain from which one explanation is better than another."""
    return max(LEAST_GAIN, GAIN_EACH * count)


def _whole(matrix: Array) -> list[list[int]]:
    return [[round(x) for x in row] for row in matrix.tolist()]
