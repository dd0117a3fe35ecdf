"""Run of `strapdown live`: receivers, sessions, and their end."""

from __future__ import annotations

import asyncio
import hmac
import http.client
import importlib
import ipaddress
import json
import re
import secrets
import socket
import tempfile
import threading
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable, Iterator, MutableMapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, Protocol
from urllib.parse import quote, unquote, urlsplit

from strapdown.config.alignment import sensors_of
from strapdown.errors import ConfigError, Finding
from strapdown.formats.sensor_streams import ACCEL, GYRO, MAG, Event
from strapdown.live.hub import Hub, StateWriter
from strapdown.live.lines import BadLineError
from strapdown.live.phones import phyphox_buffers, phyphox_events
from strapdown.live.replay import MachineClock, RunClock
from strapdown.live.run import until_a_signal
from strapdown.live.session import Session, SessionOptions
from strapdown.live.sources import LONGEST, MARK, bound_socket
from strapdown.navigation.measurements.measurement import TabulatedMeasurement
from strapdown.systems.navigation_run import make_chain
from strapdown.systems.one_thread import one_thread

# --- receiver of HTTP and WebSocket: what phones push ------------------------------------
# A token is the first part of the path: ``http://HOST:PORT/TOKEN/``. It is compared in constant
# time, and anything outside it is 404, whether it exists or not. Bodies, messages, connections and
# the time that a body may take are bounded.

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


# Other receivers of `strapdown live`: datagrams, a serial port, phyphox, and MQTT.

Warn = Callable[[Finding], None]
#: Bytes of datagrams that may wait in the system.
WAITING = 8 << 20
#: Interval at which a thread looks whether to stop, and after which it tries again, s.
LOOK, AGAIN = 0.2, 1.0


class UdpFeed(asyncio.DatagramProtocol):
    """Lines in datagrams, ours or those of Sensorstream, a session for each address.

    Parameters
    ----------
    where : str
        ``HOST:PORT``; a port alone is of this machine only.
    """

    def __init__(self, hub: Hub, where: str) -> None:
        self._hub = hub
        self._host, self._port = split_address(where, "--udp")
        self._transport: asyncio.DatagramTransport | None = None
        self.name = ""

    async def begin(self) -> None:
        """Start to receive; ConfigError: the address cannot be opened."""
        loop = asyncio.get_running_loop()
        try:
            self._transport, _ = await loop.create_datagram_endpoint(
                lambda: self, local_addr=(self._host, self._port)
            )
            bound = self._transport.get_extra_info("socket")
            # As much as the system allows: what comes while it is busy waits there.
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, WAITING)
        except OSError as error:
            raise ConfigError(
                "live.cannot-listen", quantity="--udp", reason=error.strerror or error
            ) from None
        host, port = self._transport.get_extra_info("sockname")[:2]
        self.name = f"udp://{host}:{port}"

    async def end(self) -> None:
        """Stop receiving."""
        if self._transport is not None:
            self._transport.close()

    def datagram_received(self, data: bytes, addr: tuple[str | Any, int]) -> None:
        """Take a datagram, which ends with a whole line."""
        arrived = self._hub.clock.now()
        for line in data.split(b"\n"):
            if line.strip():
                self._hub.line(_text(line), "udp", str(addr[0]), arrived)

    def error_received(self, exc: Exception) -> None:
        """Ignore what the system says of datagrams that were never sent."""


def _text(line: bytes) -> str:
    """Return a line as text; one that is too long as one that no parser accepts."""
    return ((MARK + line[:64]) if len(line) > LONGEST else line).decode("utf-8", "replace")


class _Threaded(ABC):
    """A receiver in a thread of its own."""

    name: str

    def __init__(self, hub: Hub, warn: Warn) -> None:
        self._hub, self._warn = hub, warn
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._told = ""

    async def begin(self) -> None:
        """Start to receive."""
        self._thread.start()

    async def end(self) -> None:
        """Stop receiving."""
        self._stop.set()
        await asyncio.to_thread(self._thread.join, 5.0)

    @abstractmethod
    def _run(self) -> None:
        """Receive until `_stop` is set."""

    def _say(self, code: str, **data: Any) -> None:
        """Warn once of what lasts."""
        said = f"{code} {data}"
        if said != self._told:
            self._told = said
            self._hub.post(self._warn, Finding(code, **data))


