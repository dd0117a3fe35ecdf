"""A simulated log as files, with its exact attitude, sealed in a bundle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from strapdown.bundle import Seal, check_destination, to_json, write_bundle
from strapdown.config import ScenarioSpec, SimulateSpec, specify
from strapdown.exceptions import ConfigError, nearest
from strapdown.formats.log_writers import LOG_WRITERS, write_attitude_csv
from strapdown.simulation import Motion, PulseMotion, TriadErrors, find_scenario
from strapdown.systems.attitude_source import scenario_errors, sensor_file, simulate_scenario

__all__ = ["simulate", "write_simulation"]


def simulate(
    name: str,
    out: str | Path,
    *,
    rate: float = 100.0,
    sampling: str = "instantaneous",
    seed: int = 0,
    sensor: str | None = None,
    formats: str | Sequence[str] = ("csv",),
    force: bool = False,
) -> Seal:
    """Write the log of a scenario and its exact attitude.

    Parameters
    ----------
    name : str
        One of `simulation.SCENARIOS`.
    out : str or Path
        Folder to make.
    rate : float, Hz
    sampling : {'instantaneous', 'mean'}
        The rate at each stamp, or its exact mean over the interval that ends there.
    seed : int
        Of the errors.
    sensor : str, optional
        One of `sensors.catalogue.SENSORS`, or the path of a file in the same form: the errors
        of one unit of it, drawn with the seed, take the place of the scenario's own.
    formats : sequence of str
        Of `formats.log_writers.LOG_WRITERS`, or ``all``.
    force : bool
        Replace a bundle that is there.

    Returns
    -------
    Seal
        The folder holds ``log.*`` (rad/s, body forward-right-down, with the true attitude in
        further columns), ``truth.csv`` and ``scenario.json``.

    Raises
    ------
    ConfigError
        The scenario, the rate, the sampling, the sensor or a format is unknown, or `out` may not be
        written.
    """
    scenario = specify(
        ScenarioSpec,
        name=name.lower(),
        rate_hz=rate,
        sampling=sampling.lower(),
        seed=seed,
        sensor=sensor,
    )
    wanted = [formats] if isinstance(formats, str) else list(formats)
    if not wanted:
        raise ConfigError("none is named", quantity="--format", remedy="name csv, npz, h5 or mat")
    spec = specify(SimulateSpec, scenario=scenario, formats=tuple(f.lower() for f in wanted))
    return write_simulation(spec, Path(out), force=force)


def write_simulation(spec: SimulateSpec, out: Path, *, force: bool = False) -> Seal:
    """Write a simulation from its specification; as `simulate`."""
    check_destination(out, force)
    formats = tuple(LOG_WRITERS) if "all" in spec.formats else spec.formats
    for name in formats:
        if name not in LOG_WRITERS:
            raise ConfigError(
                f"there is no writer for '{name}'",
                quantity="--format",
                remedy=nearest(name, [*LOG_WRITERS, "all"]),
            )
    imu, truth = simulate_scenario(spec.scenario)
    scenario = find_scenario(spec.scenario.name)
    errors = scenario_errors(spec.scenario)
    seals: list[Seal] = []
    with write_bundle(
        out,
        command="simulate",
        configuration=spec.model_dump(mode="json"),
        inputs=sensor_file(spec.scenario),
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
            "gyro_errors": _stated(errors.gyro, "rad_per_s"),
            "accel_errors": _stated(errors.accel or TriadErrors(), "m_per_s2"),
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
    """Numbers that make the motion: its pulses, or the fields of its class with their names."""
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


# What follows the unit of the triad in a key, or stands instead of it.
_AFTER = {"noise_density": "_per_sqrt_hz", "random_walk": "_per_sqrt_s", "trend": "_per_s"}
_UNITS = {
    "correlation_time": "s",
    "jitter": "s",
    "bandwidth": "hz",
    "misalignment": "rad",
    "scale": "relative",
    "nonlinearity_2": "relative",
    "nonlinearity_3": "relative",
}


def _stated(errors: TriadErrors, unit: str) -> dict[str, Any]:
    """The errors that there are, each key with its unit."""
    none, stated = TriadErrors(), {}
    for f in fields(errors):
        value = getattr(errors, f.name)
        if value != getattr(none, f.name):
            of = _UNITS.get(f.name, unit + _AFTER.get(f.name, ""))
            of += "_per_m_per_s2" if f.name == "g_sensitivity" else ""
            stated[f"{f.name}_{of}"] = value
    return stated
