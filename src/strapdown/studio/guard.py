"""Checks before every request of the studio: token, host, origin, sizes, waits and headers.

The server has no accounts. Whoever knows the token in the address may use it; a page of another
origin, a name that is made to point here (DNS rebinding), and a client that holds connections
without using them may not.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import json
import socket
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from strapdown.errors import Finding
from strapdown.studio.folder import Limits

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[MutableMapping[str, Any], Receive, Send], Awaitable[None]]

#: Of the page of the studio: only what comes from it, no script or style written into the page.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' data: blob:; font-src 'self'; connect-src 'self'; worker-src 'self'; "
    "frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
#: Of a file of a result, which anyone may have made: without rights, network and origin.
SANDBOX = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src 'self' data: blob:; font-src data:; "
    "form-action 'none'; base-uri 'none'; frame-ancestors 'self'"
)
HEADERS = {
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=(), usb=(), serial=()",
    "cache-control": "no-store",
}
#: Methods that only read.
_READING = ("GET", "HEAD")


def allowed_hosts(host: str, port: int, listen: bool) -> Callable[[str], bool]:
    """Return the test of a Host header: whether it names this server.

    Parameters
    ----------
    listen : bool
        Whether the server is reached from other machines: any address in numbers is allowed, which
        no name can be made to look like, and the name of this machine.
    """
    names = {"127.0.0.1", "localhost", "[::1]", f"[{host}]" if ":" in host else host}
    if listen:
        names |= {socket.gethostname().lower(), socket.getfqdn().lower()}
    names.discard("0.0.0.0")
    names.discard("[::]")

    def allowed(header: str) -> bool:
        name, _, given = header.lower().rpartition(":")
        if given != str(port):
            return False
        return name in names or (listen and _in_numbers(name))

    return allowed


def _in_numbers(name: str) -> bool:
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True


class Guard:
    """ASGI application that lets through what may reach another.

    Parameters
    ----------
    app : callable
        Application that sees paths without the token.
    token : str
    host_allowed : callable
        Test of a Host header.
    limits : Limits
    """

    def __init__(
        self, app: App, token: str, host_allowed: Callable[[str], bool], limits: Limits
    ) -> None:
        self._app, self._limits = app, limits
        self._begin = f"/{token}/".encode()
        self._host_allowed = host_allowed

    async def __call__(self, scope: MutableMapping[str, Any], receive: Receive, send: Send) -> None:
        """Answer, or refuse, a request or a WebSocket."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        status, code = self._verdict(scope)
        if status:
            await self._refuse(scope, send, status, code)
            return
        path = scope["path"][len(self._begin) - 1 :]
        inner = {**scope, "path": path, "raw_path": path.encode("utf-8", "replace")}
        if scope["type"] == "websocket":
            await self._app(inner, receive, send)
            return
        await self._app(inner, self._in_time(inner, receive), _with_headers(send))

    def _verdict(self, scope: Mapping[str, Any]) -> tuple[int, str]:
        """Status and code of a refusal; 0 if there is none."""
        headers: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
        # The host first: to a rebound name the answer does not mention tokens.
        hosts = headers.get("host", [])
        if len(hosts) != 1 or not self._host_allowed(hosts[0]):
            return 403, "studio.host-refused"
        begin = scope["path"].encode("utf-8", "surrogatepass")[: len(self._begin)]
        if not hmac.compare_digest(begin, self._begin):
            return 404, "studio.no-such-page"
        origins = headers.get("origin", [])
        if origins and origins != [f"http://{hosts[0]}"]:
            return 403, "studio.origin-refused"
        if scope["type"] == "websocket":
            # A browser always sends the origin of a page that opens one.
            return 0, ""
        path = scope["path"][len(self._begin) :]
        fetched = headers.get("sec-fetch-site", ["none"])[0]
        if path.startswith("api/") and fetched not in ("same-origin", "none"):
            return 403, "studio.origin-refused"
        if scope["method"] not in _READING:
            if headers.get("x-strapdown") != ["1"]:
                return 403, "studio.header-missing"
            upload = scope["method"] == "PUT" and path.startswith("api/files/")
            most = self._limits.upload if upload else self._limits.body
            length = headers.get("content-length", ["0"])[0]
            if not length.isdecimal() or int(length) > most:
                return 413, "studio.request-too-large"
        return 0, ""

    async def _refuse(self, scope: Mapping[str, Any], send: Send, status: int, code: str) -> None:
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})  # 403 before the handshake
            return
        body = json.dumps({"error": said(code)}).encode()
        begin = {"type": "http.response.start", "status": status, "headers": []}
        begin["headers"] = [
            (b"content-type", b"application/json"),
            (b"content-length", str(len(body)).encode()),
            (b"connection", b"close"),
        ]
        send = _with_headers(send)
        await send(begin)
        await send({"type": "http.response.body", "body": body})

    def _in_time(self, scope: Mapping[str, Any], receive: Receive) -> Receive:
        """Wait so long for each part of a body, and take so many bytes."""
        upload = scope["method"] == "PUT" and scope["path"].startswith("/api/files/")
        most, count = self._limits.upload if upload else self._limits.body, 0

        async def timed() -> Message:
            nonlocal count
            if scope["method"] in _READING:
                return await receive()
            try:
                message = await asyncio.wait_for(receive(), self._limits.patience)
            except TimeoutError:
                return {"type": "http.disconnect"}
            count += len(message.get("body", b""))
            # One part more: who writes it says what was wrong.
            if count > most + (1 << 20):
                return {"type": "http.disconnect"}
            return message

        return timed