class SerialFeed(_Threaded):
    """Lines of a serial port: ours, or the rows of a table with a header.

    Parameters
    ----------
    where : str
        ``PORT`` or ``PORT@BAUD``: ``/dev/ttyUSB0@460800``, ``COM3``.
    """

    def __init__(self, hub: Hub, where: str, warn: Warn) -> None:
        super().__init__(hub, warn)
        try:
            self._serial = importlib.import_module("serial")
        except ImportError:
            raise ConfigError(
                "live.library-missing", quantity="--serial", library="pyserial", extra="live"
            ) from None
        port, _, baud = where.rpartition("@") if "@" in where else (where, "", "115200")
        if not port or not (baud.isascii() and baud.isdecimal() and 0 < int(baud) < 10**8):
            raise ConfigError("live.not-a-port", quantity="--serial", where=where)
        self._port, self._baud, self.name = port, int(baud), f"serial:{port}"
        try:
            self._open: Any = self._opened()
        except (OSError, ValueError) as error:
            raise ConfigError("live.cannot-open", quantity="--serial", reason=str(error)) from None

    def _opened(self) -> Any:
        # Also without a port that the system lists: pseudo terminals and adapters.
        return self._serial.serial_for_url(self._port, baudrate=self._baud, timeout=LOOK)

    def _run(self) -> None:
        rest, cut = b"", True  # the first line may have begun before
        while not self._stop.is_set():
            try:
                if self._open is None:
                    self._open = self._opened()
                    rest, cut = b"", True
                data = self._open.read(1)
                data += self._open.read(self._open.in_waiting)
            except (OSError, ValueError, TypeError) as error:
                self._say("live.source-lost", file=self.name, reason=str(error)[:200])
                self._close()
                self._stop.wait(AGAIN)
                continue
            if not data:
                continue
            self._told = ""
            arrived = self._hub.clock.now()
            *lines, rest = (rest + data).split(b"\n")
            if lines and cut and not _whole(lines[0]):
                lines = lines[1:]
            cut = cut and not lines
            for line in lines:
                if line.strip():
                    self._hub.post(self._hub.line, _text(line), "serial", self._port, arrived)
            if len(rest) > LONGEST:
                rest, cut = b"", True
        self._close()

    def _close(self) -> None:
        if self._open is not None:
            with suppress(OSError):
                self._open.close()
            self._open = None


def _whole(line: bytes) -> bool:
    """Whether a first line begins as a line does: with a word, or a header."""
    return line[:1].isalpha() or line[:1] in (b"#", b'"')


