"""Latency and loss of `strapdown live`, by synthetic phones in processes of their own.

``python -m benchmarks.live --rate 400 --seconds 60`` sends as Sensor Logger does, or with ``--udp``
as Sensorstream; ``--phones 10 --rate 100`` ten at once; ``--seconds 3600`` an hour. The latency is
from before a message is sent to when the state of its last sample is read from standard output,
by the monotonic clock that processes share; ``latency.json`` has the stages. Sends are at fixed
instants, whether or not the answer to the one before has come.
"""

from __future__ import annotations

import argparse
import http.client
import json
import multiprocessing
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np

EPOCH = 1_700_000_000


def send(phone: int, where: str, rate: float, seconds: float, batch: int, sent: object) -> None:
    """Send the samples of one phone, each message when its last sample is due."""
    step, count = 1.0 / rate, int(rate * seconds)
    t = np.arange(count) * step
    gyro = 0.3 * np.stack([np.sin(t), np.cos(0.7 * t), np.sin(0.4 * t)], axis=1)
    times = np.frombuffer(sent.get_obj())  # type: ignore[attr-defined]
    parts = urlsplit(where)
    link = None
    if parts.scheme == "http":
        link = http.client.HTTPConnection(parts.hostname or "", parts.port, timeout=60)
    else:
        out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    begin = time.perf_counter() + 0.5 + 0.001 * phone
    for first in range(0, count, batch):
        rows = range(first, min(first + batch, count))
        if link is not None:
            payload = []
            for k in rows:
                stamp = EPOCH * 10**9 + round(t[k] * 1e9)
                x, y, z = gyro[k].tolist()
                for name, values in (
                    ("gyroscope", (x, y, z)),
                    ("totalacceleration", (0.1, 0.2, 9.8)),
                ):
                    payload.append(
                        {
                            "name": name,
                            "time": stamp,
                            "values": dict(zip("xyz", values, strict=True)),
                        }
                    )
            said = {"messageId": first // batch, "sessionId": "s", "deviceId": f"phone {phone}"}
            body = json.dumps({**said, "payload": payload})
        else:
            x, y, z = gyro[first].tolist()
            body = f"{t[first]:.6f}, 3, 0.1, 0.2, 9.8, 4, {x:.7f}, {y:.7f}, {z:.7f}"
        due = begin + t[rows[-1]]
        if (left := due - time.perf_counter()) > 0.0:
            time.sleep(left)
        times[rows[0] : rows[-1] + 1] = time.perf_counter()
        if link is not None:
            link.request("POST", parts.path, body)
            link.getresponse().read()
        else:
            out.sendto(body.encode(), (parts.hostname or "", parts.port or 0))


def main() -> None:
    """Measure, and print one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rate", type=float, default=400.0)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--phones", type=int, default=1)
    parser.add_argument("--batch", type=int, default=4, help="samples of a message by HTTP")
    parser.add_argument("--udp", action="store_true")
    parser.add_argument("--every", default="0")
    asked = parser.parse_args()
    count = int(asked.rate * asked.seconds)
    with tempfile.TemporaryDirectory() as folder:
        source = ["--udp", "127.0.0.1:0"] if asked.udp else ["--listen", "127.0.0.1:0"]
        command = [sys.executable, "-m", "strapdown", "live", *source, "--every", asked.every]
        job = subprocess.Popen(
            [*command, "--out", f"{folder}/out", "--quiet"], stdout=subprocess.PIPE, text=True
        )
        assert job.stdout is not None
        said = json.loads(job.stdout.readline())
        where = said["sources"][0] if asked.udp else said["listening"]
        sent = [multiprocessing.Array("d", count) for _ in range(asked.phones)]
        latencies = [np.full(count, np.nan) for _ in range(asked.phones)]
        lines = threading.Thread(target=read, args=(job.stdout, sent, latencies, asked.rate))
        lines.start()
        batch = 1 if asked.udp else asked.batch
        senders = [
            multiprocessing.Process(
                target=send, args=(k, where, asked.rate, asked.seconds, batch, sent[k])
            )
            for k in range(asked.phones)
        ]
        for one in senders:
            one.start()
        for one in senders:
            one.join()
        time.sleep(1.0)
        job.send_signal(2)
        lines.join()
        job.wait(60)
        told = [json.loads(p.read_text()) for p in sorted(Path(folder).glob("out/*/latency.json"))]
        inside = [np.isfinite(one) for one in latencies]
        ms = 1e3 * np.concatenate([one[good] for one, good in zip(latencies, inside, strict=True)])
        size = sum(p.stat().st_size for p in Path(folder).glob("out/*/journal"))
        print(
            json.dumps(
                {
                    "phones": asked.phones,
                    "rate_hz": asked.rate,
                    "seconds": asked.seconds,
                    "sent": 2 * count * asked.phones,
                    "received": sum(one["events"] for one in told),
                    "not_used": [one["not_used"] for one in told],
                    "states": len(ms),
                    "median_ms": round(float(np.median(ms)), 3),
                    "p99_ms": round(float(np.percentile(ms, 99.0)), 3),
                    "largest_ms": round(float(ms.max()), 3),
                    "inside": told[0]["stages"] if told else None,
                    "journal_bytes": size,
                }
            )
        )


def read(stdout: object, sent: list, latencies: list, rate: float) -> None:
    """Note when the state of each sample is read."""
    for line in stdout:  # type: ignore[attr-defined]
        now = time.perf_counter()
        state = json.loads(line)
        if "time" not in state:
            continue
        name = state["device"]
        phone = int(name.split()[1]) if name.startswith("phone") else 0
        since = state.get("unix", EPOCH + state["time"]) - EPOCH
        k = round(since * rate)
        if 0 <= k < len(latencies[phone]):
            latencies[phone][k] = now - np.frombuffer(sent[phone].get_obj())[k]


if __name__ == "__main__":
    main()
