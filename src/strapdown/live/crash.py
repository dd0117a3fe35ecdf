"""Detect a crash in samples as they arrive, by the recorder of a case."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.config.crash_case import CaseSpec, TriadSpec, UnitSpec
from strapdown.constants import TWO_SIDED_95
from strapdown.crash.watch import CrashLog, CrashWatch, WatchOptions, watch_options
from strapdown.errors import DataError, Finding
from strapdown.live.lines import END, BadLineError, Sample, Word, parse_line
from strapdown.live.replay import LatencyTape, RunClock
from strapdown.live.run import until_a_signal
from strapdown.live.sources import LineSource, ReceivedLine
from strapdown.sensors.catalogue import load_sensor
from strapdown.sensors.crash_unit import Mounting
from strapdown.sensors.uncertainty import TriadUncertainty, stated_uncertainty

__all__ = ["CrashReception", "receive_crash", "recorder_of_case"]


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
    from strapdown.report.crash_tables import DRIVE_QUANTITIES

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


class CrashReception:
    """Pass the samples of lines to the detection.

    Attributes
    ----------
    rows : list of tuple
        Every sample that came, also with a refused stamp: stamp, rates if any, forces.
    unused : Counter
        Lines that were not used, by kind.
    tape, processing : LatencyTape
        From the arrival of a line to its result, the time in the queue included; and the part of
        the detection.
    """

    def __init__(
        self,
        log: CrashLog,
        clock: RunClock,
        write: Callable[[str], None],
        warn: Callable[[Finding], None],
    ) -> None:
        self.log, self.tape, self.processing = log, LatencyTape(), LatencyTape()
        self._clock, self._write, self._warn = clock, write, warn
        self._gyro = log.watch.options.gyro
        self.lines = 0
        #: Whether the reader of the estimates is there; when it closes the pipe, the run ends.
        self.there = True
        self.unused: Counter[str] = Counter()
        self.rows: list[tuple[float, ...]] = []

    def take(self, line: ReceivedLine) -> bool:
        """Process a line; return whether the run continues."""
        self.lines += 1
        try:
            said = parse_line(line.text, (), without_gyro=True)
            if isinstance(said, Word):
                return said.word != END
            if isinstance(said, Sample):
                self._sample(said, line)
        except BadLineError as bad:
            self.unused[bad.kind] += 1
            if self.unused[bad.kind] == 1:
                self._warn(Finding("live.line-not-used", line=line.number, reason=bad.finding))
        return self.there

    def _sample(self, said: Sample, line: ReceivedLine) -> None:
        began = self._clock.now()
        values = said.values if self._gyro else said.values[-3:]
        if self._gyro and len(values) != 6:
            raise BadLineError("accel", "live.samples-without-gyro")
        self.rows.append((said.time, *values))
        try:
            due = self.log.take(said.time, values)
        except DataError:
            raise BadLineError("time", "live.sample-not-later", time=said.time) from None
        if due is not None and self.there:
            try:
                self._write(json.dumps(due) + "\n")
            except BrokenPipeError:
                self.there = False
        done = self._clock.now()
        self.tape.take(line.arrived, done)
        self.processing.take(began, done)


def receive_crash(
    options: WatchOptions,
    source: LineSource,
    clock: RunClock,
    write: Callable[[str], None],
    warn: Callable[[Finding], None],
    every: float = 0.01,
) -> CrashReception:
    """Detect crashes in lines until they end, an ``end`` command, or a signal.

    Parameters
    ----------
    write : callable
        Called with each estimate of an event, as a line of JSON.
    warn : callable
        Called with each finding.
    every : float, s
        Least interval between estimates of an event.
    """
    with closing(source):
        got = CrashReception(CrashLog(options, every), clock, write, warn)
        _warm_up(options)
        with until_a_signal() as wanted:
            warn(Finding("live.listening", severity="note", source=source.name))
            if None in options.full_scale:
                warn(Finding("live.range-not-stated", quantity="full_scale_g"))
            source.begin()
            while wanted():
                try:
                    line = source.next()
                except TimeoutError:
                    continue
                if line is None or not got.take(line):
                    break
    return got


def _warm_up(options: WatchOptions) -> None:
    """Detect a crash of a few samples, so that all is compiled and loaded."""
    watch = CrashWatch(replace(options, axes=WatchOptions.axes))
    for k in range(40):
        watch.take(0.01 * k, (0.0, 0.0, 0.0, -30.0 if k > 20 else 0.0, 0.0, 0.0))
    watch.estimate()
