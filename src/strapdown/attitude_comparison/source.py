"""Source of a comparison: a log or a scenario, its truth, and the part that is used."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.attitude_algorithms import Quaternion, run_attitude
from strapdown.attitude_comparison.options import AttitudeSpec
from strapdown.bundle import InputFiles, input_files, log_files, sensor_file
from strapdown.config.sources import LogSpec, ScenarioSpec
from strapdown.constants import Array
from strapdown.earth import magnetic_field
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.evaluation.differences import attitude_at, error_angles, gyro_turns
from strapdown.formats import read_log
from strapdown.formats.clocks import year_of
from strapdown.formats.inference.rotation_rate import signed_permutations
from strapdown.formats.recording import Origin, Reading, Recording
from strapdown.increments import increments_from_imu
from strapdown.systems.inputs import read_options
from strapdown.tables import ACCEL, GYRO, QUATERNION, find_gaps
from strapdown.tables.checks import MAG, index_of, values_of
from strapdown.tables.sample_clock import SampleClock, sample_clock

if TYPE_CHECKING:
    from strapdown.simulation import ImuErrors


@dataclass(frozen=True)
class AttitudeSource:
    """Log or scenario; `clean` is a scenario without sensor errors, `second` a second log.

    `axes`: how the log's axes were taken, where they were stated or gravity showed them.
    """

    name: str
    what: str
    origin: Origin
    imu: pd.DataFrame
    truth: pd.DataFrame | None
    scored: NDArray[np.bool_] | None
    readings: tuple[Reading, ...] = ()
    findings: tuple[Finding, ...] = ()
    inputs: tuple[InputFiles, ...] = ()
    sampling_error_deg: tuple[float, float] | None = None
    clean: pd.DataFrame | None = None
    second: Recording | None = None
    axes: str | None = None


def simulate_scenario(spec: ScenarioSpec) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the samples of a scenario and its exact attitude."""
    from strapdown.simulation import simulate_imu
    from strapdown.systems.trajectory_source import scenario_of

    return simulate_imu(
        scenario_of(spec).motion,
        scenario_errors(spec),
        rate=spec.rate_hz,
        sampling=spec.sampling,
        seed=spec.seed,
        source=spec.name,
    )


def scenario_errors(spec: ScenarioSpec) -> ImuErrors:
    """Return the errors of a simulated scenario: its own, or those of a sensor's unit."""
    if spec.sensor is None:
        from strapdown.systems.trajectory_source import scenario_of

        return scenario_of(spec).errors
    from strapdown.sensors.catalogue import load_sensor

    return load_sensor(spec.sensor).draw(spec.seed)


def read_source(spec: AttitudeSpec) -> AttitudeSource:
    """Read the log, or simulate the scenario, of a specification."""
    asked = spec.source
    if isinstance(asked, LogSpec):
        log = read_log(asked.path, replace(read_options(asked, asked.axes), axes_by_gravity=True))
        turned = [f for f in log.findings if f.code == "attitude.axes-by-gravity"]
        axes = str(turned[0].data["axes"]) if turned else asked.axes
        findings = (*(f for f in log.findings if f not in turned), *turned)
        imu = log.imu
        if any(f.code == "io.no-gravity" for f in findings):
            # Nothing levels by acceleration without gravity: the log is one of a gyro.
            imu = imu.drop(columns=ACCEL)
        return AttitudeSource(
            log.name,
            "recorded log",
            log.origin,
            imu,
            log.truth,
            log.scored,
            log.readings,
            findings,
            log_files(asked.path, log.files, asked.calibration),
            axes=axes,
        )
    from strapdown.simulation import ImuErrors, simulate_imu
    from strapdown.systems.trajectory_source import scenario_of

    scenario = scenario_of(asked)
    imu, truth = simulate_scenario(asked)
    clean, _ = simulate_imu(
        scenario.motion,
        ImuErrors(),
        rate=asked.rate_hz,
        sampling=asked.sampling,
        accelerometer=False,
    )
    exact = run_attitude(Quaternion(), increments_from_imu(clean), truth[QUATERNION].to_numpy()[0])
    lost = error_angles(exact.attitude, truth)
    return AttitudeSource(
        asked.name,
        f"simulated: {scenario.title} ({scenario.source})"
        + (f", sensor {Path(asked.sensor).name}" if asked.sensor else ""),
        Origin(0, "s"),
        imu,
        truth,
        np.ones(len(truth), dtype=bool),
        inputs=sensor_file(asked.sensor),
        sampling_error_deg=(float(lost.iloc[-1]), float(lost.max())),
        clean=clean,
    )


