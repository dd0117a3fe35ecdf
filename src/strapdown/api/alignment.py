"""Alignment and predicted GNSS outage drift from Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from strapdown.api.navigation import NavigationRun
from strapdown.api.reading import ImuFile, imu_input, keys_in, log_in, table_input
from strapdown.config.alignment import NOT_BEFORE_FINE, AlignmentSpec
from strapdown.config.navigation import NavigationSpec
from strapdown.config.outage import OutageSpec
from strapdown.config.spec import specify
from strapdown.errors import ConfigError
from strapdown.formats import read_raw
from strapdown.progress import Progress, silent
from strapdown.report.outage import read_run_of_outage
from strapdown.systems.alignment_run import AlignmentRun as AlignmentRun
from strapdown.systems.alignment_run import run_alignment
from strapdown.systems.inputs import NOWHERE, Memory
from strapdown.systems.outage_run import OutageRun as OutageRun
from strapdown.systems.outage_run import run_outage


def align(
    imu: Any,
    *,
    site: Mapping[str, float] | Sequence[float] | None = None,
    sensor: str | Path | None = None,
    method: str | Mapping[str, Any] = "inertial_frame",
    fine: bool = True,
    gnss: Any = None,
    prefilter: str | Mapping[str, Any] = "none",
    progress: Progress = silent,
) -> AlignmentRun:
    """Find roll, pitch and heading of a body at a fixed position, with their uncertainty.

    Parameters
    ----------
    imu : Imu, DataFrame, (t, gyro, accel), str or Path
        Samples: s, rad/s (n, 3), m/s² (n, 3), body axes forward-right-down. A path is that of a
        log, or of a configuration (``.toml``), which then replaces the other arguments.
    site : mapping or sequence of float
        ``lat_deg``, ``lon_deg``, ``alt_m``: deg, deg, m over the ellipsoid; by default as stated
        in the log.
    sensor : str or Path
        Data sheet: a name of the catalogue, or a ``.toml`` file.
    method : str or mapping
        Coarse alignment: ``inertial_frame``, ``two_vector``, ``levelling``, ``gnss_course``; with
        options as a mapping: ``{"kind": "known_heading", "heading_deg": 90.0}``.
    fine : bool
        Whether a filter refines it, where that is possible after the coarse method.
    gnss : GnssFixes, DataFrame, str or Path, optional
        Fixes, for ``gnss_course``.
    prefilter : str or mapping
        Filter applied to the samples first: ``{"kind": "robust_fir", "rate_hz": 100.0}``.
    progress : callable, optional
        Called with a stage and the completed fraction.

    Raises
    ------
    ConfigError
        A required argument is missing or does not fit; the message names the argument.
    DataError
        The record cannot be used, or does not determine the attitude.
    DivergenceError
        The filter left the range possible for a stationary body.
    """
    if isinstance(imu, str | Path) and Path(imu).suffix.lower() == ".toml":
        if any(one is not None for one in (site, sensor, gnss)):
            raise ConfigError(
                "api.configuration-and-arguments",
                file=Path(imu).name,
                quantity="site, sensor, gnss",
            )
        return run_alignment(AlignmentSpec.read(imu), Path(imu), progress)
    samples = imu_input(imu)
    fixes = None if gnss is None else table_input(gnss, "gnss")
    memory = Memory.of({"imu.npz": samples, "gnss.csv": fixes})
    with memory.as_files() as folder:
        spec = specify_alignment(
            log_in(samples, folder),
            site=site if site is None or isinstance(site, Mapping) else _named(site),
            sensor=sensor,
            coarse={"kind": method} if isinstance(method, str) else method,
            fine=fine,
            gnss=None if fixes is None else keys_in(fixes, folder / "gnss.csv"),
            prefilter={"kind": prefilter} if isinstance(prefilter, str) else prefilter,
        )
        run = run_alignment(spec, None, progress)
        return replace(run, memory=memory).in_folder(folder, NOWHERE)


def _named(site: Sequence[float]) -> dict[str, float]:
    if len(site) not in (2, 3):
        raise ConfigError("api.not-a-position", quantity="site", count=len(site))
    return dict(zip(("lat_deg", "lon_deg", "alt_m"), map(float, site), strict=False))


def specify_alignment(
    log: ImuFile,
    *,
    site: Mapping[str, float] | None,
    sensor: str | Path | None,
    coarse: Mapping[str, Any],
    fine: bool,
    gnss: Mapping[str, Any] | None = None,
    prefilter: Mapping[str, Any] | None = None,
    called: Callable[[str], str] = str,
) -> AlignmentSpec:
    """Build the specification of an alignment; its position may come from the log.

    `site`, `sensor`, `fine`: as `align`. `gnss`: the file of fixes, as the table ``gnss`` of a
    configuration. `coarse`, `prefilter`: the module with its options, including ``kind``. `called`:
    name of an argument in the interface, for messages: ``sensor`` as ``--sensor``. ConfigError: a
    required argument is missing; the message names it. DataError: the log cannot be read.
    """
    if sensor is None:
        raise ConfigError("api.no-sensor-for-alignment", quantity=called("sensor"))
    alone = not fine or coarse.get("kind") in NOT_BEFORE_FINE
    return AlignmentSpec.checked(
        {
            "name": Path(log.log.path).resolve().stem,
            "log": log.log.model_dump(exclude_none=True),
            "axes": {"axes": log.axes},
            "site": _site(log.log.path, site or {}, called),
            "sensors": {"sensor": str(sensor)},
            "prefilter": dict(prefilter or {"kind": "none"}),
            "gnss": gnss,
            "coarse": dict(coarse),
            "fine": {"kind": "none" if alone else "filter"},
        }
    )


def _site(log: str, known: Mapping[str, float], called: Callable[[str], str]) -> dict[str, float]:
    if not {"lat_deg", "lon_deg"} & set(known):
        start = read_raw(Path(log)).start
        if start is not None:
            said = {"lat_deg": start.lat_deg, "lon_deg": start.lon_deg, "alt_m": start.alt}
            return {**said, **known}
    for key in ("lat", "lon"):
        if f"{key}_deg" not in known:
            raise ConfigError(
                "api.no-site-position",
                quantity=called(key),
                called=called("lat"),
                called_2=called("lon"),
                called_3=called("alt"),
            )
    return {key: float(value) for key, value in known.items()}


# --- predicted drift in a GNSS outage -----------------------------------------------------


def outage(
    source: str | Path | NavigationRun,
    outage_s: float = 60.0,
    *,
    progress: Progress = silent,
    **options: Any,
) -> OutageRun:
    """Predict the drift of a sensor, or of a navigation run, in a GNSS outage.

    Parameters
    ----------
    source : str, Path or NavigationRun
        A sensor of the catalogue or its file, along a stated motion; or a navigation run, its
        bundle or its configuration, whose receivers are switched off.
    outage_s : float, s
    progress : callable, optional
        Called with a stage and the completed fraction.
    **options
        Tables and keys of the configuration: ``motion={"speed_m_per_s": 15.0}``,
        ``start={"heading_sd_deg": 1.0}``, ``aiding={"no_slip": {}}``; for a run ``places``,
        ``at_s``, ``from_s``, ``to_s``, ``duration_s``.

    Raises
    ------
    ConfigError
        The sensor does not exist, or an option does not fit.
    DataError
        The record of the run no longer exists.
    """
    with _run_of(source) as (navigation, file, memory, folder):
        sensor = None if navigation is not None else str(source)
        spec = specify(OutageSpec, outage_s=float(outage_s), sensor=sensor, **options)
        run = run_outage(spec, navigation, file, progress)
        return replace(run, memory=memory).in_folder(folder, NOWHERE)


@contextmanager
def _run_of(
    source: str | Path | NavigationRun,
) -> Iterator[tuple[NavigationSpec | None, Path | None, Memory, Path]]:
    """The navigation run that a source names, with every input a file."""
    if not isinstance(source, NavigationRun):
        yield (*read_run_of_outage(source), Memory({}), NOWHERE)
        return
    with source.memory.as_files() as folder:
        yield source.in_folder(NOWHERE, folder).spec, None, source.memory, folder
