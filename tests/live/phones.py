"""Synthetic phones with exact truth, which speak each protocol as its documentation says.

Sensor Logger: https://github.com/tszheichoi/awesome-sensor-logger (PUSHING.md, UNITS.md,
COORDINATES.md). phyphox: https://phyphox.org/wiki/index.php/Remote-interface_communication.
"""

from __future__ import annotations

import http.client
import json
import math
import threading
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qsl, urlsplit

import numpy as np
from scipy.spatial.transform import Rotation

G = 9.80665
#: Of a place in Europe, north, east, down, µT: without declination.
FIELD = np.array([20.0, 0.0, 44.0])
EPOCH_NS = 1_698_501_144_401_773_000


def body_from_phone(v):
    """Forward, right, down of x right, y to the top edge, z out of the screen."""
    return np.stack([v[..., 1], v[..., 0], -v[..., 2]], axis=-1)


phone_from_body = body_from_phone  # it is its own inverse


@dataclass
class Motion:
    """A phone that is turned in hand: smooth 3-2-1 angles, exact rates, gravity and field."""

    begin: float = 2.0
    heading: float = 30.0

    def angles(self, t):
        """Roll, pitch, heading, rad; at rest until `begin`."""
        s = np.maximum(np.asarray(t) - self.begin, 0.0)
        ramp = 1.0 - np.exp(-(s**2))
        roll = 0.5 * ramp * np.sin(0.9 * s)
        pitch = 0.4 * ramp * np.sin(0.7 * s + 0.3) * np.sin(0.1 * s)
        heading = math.radians(self.heading) + 0.8 * ramp * np.sin(0.5 * s)
        return np.stack([roll, pitch, heading], axis=-1)

    def attitude(self, t):
        return Rotation.from_euler("ZYX", self.angles(t)[..., ::-1])

    def rates(self, t):
        """Body rates by the derivative of the angles (Groves 2.58), rad/s."""
        h = 1e-5
        d = (self.angles(np.asarray(t) + h) - self.angles(np.asarray(t) - h)) / (2.0 * h)
        roll, pitch, _ = np.moveaxis(self.angles(t), -1, 0)
        dr, dp, dh = np.moveaxis(d, -1, 0)
        return np.stack(
            [
                dr - dh * np.sin(pitch),
                dp * np.cos(roll) + dh * np.sin(roll) * np.cos(pitch),
                -dp * np.sin(roll) + dh * np.cos(roll) * np.cos(pitch),
            ],
            axis=-1,
        )

    def sensors(self, t, noise=1.0, seed=1):
        """Rates, specific force and field at stamps, axes of the phone."""
        rng = np.random.default_rng(seed)
        turn = self.attitude(t).inv()
        gyro = self.rates(t) + noise * rng.normal(0.0, 1e-3, (len(t), 3))
        force = turn.apply([0.0, 0.0, -G]) + noise * rng.normal(0.0, 0.02, (len(t), 3))
        field = turn.apply(FIELD) + noise * rng.normal(0.0, 0.2, (len(t), 3))
        return phone_from_body(gyro), phone_from_body(force), phone_from_body(field)


def xyz(row):
    return dict(zip("xyz", map(float, row), strict=True))


def readings(
    t, motion=None, *, system="android", mag=True, offset=0.0, drift=0.0, seed=1, noise=1.0
):
    """Values of Sensor Logger in order of their stamps: gyro, accelerometer, field.

    `offset` (s): by which the accelerometer's stamps differ from the gyro's. `drift`: relative
    error of the phone's clock.
    """
    motion = motion or Motion()
    sign = -1.0 if system == "ios" else 1.0
    out = []
    gyro, _, _ = motion.sensors(t, noise, seed)
    _, force, _ = motion.sensors(t + offset, noise, seed + 1)
    tm = t[::2]
    _, _, field = motion.sensors(tm, noise, seed + 2)

    def stamp(s):
        return EPOCH_NS + round(s * (1.0 + drift) * 1e9)

    for k, s in enumerate(t):
        out.append((stamp(s), "gyroscope", xyz(gyro[k])))
        if system == "android":
            out.append((stamp(s + offset), "totalacceleration", xyz(force[k])))
        else:
            down = motion.attitude(s + offset).inv().apply([0.0, 0.0, -G])
            gravity = phone_from_body(down)
            out.append((stamp(s + offset), "accelerometer", xyz(sign * (force[k] - gravity))))
            out.append((stamp(s + offset), "gravity", xyz(sign * gravity)))
    if mag:
        out += [(stamp(s), "magnetometer", xyz(field[k])) for k, s in enumerate(tm)]
    out.sort(key=lambda one: one[0])
    return [{"name": n, "time": t, "accuracy": 3, "values": v} for t, n, v in out]


