"""Write a simulated log with its exact attitude as a sealed bundle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

from strapdown.bundle.seal import Seal, check_destination, to_json
from strapdown.bundle.writing import write_bundle
from strapdown.config import (
    CrashSimulationSpec,
    ScenarioSpec,
    SimulateSpec,
    TrajectorySpec,
    specify,
)
from strapdown.errors import ConfigError
from strapdown.formats.log_writers import LOG_WRITERS, log_formats, write_attitude_csv
from strapdown.report.crash_simulation import stated_errors, write_crash_simulation
from strapdown.report.trajectory_simulation import write_trajectory_simulation
from strapdown.simulation import SCENARIOS, Motion, PulseMotion, TriadErrors, find_scenario
from strapdown.simulation.crash_cases import CASES
from strapdown.systems.attitude_source import scenario_errors, sensor_file, simulate_scenario

__all__ = ["simulate", "write_simulation"]


def simulate(
    name: str,
    out: str | Path,
    *,
    rate: float | None = None,
    sampling: str | None = None,
    seed: int | None = None,
    sensor: str | None = None,
    formats: str | Sequence[str] | None = None,
    units: Sequence[str] = (),
    force: bool = False,
) -> Seal:
    """Write the log of a scenario, a trajectory's file or a crash, with its exact truth.

    Parameters
    ----------
    name : str
        One of `simulation.SCENARIOS`, the path of a trajectory's file, which ends in ``.toml``, or
        one of `simulation.crash_cases.CASES`. Arguments that are None take the value of the file,
        else the default stated here.
    out : str or Path
        Folder to create.
    rate : float, Hz
        100; for a crash each recorder's own rate.
    sampling : {'instantaneous', 'mean'}
        The rate at each stamp (the default), or its exact mean over the interval that ends there.
    seed : int
        Seed of the errors; 0.
    sensor : str, optional
        One of `sensors.catalogue.SENSORS`, or the path of a file in the same form: the errors
        of one unit, drawn with the seed, replace those of the scenario.
    formats : sequence of str
        Of `formats.log_writers.LOG_WRITERS`, of a crash of `crash_simulation.RECORD_WRITERS`, or
        ``all``; ``csv``.
    units : sequence of str
        For a crash: names of its recorders, or ``all``.
    force : bool
        Overwrite an existing bundle.

    Returns
    -------
    Seal
        The folder holds ``log.*`` (rad/s, body forward-right-down, with the true attitude in
        further columns), ``scenario.json``, and the truth: ``truth.csv`` with the attitude of a
        scenario, ``trajectory.csv`` with the position, velocity and attitude of a trajectory. For
        a crash: as `crash_simulation.write_crash_simulation`.

    Raises
    ------
    ConfigError
        The scenario, the rate, the sampling, the sensor or a format is unknown, `out` may not be
        written, or an entry of the file is invalid; the message names the key.
    """
    wanted = [formats] if isinstance(formats, str) else formats and list(formats)
    if wanted is not None and not wanted:
        raise ConfigError("report.none-named", quantity="--format")
    wanted = wanted and [f.lower() for f in wanted]
    if name.lower() in CASES:
        if sensor is not None:
            raise ConfigError("report.recorders-crash-parts-their-own", quantity="--sensor")
        crash = specify(
            CrashSimulationSpec,
            name=name.lower(),
            units=tuple(units),
            rate_hz=rate,
            sampling=(sampling or "instantaneous").lower(),
            seed=seed or 0,
            formats=tuple(wanted or ["csv"]),
        )
        return write_crash_simulation(crash, Path(out), force=force)
    if units:
        raise ConfigError("report.no-crash-no-recorders", quantity="--units", name=name)
    if name.lower().endswith(".toml"):
        trajectory = TrajectorySpec.read(
            Path(name),
            rate_hz=rate,
            sampling=sampling and sampling.lower(),
            seed=seed,
            sensor=sensor,
            formats=wanted,
        )
        return write_trajectory_simulation(trajectory, Path(out), force=force)
    if name.lower() not in SCENARIOS:
        raise ConfigError(
            "report.no-scenario-no-crash",
            quantity="scenario",
            name=name,
            word=name.lower(),
            known=[*SCENARIOS, *CASES],
        )
    scenario = specify(
        ScenarioSpec,
        name=name.lower(),
        rate_hz=100.0 if rate is None else rate,
        sampling=(sampling or "instantaneous").lower(),
        seed=seed or 0,
        sensor=sensor,
    )
    spec = specify(SimulateSpec, scenario=scenario, formats=tuple(wanted or ["csv"]))
    return write_simulation(spec, Path(out), force=force)


def write_simulation(spec: SimulateSpec, out: Path, *, force: bool = False) -> Seal:
    """Write a simulation from its specification; as `simulate`."""
    check_destination(out, force)
    formats = log_formats(spec.formats)
    imu, truth = simulate_scenario(spec.scenario)
    scenario = find_scenario(spec.scenario.name)
    errors = scenario_errors(spec.scenario)
    seals: list[Seal] = []
    with write_bundle(
        out,
        command="simulate",
        configuration=spec.model_dump(mode="json"),
        inputs=sensor_file(spec.scenario.sensor),
        force=force,
        seals=seals,
    ) as folder:
        for name in formats:
            LOG_WRITERS[name](folder / f"log.{name}", imu, truth)
        write_attitude_csv(folder / "truth.csv", truth)
        final = truth.iloc[-1]
        description = {
            "schema": "strapdown scenario 1",
            "scenario": spec.scenario.name,
            "title": scenario.title,
            "origin": scenario.source,
            "sampling": spec.scenario.sampling,
            "rate_hz": spec.scenario.rate_hz,
            "seed": spec.scenario.seed,
            "duration_s": scenario.motion.duration,
            **_describe_motion(scenario.motion),
            "references": scenario.references,
            "sensor": spec.scenario.sensor and Path(spec.scenario.sensor).name,
            "gyro_errors": stated_errors(errors.gyro, "rad_per_s"),
            "accel_errors": stated_errors(errors.accel or TriadErrors(), "m_per_s2"),
            "final_attitude": {
                "time_s": float(truth.index[-1]),
                "q_nb": [float(final[q]) for q in ("q_w", "q_x", "q_y", "q_z")],
                "roll_deg": float(final["roll"]),
                "pitch_deg": float(final["pitch"]),
                "heading_deg": float(final["heading"]),
            },
        }
        (folder / "scenario.json").write_text(to_json(description), encoding="utf-8", newline="\n")
    return seals[0]


def _describe_motion(motion: Motion) -> dict[str, object]:
    """Parameters of the motion: its pulses, or the fields of its class with their names."""
    if isinstance(motion, PulseMotion):
        pulses = [
            {
                "axis": "xyz"[p.axis],
                "start_s": p.start,
                "end_s": p.end,
                "end_closed": p.closed,
                "rate_rad_per_s": p.rate,
            }
            for p in motion.pulses
        ]
        return {"pulses": pulses}
    return {"motion": {"class": type(motion).__name__, **_fields(motion)}}


def _fields(thing: object) -> dict[str, object]:
    found = {}
    for f in fields(thing):  # type: ignore[arg-type]
        value = getattr(thing, f.name)
        found[f.name] = _fields(value) if hasattr(value, "__dataclass_fields__") else value
    return found
