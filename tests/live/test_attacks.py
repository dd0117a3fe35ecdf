"""Attacks on the receiver of HTTP: nothing without the token, nothing without a bound."""

from __future__ import annotations

import contextlib
import http.client
import json
import random
import socket
import time
from urllib.parse import urlsplit

import numpy as np
import pytest
from tests.live.phones import Push, messages, readings
from tests.live.running import Run

from strapdown.live.hub import Hub, StateWriter
from strapdown.live.lines import BadLineError
from strapdown.live.many import listening_socket
from strapdown.live.phones import LineDevice, phyphox_buffers, phyphox_events
from strapdown.live.replay import MachineClock
from strapdown.live.session import SessionOptions

TIME = np.arange(0.0, 2.0, 0.01)


@pytest.fixture
def run(tmp_path):
    made = Run(tmp_path, "--every", "0")
    yield made
    if made.job.poll() is None:
        made.kill()


def asked(run, path, method="POST", body=b"{}"):
    with Push(run.address) as push:
        return push.send(body, path, method)


def wrong_paths(token):
    yield from ("/", "", "/data", "/favicon.ico", "//", f"//{token}/", f"/{token[:-1]}/")
    yield from (f"/{token}x/", f"/{token.swapcase()}/", f"/{token}/../{token}/", f"/{token}/x")
    yield from (f"/{token}/data/x", f"/%2e%2e/{token}/", f"/{token}%00/", f"/x/{token}/")
    yield from (f"/{token}/../../etc/passwd", f"/{token}//", "/" + "a" * 4000, f"/?{token}")
    yield from (f"/{token}\\..\\x/", "/%F0%9F%98%80/", f"/{token}/%2e%2e/%2e%2e/etc/passwd")


@pytest.mark.slow
def test_nothing_is_found_without_the_token(run):
    token = urlsplit(run.address).path.strip("/")
    assert len(token) == 32
    for path in wrong_paths(token):
        for method in ("GET", "POST", "PUT", "DELETE", "OPTIONS"):
            status = asked(run, path or "*", method)
            assert status in (404, 400), (path, method)
    assert asked(run, f"/{token}/", "PUT") == 405
    assert asked(run, f"/{token}", "GET", b"") == 200
    # Nothing of it began a session.
    assert [one for one in run.said if "begun" in one] == []
    with socket.create_connection(urlsplit(run.address).netloc.split(":"), 10) as link:
        key = "GET /wrong/ HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        key += "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
        link.sendall(key.encode())
        assert b" 404 " in link.recv(200)
    run.end()


@pytest.mark.slow
def test_bodies_headers_and_clients_are_bounded(run):
    parts = urlsplit(run.address)
    for headers, body, codes in (
        ({"Content-Length": str(1 << 40)}, b"x", (413,)),
        ({"Content-Length": "-1"}, b"", (400,)),
        ({"Content-Length": "many"}, b"", (400,)),
        ({"X-Long": "y" * 100_000}, b"", (400, 431)),
        ({"Transfer-Encoding": "chunked"}, chunks(6 << 20), (413,)),
    ):
        link = http.client.HTTPConnection(parts.hostname, parts.port, timeout=20)
        link.putrequest("POST", parts.path)
        for name, value in headers.items():
            link.putheader(name, value)
        with contextlib.suppress(ConnectionError):
            link.endheaders()
            link.send(body)
        with contextlib.suppress(ConnectionError, http.client.HTTPException):
            assert link.getresponse().status in codes, headers
        link.close()
    # Clients that say nothing, and ones that are slow, do not keep a phone from sending.
    idle = [socket.create_connection((parts.hostname, parts.port), 10) for _ in range(60)]
    for one in idle[:30]:
        one.sendall(
            f"POST {parts.path} HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\n{{".encode()
        )
    with Push(run.address) as push:
        for message in messages(readings(TIME)):
            assert push.send(message) == 200
    run.until(lambda: len(run.states()) >= 190)
    # A body that does not come is given up, and a connection without a request.
    idle[0].settimeout(20)
    began = time.monotonic()
    assert b" 408 " in idle[0].recv(500)
    assert time.monotonic() - began < 15.0
    idle[-1].settimeout(20)
    assert idle[-1].recv(10) == b""
    for one in idle:
        one.close()
    run.end()


