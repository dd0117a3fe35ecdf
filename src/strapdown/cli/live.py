"""``strapdown live``."""

from __future__ import annotations

import os
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from strapdown.cli.console import print_table, tell
from strapdown.cli.shared_options import (
    QUIET,
    folder_to_make,
    running,
    spread,
    with_what,
)
from strapdown.errors import ConfigError, Finding

if TYPE_CHECKING:
    from strapdown.live.hub import Hub

EPILOG = (
    "Example: strapdown live --listen 0.0.0.0:8437 --out walk\n\n"
    "Example: strapdown live --phyphox 192.168.0.42 | head"
)
#: The password of a broker, which is not to be seen in the list of processes.
PASSWORD = "STRAPDOWN_MQTT_PASSWORD"
#: Default interval of states, s.
EVERY = 0.1


@dataclass(frozen=True)
class SourceFlags:
    """Where samples come from."""

    listen: str | None = with_what(
        "HOST:PORT",
        "Let phones send by HTTP or WebSocket: Sensor Logger. 127.0.0.1, any port, if no "
        "source is given; 0.0.0.0:8437 for phones in your network.",
    )
    phyphox: list[str] | None = with_what(
        "HOST:PORT", "Ask a phone with phyphox and remote access, repeatable."
    )
    udp: list[str] | None = with_what(
        "HOST:PORT", "Lines in datagrams: ours, or of Sensorstream; repeatable."
    )
    serial: list[str] | None = with_what(
        "PORT@BAUD", "Lines of a serial port, or rows under a header; repeatable (115200)."
    )
    mqtt: list[str] | None = with_what(
        "URL", "Sensor Logger by a broker: mqtt://HOST/TOPIC, mqtts, ws, wss; repeatable."
    )
    mqtt_user: str | None = with_what("NAME", f"User of the broker; the password is in {PASSWORD}.")
    token: str | None = with_what(
        "WORD",
        "Last part of the address for phones, at least 16 letters and digits; and of commands "
        "in datagrams. By default one is drawn.",
    )
    platform: str = with_what(
        "auto|android|ios",
        "Sign of the accelerations of Sensor Logger: ios without its setting Standardise "
        "Units & Frames (auto).",
        default="auto",
    )


@spread
def live(
    config: Path | None = typer.Argument(
        None,
        metavar="CONFIG.toml",
        help="The file of a run of navigation; without it the attitude by a filter.",
        show_default=False,
    ),
    *,
    sources: SourceFlags,
    algorithm: str = running(
        "NAME", "Filter of the attitude, with its options (error-state).", default="error-state"
    ),
    every: float = running(
        "S", "Least interval between states; 0: each sample (0.1).", default=EVERY
    ),
    lines: str = running("json|csv", "States as lines of this form (json).", default="json"),
    reorder: float = running(
        "S", "Wait so long for samples that others overtook (0).", default=0.0
    ),
    stop_after: float | None = running("S", "End after so long; otherwise at Ctrl-C."),
    qr: bool | None = running(
        None,
        "Show the address as a QR code; by default on a terminal, if phones can reach it.",
        "--qr/--no-qr",
    ),
    out: Path | None = folder_to_make("live, a folder in it for each device"),
    quiet: bool = QUIET,
) -> None:
    """Receive phones and sensors as they send, and show their attitude or navigation.

    Each device has a session of its own: a folder with all that it sent, on the disk before it is
    used, which every other command reads as a log. States are written to standard output, one a
    line, all else to standard error.
    """
    from strapdown.cli.live_folder import warner
    from strapdown.cli.navigate_live import line_writer
    from strapdown.config.navigation import NavigationSpec
    from strapdown.live.hub import StateWriter
    from strapdown.live.many import LiveSources, receive_many
    from strapdown.live.replay import MachineClock
    from strapdown.live.session import SessionOptions

    for option, value in (("--every", every), ("--reorder", reorder), ("--stop-after", stop_after)):
        if value is not None and not 0.0 <= value < 1e9:
            raise ConfigError("live.bad-interval", quantity=option, every=value)
    spec = None if config is None else NavigationSpec.read(config)
    options = SessionOptions(spec, algorithm, every, reorder)
    warn = warner(quiet)
    user = sources.mqtt_user

    def listening(address: str, loopback: bool) -> None:
        # For the studio, which shows the address.
        tell({"live": {"address": address, "loopback": loopback}})
        if not loopback:
            warn(Finding("live.open-to-network", address=address))
        if qr or (qr is None and not loopback and sys.stderr.isatty() and not quiet):
            show_qr(address)

    hub = receive_many(
        out or Path("live"),
        LiveSources(
            sources.listen,
            sources.udp or (),
            sources.phyphox or (),
            sources.serial or (),
            sources.mqtt or (),
            sources.token,
            None if user is None else (user, os.environ.get(PASSWORD)),
        ),
        options,
        MachineClock(),
        StateWriter(line_writer, lines),
        warn,
        sources.platform,
        listening,
        stop_after,
    )
    if not quiet:
        _print_sessions(hub, "attitude" if spec is None else "navigate")


def show_qr(address: str) -> None:
    """Show an address as a QR code on standard error."""
    try:
        import segno
    except ImportError:
        raise ConfigError(
            "live.library-missing", quantity="--qr", library="segno", extra="live"
        ) from None
    made: Any = segno.make(address, micro=False)
    made.terminal(out=sys.stderr, compact=True)
    typer.echo(address, err=True)


def _print_sessions(hub: Hub, command: str) -> None:
    """Print the latencies and counts of all sessions to standard error.

    `command`: makes the sealed result of a session, which is a log.
    """
    from contextlib import redirect_stdout

    rows = []
    for told in hub.ended:
        stages = told["stages"]
        whole = stages.get("arrival_to_state")
        times = (
            ["-"] * 3
            if whole is None
            else [f"{whole[key]:.3f}" for key in ("median_ms", "p99_ms", "largest_ms")]
        )
        unused = ", ".join(f"{n} {reason}" for reason, n in told["not_used"].items())
        rows.append(
            [
                told["session"],
                str(told["events"]),
                *times,
                str(told["messages_lost"]),
                unused or "-",
            ]
        )
    with redirect_stdout(sys.stderr):
        if rows:
            print_table(
                [
                    "session",
                    "readings, all sensors",
                    "median, ms",
                    "99 %",
                    "largest",
                    "lost messages",
                    "not used",
                ],
                rows,
            )
            print(f"sessions: {hub.folder}")
            for told in hub.ended:
                folder = shlex.quote(str(hub.folder / str(told["session"])))
                print(f"sealed result, with its report: strapdown {command} {folder}")
