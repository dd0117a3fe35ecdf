"""Write a simulated log with its exact attitude as a sealed bundle."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from strapdown.attitude_comparison.source import scenario_errors, simulate_scenario
from strapdown.bundle.seal import Seal, check_destination, sensor_file, to_json
from strapdown.bundle.writing import write_bundle
from strapdown.config import (
    SimulateSpec,
)
from strapdown.formats.log_writers import LOG_WRITERS, log_formats, write_attitude_csv
from strapdown.report.crash_simulation import stated_errors
from strapdown.simulation import Motion, PulseMotion, TriadErrors, find_scenario

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["write_simulation"]


def write_simulation(
    spec: SimulateSpec,
    out: Path,
    *,
    force: bool = False,
    made: tuple[pd.DataFrame, pd.DataFrame] | None = None,
) -> Seal:
    """Write a simulated scenario.

    Parameters
    ----------
    spec : SimulateSpec
    out : Path
        Folder to create.
    force : bool
        Overwrite an existing bundle.
    made : (DataFrame, DataFrame), optional
        From `simulate_scenario` of this specification, if it has been simulated already.

    Returns
    -------
    Seal
        The folder holds ``log.*``, ``truth.csv`` and ``scenario.json``.

    Raises
    ------
    ConfigError
        A format is unknown, or `out` may not be written.
    """
    check_destination(out, force)
    formats = log_formats(spec.formats)
    imu, truth = made or simulate_scenario(spec.scenario)
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
