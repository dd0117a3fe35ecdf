"""Run of `strapdown live`: receivers, sessions, and their end."""

from __future__ import annotations

import asyncio
import re
import secrets
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from strapdown.config.alignment import sensors_of
from strapdown.errors import ConfigError, Finding
from strapdown.formats.sensor_streams import ACCEL, GYRO, MAG, Event
from strapdown.live.feeds import MqttFeed, PhyphoxFeed, SerialFeed, UdpFeed
from strapdown.live.hub import Hub, StateWriter
from strapdown.live.replay import MachineClock, RunClock
from strapdown.live.run import until_a_signal
from strapdown.live.session import Session, SessionOptions
from strapdown.live.web import WebReceiver, listening_socket
from strapdown.navigation.measurements.measurement import TabulatedMeasurement
from strapdown.systems.navigation_run import make_chain
from strapdown.systems.one_thread import one_thread

#: Interval at which the run looks whether it ends, s.
LOOK = 0.1


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
        silent = 0
        while wanted() and hub.writer.there and hub.error is None:
            if end is not None and hub.clock.now() >= end:
                break
            await asyncio.sleep(LOOK)
            silent += 1
            if silent % 100 == 0:
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