def said(code: str) -> dict[str, Any]:
    """Return a refusal as JSON: code, sentence, remedy."""
    one = Finding(code, severity="error")
    return {"code": code, "text": one.sentence("studio"), "remedy": one.advice("studio")}


def _with_headers(send: Send) -> Send:
    """Add the headers that every answer has, where it has no own of that name."""

    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            own = {name.lower() for name, _ in message["headers"]}
            more = {**HEADERS, "content-security-policy": POLICY}
            message["headers"] = [
                *message["headers"],
                *((k.encode(), v.encode()) for k, v in more.items() if k.encode() not in own),
            ]
        await send(message)

    return sent


class PatientProtocol(H11Protocol):
    """HTTP of a bounded number of connections, each of which must do something in time."""

    #: Set by `serve`.
    limits = Limits()
    _late: asyncio.TimerHandle | None = None
    _stuck: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Take a connection, and wait so long for its first request."""
        super().connection_made(transport)
        if len(self.connections) > self.limits.connections:
            transport.abort()
            return
        self._wait_for_request()

    def on_response_complete(self) -> None:
        """End a request, and wait so long for the whole of the next."""
        super().on_response_complete()
        if not self.transport.is_closing():
            self._wait_for_request()

    def _wait_for_request(self) -> None:
        if self._late is not None:
            self._late.cancel()
        self._late = self.loop.call_later(self.limits.patience, self._end_if_silent)

    def _end_if_silent(self) -> None:
        cycle: Any = self.cycle
        if (cycle is None or cycle.response_complete) and not self.transport.is_closing():
            self.transport.abort()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Hand the connection to the protocol of WebSockets, which has its own waits."""
        if self._late is not None:
            self._late.cancel()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """End the timers of a connection."""
        for timer in (self._late, self._stuck):
            if timer is not None:
                timer.cancel()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """Wait so long for a client that does not take its answer."""
        super().pause_writing()
        self._stuck = self.loop.call_later(self.limits.patience, self.transport.abort)

    def resume_writing(self) -> None:
        """Go on: the client took what there was."""
        super().resume_writing()
        if self._stuck is not None:
            self._stuck.cancel()
            self._stuck = None
