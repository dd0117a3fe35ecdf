"""Receiver of HTTP and WebSocket: what phones push to an address that holds a token.

The token is the first part of the path: ``http://HOST:PORT/TOKEN/``. It is compared in constant
time, and anything outside it is 404, whether it exists or not. Bodies, messages, connections and
the time that a body may take are bounded.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import socket
from collections.abc import Awaitable, Callable, Iterator, MutableMapping
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from strapdown.errors import ConfigError
from strapdown.live.hub import Hub
from strapdown.live.sources import bound_socket

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Any]]
Send = Callable[[Any], Awaitable[None]]

#: Largest body and message, bytes; longest time that a body may take, s.
MOST_BODY, MOST_MESSAGE, BODY_TIME = 4 << 20, 1 << 20, 10.0
#: Most connections at once, and headers of a request, bytes.
MOST_CLIENTS, MOST_HEADERS = 128, 16 << 10
LOOPBACK = "127.0.0.1"


def web_library(name: str) -> ModuleType:
    """Import a library of the extra ``studio``; ConfigError: it is not installed."""
    import importlib

    try:
        return importlib.import_module(name)
    except ImportError:
        raise ConfigError(
            "live.library-missing", quantity="--listen", library=name, extra="studio"
        ) from None


def is_loopback(host: str) -> bool:
    """Whether an address is of this machine alone."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def local_address() -> str:
    """Return the address of this machine in its network, as others reach it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # Of documentation (RFC 5737): nothing is sent, a route is looked up.
            probe.connect(("192.0.2.1", 9))
            return str(probe.getsockname()[0])
        except OSError:
            return LOOPBACK


def listening_socket(where: str) -> socket.socket:
    """Open ``HOST:PORT`` for connections; a port without a host is of this machine alone.

    ConfigError: the address cannot be opened.
    """
    host, port = split_address(where, "--listen")
    try:
        return bound_socket(host, port, socket.SOCK_STREAM)
    except OSError as error:
        raise ConfigError(
            "live.cannot-listen", quantity="--listen", reason=error.strerror or error
        ) from None


def split_address(where: str, option: str, port: int | None = 0) -> tuple[str, int]:
    """Split ``HOST:PORT``, ``HOST`` or ``PORT``; `port`: if there is none, None: it must be."""
    text = where.strip()
    host, colon, number = text.rpartition(":")
    if not colon:
        host, number = ("", text) if text.isdecimal() else (text, "")
    elif text.endswith("]") or (text.count(":") > 1 and not text.startswith("[")):
        host, number = text, ""
    value = port if number == "" else int(number) if number.isascii() and number.isdecimal() else -1
    if value is None or not 0 <= value < 65536 or "/" in text:
        raise ConfigError("live.not-an-address", quantity=option, where=where)
    return host.strip("[]") or LOOPBACK, value


class WebReceiver:
    """Receive messages of phones by HTTP and WebSocket.

    Parameters
    ----------
    bound : socket
        From `listening_socket`.
    token : str
    """

    def __init__(self, hub: Hub, bound: socket.socket, token: str) -> None:
        self._hub, self._bound, self._token = hub, bound, token
        uvicorn = web_library("uvicorn")
        web_library("starlette")
        web_library("websockets")
        host, port = bound.getsockname()[:2]
        self.loopback = is_loopback(host)
        shown = local_address() if host in ("0.0.0.0", "::") else host
        shown = f"[{shown}]" if ":" in shown else shown
        self.address = f"http://{shown}:{port}/{token}/"
        config = uvicorn.Config(
            self._answer,
            interface="asgi3",
            log_level="critical",
            access_log=False,
            lifespan="off",
            limit_concurrency=MOST_CLIENTS,
            backlog=MOST_CLIENTS,
            timeout_keep_alive=30,
            h11_max_incomplete_event_size=MOST_HEADERS,
            http=_bounded(web_library("uvicorn.protocols.http.h11_impl").H11Protocol),
            ws="websockets-sansio",
            ws_max_size=MOST_MESSAGE,
            server_header=False,
            date_header=False,
            proxy_headers=False,
            timeout_graceful_shutdown=1,
        )
        self._server = _without_signals(uvicorn.Server)(config)
        self._task: asyncio.Task[None] | None = None

    async def begin(self) -> None:
        """Start to receive."""
        self._task = asyncio.create_task(self._server.serve(sockets=[self._bound]))
        while not self._server.started and not self._task.done():
            await asyncio.sleep(0.005)

    async def end(self) -> None:
        """Stop receiving, and let what is received be used."""
        self._server.should_exit = True
        if self._task is not None:
            await self._task
        self._bound.close()

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] not in ("http", "websocket"):
            return
        own = self._is_own(scope)
        if scope["type"] == "websocket":
            await self._converse(scope, receive, send, own)
            return
        from starlette.responses import PlainTextResponse

        status, text = 404, "not found\n"
        if own and scope["method"] in ("GET", "HEAD"):
            status, text = 200, "strapdown live: send POST here\n"
        elif own and scope["method"] == "POST":
            status, text = await self._posted(scope, receive)
        elif own:
            status, text = 405, "POST only\n"
        headers = {"cache-control": "no-store", "x-content-type-options": "nosniff"}
        if status in (408, 413):  # the rest of the body is not read
            headers["connection"] = "close"
        await PlainTextResponse(text, status, headers)(scope, receive, send)

    def _is_own(self, scope: Scope) -> bool:
        """Whether the path is the token, or the token and ``data``."""
        path = scope.get("raw_path") or scope["path"].encode()
        parts = bytes(path).partition(b"?")[0].split(b"/")
        first = parts[1] if len(parts) > 1 else b""
        same = hmac.compare_digest(first, self._token.encode())
        return same and parts[2:] in ([], [b""], [b"data"], [b"data", b""])

    async def _posted(self, scope: Scope, receive: Receive) -> tuple[int, str]:
        from starlette.requests import ClientDisconnect, Request

        request = Request(scope, receive)
        body = bytearray()
        try:
            if int(request.headers.get("content-length", "0")) > MOST_BODY:
                return 413, "too large\n"
            async with asyncio.timeout(BODY_TIME):
                async for part in request.stream():
                    body += part
                    if len(body) > MOST_BODY:
                        return 413, "too large\n"
        except ValueError:
            return 400, "bad length\n"
        except TimeoutError:
            return 408, "too slow\n"
        except ClientDisconnect:
            return 400, "gone\n"
        bad = self._hub.sensor_logger(bytes(body), "sensor-logger", self._hub.clock.now())
        if bad is None:
            return 200, "ok\n"
        return (429 if bad.kind == "session" else 400), "not used\n"

    async def _converse(self, scope: Scope, receive: Receive, send: Send, own: bool) -> None:
        """Take the messages of a WebSocket: those of Sensor Logger, or lines."""
        from starlette.websockets import WebSocket, WebSocketDisconnect

        socket_ = WebSocket(scope, receive, send)
        if not own:
            from starlette.responses import PlainTextResponse

            await socket_.send_denial_response(PlainTextResponse("not found\n", 404))
            return
        await socket_.accept()
        client = scope.get("client") or ("websocket", 0)
        try:
            while True:
                message = await socket_.receive()
                if message["type"] == "websocket.disconnect":
                    return
                data = message.get("text") or message.get("bytes") or b""
                arrived = self._hub.clock.now()
                text = data if isinstance(data, str) else bytes(data).decode("utf-8", "replace")
                if text.lstrip().startswith("{"):
                    self._hub.sensor_logger(text, "sensor-logger", arrived)
                    continue
                for line in text.splitlines():
                    self._hub.line(line, "websocket", str(client[0]), arrived)
        except (WebSocketDisconnect, RuntimeError):
            return


def _bounded(protocol: type[Any]) -> type[Any]:
    """Return a protocol of connections that are not too many, and that ask for something soon."""

    class Bounded(protocol):  # type: ignore[misc]
        def connection_made(self, transport: asyncio.Transport) -> None:
            super().connection_made(transport)
            if len(self.connections) > MOST_CLIENTS:
                transport.abort()
                return
            self.loop.call_later(BODY_TIME, self._give_up, transport)

        def _give_up(self, transport: asyncio.Transport) -> None:
            if transport.get_protocol() is self and self.cycle is None:
                transport.close()

    return Bounded


def _without_signals(server: type[Any]) -> type[Any]:
    """Return a server that leaves the signals to the command."""

    class Server(server):  # type: ignore[misc]
        @contextmanager
        def capture_signals(self) -> Iterator[None]:
            yield

    return Server