#: Windows in which the rotation of a gyro is compared with that of a truth, and the fewest of them;
#: the largest rotation within one, rad.
AXES_WINDOW, LEAST_AXES_WINDOWS, SMALL = 0.2, 30, 1.0
#: Of the sum of squares, what other axes must leave, beside those taken and beside the next best.
AXES_LEFT, AXES_APART = 0.25, 2.0


def axes_by_truth(source: AttitudeSource, stated: bool) -> AttitudeSource:
    """Turn a gyro whose axes are not those of the truth, as the rotations of both show.

    Right-handed axes turn all sensors; a mirrored gyro has the sign of axes wrong, and is turned
    alone. Axes that the user stated (`stated`) are only reported.
    """
    if source.truth is None or source.scored is None or not source.scored.any():
        return source
    by_gyro, by_truth = _window_rotations(source)
    if len(by_gyro) < LEAST_AXES_WINDOWS:
        return source
    names, matrices = signed_permutations()
    left = np.array([np.square(by_truth - by_gyro @ m.T).sum() for m in matrices])
    order = np.argsort(left, kind="stable")
    best, second = int(order[0]), int(order[1])
    found = left[best] < AXES_LEFT * min(left[0], float(np.square(by_truth).sum()))
    if best == 0 or not found or left[second] < AXES_APART * left[best]:
        return source
    mirrored = bool(np.linalg.det(matrices[best]) < 0.0)
    finding = Finding(
        "attitude.gyro-mirrored" if mirrored else "attitude.axes-by-reference",
        file=source.name,
        quantity="axes",
        axes=names[best],
        left_percent=100.0 * float(np.sqrt(left[best] / left[0])),
        applied=not stated,
    )
    if stated:
        return replace(source, findings=(*source.findings, finding))
    imu = source.imu.copy()
    for triad in (GYRO,) if mirrored else (GYRO, ACCEL, MAG):
        if set(triad) <= set(imu.columns):
            imu[triad] = values_of(imu, triad) @ matrices[best].T
    # The gyro's, which an exported configuration takes; those of the others may stay.
    if mirrored:
        imu.attrs["aiding_axes"] = str(imu.attrs.get("sensor_axes") or "x,y,z")
    sensor = str(imu.attrs.get("sensor_axes") or "x,y,z").split(",")
    turned = [sensor["xyz".index(name[-1])] for name in names[best].split(",")]
    imu.attrs["sensor_axes"] = ",".join(
        axis if name[0] != "-" else axis[1:] if axis[0] == "-" else f"-{axis}"
        for axis, name in zip(turned, names[best].split(","), strict=True)
    )
    return replace(source, imu=imu, findings=(*source.findings, finding))


def _window_rotations(source: AttitudeSource) -> tuple[Array, Array]:
    """Rotations over windows, (n, 3), rad, of the gyro and of the truth."""
    assert source.truth is not None
    assert source.scored is not None
    known = source.truth.iloc[np.flatnonzero(source.scored)]
    time, stamps = index_of(source.imu), index_of(known)
    edges = np.arange(max(time[0], stamps[0]), min(time[-1], stamps[-1]), AXES_WINDOW)
    if edges.size < 2:
        return np.empty((0, 3)), np.empty((0, 3))
    turns = gyro_turns(source.imu, edges).T
    q = attitude_at(known, edges)
    known_turns = rotation.rotation_vector_from_quaternion(
        rotation.compose(rotation.conjugate(q[:-1]), q[1:])
    )
    small = (np.abs(turns).max(axis=1) < SMALL) & (np.abs(known_turns).max(axis=1) < SMALL)
    for gap in [*find_gaps(time), *find_gaps(stamps)]:
        small &= ~((edges[1:] > gap.start) & (edges[:-1] < gap.end))
    return turns[small], np.asarray(known_turns)[small]


