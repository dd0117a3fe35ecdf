"""The records of a simulated crash as files, with their case and the truth, sealed in a bundle."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.bundle.destination import check_destination
from strapdown.bundle.json_text import to_json
from strapdown.bundle.seal import Seal
from strapdown.bundle.writing import write_bundle
from strapdown.config import CrashSimulationSpec
from strapdown.crash.pdof import pdof
from strapdown.errors import ConfigError
from strapdown.formats.crash_record import QUANTITIES, CrashChannel, CrashRecord
from strapdown.formats.mme_writer import write_mme
from strapdown.formats.recorder_csv import (
    ACCEL_HEADINGS,
    GYRO_HEADINGS,
    TIME,
    write_path_csv,
    write_recorder_csv,
)
from strapdown.report.simulated_case_file import PartPlace, case_text, part_file, part_name
from strapdown.report.stated_errors import stated_errors
from strapdown.sensors.crash_unit import Mounting, RecordedTriad
from strapdown.simulation.case_recording import (
    AFTER,
    RecordedCase,
    RecordedUnit,
    record_case,
)
from strapdown.simulation.crash_cases import find_case
from strapdown.simulation.exact_answers import ExactAnswers
from strapdown.tables import ACCEL, GYRO

__all__ = ["write_crash_simulation"]

# Over which 49 CFR 563 looks for the change of an event; the pulses of all crashes here are over.
SPAN = 0.15  # s


def write_crash_simulation(spec: CrashSimulationSpec, out: Path, *, force: bool = False) -> Seal:
    """Write the records of a simulated crash.

    Parameters
    ----------
    spec : CrashSimulationSpec
    out : Path
        Folder to make.
    force : bool
        Replace a bundle that is there.

    Returns
    -------
    Seal
        The folder holds one text table a part of each recorder (``imu1_low_g.csv``), or one test
        in ISO MME a recorder (``imu1/imu1.mme``), on its own clock; ``cameras.csv``, the path of
        the reference point that two cameras saw, and ``truth.csv``, the exact one with velocity
        and attitude, both by time from the trigger; ``case.toml``, which `strapdown crash` reads;
        and ``scenario.json`` with the exact answers and every error that was drawn.

    Raises
    ------
    ConfigError
        The crash, a recorder, a format or the sampling is unknown, the rate is too low to record
        with, or `out` may not be written.
    """
    check_destination(out, force)
    formats = _formats(spec)
    case = find_case(spec.name)
    recorded = record_case(
        case, spec.units, rate=spec.rate_hz, sampling=spec.sampling, seed=spec.seed
    )
    seals: list[Seal] = []
    with write_bundle(
        out,
        command="simulate",
        configuration={"crash": spec.model_dump(mode="json")},
        force=force,
        seals=seals,
    ) as folder:
        places: dict[str, PartPlace] = {}
        # The case reads what was named first.
        for name in reversed(formats):
            for unit in recorded.units:
                places |= RECORD_WRITERS[name](folder, unit)
        write_path_csv(folder / "cameras.csv", recorded.camera_path)
        write_path_csv(folder / "truth.csv", recorded.truth)
        text = case_text(recorded, places, spec.seed)
        (folder / "case.toml").write_text(text, encoding="utf-8", newline="\n")
        (folder / "scenario.json").write_text(
            to_json(_description(spec, recorded)), encoding="utf-8", newline="\n"
        )
    return seals[0]


def _formats(spec: CrashSimulationSpec) -> tuple[str, ...]:
    for name in spec.formats:
        if name not in (*RECORD_WRITERS, "all"):
            raise ConfigError(
                "report.no-writer-crash-records",
                quantity="--format",
                name=name,
                word=name,
                known=[*RECORD_WRITERS, "all"],
            )
    return tuple(RECORD_WRITERS) if "all" in spec.formats else tuple(dict.fromkeys(spec.formats))


def _parts(of: RecordedUnit) -> list[tuple[int | None, RecordedTriad]]:
    """Accelerometers by their numbers, and the gyro (None)."""
    parts: list[tuple[int | None, RecordedTriad]] = list(enumerate(of.unit.accelerometers))
    return parts if of.unit.gyro is None else [*parts, (None, of.unit.gyro)]


def _write_csv(folder: Path, of: RecordedUnit) -> dict[str, PartPlace]:
    """One text table a part, as a recorder exports it."""
    places = {}
    for which, triad in _parts(of):
        name = part_file(of, which)
        write_recorder_csv(folder / f"{name}.csv", triad.table)
        headings = GYRO_HEADINGS if which is None else ACCEL_HEADINGS
        places[name] = PartPlace(f"{name}.csv", headings, TIME)
    return places


def _write_mme(folder: Path, of: RecordedUnit) -> dict[str, PartPlace]:
    """One test in ISO MME for all parts, as a laboratory hands it over."""
    name = of.unit.name.lower()
    channels = {part_file(of, which): _channels(of, which, triad) for which, triad in _parts(of)}
    record = CrashRecord(
        Path(name),
        "simulated",
        f"simulated recorder {of.unit.name}",
        {},
        tuple(c for triple in channels.values() for c in triple),
        (),
    )
    codes = write_mme(folder / name, record, name=name)
    return {
        part: PartPlace(f"{name}/{name}.mme", (codes[x.name], codes[y.name], codes[z.name]))
        for part, (x, y, z) in channels.items()
    }


def _channels(
    of: RecordedUnit, which: int | None, triad: RecordedTriad
) -> tuple[CrashChannel, CrashChannel, CrashChannel]:
    quantity = "rate" if which is None else "acceleration"
    time = triad.table.index.to_numpy(dtype=np.float64)
    values = triad.table[GYRO if which is None else ACCEL].to_numpy(dtype=np.float64)

    def channel(k: int) -> CrashChannel:
        return CrashChannel(
            f"{part_name(of, which)} {'xyz'[k]}",
            quantity,
            "xyz"[k],
            QUANTITIES[quantity],
            lambda: (time, values[:, k]),
            sampling=triad.table.attrs["sampling"],
        )

    return channel(0), channel(1), channel(2)


#: What records are written in: a function that says where each part of a recorder then is.
RECORD_WRITERS: dict[str, Callable[[Path, RecordedUnit], dict[str, PartPlace]]] = {
    "csv": _write_csv,
    "mme": _write_mme,
}


def _description(spec: CrashSimulationSpec, recorded: RecordedCase) -> dict[str, Any]:
    """What really happened, and what the recorders really did."""
    case, entry = recorded.case, recorded.entry
    crash = case.crash
    return {
        "schema": "strapdown crash scenario 1",
        "case": case.name,
        "summary": case.summary,
        "remark": case.remark,
        "crash": crash.name,
        "source": crash.source,
        "parameters": dict(crash.parameters),
        "seed": spec.seed,
        "sampling": spec.sampling,
        "duration_s": crash.motion.duration,
        "trigger_s": crash.start,
        "point": "centre of mass",
        "entry": {
            "speed_m_per_s": entry.speed,
            "stated_speed_m_per_s": entry.told_speed if entry.speed else None,
            "heading_deg": entry.heading_deg,
            "slip_deg": entry.slip_deg,
        },
        "impacts": _impacts(recorded),
        "end": _end(recorded),
        "units": {of.unit.name: _unit(of) for of in recorded.units},
        "cameras": {
            camera.name: {"position_m": list(camera.position), "rate_hz": camera.rate}
            for camera in recorded.cameras
        },
    }


def _impacts(recorded: RecordedCase) -> list[dict[str, Any]]:
    crash = recorded.case.crash
    exact = ExactAnswers(crash.motion, crash.start)
    found = []
    for begin, change in zip(crash.impacts, crash.delta_v, strict=True):
        since = begin - crash.start
        felt = exact.along_body(since, since + SPAN)
        over_ground = exact.over_ground(since, since + SPAN)
        angles = _yaw(recorded, since), _yaw(recorded, since + SPAN)
        found.append(
            {
                "time_s": since,
                # Of the blow alone, in the vehicle's axes as they lie when it begins.
                "delta_v_m_per_s": list(change),
                "pdof_deg": pdof(change).horizontal_deg,
                "span_s": SPAN,
                "delta_v_along_turning_axes_m_per_s": felt.tolist(),
                "delta_v_north_east_down_m_per_s": over_ground.tolist(),
                "pdof_along_turning_axes_deg": pdof(felt).horizontal_deg,
                "yaw_rate_before_deg_per_s": angles[0],
                "yaw_rate_after_deg_per_s": angles[1],
            }
        )
    return found


def _yaw(recorded: RecordedCase, since: float) -> float:
    """Yaw rate about the vehicle's down axis, deg/s, exactly."""
    crash = recorded.case.crash
    rate = crash.motion.rate(np.array([crash.start + since]))
    return math.degrees(float(rate[0, 2]))