class PhyphoxFeed(_Threaded):
    """Poll a phone with phyphox and "Allow remote access", for what is new.

    Parameters
    ----------
    where : str
        ``HOST`` or ``HOST:PORT`` as the app shows it; 8080 without a port.
    """

    #: Between two answers, s: the server of the app has one thread.
    PAUSE = 0.02
    TIMEOUT = 3.0
    #: Largest answer, bytes.
    MOST = 16 << 20

    def __init__(self, hub: Hub, where: str, warn: Warn) -> None:
        super().__init__(hub, warn)
        plain = where.removeprefix("http://").rstrip("/")
        self._host, self._port = split_address(plain, "--phyphox", 8080)
        self.name = f"phyphox://{self._host}:{self._port}"
        self._recording, self._buffers = "", phyphox_buffers(None)
        self._newest: dict[int, float] = {}

    def _run(self) -> None:
        known = False
        while not self._stop.is_set():
            try:
                if not known:
                    self._configure()
                    known = True
                known = self._poll()
                self._told = ""
            except BadLineError as bad:
                self._say("live.source-not-understood", file=self.name, reason=bad.finding)
                known = False
                self._stop.wait(AGAIN)
            except (OSError, http.client.HTTPException) as error:
                reason = (str(error) or type(error).__name__)[:200]
                self._say("live.source-lost", file=self.name, reason=reason)
                self._stop.wait(AGAIN)
            self._stop.wait(self.PAUSE)

    def _configure(self) -> None:
        """Find the buffers of the experiment; apps before 1.1.6 do not state them."""
        try:
            config = self._ask("/config")
        except BadLineError:
            config = None
        self._buffers = phyphox_buffers(config)

    def _poll(self) -> bool:
        """Ask for what is new; return whether the experiment is still the same."""
        asked = []
        for kind, (x, y, z, t) in self._buffers.items():
            since = self._newest.get(kind)
            after = "full" if since is None else f"{since!r}"
            asked.append(f"{quote(t)}={after}")
            for name in (x, y, z):
                value = after if since is None else f"{after}%7C{quote(t)}"
                asked.append(f"{quote(name)}={value}")
        answer = self._ask("/get?" + "&".join(asked))
        arrived = self._hub.clock.now()
        if not isinstance(answer, dict):
            raise BadLineError("answer", "live.answer-not-understood")
        status = answer.get("status")
        recording = str(status.get("session", "")) if isinstance(status, dict) else ""
        if recording != self._recording:
            # Another experiment, whose buffers begin anew.
            first, self._recording = not self._recording, recording[:200]
            self._newest.clear()
            if not first:
                return False
            if asked and "full" not in asked[0]:
                return True
        if not self._newest and isinstance(held := answer.get("buffer"), dict):
            # Of names that were tried, those of this experiment.
            own = {kind: names for kind, names in self._buffers.items() if set(names) <= set(held)}
            self._buffers = own or self._buffers
        if self._was_cleared(answer):
            self._newest.clear()
            return True
        events = phyphox_events(answer, self._buffers, self._newest)
        device = f"{self._host}-{self._port}"
        self._hub.post(self._hub.events, events, "phyphox", device, self._recording, arrived)
        return True

    def _was_cleared(self, answer: Any) -> bool:
        """Whether stamps begin anew: the measurement was cleared and started again.

        The app then finds no stamp above the last one, until time is there again: it is asked for
        the last stamp alone, now and then.
        """
        if not self._newest or not isinstance(answer, dict):
            return False
        held = answer.get("buffer")
        if not isinstance(held, dict) or any(
            isinstance(one, dict) and one.get("buffer") for one in held.values()
        ):
            return False
        kind, (_, _, _, t) = next(iter(self._buffers.items()))
        last = self._ask(f"/get?{quote(t)}")
        held = last.get("buffer", {}) if isinstance(last, dict) else {}
        one = held.get(t) if isinstance(held, dict) else None
        values = one.get("buffer") if isinstance(one, dict) else None
        if not isinstance(values, list) or not values or not isinstance(values[-1], int | float):
            return False
        return bool(values[-1] < self._newest.get(kind, -1.0) - 1.0)

    def _ask(self, path: str) -> Any:
        """Return the JSON of an answer; BadLineError: it has none."""
        link = http.client.HTTPConnection(self._host, self._port, timeout=self.TIMEOUT)
        try:
            link.request("GET", path, headers={"Connection": "close"})
            answer = link.getresponse()
            data = answer.read(self.MOST + 1)
            status = answer.status
        finally:
            link.close()
        if status != 200 or len(data) > self.MOST:
            raise BadLineError("answer", "live.answer-not-understood")
        try:
            return json.loads(data)
        except (ValueError, RecursionError):
            raise BadLineError("answer", "live.answer-not-understood") from None


