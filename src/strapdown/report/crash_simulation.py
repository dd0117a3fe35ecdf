"""Write the records of a simulated crash, its case and the truth as a sealed bundle."""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from strapdown import earth
from strapdown.bundle import Seal, check_destination, write_bundle, write_json
from strapdown.config.sources import CrashSimulationSpec
from strapdown.crash.pdof import pdof
from strapdown.errors import check_choice
from strapdown.formats import crash_writers as writers
from strapdown.formats.crash_record import QUANTITIES, CrashChannel, CrashRecord
from strapdown.sensors.catalogue import KEYS, load_sensor
from strapdown.sensors.crash_unit import Mounting, RecordedTriad
from strapdown.sensors.uncertainty import TriadUncertainty, uncertainty_of
from strapdown.simulation import TriadErrors
from strapdown.simulation.crash_cases import (
    AFTER,
    RecordedCase,
    RecordedUnit,
    find_case,
    record_case,
)
from strapdown.simulation.crash_recording import TriadDesign
from strapdown.simulation.mounted_motion import ExactAnswers
from strapdown.tables import ACCEL, GYRO
from strapdown.tables.checks import index_of


def write_crash_simulation(
    spec: CrashSimulationSpec, out: Path, *, force: bool = False, made: RecordedCase | None = None
) -> Seal:
    """Write the records of a simulated crash.

    Parameters
    ----------
    out : Path
        Folder to create.
    force : bool
        Overwrite an existing bundle.
    made : RecordedCase, optional
        From `record_case` of this specification, if it has been simulated already.

    Returns
    -------
    Seal
        The folder holds one text table per part of each recorder (``imu1_low_g.csv``), or one test
        in ISO MME per recorder (``imu1/imu1.mme``), on its own clock; ``cameras.csv``, the path of
        the reference point seen by two cameras, and ``truth.csv``, the exact path with velocity
        and attitude, both by time from the trigger; ``case.toml``, which `strapdown crash` reads;
        and ``scenario.json`` with the exact answers and every drawn error.

    Raises
    ------
    ConfigError
        The crash, a recorder, a format or the sampling is unknown, the rate is too low, or `out`
        may not be written.
    """
    check_destination(out, force)
    formats = _formats(spec)
    recorded = made or record_case(
        find_case(spec.name),
        spec.units,
        rate=spec.rate_hz,
        sampling=spec.sampling,
        seed=spec.seed,
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
        # The case reads the format that was named first.
        for name in reversed(formats):
            for unit in recorded.units:
                places |= RECORD_WRITERS[name](folder, unit)
        writers.write_path_csv(folder / "cameras.csv", recorded.camera_path)
        writers.write_path_csv(folder / "truth.csv", recorded.truth)
        text = case_text(recorded, places, spec.seed)
        (folder / "case.toml").write_text(text, encoding="utf-8", newline="\n")
        write_json(folder / "scenario.json", _description(spec, recorded))
    return seals[0]


def _formats(spec: CrashSimulationSpec) -> tuple[str, ...]:
    for name in spec.formats:
        check_choice(
            "report.no-writer-crash-records",
            (*RECORD_WRITERS, "all"),
            quantity="--format",
            name=name,
        )
    return tuple(RECORD_WRITERS) if "all" in spec.formats else tuple(dict.fromkeys(spec.formats))


class _Part(NamedTuple):
    """A triad of a recorder: its number (None: the gyro), how it was built, read and is wrong."""

    which: int | None
    design: TriadDesign
    triad: RecordedTriad
    errors: TriadErrors


def _parts(of: RecordedUnit) -> list[_Part]:
    """The accelerometers of a recorder, and its gyro."""
    unit, design, truth = of.unit, of.recorder.design, of.truth
    each = zip(design.accelerometers, unit.accelerometers, truth.accelerometers, strict=True)
    parts = [_Part(k, *one) for k, one in enumerate(each)]
    if unit.gyro is not None and design.gyro is not None and truth.gyro is not None:
        parts.append(_Part(None, design.gyro, unit.gyro, truth.gyro))
    return parts


def _write_csv(folder: Path, of: RecordedUnit) -> dict[str, PartPlace]:
    """Write one text table per part, as exported by a recorder."""
    places = {}
    for which, _, triad, _ in _parts(of):
        name = part_file(of, which)
        writers.write_recorder_csv(folder / f"{name}.csv", triad.table)
        headings = writers.GYRO_HEADINGS if which is None else writers.ACCEL_HEADINGS
        places[name] = PartPlace(f"{name}.csv", headings, writers.TIME)
    return places


def _write_mme(folder: Path, of: RecordedUnit) -> dict[str, PartPlace]:
    """Write one test in ISO MME for all parts, as delivered by a laboratory."""
    name = of.unit.name.lower()
    channels = {part_file(of, p.which): _channels(of, p.which, p.triad) for p in _parts(of)}
    record = CrashRecord(
        Path(name),
        "simulated",
        f"simulated recorder {of.unit.name}",
        {},
        tuple(c for triple in channels.values() for c in triple),
        (),
    )
    codes = writers.write_mme(folder / name, record, name=name)
    return {
        part: PartPlace(f"{name}/{name}.mme", (codes[x.name], codes[y.name], codes[z.name]))
        for part, (x, y, z) in channels.items()
    }


def _channels(
    of: RecordedUnit, which: int | None, triad: RecordedTriad
) -> tuple[CrashChannel, CrashChannel, CrashChannel]:
    quantity = "rate" if which is None else "acceleration"
    time = index_of(triad.table)
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


#: Writers by format; each returns the file location of each part of a recorder.
RECORD_WRITERS: dict[str, Callable[[Path, RecordedUnit], dict[str, PartPlace]]] = {
    "csv": _write_csv,
    "mme": _write_mme,
}


def _description(spec: CrashSimulationSpec, recorded: RecordedCase) -> dict[str, Any]:
    """True motion, and true errors of the recorders."""
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
        "point": "center of mass",
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
    for begin, end, change in zip(crash.impacts, crash.ends, crash.delta_v, strict=True):
        # Over the contact, as it is reconstructed: tires and lean go on changing the velocity.
        since, until = begin - crash.start, end - crash.start
        felt = exact.along_body(since, until)
        over_ground = exact.over_ground(since, until)
        angles = _yaw(recorded, since), _yaw(recorded, until)
        found.append(
            {
                "time_s": since,
                # Of the impact alone, in the vehicle's axes at its start.
                "delta_v_m_per_s": list(change),
                "pdof_deg": pdof(change).horizontal_deg,
                "span_s": round(until - since, 12),
                "delta_v_along_turning_axes_m_per_s": felt.tolist(),
                "delta_v_north_east_down_m_per_s": over_ground.tolist(),
                "pdof_along_turning_axes_deg": pdof(felt).horizontal_deg,
                "yaw_rate_before_deg_per_s": angles[0],
                "yaw_rate_after_deg_per_s": angles[1],
            }
        )
    return found


def _yaw(recorded: RecordedCase, since: float) -> float:
    """Exact yaw rate about the vehicle's down axis, deg/s."""
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
    truth, unit = of.truth, of.unit
    parts = {
        f"{part_file(of, which)}.csv": {
            "part": built.part,
            "rate_hz": built.rate,
            "errors": stated_errors(errors, "rad_per_s" if which is None else "m_per_s2"),
        }
        for which, built, _, errors in _parts(of)
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


# Case file of a simulated crash, completed as by an investigator.


# Attributes of a triad's uncertainty, and the catalogue keys that state them in a case.
_STATED: dict[str, dict[str, str]] = {
    "accel": {
        "noise_density": "noise_density_ug_per_sqrt_hz",
        "bias": "bias_sd_mg",
        "scale": "scale_sd_percent",
        "misalignment": "misalignment_sd_percent",
        "nonlinearity_2": "nonlinearity_bound_percent",
        "full_scale": "full_scale_g",
        "quantization": "quantization_mg",
        "bandwidth": "bandwidth_hz",
    },
    "gyro": {
        "noise_density": "noise_density_deg_per_s_per_sqrt_hz",
        "bias": "bias_sd_deg_per_s",
        "scale": "scale_sd_percent",
        "misalignment": "misalignment_sd_percent",
        "nonlinearity_2": "nonlinearity_bound_percent",
        "g_sensitivity": "g_sensitivity_sd_deg_per_s_per_g",
        "full_scale": "full_scale_deg_per_s",
        "quantization": "quantization_deg_per_s",
        "bandwidth": "bandwidth_hz",
    },
}
# Digits of an uncertainty; a catalogue states fewer.
_DIGITS = 7
_COMMON_RATE = 200.0  # Hz
# Column of the comments.
_COLUMN = 34


@dataclass(frozen=True)
class PartPlace:
    """Location of a recorder's part: the file, its three channels, and its time stamps."""

    path: str
    channels: tuple[str, str, str]
    time: str | None = None


def case_text(recorded: RecordedCase, places: Mapping[str, PartPlace], seed: int) -> str:
    """Write the case file of a simulated crash.

    `places`: by `part_file`. `seed`: seed of the simulation, for the file's number. Returns: TOML
    with the stated properties of the recorders, not their true errors.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("strapdown.report", ""),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    case = recorded.case
    text = environment.get_template("simulated_case.toml.jinja").render(
        case=case,
        entry=recorded.entry,
        summary=case.summary[0].upper() + case.summary[1:],
        remark=textwrap.wrap(case.remark, 94),
        seed=seed,
        units=recorded.units,
        parts=lambda of: _statements(of, places),
        sampling=recorded.units[0].unit.accelerometers[0].table.attrs["sampling"],
        rate=_rate(recorded),
        gravity=_gravity(recorded),
        number=_number,
        numbers=_numbers,
        text=lambda text: json.dumps(text, ensure_ascii=False),
    )
    return _aligned(text)


def part_name(unit: RecordedUnit, which: int | None) -> str:
    """Name of an accelerometer by its number, or of the gyro (None)."""
    if which is None:
        return "gyro"
    if len(unit.unit.accelerometers) == 1:
        return "accel"
    return "low-g" if which == 0 else "high-g"


def part_file(unit: RecordedUnit, which: int | None) -> str:
    """File name of a part, without extension."""
    return f"{unit.unit.name}_{part_name(unit, which)}".lower().replace("-", "_")


def _statements(of: RecordedUnit, places: Mapping[str, PartPlace]) -> Iterator[dict[str, Any]]:
    """What the case says of each part of a recorder."""
    for which, built, triad, _ in _parts(of):
        table = "[units.gyro]" if which is None else "[[units.accelerometers]]"
        place = places[part_file(of, which)]
        kind = "gyro" if which is None else "accel"
        yield {
            "table": table + "  # the lowest range first" * (which == 0),
            "name": part_name(of, which),
            "place": place,
            "channels": zip("xyz", place.channels, strict=True),
            "sampling": triad.table.attrs["sampling"],
            "sensor": built.part,
            "stated": _differences(kind, built.part, triad.uncertainty),
        }


def _differences(kind: str, sensor: str, told: TriadUncertainty) -> list[str]:
    """Stated uncertainties of a triad that differ from its data sheet."""
    sheet = uncertainty_of(load_sensor(sensor), kind)
    found = []
    for name, key in _STATED[kind].items():
        ours, theirs = (np.atleast_1d(getattr(u, name)) for u in (told, sheet))
        if np.array_equal(ours, theirs):
            continue
        # A bound of the catalogue is √3 times the standard deviation.
        factor = KEYS[kind][key].factor * (1.0 if "_bound_" not in key else 1.0 / math.sqrt(3.0))
        values = [float(v) / factor for v in ours]
        alike = max(values) - min(values) <= 1e-12 * max(values)
        value = _number(values[0], _DIGITS) if alike else _numbers(values, _DIGITS)
        found.append(f"{key} = {value}")
    return found


def _gravity(recorded: RecordedCase) -> float:
    motion = recorded.case.crash.motion
    origin, shape = motion.origin, motion.ellipsoid
    return float(earth.gravity([origin.lat_deg], [origin.alt], ellipsoid=shape)[0, 2])


def _rate(recorded: RecordedCase) -> float:
    """Rate of the common stamps: 200 Hz, or that of the slowest recorder."""
    rates = [t.rate for u in recorded.units for t in u.recorder.design.accelerometers]
    return min(_COMMON_RATE, *rates)


def _number(value: float, digits: int = 12) -> str:
    # Zero is written without a sign.
    return repr(float(f"{value:.{digits}g}") + 0.0)


def _numbers(values: Sequence[float], digits: int = 12) -> str:
    return f"[{', '.join(_number(v, digits) for v in values)}]"


def _aligned(text: str) -> str:
    """Align the comments behind values in one column, where the values leave room."""
    lines = []
    for line in text.splitlines():
        value, mark, comment = line.partition("  # ")
        lines.append(f"{value:<{_COLUMN}}{mark.lstrip()}{comment}" if mark else line)
    return "\n".join(lines) + "\n"


# Stated errors of a sensor, with keys that carry their units.


# Suffix to the unit of the triad in a key, or its replacement.
_AFTER = {
    "noise_density": "_per_sqrt_hz",
    "random_walk": "_per_sqrt_s",
    "trend": "_per_s",
    "vibration_rectification": "_per_m2_per_s4",
}
_UNITS = {
    "correlation_time": "s",
    "jitter": "s",
    "warm_up_time": "s",
    "bandwidth": "hz",
    "misalignment": "rad",
    "scale": "relative",
    "nonlinearity_2": "relative",
    "nonlinearity_3": "relative",
}


def stated_errors(errors: TriadErrors, unit: str) -> dict[str, Any]:
    """The errors that are set; each key carries its unit."""
    none, stated = TriadErrors(), {}
    for f in fields(errors):
        value = getattr(errors, f.name)
        if value != getattr(none, f.name):
            of = _UNITS.get(f.name, unit + _AFTER.get(f.name, ""))
            of += "_per_m_per_s2" if f.name == "g_sensitivity" else ""
            stated[f"{f.name}_{of}"] = value
    return stated
