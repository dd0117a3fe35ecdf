"""``strapdown navigate``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from strapdown.cli.console import WORDS
from strapdown.cli.result_folder import (
    claim,
    folder_to_write,
    refuse_result,
    run_and_save,
    source_name,
)
from strapdown.cli.shared_options import (
    HEIGHT,
    LOG_FLAGS,
    LONGITUDE,
    RECOVER,
    SENSOR_MODEL,
    TOKEN,
    FixFlags,
    LogFlags,
    ReportFlags,
    as_flag,
    fix_flags,
    fix_keys,
    flag_of,
    folder_to_make,
    log_keys,
    missing_argument,
    refuse_beside_file,
    refuse_without_live,
    running,
    spread,
    with_what,
)
from strapdown.errors import ConfigError

if TYPE_CHECKING:
    from strapdown.bundle import Seal
    from strapdown.config.navigation import NavigationSpec
    from strapdown.live.replay import Replay
    from strapdown.progress import Progress
    from strapdown.systems.navigation_run import NavigationRun

EPILOG = (
    "Example: strapdown navigate log.csv --gnss fixes.csv --sensor adis16470\n\n"
    "Example: strapdown navigate navigate.toml (strapdown init navigate LOG writes one)"
)
#: Flags by key path of the specification.
FLAGS = {
    "site, lat_deg": "--lat",
    "site, lon_deg": "--lon",
    "site, alt_m": "--alt",
    "sensors, sensor": "--sensor",
    "coarse, heading_deg": "--heading",
    "aiding, gnss, path": "--gnss",
    "aiding, gnss, lever_arm_m": "--lever-arm",
    "truth, path": "--truth",
    "control_points, path": "--points",
    "map, path": "--map",
    "smoother, kind": "--smooth",
    **LOG_FLAGS,
    **fix_flags("aiding, gnss"),
}


@dataclass(frozen=True)
class NavigateFlags:
    """Measurements, start and mode of a navigation run."""

    gnss: Path | None = with_what("FIXES", "Fixes of a satellite receiver.")
    lever_arm: str | None = with_what(
        "X,Y,Z", "Of its antenna from the sensors, forward, right, down, m (0,0,0)."
    )
    sensor: str | None = SENSOR_MODEL
    lat: float | None = with_what("DEG", "Latitude at the start, without fixes.")
    lon: float | None = LONGITUDE
    alt: float | None = HEIGHT
    heading: float | None = with_what(
        "DEG", "Initial heading, if neither gyros nor course determine it."
    )
    truth: Path | None = with_what("FILE", "A trajectory to compare with, before that of a file.")
    points: Path | None = with_what(
        "FILE",
        "Control points (time, north, east) to score the path by, after the origin and "
        "heading that fit best.",
    )
    map: Path | None = with_what(
        "FILE",
        "A local map under the plan of the report: raster tiles, .mbtiles or .pmtiles. "
        "Nothing is fetched.",
    )
    smooth: bool = running(
        None,
        "Smooth the run: estimate every state from all measurements (RTS).",
        "--smooth",
        default=False,
    )
    pace: str | None = running(
        "N|max",
        "Replay the record sample by sample, N times as fast as recorded, and report "
        "the latency of each sample.",
    )
    live: str | None = running(
        "-|udp://HOST:PORT",
        "Take samples as they come, as lines of standard input or of datagrams, by the "
        "file of a run.",
    )
    every: float | None = running("S", "With --live: a line of the state so often (1).")
    lines: str | None = running("json|csv", "With --live: as what (json).")
    token: str | None = TOKEN
    recover: Path | None = RECOVER


@spread
def navigate(
    source: Path | None = typer.Argument(
        None,
        metavar="LOG|CONFIG.toml",
        help="A log of gyros and accelerometers, a session of strapdown live, or the file of "
        "a run of navigation.",
        show_default=False,
    ),
    *,
    flags: NavigateFlags,
    log: LogFlags,
    fixes: FixFlags,
    out: Path | None = folder_to_make("LOG-navigate"),
    write: ReportFlags,
) -> None:
    """Find position, velocity and attitude over a record, by inertial sensors and measurements."""
    from strapdown.bundle import write_latency
    from strapdown.config.navigation import NavigationSpec
    from strapdown.systems.navigation_run import run_navigation

    if source is None:
        if flags.recover is None:
            raise missing_argument("LOG|CONFIG.toml")
    else:
        refuse_result(source, "log")
    played: Replay | None = None
    if flags.pace is not None:
        from strapdown.live.replay import Replay, parse_pace

        played = Replay(parse_pace(flags.pace))
    given: dict[str, Any] = {**asdict(flags), "smooth": flags.smooth or None}
    given |= {**log.given(), **fixes.given()}
    pace, live = given.pop("pace"), given.pop("live")
    own_of_live = {f"--{name}": given.pop(name) for name in ("every", "lines", "token")}
    refused = {flag_of(name): value for name, value in given.items() if name != "recover"}
    refused |= {"--pace": pace, "--json": write.json or None}
    if flags.recover is not None:
        from strapdown.cli.navigate_live import recover_navigation

        recover_navigation(out, write, flags, {"LOG|CONFIG.toml": source, **refused})
        return
    del given["recover"]
    assert source is not None
    own = source.suffix.lower() == ".toml"
    if own and live is None:
        refuse_beside_file(source, given | dict.fromkeys(("smooth", "map", "truth")), FLAGS)
    if own:
        WORDS.set("file")
    asked = NavigationSpec.read(source) if own else None
    if asked is not None and flags.smooth:
        asked = asked.smoothed()
    for table, path in (("map", flags.map), ("truth", flags.truth)):
        if asked is not None and path is not None:
            asked = asked.with_path(table, path.absolute())
    named = None if asked is None else source_name(asked)
    folder = folder_to_write(out, source, "navigate", write.force, named)
    if live is not None:
        from strapdown.cli.navigate_live import navigate_live

        claim(folder, write.force)
        navigate_live(source, folder, write, flags, refused)
        return
    refuse_without_live(own_of_live)
    session = None if own or any(value is not None for value in given.values()) else source
    with_pace = played is not None
    received = None if session is None else _session_that_navigated(session, pace=with_pace)

    def compute(report: Progress) -> NavigationRun:
        if received is not None:
            from strapdown.cli.live_folder import warner
            from strapdown.cli.navigate_live import navigate_session

            return navigate_session(received, folder, report, played, warner(write.quiet))
        report("looking through", 0.01)
        spec = navigation_of_flags(source, given) if asked is None else asked
        drive: dict[str, Any] = {} if played is None else {"drive": played}
        return run_navigation(spec, source if own else None, report, **drive)

    def further(_: NavigationRun, seal: Seal) -> None:
        found = None if played is None else played.tape.latency()
        if found is not None:
            write_latency(seal, {"pace": pace, **found.told()})
        if received is not None:
            from strapdown.cli.live_folder import let_go_of_received

            let_go_of_received(folder)

    def show(result: NavigationRun) -> None:
        from strapdown.cli.navigate_tables import print_latency, print_navigation

        print_navigation(result, result.findings, verbose=write.verbose)
        found = None if played is None else played.tape.latency()
        if found is not None:
            print_latency(found, f"played, pace {pace}")

    run_and_save(compute, folder, write, "navigation.json", show, further)


def _session_that_navigated(path: Path, *, pace: bool = False) -> Path | None:
    """Return the folder of a session that navigated, by itself or its journal; None of others.

    `pace`: whether it is to be played at a pace. ConfigError: it is, and computed an attitude,
    which is not a navigation to play.
    """
    from strapdown.formats.live_journal import run_of, session_folder

    folder = session_folder(path) if path.exists() else None
    if folder is None or (run := run_of(folder))["command"] != "live":
        return None
    if isinstance(run.get("configuration"), dict):
        return folder
    if pace:
        raise ConfigError("live.pace-of-attitude", file=str(path), quantity="--pace")
    return None


def navigation_of_flags(log: Path, given: Mapping[str, Any]) -> NavigationSpec:
    """Return the specification by the flags, completed from the log and the fixes.

    ConfigError: a value is invalid or missing; the message names the flag. DataError: a file cannot
    be read.
    """
    from strapdown.api.navigation import specify_navigation
    from strapdown.api.reading import ImuFile
    from strapdown.config.logs import LogTable
    from strapdown.config.spec import specify
    from strapdown.formats.gnss_files import open_fixes

    aids: dict[str, dict[str, Any]] = {}
    fixes = fix_keys(given, given["gnss"])
    if fixes or open_fixes(log) is not None:
        arm = given["lever_arm"]
        aids["gnss"] = {"kind": "gnss", "path": str(log), **fixes}
        aids["gnss"] |= {} if arm is None else {"lever_arm_m": _arm(arm)}
    elif given["lever_arm"] is not None:
        raise ConfigError("cli.lever-arm-without-receiver", quantity="--lever-arm")
    start = {
        "lat_deg": given["lat"],
        "lon_deg": given["lon"],
        "alt_m": given["alt"],
        "heading_deg": given["heading"],
    }
    further = {
        "truth": given["truth"] and {"path": str(given["truth"])},
        "control_points": given["points"] and {"path": str(given["points"])},
        "smoother": given["smooth"] and {"kind": "rts"},
        "map": given["map"] and {"path": str(given["map"].absolute())},
    }
    try:
        table = specify(LogTable, path=str(log), **log_keys(given))
        return specify_navigation(
            ImuFile(table, given["axes"]),
            aids,
            sensor=given["sensor"],
            start={key: value for key, value in start.items() if value is not None},
            options={name: table for name, table in further.items() if table},
            called=lambda argument: f"--{argument}",
        )
    except ConfigError as error:
        raise as_flag(error, FLAGS) from None


def _arm(text: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise ConfigError("cli.bad-lever-arm", quantity="--lever-arm", text=text) from None
    return x, y, z