def magnetic_north(
    place: Sequence[float], imu: pd.DataFrame
) -> tuple[float, float, tuple[Finding, ...]]:
    """Declination at a place and the date of a log, its standard deviation, deg, and what to say.

    `place`: latitude and longitude in deg, and height in m or none.
    """
    if len(place) not in (2, 3):
        raise ConfigError("attitude.not-a-place", quantity="place", count=len(place))
    year = year_of(imu)
    lat, lon, alt = (float(v) for v in (*place, 0.0)[:3])
    model = magnetic_field(lat, lon, alt, year)
    finding = Finding(
        "attitude.true-north" if year is not None else "attitude.true-north-undated",
        file=imu.attrs.get("source"),
        quantity="mag",
        severity="note",
        declination=model.declination,
        sd=model.declination_sd,
        strength=model.strength,
        inclination=model.inclination,
        year=model.year,
    )
    return model.declination, model.declination_sd, (finding,)


def on_clock(source: AttitudeSource) -> tuple[AttitudeSource, SampleClock]:
    """Bring the samples of a log to their own clock, and report what its stamps are."""
    imu = source.imu
    clock = sample_clock(index_of(imu), values_of(imu, GYRO))
    said: list[tuple[str, dict[str, float]]] = []
    if clock.repaired:
        imu = imu.copy()
        imu.index = pd.Index(clock.time, name=imu.index.name)
        in_bursts = clock.kind == "bursts"
        code = "attitude.stamps-in-bursts" if in_bursts else "attitude.stamps-jitter"
        said.append((code, {"rate_hz": clock.rate_hz, "spread": clock.spread}))
    elif clock.kind == "irregular":
        said.append(("attitude.sampled-unevenly", {"rate_hz": clock.rate_hz}))
    if clock.lost:
        share = clock.lost / (clock.lost + len(imu))
        said.append(("attitude.samples-lost", {"count": clock.lost, "percent": 100.0 * share}))
    findings = [
        Finding(code, file=source.name, quantity="time", severity="note", data=data)
        for code, data in said
    ]
    before = source.findings
    if clock.repaired and not clock.gaps:
        # Delays of delivery, as the clock shows.
        before = tuple(f for f in before if f.code not in ("io.gaps", "io.long-gap"))
    return replace(source, imu=imu, findings=(*before, *findings)), clock


def describe(imu: pd.DataFrame, what: str, whole: pd.DataFrame, clock: SampleClock) -> str:
    """Describe the input in words: duration, rate, gaps, meaning of a row, and part."""
    length = float(imu.index[-1] - imu.index[0])
    kind = {
        "instantaneous": "rates at the instant of each stamp",
        "mean": "mean rates over the interval that ends at each stamp",
    }[imu.attrs["sampling"]]
    text = f"{what}; {len(imu)} samples in {length:.4g} s, {clock.rate_hz:.4g} Hz; {kind}"
    if clock.gaps:
        text += (
            f"; without {sum(g.length for g in clock.gaps):.4g} s in {len(clock.gaps)} gaps, after "
            "each of which the algorithms begin anew"
        )
    if len(imu) < len(whole):
        text += (
            f"; the part from {imu.index[0]:.6g} to {imu.index[-1]:.6g} s of one from "
            f"{whole.index[0]:.6g} to {whole.index[-1]:.6g} s"
        )
    return text


def with_truth(source: AttitudeSource, spec: AttitudeSpec) -> AttitudeSource:
    """Add the given truth to the source, on its own clock and within its window."""
    truth, scored, stated = source.truth, source.scored, spec.truth_path
    if stated is not None:
        from strapdown.formats.references import read_truth

        log = spec.source
        options = read_options(log, source.axes) if isinstance(log, LogSpec) else None
        truth = read_truth(Path(stated), options, source.origin)
        scored = np.ones(len(truth), dtype=bool)
    if truth is None or scored is None:
        return source
    start, end = source.imu.index[0], source.imu.index[-1]
    inside = np.asarray((truth.index >= start) & (truth.index <= end))
    if stated is None:
        if not inside.any():
            return replace(source, truth=None, scored=None)
        return replace(source, truth=truth[inside], scored=scored[inside])
    if inside.sum() < 2:
        raise DataError(
            "attitude.instants-lie-within-log-runs",
            file=Path(stated).name,
            quantity="time",
            inside=int(inside.sum()),
            index=truth.index[0],
            index_2=truth.index[-1],
            log=start,
            log_2=end,
        )
    return replace(
        source,
        truth=truth[inside],
        scored=scored[inside],
        # It may differ from the scenario's own truth, which alone is exact.
        clean=None,
        inputs=(*source.inputs, input_files("truth", stated, (Path(stated),))),
    )
