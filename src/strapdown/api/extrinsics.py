"""Extrinsics of two sensors from Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from strapdown.api.navigation import specify_navigation
from strapdown.api.reading import ImuFile, imu_input, imu_of, keys_in, log_table, table_input
from strapdown.api.stamps import by_time
from strapdown.config.logs import LogTable
from strapdown.config.navigation import ExtrinsicsSpec, NavigationSpec
from strapdown.config.spec import specify
from strapdown.errors import ConfigError, StrapdownError
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.gnss_fixes import GnssOptions
from strapdown.progress import Progress, silent
from strapdown.systems.extrinsics_run import ExtrinsicsRun as ExtrinsicsRun
from strapdown.systems.extrinsics_run import read_field, run_extrinsics
from strapdown.systems.inputs import NOWHERE, Memory
from strapdown.tables import GEODETIC, GYRO, MAG

#: Before a drive: standard deviations of the antenna's lever arm, m, of the offset, s, and of the
#: mounting, deg.
ARM_SD, OFFSET_SD, MOUNTING_SD = 2.0, 0.3, 10.0
#: The axle is not known: at 1.5 m, a turn faster than this, deg/s, would be a lateral velocity of
#: more than this, m/s, which would count as lever arm of the antenna.
STRAIGHT, SIDEWAYS = 2.0, 0.05
KINDS = ("imu", "magnetometer", "gnss")


def extrinsics(
    log: Any,
    other: Any = None,
    *,
    kind: str | None = None,
    offset: float | None = None,
    sensor: str | Path | None = None,
    wheels: bool = True,
    progress: Progress = silent,
    **options: Any,
) -> ExtrinsicsRun:
    """Find rotation, lever arm and clock offset between two sensors on one rigid body.

    ``v_a = R v_b``; the lever arm is from the origin of a to that of b along the axes of a;
    ``t_b = t_a + offset``.

    Parameters
    ----------
    log : Imu, DataFrame, (t, gyro, accel), str or Path
        Samples of the inertial unit a.
    other : as `log`; GnssFixes, DataFrame with ``mag_x mag_y mag_z``, str or Path; optional
        The other sensor, b: a second unit, a magnetometer, fixes of an antenna. Without it: the
        magnetometer in `log`.
    kind : {'imu', 'magnetometer', 'gnss'}, optional
        What `other` is; found from it, if not given.
    offset : float, s, optional
        Clock of b less that of a, to 0.3 s; searched, if not given.
    sensor : str or Path, optional
        Data sheet of the unit, for an antenna.
    wheels : bool
        For an antenna: whether the vehicle rolls on wheels, which shows the mounting of the unit.
    progress : callable, optional
        Called with a stage and the completed fraction.
    **options
        Further keys of the log in a file, as ``columns``, ``format``, ``from_s``, ``axes``,
        ``calibration``; with the prefix ``other_``, of the other log. For an antenna keys of the
        measurement ``gnss``, as ``lever_arm_m``, ``lever_arm_sd_m``, ``position_sd_m``; and
        ``heading_deg`` at the start, for a drive whose course does not show it.

    Returns
    -------
    ExtrinsicsRun
        `result`, `transform`, `to_pandas`, `findings`; `plot`, `save`.

    Raises
    ------
    ConfigError
        A file does not exist, or an option does not fit it.
    DataError
        A log cannot be read, moves too little, or both do not show one motion.
    """
    if kind is not None and kind not in KINDS:
        raise ConfigError("extrinsics.unknown-kind", quantity="kind", word=kind, known=KINDS)
    one_clock = False
    if other is None and isinstance(log, pd.DataFrame) and set(MAG) <= set(log.columns):
        # Samples in memory keep only those of gyros and accelerometers.
        other, one_clock = by_time(log)[MAG], True
    samples = imu_input(log)
    kind = kind or _kind_of(other)
    given = {key: value for key, value in options.items() if value not in (None, {}, False)}
    theirs = {k.removeprefix("other_"): given.pop(k) for k in list(given) if k[:6] == "other_"}
    second = None if other is None else _second(other, kind)
    file = {"imu": "other.npz", "gnss": "gnss.csv", "magnetometer": "other.csv"}[kind]
    if isinstance(second, pd.DataFrame) and GYRO[0] in second.columns:
        file = "other.npz"
    memory = Memory.of({"imu.npz": samples, file: second})
    with memory.as_files() as folder:
        own = {k: given.pop(k) for k in list(given) if k in LogTable.model_fields or k == "axes"}
        table, axes, name = _log(samples, own, folder / "imu.npz")
        spec: dict[str, Any] = {"kind": kind, "name": name, "log": table, "axes": axes}
        if kind == "gnss":
            if second is None:
                raise ConfigError("extrinsics.other-missing", quantity="other")
            if theirs:
                key = f"other_{next(iter(theirs))}"
                raise ConfigError("extrinsics.unknown-option", quantity=key, kind=kind)
            log_file = ImuFile(table, axes)
            keys = {**given, **keys_in(second, folder / file)}
            spec["navigation"] = _run_of_antenna(log_file, keys, sensor, offset, wheels).plain()
        elif given:
            raise ConfigError("extrinsics.unknown-option", quantity=next(iter(given)), kind=kind)
        else:
            spec |= {"offset_s": offset, "one_clock": one_clock}
            if second is not None:
                spec["other"], spec["other_axes"], _ = _log(second, theirs, folder / file)
        run = run_extrinsics(specify(ExtrinsicsSpec, **spec), progress)
        return replace(run, memory=memory).in_folder(folder, NOWHERE)


def _second(other: Any, kind: str) -> Any:
    """The other sensor as a table in memory, or as a file."""
    if kind == "imu" or (kind == "magnetometer" and not isinstance(other, pd.DataFrame)):
        return imu_input(other)
    return table_input(other, "other")


def _log(samples: Any, stated: dict[str, Any], path: Path) -> tuple[LogTable, Any, str]:
    """Table of a log, its axes, and a name; `path`: of samples in memory."""
    axes = stated.pop("axes", None)
    if isinstance(samples, ImuFile):
        axes = axes or samples.axes
    table = log_table(samples, path, stated)
    return table, axes, Path(table.path).resolve().stem


def _run_of_antenna(
    log: ImuFile, keys: dict[str, Any], sensor: Any, offset: float | None, wheels: bool
) -> NavigationSpec:
    """The run with lever arm, time offset and mounting as states, with which the passes begin."""
    start = {key: keys[key] for key in ("heading_deg",) if key in keys}
    keys = {key: value for key, value in keys.items() if key not in start}
    aids: dict[str, Any] = {"gnss": {"kind": "gnss", "lever_arm_sd_m": ARM_SD, **keys}}
    if offset is not None:
        aids["gnss"]["time_offset_s"] = offset
    if wheels:
        aids["no_slip"] = {
            "kind": "no_slip",
            "mounting_sd_deg": (MOUNTING_SD, MOUNTING_SD),
            "largest_rate_deg_per_s": STRAIGHT,
            "lateral_sd_m_per_s": SIDEWAYS,
        }
    options = {"smoother": {"kind": "rts", "passes": 1}, "trust": {"repeat": False}}
    called = {"heading": "heading_deg", "gnss": "other"}
    spec = specify_navigation(
        log,
        aids,
        sensor=sensor,
        start=start,
        options=options,
        called=lambda name: called.get(name, name),
    ).plain()
    aid = spec["aiding"]["gnss"]
    aid["time_offset_sd_s"] = max(aid["time_offset_sd_s"], OFFSET_SD)
    # In a turn late velocities look like a lever arm along the path of speed times delay, which is
    # not a state: of 130 ms, 10 ms wrong are 0.1 m at 10 m/s.
    aid["use_velocity"] = aid["use_velocity"] and not aid["velocity_delay_s"]
    return NavigationSpec.checked(spec)


def _kind_of(other: Any) -> str:
    """What another sensor is, by its columns or by the streams of its file."""
    if other is None:
        return "magnetometer"
    if isinstance(other, pd.DataFrame):
        columns = set(other.columns)
        if set(GYRO) <= columns:
            return "imu"
        return "gnss" if set(GEODETIC) <= columns else "magnetometer"
    if not isinstance(other, str | Path):
        return "imu"
    tried: list[tuple[str, Callable[[], Any]]] = [
        ("imu", lambda: imu_of(other)),
        ("gnss", lambda: read_gnss(other, GnssOptions(unstated_position_sd=1.0))),
        ("magnetometer", lambda: read_field(other)),
    ]
    refused = []
    for kind, read in tried:
        try:
            read()
        except StrapdownError as error:
            refused.append(error)
            continue
        return kind
    # Of a file of fixes: what is wrong with them, and not that it is not a log.
    code, data = refused[0].finding.code, refused[0].finding.data
    fixes = code == "io.no-stream" and "gnss" in data["streams"]
    raise refused[1 if fixes else 0]