def _end(recorded: RecordedCase) -> dict[str, float]:
    filmed = recorded.truth.loc[:AFTER]
    at = filmed.iloc[-1]
    return {
        "time_s": float(filmed.index[-1]),
        "north_m": float(at["north"]),
        "east_m": float(at["east"]),
        "down_m": float(at["down"]),
        "heading_deg": float(at["heading"]),
    }


def _unit(of: RecordedUnit) -> dict[str, Any]:
    truth, unit, design = of.truth, of.unit, of.recorder.design
    parts = {
        f"{part_file(of, k)}.csv": {
            "part": built.part,
            "rate_hz": built.rate,
            "errors": stated_errors(errors, "m_per_s2"),
        }
        for k, (built, errors) in enumerate(
            zip(design.accelerometers, truth.accelerometers, strict=True)
        )
    }
    if truth.gyro is not None and design.gyro is not None:
        parts[f"{part_file(of, None)}.csv"] = {
            "part": design.gyro.part,
            "rate_hz": design.gyro.rate,
            "errors": stated_errors(truth.gyro, "rad_per_s"),
        }
    return {
        "mounting": _mounting(truth.mounting),
        "stated_mounting": _mounting(unit.mounting),
        "clock_offset_s": truth.clock_offset,
        "clock_drift_ppm": truth.clock_drift_ppm,
        "trigger_error_s": truth.trigger_error,
        "parts": parts,
    }


def _mounting(mounting: Mounting) -> dict[str, list[float]]:
    return {"position_m": list(mounting.position), "angles_deg": list(mounting.angles_deg)}