def messages(values, size=30, device="phone-1", session="walk", first=0):
    """Messages of Sensor Logger's HTTP push."""
    return [
        {
            "messageId": first + k,
            "sessionId": session,
            "deviceId": device,
            "payload": values[i : i + size],
        }
        for k, i in enumerate(range(0, len(values), size))
    ]


def error_deg(q, motion, t):
    """Angles between attitudes, (n, 4), scalar first, and the truth, deg."""
    shown = Rotation.from_quat(np.roll(np.asarray(q), -1, axis=-1))
    return np.degrees((motion.attitude(np.asarray(t)).inv() * shown).magnitude())


class Push:
    """Client of HTTP push, with one connection."""

    def __init__(self, address):
        parts = urlsplit(address)
        self.path = parts.path
        self.link = http.client.HTTPConnection(parts.hostname, parts.port, timeout=20)

    def send(self, message, path=None, method="POST", headers=None):
        body = message if isinstance(message, bytes) else json.dumps(message).encode()
        try:
            self.link.request(method, self.path if path is None else path, body, headers or {})
            answer = self.link.getresponse()
            answer.read()
        except (ConnectionError, http.client.HTTPException):
            self.link.close()
            raise
        return answer.status

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.link.close()


class Phyphox(ThreadingHTTPServer):
    """The remote interface of phyphox, over buffers that grow as the test says."""

    def __init__(self, config=True, port=0):
        self.buffers: dict[str, list[float]] = {}
        self.session, self.measuring, self.lock = "abcdef", True, threading.Lock()
        self.asked: list[str] = []
        self.with_config = config
        super().__init__(("127.0.0.1", port), _PhyphoxHandler)
        self.daemon_threads = True
        threading.Thread(target=self.serve_forever, args=(0.02,), daemon=True).start()

    @property
    def address(self):
        return f"127.0.0.1:{self.server_address[1]}"

    def leave(self):
        """Leave the network."""
        self.shutdown()
        self.server_close()

    def extend(self, **columns):
        with self.lock:
            for name, values in columns.items():
                self.buffers.setdefault(name, []).extend(map(float, values))


def time(name):
    return {"t": f"{name}_time"}


class _PhyphoxHandler(BaseHTTPRequestHandler):
    def do_GET(self):
        phone, parts = self.server, urlsplit(self.path)
        phone.asked.append(self.path)
        if parts.path == "/config" and phone.with_config:
            inputs = [
                {
                    "source": source,
                    "outputs": [{a: f"{n}{a.upper()}"} for a in "xyz"] + [{"t": f"{n}_time"}],
                }
                for source, n in (("accelerometer", "acc"), ("gyroscope", "gyr"))
            ]
            names = [{"name": n, "size": 0} for n in phone.buffers]
            return self.answer({"title": "test", "buffers": names, "inputs": inputs, "export": []})
        if parts.path != "/get":
            return self.answer({}, 404)
        with phone.lock:
            held = {}
            for name, asked in parse_qsl(parts.query, keep_blank_values=True):
                if name not in phone.buffers:
                    continue
                values = phone.buffers[name]
                if asked == "":
                    mode, values = "single", values[-1:]
                elif asked == "full":
                    mode = "full"
                else:
                    above, _, reference = asked.partition("|")
                    by = phone.buffers[reference or name]
                    first = next((k for k, v in enumerate(by) if v > float(above)), len(by))
                    mode, values = "partial", values[first:]
                # About eight digits, as the app writes them.
                held[name] = {
                    "size": 0,
                    "updateMode": mode,
                    "buffer": [float(f"{v:.8g}") for v in values],
                }
            status = {
                "session": phone.session,
                "measuring": phone.measuring,
                "timedRun": False,
                "countDown": 0,
            }
        return self.answer({"buffer": held, "status": status})

    def answer(self, said, status=200):
        data = json.dumps(said).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, *args):
        pass