def chunks(size):
    part = b"10000\r\n" + b" " * 65536 + b"\r\n"
    return part * (size // 65536) + b"0\r\n\r\n"


@pytest.mark.slow
def test_a_thousand_websockets_do_not_end_it(run):
    from websockets.exceptions import WebSocketException
    from websockets.sync.client import connect

    address = run.address.replace("http", "ws")
    failed = (WebSocketException, OSError, TimeoutError)
    with contextlib.ExitStack() as stack:
        links = []
        for _ in range(1000):
            with contextlib.suppress(*failed):
                link = connect(address, open_timeout=5, ping_interval=None, close_timeout=1)
                links.append(stack.enter_context(link))
        assert 100 <= len(links) <= 128
        with contextlib.suppress(*failed):
            links[0].send("x" * (2 << 20))  # too large
            links[0].recv(5)
        assert links[0].close_code == 1009
        links[1].send("\n".join(f"imu,{0.01 * k!r},0,0,0,0,0,-9.81" for k in range(100)))
        run.until(lambda: len(run.states()) > 80)
    run.until(lambda: sends(run))
    run.end()


def sends(run):
    with contextlib.suppress(OSError, http.client.HTTPException), Push(run.address) as push:
        return push.send(messages(readings(TIME))[0]) == 200
    return False


def mutated(rng, message):
    """A message that is wrong somewhere: as bytes."""
    text = json.dumps(message).encode()
    kind = rng.randrange(8)
    if kind == 0:  # bytes
        data = bytearray(text)
        for _ in range(rng.randrange(1, 20)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        return bytes(data)
    if kind == 1:  # cut
        return text[: rng.randrange(len(text))]
    if kind == 2:  # nested
        return b'{"payload": ' + b"[" * rng.choice([50, 5000, 200_000]) + b"]"
    whole = json.loads(text)
    strange = [None, True, -1, 10**400, 1e308, "x" * 5000, "\x1b[31m", [], {}, [[]], "NaN"]
    strange += [float("nan"), float("inf"), -(10**18), 10**19, "../../etc/passwd", "\ud800", "‮"]
    if kind == 3:
        whole[rng.choice(["messageId", "sessionId", "deviceId", "payload"])] = rng.choice(strange)
    elif kind == 4:
        whole["payload"][rng.randrange(len(whole["payload"]))] = rng.choice(strange)
    elif kind == 5:
        one = rng.choice(whole["payload"])
        one[rng.choice(["name", "time", "values"])] = rng.choice(strange)
    elif kind == 6:
        one = rng.choice(whole["payload"])
        one["values"][rng.choice(["x", "y", "z"])] = rng.choice(strange)
    else:
        return json.dumps(rng.choice(strange)).encode()
    return json.dumps(whole).encode()


def test_six_hundred_mutated_messages_are_refused_or_used_without_a_traceback(tmp_path):
    lines, warned, rng = [], [], random.Random(7)
    hub = Hub(
        tmp_path,
        SessionOptions(every=0.0),
        MachineClock(),
        StateWriter(lines.append),
        warned.append,
    )
    good = messages(readings(TIME))
    for k in range(600):
        hub.sensor_logger(mutated(rng, good[k % len(good)]), "sensor-logger", 0.0)
        if k % 30 == 29:
            assert (
                hub.sensor_logger(json.dumps(good[k // 30 % len(good)]), "sensor-logger", 0.0)
                is None
            )
    hub.finish()
    assert hub.refused["message"] > 100
    # States are of finite numbers, names without what moves a terminal's cursor.
    for line in lines:
        assert line.isascii()
        state = json.loads(line, parse_constant=pytest.fail)
        if "q" in state:
            assert abs(np.linalg.norm(state["q"]) - 1.0) < 1e-9
    for folder in tmp_path.iterdir():
        assert folder.name.replace("-", "").isalnum()
    assert any(one["session"] == "phone-1" for one in hub.ended)


def test_mutated_lines_and_answers_of_phyphox(tmp_path):
    rng = random.Random(3)
    lines = [
        "imu,1.0,0,0,0,0,0,-9.8",
        "1.0, 3, 0,0,9.8, 4, 0,0,0",
        "time_s,gyro_x_rad_s,gyro_y_rad_s",
    ]
    device = LineDevice(["gnss"])
    for k in range(2000):
        text = list(lines[k % 3])
        for _ in range(rng.randrange(1, 6)):
            text[rng.randrange(len(text))] = rng.choice("0123456789,.-+eE_xnainf\0é \t")
        with contextlib.suppress(BadLineError):
            device.parse("".join(text), 0.0)
    strange = [None, [], {}, 1, "x", {"buffer": []}, {"buffer": {"acc_time": 1}}]
    strange += [{"buffer": {n: {"buffer": [None, "x", 1e400, 10**400, [1]]}}} for n in ("accX",)]
    config = {"inputs": [None, {"source": "gyroscope", "outputs": [1, {"x": 1}]}], "buffers": [1]}
    for one in (*strange, config):
        buffers = phyphox_buffers(one)
        assert isinstance(buffers, dict)
        for other in strange:
            with contextlib.suppress(BadLineError):
                assert phyphox_events(other, phyphox_buffers(None), {}) == []


def test_answers_do_not_wait_for_an_acknowledgment():
    # asyncio sets TCP_NODELAY on connections of a socket that is named as TCP alone: an answer of
    # two writes otherwise takes 40 ms, which the benchmark found.
    with listening_socket("127.0.0.1:0") as bound:
        assert bound.proto == socket.IPPROTO_TCP
