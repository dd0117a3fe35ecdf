"""Calibration of a sensor from Python."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from strapdown.api.reading import imu_input, log_table
from strapdown.config.logs import GRAVITY_RANGE, CalibrateSpec, KnownTurn, LogTable
from strapdown.config.spec import specify
from strapdown.errors import ConfigError, DataError, check_choice
from strapdown.progress import Progress, silent
from strapdown.systems.calibrate_run import CalibrateRun as CalibrateRun
from strapdown.systems.calibrate_run import run_calibrate
from strapdown.systems.inputs import NOWHERE, Memory

WORD = re.compile(r"([xyz])?\s*([+-]?\d+(?:\.\d+)?)\s*(?:deg|°)?")


def calibrate(
    logs: Any,
    *,
    procedure: str | None = None,
    turns: str | Path | Sequence[Mapping[str, Any]] | None = None,
    gravity_m_per_s2: float | None = None,
    lat: float | None = None,
    alt: float = 0.0,
    sensor: str | Path | None = None,
    progress: Progress = silent,
    **options: Any,
) -> CalibrateRun:
    """Find bias, scale, misalignment and g-sensitivity of a sensor, each with its bound.

    Parameters
    ----------
    logs : Imu, DataFrame, (t, gyro, accel), str or Path; or a list of them
        Logs of one sensor that rests in many poses, in any order: s, rad/s (n, 3), m/s² (n, 3).
    procedure : str, optional
        ``positions``, ``six-position``, ``turns`` or ``rate-table``; by the logs if not given.
    turns : str, Path, or sequence of mapping, optional
        Known rotations: words (``360``: each turn of about that angle; ``x 720, y 720``), a CSV
        file, or mappings, with ``axis``, ``angle_deg`` or ``rate_deg_per_s``, ``sd_deg``, ``log``
        (from 1), ``from_s``, ``to_s``.
    gravity_m_per_s2 : float, optional
        Local gravity; else by `lat` and `alt`, else the mean of the Earth, within 0.16 %.
    lat, alt : float, optional
        Latitude in deg, height in m.
    sensor : str or Path, optional
        Data sheet: what is known before the logs are read.
    progress : callable, optional
        Called with a stage and the completed fraction.
    **options
        ``pose_sd_deg`` (2) of six positions, ``turn_sd_deg`` (3) of known angles; and keys of a log
        in a file, as of `allan`.

    Returns
    -------
    CalibrateRun
        `parameters`, `calibration`, `magnetometer`, `findings`; `sensor` with the errors for
        `sensors.compensate`; `plot`, `save`, which writes ``calibration.toml`` for
        ``calibration=`` of `read_imu`.

    Raises
    ------
    ConfigError
        A file does not exist, or an option does not fit it.
    DataError
        A log cannot be read, or shows neither rests, nor known rotations, nor a turning field.
    """
    given = logs if isinstance(logs, list) else [logs]
    samples = [imu_input(one) for one in given]
    own = {k: options.pop(k) for k in ("pose_sd_deg", "turn_sd_deg") if k in options}
    known = ["gravity_m_per_s2", "lat", "alt", *LogTable.model_fields]
    known.remove("path")
    for key in options:
        check_choice("calibrate.unknown-option", known, quantity=key, name=key)
    low, high = GRAVITY_RANGE
    if gravity_m_per_s2 is not None and not low <= gravity_m_per_s2 <= high:
        data = {"quantity": "gravity_m_per_s2", "value": gravity_m_per_s2}
        raise ConfigError("calibrate.gravity-range", **data)
    stated = {key: value for key, value in options.items() if value not in (None, {}, False)}
    names = [f"imu-{k + 1}.npz" if len(given) > 1 else "imu.npz" for k in range(len(given))]
    memory = Memory.of(dict(zip(names, samples, strict=True)))
    with memory.as_files() as folder:
        tables = [log_table(one, folder / n, stated) for n, one in zip(names, samples, strict=True)]
        spec = specify(
            CalibrateSpec,
            name=Path(tables[0].path).resolve().stem,
            logs=tuple(tables),
            procedure=procedure,
            turns=() if turns is None else turns_of(turns),
            gravity_m_per_s2=gravity_m_per_s2,
            lat_deg=lat,
            alt_m=alt,
            sensor=None if sensor is None else str(sensor),
            **{key: value for key, value in own.items() if value is not None},
        )
        run = run_calibrate(spec, progress)
        return replace(run, memory=memory).in_folder(folder, NOWHERE)


def turns_of(given: str | Path | Sequence[Mapping[str, Any]]) -> tuple[KnownTurn, ...]:
    """Known rotations from words, a CSV file, or mappings.

    ConfigError: they are not understood.
    """
    if not isinstance(given, str | Path):
        return tuple(specify(KnownTurn, **row) for row in given)
    text = str(given).strip()
    if Path(text).suffix.lower() == ".csv":
        return _table(Path(text))
    out = []
    for word in (w.strip().lower() for w in text.split(",")):
        found = WORD.fullmatch(word)
        if found is None:
            raise ConfigError("calibrate.turns-not-understood", quantity="turns", text=word)
        # The gyro shows the sign.
        out.append(specify(KnownTurn, axis=found[1], angle_deg=abs(float(found[2]))))
    return tuple(out)


def _table(path: Path) -> tuple[KnownTurn, ...]:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        raise ConfigError("calibrate.no-turn-table", file=path.name, quantity="turns") from None
    rows = []
    for number, row in enumerate(csv.DictReader(lines), start=2):
        values: dict[str, Any] = {}
        for key, text in row.items():
            name, word = (key or "").strip(), (text if isinstance(text, str) else "").strip()
            if not word:
                continue
            if name == "axis":
                values[name] = word.lower()
                continue
            try:
                values[name] = int(word) if name == "log" else float(word)
            except ValueError:
                raise DataError(
                    "calibrate.turn-not-a-number",
                    file=path.name,
                    row=number,
                    quantity=name,
                    text=word,
                ) from None
        rows.append(specify(KnownTurn, **values))
    if not rows:
        raise DataError("calibrate.no-turn-in-table", file=path.name, quantity="turns")
    return tuple(rows)
