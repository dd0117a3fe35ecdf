"""The server of the studio: its address and token, and its end."""

from __future__ import annotations

import secrets
import socket
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from strapdown.errors import ConfigError, DataError
from strapdown.formats.map_tiles import open_map
from strapdown.live.sources import bound_socket
from strapdown.studio.folder import Folder, Limits

#: Loopback addresses, which other machines cannot reach.
LIMITS = Limits()
LOOPBACK = ("127.0.0.1", "::1", "localhost")


@dataclass(frozen=True)
class Address:
    """Where the studio is.

    Attributes
    ----------
    url : str
        With the token.
    folder : Path
    jobs : int
        Jobs that go on from before.
    """

    url: str
    folder: Path
    jobs: int


def serve(
    folder: str | Path = ".",
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    listen: bool = False,
    map_file: str | Path | None = None,
    limits: Limits = LIMITS,
    started: Callable[[Address], None] = lambda _: None,
) -> int:
    """Serve the studio of a folder until it is interrupted.

    Parameters
    ----------
    folder : str or Path
    host, port
        Address; a free port, if 0.
    listen : bool
        Whether an address may be one that other machines reach.
    map_file : str or Path, optional
        Raster tiles, instead of those in the folder.
    limits : Limits
    started : callable
        Called with the address when requests are answered.

    Returns
    -------
    int
        Number of jobs that go on.

    Raises
    ------
    ConfigError
        The folder, the address or the map cannot be used, a studio runs in the folder already, or
        the extra ``studio`` is not installed.
    """
    _libraries()
    from strapdown.studio.app import STATIC, Studio, make_app
    from strapdown.studio.guard import Guard, allowed_hosts

    if host not in LOOPBACK and not listen:
        raise ConfigError("studio.host-needs-listen", quantity="--host", host=host)
    if not (STATIC / "index.html").is_file():
        raise ConfigError("studio.no-page")
    with ExitStack() as kept:
        opened = Folder.open(folder, limits)
        kept.enter_context(_locked(opened))
        map_path = None if map_file is None else _map(Path(map_file))
        bound = kept.enter_context(_bound(host, port))
        port = bound.getsockname()[1]
        studio = Studio.of(opened, map_path)
        kept.callback(studio.end)
        token = secrets.token_urlsafe(24)
        guard = Guard(make_app(studio), token, allowed_hosts(host, port, listen), limits)
        url = f"http://{_shown(host)}:{port}/{token}/"
        address = Address(url, opened.path, studio.jobs.running())
        _run(guard, bound, limits, lambda: started(address))
        return studio.jobs.running()


def _run(app: Any, bound: socket.socket, limits: Limits, started: Callable[[], None]) -> None:
    """Answer requests until the process is interrupted."""
    import uvicorn

    from strapdown.studio.guard import PatientProtocol

    config = uvicorn.Config(
        app,
        http=type("Protocol", (PatientProtocol,), {"limits": limits}),
        ws="websockets-sansio",
        ws_max_size=1 << 16,
        ws_max_queue=4,
        ws_per_message_deflate=False,
        lifespan="on",
        access_log=False,
        log_config=None,
        server_header=False,
        date_header=False,
        proxy_headers=False,
        h11_max_incomplete_event_size=32 << 10,
        timeout_keep_alive=10,
        timeout_graceful_shutdown=3,
    )

    class Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            started()

    # The server ends in order, and raises the interrupt again.
    with suppress(KeyboardInterrupt):
        Server(config).run([bound])


def _shown(host: str) -> str:
    """Host as a person types it into a browser."""
    if host in ("0.0.0.0", "::"):
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host


def _libraries() -> None:
    """Refuse to start without the extra: ConfigError."""
    from importlib.util import find_spec

    for library in ("starlette", "uvicorn", "websockets", "tomlkit"):
        if find_spec(library) is None:
            raise ConfigError("studio.library-missing", library=library)


def _bound(host: str, port: int) -> socket.socket:
    """Return a socket that is bound; a port that is taken is refused at once."""
    try:
        return bound_socket(host, port, socket.SOCK_STREAM)
    except (OSError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ConfigError(
            "studio.port-taken", quantity="--port", host=host, port=port, reason=reason
        ) from None


def _locked(folder: Folder) -> Any:
    """Hold the folder, so that no second studio keeps its jobs; the lock ends with the process."""
    stream = (folder.state / "lock").open("a")
    try:
        import fcntl
    except ImportError:  # not on Windows
        return stream
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        stream.close()
        raise ConfigError("studio.folder-in-use", file=str(folder.path)) from None
    return stream


def _map(path: Path) -> Path:
    try:
        with open_map(path):
            return path.resolve()
    except DataError as error:
        raise ConfigError(
            "studio.map-not-read", quantity="--map", file=str(path), reason=error.finding
        ) from None
