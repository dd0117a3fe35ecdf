"""`strapdown live` itself: every protocol by a synthetic device, a kill, and navigation."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import re
import shlex
import socket
import struct
import threading
import time
import tty
from functools import partial

import numpy as np
import pandas as pd
import pytest
from tests.cli.test_navigate_live import lines, recorded, written
from tests.live.phones import Motion, Phyphox, Push, body_from_phone, error_deg, messages, readings
from tests.live.running import Run
from tests.live.test_sessions import WITHIN, attitude_of, errors

from strapdown.bundle import read_manifest, unsealed_changes

TIME = np.arange(0.0, 8.0, 0.01)
MOTION = Motion()
FILTER = "error-state:velocity=0.3"


@pytest.fixture
def start(tmp_path):
    runs = []

    def make(*options, **more):
        runs.append(Run(tmp_path, *options, **more))
        return runs[-1]

    yield make
    for run in runs:
        if run.job.poll() is None:
            run.kill()


def settled(run, last, seconds=60.0):
    """Wait for the state of a stamp."""
    run.until(lambda: run.states() and run.states()[-1]["time"] >= last - 1e-6, seconds)


def shows(run, count):
    return len(run.states()) == count


def shown(run):
    return np.array([one["q"] for one in run.states()])


@pytest.mark.slow
@pytest.mark.parametrize("path", ["", "data"])
def test_sensor_logger_by_http_push(start, tmp_path, path, run_cli):
    run = start("--every", "0")
    assert run.said[0]["sources"][0].startswith("http http://127.0.0.1:")
    with Push(run.address + path) as push:
        assert push.send(b"", method="GET") == 200
        for message in messages(readings(TIME, MOTION)):
            assert push.send(message) == 200
    run.until(lambda: len(run.states()) >= 790)
    run.end()
    states = run.states()
    assert {one["session"] for one in states} == {"phone-1"}
    assert errors(states, MOTION).max() < WITHIN
    np.testing.assert_array_equal(shown(run), attitude_of(tmp_path / "out" / "phone-1"))
    told = json.loads((tmp_path / "out" / "phone-1" / "latency.json").read_text())
    assert set(told["stages"]) == {"arrival_to_parsed", "parsed_to_journal", "arrival_to_state"}
    assert (told["messages"], told["not_used"]) == (len(messages(readings(TIME))), {})
    # The command of its sealed result; there is no navigation to play at a pace.
    session = tmp_path / "out" / "phone-1"
    words = re.findall(r"(?m)report: strapdown (.*)$", run.err())
    assert [shlex.split(one) for one in words] == [["attitude", str(session)]]
    done = run_cli("navigate", session, "--pace", "max", "--out", tmp_path / "no")
    assert done.code == 4 and "computed an attitude" in done.err
    done = run_cli("attitude", session, "--out", tmp_path / "sealed", "-q")
    assert done.code == 0, done.err


@pytest.mark.slow
def test_json_and_lines_by_websocket(start, tmp_path):
    from websockets.sync.client import connect

    run = start("--every", "0")
    with connect(run.address.replace("http", "ws")) as link:
        for message in messages(readings(TIME, MOTION)):
            link.send(json.dumps(message))
    run.until(lambda: len(run.states()) >= 790)
    assert errors(run.states(), MOTION).max() < WITHIN
    with connect(run.address.replace("http", "ws")) as link:
        link.send("\n".join(f"imu,{0.01 * k!r},0,0,0,0,0,-9.81" for k in range(100)))
    run.until(lambda: run.states("127-0-0-1"))
    run.end()
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["127-0-0-1", "phone-1"]


@pytest.mark.slow
def test_sensorstream_and_our_lines_by_datagrams(start, tmp_path):
    run = start("--udp", "127.0.0.1:0", "--every", "0")
    assert run.said[0]["listening"] is None
    port = int(run.said[0]["sources"][0].rpartition(":")[2])
    gyro, force, field = MOTION.sensors(TIME)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for k, t in enumerate(TIME):
            blocks = [(3, force[k]), (4, gyro[k]), (5, field[k])]
            text = ", ".join(f"{n}, " + ", ".join(f"{v:.7f}" for v in row) for n, row in blocks)
            sender.sendto(f"{t:.5f}, {text}".encode(), ("127.0.0.1", port))
            if k % 10 == 0:
                time.sleep(0.02)
        settled(run, TIME[-1])
        sender.sendto(b"command,end\n", ("127.0.0.1", port))
        sender.sendto(b"garbage\n" + b"x" * 5000, ("127.0.0.1", port))
        time.sleep(0.3)
    run.end()
    assert len(run.states()) == len(TIME)
    q = shown(run)
    # Axes of lines are those of the sensor, x, y, z; the truth's are those of the phone.
    turn = np.array([0.0, np.sqrt(0.5), np.sqrt(0.5), 0.0])
    found = sd_rotation(q) * sd_rotation(turn)
    # The first field gives the heading of the sensor's own x, which points right.
    assert error_deg(np.roll(found.as_quat(), 1, axis=1), MOTION, TIME)[300:].max() < WITHIN
    folder = tmp_path / "out" / "127-0-0-1"
    np.testing.assert_array_equal(q, attitude_of(folder))
    told = json.loads((folder / "latency.json").read_text())
    assert told["not_used"]["command refused"] == 1
    assert sum(told["not_used"].values()) == 3


def sd_rotation(q):
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(np.roll(q, -1, axis=-1))


@pytest.mark.slow
@pytest.mark.parametrize("header", [False, True])
def test_a_serial_port_is_a_pseudo_terminal(start, tmp_path, header):
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    run = start("--serial", os.ttyname(theirs) + "@460800", "--every", "0")
    gyro, force, _ = MOTION.sensors(TIME)
    # The sensor is mounted forward, right, down.
    gyro, force = body_from_phone(gyro), body_from_phone(force)
    out = b"34,0.1,0.2\n"  # the rest of a line
    if header:
        names = [
            "gyro_x_deg_s",
            "gyro_y_deg_s",
            "gyro_z_deg_s",
            "accel_x_g",
            "accel_y_g",
            "accel_z_g",
        ]
        out += (",".join(["time_ms", *names]) + "\n").encode()
    for k, t in enumerate(TIME):
        rates, forces = gyro[k], force[k]
        if header:
            rates, forces = np.degrees(rates), forces / 9.80665
        row = ",".join(f"{v:.9f}" for v in (*rates, *forces))
        out += f"{1e3 * t:.3f},{row}\n".encode() if header else f"imu,{t:.5f},{row}\n".encode()
    threading.Thread(target=_write, args=(ours, out), daemon=True).start()
    settled(run, TIME[-1])
    run.end()
    os.close(ours)
    assert len(run.states()) == len(TIME)
    q = shown(run)
    np.testing.assert_array_equal(q, attitude_of(next((tmp_path / "out").iterdir())))
    roll, pitch, _ = np.degrees(MOTION.angles(TIME)).T
    states = run.states()
    assert np.abs(np.array([s["roll"] for s in states]) - roll)[300:].max() < WITHIN
    assert np.abs(np.array([s["pitch"] for s in states]) - pitch)[300:].max() < WITHIN


def _write(file, data):
    with contextlib.suppress(OSError):
        for k in range(0, len(data), 512):
            os.write(file, data[k : k + 512])
            time.sleep(0.001)


@pytest.mark.slow
@pytest.mark.parametrize("config", [False, True])
def test_phyphox_is_polled_for_what_is_new(start, tmp_path, config):
    phone = Phyphox(config)
    gyro, force, _ = MOTION.sensors(TIME)

    def grown(first, last, since=0.0):
        rows = slice(first, last)
        for name, values in (("gyr", gyro), ("acc", force)):
            columns = {f"{name}{a}": values[rows, k] for k, a in enumerate("XYZ")}
            phone.extend(**columns, **{f"{name}_time": TIME[rows] - since})

    grown(0, 100)
    run = start("--phyphox", phone.address, "--every", "0")
    for k in range(100, len(TIME), 25):
        grown(k, k + 25)
        time.sleep(0.02)
    settled(run, TIME[-1])
    assert len(run.states()) == len(TIME)
    assert any("acc_time%7C" in one or "%7Cacc_time" in one for one in phone.asked)
    assert all("full" not in one for one in phone.asked if "%7C" in one)
    roll = np.degrees(MOTION.angles(TIME))[:, 0]
    assert np.abs(np.array([s["roll"] for s in run.states()]) - roll)[300:].max() < WITHIN
    # The phone leaves the network, and is there again.
    phone.leave()
    run.until(lambda: "no data" in run.err())
    again = Phyphox(config, phone.server_address[1])
    again.buffers = phone.buffers
    grown_on = {name: [*values] for name, values in phone.buffers.items()}
    for name in ("gyr_time", "acc_time"):
        grown_on[name] = [one + TIME[-1] + 0.01 for one in grown_on[name]]
    again.extend(**grown_on)
    run.until(lambda: len(run.states()) == 2 * len(TIME))
    run.end()
    again.leave()
    folder = tmp_path / "out" / ("127-0-0-1-" + phone.address.rpartition(":")[2])
    np.testing.assert_array_equal(shown(run), attitude_of(folder))


@pytest.mark.slow
def test_another_experiment_of_phyphox_is_another_session(start, tmp_path):
    phone, run = Phyphox(), None
    gyro, force, _ = MOTION.sensors(TIME[:200])
    for session, count in (("first", 200), ("second", 400)):
        with phone.lock:
            phone.buffers.clear()
            phone.session = session
        for name, values in (("gyr", gyro), ("acc", force)):
            columns = {f"{name}{a}": values[:, k] for k, a in enumerate("XYZ")}
            phone.extend(**columns, **{f"{name}_time": TIME[:200]})
        run = run or start("--phyphox", phone.address, "--every", "0")
        run.until(partial(shows, run, count))
    run.end()
    phone.leave()
    assert len(list((tmp_path / "out").iterdir())) == 2


@pytest.mark.slow
def test_a_kill_leaves_every_session_a_log(start, tmp_path):
    run = start("--every", "0")
    with Push(run.address) as push:
        for message in messages(readings(TIME, MOTION)):
            push.send(message)
        run.until(lambda: len(run.states()) >= 790)
        run.kill()
    count = len(run.states())
    found = attitude_of(tmp_path / "out" / "phone-1")
    np.testing.assert_array_equal(found[:count], shown(run))
    assert len(found) - count <= 5  # which waited for the other sensors
    assert not (tmp_path / "out" / "phone-1" / "latency.json").exists()
    # Another run takes a folder of its own.
    run = start("--every", "0")
    with Push(run.address) as push:
        push.send(messages(readings(TIME[:50], MOTION), 1000)[0])
    run.until(lambda: run.states("phone-1-2"))
    run.end()


CONFIG = '[live]\nsampling = "mean"\n'


@pytest.mark.slow
def test_navigation_of_lines_is_that_of_navigate_live_and_of_its_session(start, tmp_path, run_cli):
    written(tmp_path, CONFIG)
    run = start("run.toml", "--udp", "127.0.0.1:0", "--every", "0")
    port = int(run.said[0]["sources"][0].rpartition(":")[2])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for k, text in enumerate(lines()):
            sender.sendto(text.encode(), ("127.0.0.1", port))
            if k % 5 == 0:
                time.sleep(0.01)
        run.until(lambda: run.states() and run.states()[-1]["time"] > 4.0)
        time.sleep(0.5)
    run.end()
    states = [one for one in run.states() if one.get("lat") is not None]
    assert {"lat", "VN", "roll", "q", "heading_sd", "session"} <= set(states[-1])
    folder = tmp_path / "out" / "127-0-0-1"
    assert f"strapdown navigate {shlex.quote(str(folder))}" in run.err()
    for source in (folder, folder / "journal"):
        for pace in ((), ("--pace", "max")):
            done = run_cli("navigate", source, "--out", tmp_path / "again", "--force", *pace, "-q")
            assert done.code == 0, done.err
            assert unsealed_changes(tmp_path / "again", read_manifest(tmp_path / "again")) == []
            table = pd.read_csv(tmp_path / "again" / "trajectory.csv", comment="#")
            time_s = table.iloc[:, 0].to_numpy()
            rows = table[["lat_deg", "lon_deg", "alt_m"]].to_numpy()
            of_time = {round(one["time"], 6): one for one in states}
            common = [k for k, one in enumerate(time_s) if round(one, 6) in of_time]
            assert len(common) > 30
            for k in common:
                one = of_time[round(time_s[k], 6)]
                digits = zip(rows[k], (9, 9, 6), strict=True)
                assert [round(float(v), n) for v, n in digits] == [
                    one[name] for name in ("lat", "lon", "alt")
                ]
    assert not (tmp_path / "again-received").exists()
    done = run_cli("verify", tmp_path / "again")
    assert done.code == 0, done.err
    # The same record from files.
    other = tmp_path / "files"
    other.mkdir()
    done = run_cli("navigate", recorded(other), "--out", other / "out", "-q")
    assert done.code == 0, done.err
    batch = pd.read_csv(other / "out" / "trajectory.csv", comment="#").to_numpy()
    # Stamps of lines are rounded to a nanosecond.
    np.testing.assert_allclose(table.to_numpy(), batch, rtol=1e-9, atol=2e-6)


@pytest.mark.slow
def test_messages_by_a_broker(start, tmp_path):
    pytest.importorskip("paho.mqtt.client")
    broker = Broker()
    run = start("--mqtt", f"mqtt://127.0.0.1:{broker.port}/sensor-logger", "--every", "0")
    broker.subscribed.wait(30)
    for message in messages(readings(TIME, MOTION)):
        broker.publish("sensor-logger", json.dumps(message).encode())
    run.until(lambda: len(run.states()) >= 790)
    broker.drop()
    run.until(lambda: broker.connections == 2, 30)
    broker.subscribed.wait(30)
    broker.publish("sensor-logger", b"{not json")
    run.until(lambda: "not JSON" in run.err())
    run.end()
    broker.close()
    assert errors(run.states(), MOTION).max() < WITHIN
    np.testing.assert_array_equal(shown(run), attitude_of(tmp_path / "out" / "phone-1"))


class Broker:
    """A broker of MQTT 3.1.1 for one client: CONNECT, SUBSCRIBE, PUBLISH with QoS 0, PINGREQ."""

    def __init__(self):
        self.server = socket.create_server(("127.0.0.1", 0))
        self.port = self.server.getsockname()[1]
        self.subscribed, self.link, self.connections = threading.Event(), None, 0
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        with contextlib.suppress(OSError):
            while True:
                self.link, _ = self.server.accept()
                self.connections += 1
                with contextlib.suppress(OSError, ConnectionError):
                    while self._answer(self.link):
                        pass

    def _answer(self, link):
        head = link.recv(1)
        if not head:
            return False
        length, shift = 0, 0
        while True:
            (byte,) = link.recv(1)
            length |= (byte & 127) << shift
            shift += 7
            if not byte & 128:
                break
        body = b""
        while len(body) < length:
            body += link.recv(length - len(body))
        kind = head[0] >> 4
        if kind == 1:
            link.sendall(b"\x20\x02\x00\x00")
        elif kind == 8:
            link.sendall(b"\x90\x03" + body[:2] + b"\x00")
            self.subscribed.set()
        elif kind == 12:
            link.sendall(b"\xd0\x00")
        return kind != 14

    def publish(self, topic, payload):
        body = struct.pack(">H", len(topic)) + topic.encode() + payload
        length, head = len(body), b"\x30"
        while True:
            length, byte = divmod(length, 128)
            head += bytes([byte | (128 if length else 0)])
            if not length:
                break
        self.link.sendall(head + body)

    def drop(self):
        self.subscribed.clear()
        self.link.shutdown(socket.SHUT_RDWR)
        self.link.close()

    def close(self):
        self.server.close()
        if self.link is not None:
            self.link.close()


@pytest.mark.slow
def test_addresses_off_this_machine_are_told_and_shown_as_a_code(start, tmp_path):
    run = start("--listen", "0.0.0.0:0", "--qr", "--lines", "json", "--stop-after", "0.3")
    run.job.wait(60)
    run.end()
    assert "every device in the network can reach" in run.err()
    assert "▀" in run.err() or "█" in run.err()
    assert run.said[0]["listening"].split("/")[2].rpartition(":")[0] not in ("0.0.0.0", "")


@pytest.mark.parametrize(
    ("options", "code"),
    [
        (("--listen", "nowhere.invalid:1"), "cannot be opened"),
        (("--listen", "1:2:3:x"), "cannot be opened"),
        (("--listen", "127.0.0.1/path:1"), "is not an address"),
        (("--listen", "127.0.0.1:70000"), "is not an address"),
        (("--token", "short"), "16 to 128"),
        (("--token", "../../../../etc/passwd"), "16 to 128"),
        (("--serial", "/dev/no-such-port"), "cannot be opened"),
        (("--serial", "/dev/ttyS0@fast"), "is not a serial port"),
        (("--mqtt", "http://127.0.0.1"), "is not the address of a broker"),
        (("--platform", "symbian"), "unknown platform"),
        (("--lines", "xml"), "unknown form"),
        (("--every", "-1"), "is not an interval"),
        (("--algorithm", "kalman"), "kalman"),
        (("no-such.toml",), "no-such.toml"),
    ],
)
def test_what_is_not_understood_is_an_error_before_anything_begins(
    run_cli, tmp_path, options, code
):
    done = run_cli("live", *options, "--out", tmp_path / "out")
    assert done.code == 4, done.err
    assert code in done.err
    assert done.out == ""