class MqttFeed(_Threaded):
    """Messages of Sensor Logger from a topic of an MQTT broker.

    Parameters
    ----------
    where : str
        ``mqtt://HOST:PORT/TOPIC``, ``mqtts://…`` with TLS, ``ws://…`` and ``wss://…`` over
        WebSocket, which the app itself needs; the topic is ``sensor-logger`` if not given.
    user, password : str, optional
    """

    PORTS: ClassVar[dict[str, int]] = {"mqtt": 1883, "mqtts": 8883, "ws": 8000, "wss": 8884}

    def __init__(
        self, hub: Hub, where: str, warn: Warn, user: str | None = None, password: str | None = None
    ) -> None:
        super().__init__(hub, warn)
        try:
            self._mqtt = importlib.import_module("paho.mqtt.client")
        except ImportError:
            raise ConfigError(
                "live.library-missing", quantity="--mqtt", library="paho-mqtt", extra="mqtt"
            ) from None
        try:
            parts = urlsplit(where)
            host, port = parts.hostname, parts.port
        except ValueError:
            parts, host, port = urlsplit(""), None, None
        if parts.scheme not in self.PORTS or not host or parts.password or parts.username:
            raise ConfigError("live.not-a-broker", quantity="--mqtt", where=where)
        self._host, self._port = host, port or self.PORTS[parts.scheme]
        self._topic = unquote(parts.path.strip("/")) or "sensor-logger"
        self.name = f"{parts.scheme}://{self._host}:{self._port}/{self._topic}"
        self._client = self._mqtt.Client(
            self._mqtt.CallbackAPIVersion.VERSION2,
            transport="websockets" if parts.scheme.startswith("ws") else "tcp",
            reconnect_on_failure=True,
        )
        if parts.scheme in ("mqtts", "wss"):
            self._client.tls_set()
        if user is not None:
            self._client.username_pw_set(user, password)
        self._client.on_connect = self._connected
        self._client.on_message = self._came

    def _connected(self, client: Any, data: Any, flags: Any, reason: Any, extra: Any) -> None:
        if reason.is_failure:
            self._say("live.source-lost", file=self.name, reason=str(reason))
            return
        self._told = ""
        client.subscribe(self._topic, qos=0)

    def _came(self, client: Any, data: Any, message: Any) -> None:
        arrived = self._hub.clock.now()
        if len(message.payload) <= 4 << 20:
            payload = bytes(message.payload)
            self._hub.post(self._hub.sensor_logger, payload, "mqtt", arrived)

    def _run(self) -> None:
        connected = False
        while not self._stop.is_set():
            try:
                if not connected:
                    self._client.connect(self._host, self._port, keepalive=30)
                    connected = True
                if self._client.loop(timeout=LOOK) != self._mqtt.MQTT_ERR_SUCCESS:
                    self._say("live.source-lost", file=self.name, reason="the broker closed")
                    connected = False
                    self._stop.wait(AGAIN)
            except (OSError, ValueError, self._mqtt.WebsocketConnectionError) as error:
                self._say("live.source-lost", file=self.name, reason=str(error)[:200])
                connected = False
                self._stop.wait(AGAIN)
        self._client.disconnect()


#: Interval at which the run looks whether it ends, s.
POLL = 0.1


@dataclass(frozen=True)
class LiveSources:
    """Where samples come from; `listen` alone if none is given.

    Attributes
    ----------
    listen : str or None
        Address of HTTP and WebSocket, ``HOST:PORT``.
    udp, phyphox, serial, mqtt : sequence of str
        As `UdpFeed`, `PhyphoxFeed`, `SerialFeed`, `MqttFeed`.
    token : str or None
        Of the address, and of commands in datagrams; drawn if not given.
    mqtt_login : pair of str, optional
        User and password.
    """

    listen: str | None = None
    udp: Sequence[str] = ()
    phyphox: Sequence[str] = ()
    serial: Sequence[str] = ()
    mqtt: Sequence[str] = ()
    token: str | None = None
    mqtt_login: tuple[str, str | None] | None = None

    @property
    def alone(self) -> bool:
        """Whether no other source than `listen` is given."""
        return not (self.udp or self.phyphox or self.serial or self.mqtt)


class _Feed(Protocol):
    """A receiver."""

    async def begin(self) -> None:
        """Start to receive."""

    async def end(self) -> None:
        """Stop receiving."""


