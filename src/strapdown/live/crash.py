"""Detect a crash in samples as they arrive, by the recorder of a case."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable
from contextlib import closing, nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.config.crash_case import CaseSpec, TriadSpec, UnitSpec
from strapdown.constants import TWO_SIDED_95
from strapdown.crash.watch import CrashLog, CrashWatch, WatchOptions, watch_options
from strapdown.errors import DataError, Finding
from strapdown.formats.stamp_gate import StampGate
from strapdown.live.journal import Journal, SpooledRows
from strapdown.live.lines import (
    END,
    BadLineError,
    Sample,
    Word,
    check_token,
    count_unused,
    parse_line,
)
from strapdown.live.reception import FAMILY, STRONGEST, ValueLimits
from strapdown.live.replay import LatencyTape, RunClock
from strapdown.live.run import received_lines, until_a_signal
from strapdown.live.sources import LineSource, ReceivedLine
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.crash_unit import Mounting
from strapdown.sensors.uncertainty import TriadUncertainty, stated_uncertainty


def recorder_of_case(path: Path, calibration: Path | None = None) -> WatchOptions:
    """Return the options of the first unit of a case, whose records are not read.

    Of several accelerometers, the last has the highest range: its samples are expected. Lines hold
    the axes x, y, z of the recorder, before the signs of `channels`.

    Parameters
    ----------
    calibration : Path, optional
        Result of `strapdown crash`, a folder or its `crash.json`, in which a drive determined the
        errors of this unit. They are taken off, and their bound replaces the stated one; that of a
        scale factor only where a nonlinearity says how far beyond the drive it holds.

    Raises
    ------
    DataError
        `calibration` is no such result, or has no drive of the unit.
    """
    spec = CaseSpec.read(path, files=False)
    unit = spec.units[0]
    strong = unit.accelerometers[-1]
    mounting = Mounting(unit.position_m, unit.angles_deg, unit.position_sd_m, unit.angles_sd_deg)
    gyro = None if unit.gyro is None else _uncertainty("gyro", unit.gyro, path.parent)
    accel, C = _uncertainty("accel", strong, path.parent), mounting.C_vs
    angles_sd = np.full(3, math.radians(unit.angles_sd_deg))
    bias, scale = np.zeros((2, 2, 3))
    if calibration is not None:
        known = _calibration(calibration, unit)
        turned, own = known("mounting", unit.name, angles_sd)
        C, angles_sd = rotation.dcm_from_rotation_vector(turned) @ C, own
        name = f"{unit.name} {unit.accelerometer_names[-1]}"
        bias[1], bias_sd = known("bias", name, accel.axis("bias"))
        scale[1], scale_sd = known("scale", name, accel.axis("scale"))
        linear = np.array(accel.axis("nonlinearity_2")) > 0.0
        scale_sd = np.where(linear, scale_sd, accel.axis("scale"))
        accel = replace(accel, bias=tuple(bias_sd), scale=tuple(scale_sd))
        if gyro is not None:
            name = f"{unit.name} gyro"
            bias[0], bias_sd = known("gyro bias", name, gyro.axis("bias"))
            scale[0], _ = known("gyro scale", name, gyro.axis("scale"))
            gyro = replace(gyro, bias=tuple(bias_sd))
    options = watch_options(
        accel,
        gyro,
        C,
        angles_sd,
        mean=(strong.sampling or spec.options.sampling) == "mean",
        severity=spec.options.severity,
    )
    return replace(options, bias=tuple(bias.ravel().tolist()), scale=tuple(scale.ravel().tolist()))


def _calibration(
    path: Path, unit: UnitSpec
) -> Callable[[str, str, ArrayLike], tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return what gives the error of a quantity of a sensor on three axes, and its bound."""
    from strapdown.report.crash_words import DRIVE_QUANTITIES

    file = path / "crash.json" if path.is_dir() else path
    try:
        answers = json.loads(file.read_text(encoding="utf-8"))["answers"]
        drives = {one["recorder"]: one["drive"] for one in answers if one["drive"] is not None}
    except (OSError, ValueError, TypeError, KeyError):
        drives = {}
    if not drives:
        raise DataError("live.no-calibration", file=str(file), quantity="--calibration")
    if unit.name not in drives:
        raise DataError(
            "live.calibration-of-others",
            file=str(file),
            quantity="--calibration",
            name=unit.name,
            others=list(drives),
        )

    def known(
        quantity: str, of: str, stated: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        key, _, size, _ = DRIVE_QUANTITIES[quantity]
        error, sd = np.zeros(3), np.array(stated, dtype=np.float64)
        for row in drives[unit.name]["errors"]:
            if (row["quantity"], row["of"]) == (key, of):
                axis, by_drive = "xyz".index(row["axis"]), row["by_drive"]
                error[axis] = size * by_drive["value"]
                sd[axis] = size * (by_drive["high"] - by_drive["value"]) / TWO_SIDED_95
        return error, sd

    return known


def _uncertainty(triad: str, spec: TriadSpec, folder: Path) -> TriadUncertainty:
    name = spec.sensor
    if name is not None and name.lower().endswith(".toml"):
        name = str(folder / name)
    sensor = None if name is None else load_sensor(name)
    return stated_uncertainty(triad, spec.uncertainty, sensor)


#: Samples in a row that confirm a gap, as many as a clock that was reset.
CONFIRM = 3
#: A longer step, relative to the usual one, is a gap, as in navigation.
GAP = 3.0


class CrashReception:
    """Pass the samples of lines to the detection.

    Parameters
    ----------
    journal : Journal, optional
        Takes every sample before it is used, and holds the recorded ones; in memory without it.

    Attributes
    ----------
    rows : SpooledRows
        Every sample that was taken, also with a stamp that is not later: stamp, rates if any,
        forces.
    unused : Counter
        Lines that were not used, by kind.
    tape, processing : LatencyTape
        From the arrival of a line to its result, the time in the queue included; and the part of
        the detection.
    replayed : int
        Records that came from the journal.
    token : str or None
        That commands need.
    """

    def __init__(
        self,
        log: CrashLog,
        clock: RunClock,
        write: Callable[[str], None],
        warn: Callable[[Finding], None],
        journal: Journal | None = None,
    ) -> None:
        self.log, self.tape, self.processing = log, LatencyTape(), LatencyTape()
        self._clock, self._write, self._warn, self._journal = clock, write, warn, journal
        self._options = log.watch.options
        self._gate: StampGate[tuple[Sample, ReceivedLine | None]] = StampGate(CONFIRM, GAP)
        self._limits = _limits(self._options)
        self.lines = self.replayed = 0
        #: Whether the reader of the estimates is there; when it closes the pipe, the run ends.
        self.there = True
        self.unused: Counter[str] = Counter()
        self.token: str | None = None
        columns = 7 if self._options.gyro else 4
        self.rows = SpooledRows(columns) if journal is None else journal.spool("samples", columns)

    def take(self, line: ReceivedLine) -> bool:
        """Process a line; return whether the run continues."""
        self.lines += 1
        try:
            said = parse_line(line.text, (), without_gyro=True)
            if isinstance(said, Word):
                check_token(said, self.token)
                return said.word != END
            if isinstance(said, Sample):
                self._check(said)
                if self._journal is not None:
                    self._journal.append(said)
                self._sample(said, line)
        except BadLineError as bad:
            self._not_used(bad, line)
        return self.there

    def replay(self, journal: Journal) -> None:
        """Process what the journal of a killed run has, without writing."""
        write, self._write = self._write, lambda text: None
        for said in journal.said():
            self.replayed += 1
            if isinstance(said, Sample):
                self._sample(said, None)
        self._write = write

    def finish(self) -> None:
        """Use what waits, unless it is contradicted."""
        self._pass(self._gate.finish())

    def _check(self, said: Sample) -> None:
        if self._options.gyro and len(said.values) != 6:
            raise BadLineError("accel", "live.samples-without-gyro")
        self._limits.check(said)

    def _sample(self, said: Sample, line: ReceivedLine | None) -> None:
        if said.time > self._gate.newest:
            self._pass(self._gate.take(said.time, (said, line)))
            return
        resets = self.log.watch.resets
        self._detect(said, line)
        if self.log.watch.resets > resets:
            self._gate.restart(said.time)

    def _pass(self, items: list[tuple[float, tuple[Sample, ReceivedLine | None]]]) -> None:
        newest = self.log.watch.newest
        for stamp, (_, line) in self._gate.dropped:
            code = "live.stamp-not-first" if newest is None else "live.stamp-not-confirmed"
            self._not_used(BadLineError("stamp", code, time=stamp, newest=newest), line)
        for _, (said, line) in items:
            self._detect(said, line)

    def _detect(self, said: Sample, line: ReceivedLine | None) -> None:
        began = self._clock.now()
        values = said.values if self._options.gyro else said.values[-3:]
        self.rows.append((said.time, *values))
        try:
            due = self.log.take(said.time, values)
        except DataError:
            self._not_used(BadLineError("time", "live.sample-not-later", time=said.time), line)
            return
        if due is not None and self.there:
            try:
                self._write(json.dumps(due) + "\n")
            except BrokenPipeError:
                self.there = False
        if line is not None:
            done = self._clock.now()
            self.tape.take(line.arrived, done)
            self.processing.take(began, done)

    def _not_used(self, bad: BadLineError, line: ReceivedLine | None) -> None:
        count_unused(self.unused, bad, None if line is None else line.number, self._warn)


def _limits(options: WatchOptions) -> ValueLimits:
    stated = [FAMILY * one for one in options.full_scale if one is not None]
    whole = len(stated) == len(options.full_scale)
    return ValueLimits(force=min(STRONGEST, max(stated))) if whole else ValueLimits()


def receive_crash(
    options: WatchOptions,
    source: LineSource | None,
    clock: RunClock,
    write: Callable[[str], None],
    warn: Callable[[Finding], None],
    every: float = 0.01,
    journal: Journal | None = None,
) -> CrashReception:
    """Detect crashes in lines until they end, an ``end`` command, or a signal.

    Parameters
    ----------
    source : LineSource or None
        None for what the journal has, and no more.
    write : callable
        Called with each estimate of an event, as a line of JSON, that follows from a received line.
    warn : callable
        Called with each finding.
    every : float, s
        Least interval between estimates of an event.
    journal : Journal, optional
        Takes what is received before it is used; what it has already is processed first.
    """
    with closing(source) if source is not None else nullcontext():
        got = CrashReception(CrashLog(options, every), clock, write, warn, journal)
        if journal is not None:
            journal.warn = warn
            got.replay(journal)
        if source is None:
            got.finish()
            return got
        _warm_up(options)
        with until_a_signal() as wanted:
            got.token = source.token
            warn(Finding("live.listening", severity="note", source=source.name))
            if None in options.full_scale:
                warn(Finding("live.range-not-stated", quantity="full_scale_g"))
            source.begin()
            for line in received_lines(source, wanted):
                if not got.take(line):
                    break
    got.finish()
    return got


def _warm_up(options: WatchOptions) -> None:
    """Detect a crash of a few samples, so that all is compiled and loaded."""
    watch = CrashWatch(replace(options, axes=WatchOptions.axes))
    for k in range(40):
        watch.take(0.01 * k, (0.0, 0.0, 0.0, -30.0 if k > 20 else 0.0, 0.0, 0.0))
    watch.estimate()