@one_thread()
def receive_many(
    folder: Path,
    sources: LiveSources,
    options: SessionOptions,
    clock: RunClock,
    writer: StateWriter,
    warn: Callable[[Finding], None],
    platform: str = "auto",
    listening: Callable[[str, bool], None] = lambda address, loopback: None,
    duration: float | None = None,
) -> Hub:
    """Receive devices until a signal, or until the reader of the states has closed.

    Parameters
    ----------
    folder : Path
        Holds a folder of each session.
    writer : StateWriter
        Its first line says where the run listens.
    listening : callable
        Called with the address for phones, and whether it is of this machine alone.
    duration : float, optional, s
        After which the run ends.

    Returns
    -------
    Hub
        With what each session counted.
    """
    token = address_token(sources.token)
    aids = _warmed(options)
    folder.mkdir(parents=True, exist_ok=True)
    hub = Hub(folder, options, clock, writer, warn, platform, aids, token)
    with until_a_signal() as wanted:
        asyncio.run(_run(hub, sources, token, wanted, warn, listening, duration))
    if hub.error is not None and not hub.ended:
        raise hub.error
    return hub


def address_token(token: str | None) -> str:
    """Return the token, or draw one; ConfigError: it is short, or no part of a path."""
    if token is None:
        return secrets.token_urlsafe(24)
    if not re.fullmatch(r"[\w-]{16,128}", token, re.ASCII):
        raise ConfigError("live.bad-address-token", quantity="--token")
    return token


def _warmed(options: SessionOptions) -> list[str]:
    """Load and compile what sessions need; return the names of measurements that lines may hold."""
    if options.spec is None:
        # A session of a second, so that the first real one does not wait for what it needs.
        values = (0.0, 0.0, 9.8)
        with tempfile.TemporaryDirectory() as folder:
            session = Session(
                Path(folder) / "warm-up",
                "",
                "",
                None,
                options,
                lambda state: None,
                lambda finding: None,
                MachineClock(),
            )
            for k in range(100):
                rows = [Event(kind, k * 10**7, values) for kind in (GYRO, ACCEL, MAG)]
                session.take(rows, 0.0)
            session.finish()
        return []
    chain = make_chain(options.spec, sensors_of(options.spec))
    return [aid.name for aid in chain.navigator.aids if isinstance(aid, TabulatedMeasurement)]


async def _run(
    hub: Hub,
    sources: LiveSources,
    token: str,
    wanted: Callable[[], bool],
    warn: Callable[[Finding], None],
    listening: Callable[[str, bool], None],
    duration: float | None,
) -> None:
    hub.attach(asyncio.get_running_loop())
    feeds, said = _feeds(hub, sources, token, warn)
    begun: list[_Feed] = []
    try:
        for feed in feeds:
            await feed.begin()
            begun.append(feed)
        web = next((feed for feed in feeds if isinstance(feed, WebReceiver)), None)
        said["sources"] = [getattr(f, "name", "") for f in feeds if not isinstance(f, WebReceiver)]
        if web is not None:
            said["listening"] = web.address
            said["sources"] = [f"http {web.address}", *said["sources"]]
            listening(web.address, web.loopback)
        hub.writer.said(said)
        end = None if duration is None else hub.clock.now() + duration
        looks = 0
        while wanted() and hub.writer.there and hub.error is None:
            if end is not None and hub.clock.now() >= end:
                break
            await asyncio.sleep(POLL)
            looks += 1
            hub.report_silent()
            if looks % 100 == 0:
                hub.end_silent()
    finally:
        for feed in begun:
            with suppress(OSError):
                await feed.end()
        await asyncio.sleep(0)  # what threads posted
        hub.finish()


def _feeds(
    hub: Hub, sources: LiveSources, token: str, warn: Callable[[Finding], None]
) -> tuple[list[Any], dict[str, Any]]:
    """Make the receivers that are asked for; ConfigError: one cannot be."""
    feeds: list[Any] = [UdpFeed(hub, where) for where in sources.udp]
    feeds += [SerialFeed(hub, where, warn) for where in sources.serial]
    feeds += [PhyphoxFeed(hub, where, warn) for where in sources.phyphox]
    user, password = sources.mqtt_login or (None, None)
    feeds += [MqttFeed(hub, where, warn, user, password) for where in sources.mqtt]
    listen = sources.listen or ("127.0.0.1:0" if sources.alone else None)
    if listen is not None:
        feeds.append(WebReceiver(hub, listening_socket(listen), token))
    return feeds, {"listening": None, "sources": []}
