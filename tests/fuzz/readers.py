"""Damaged files of every format that a library parses, through the process that parses them.

    python -m tests.fuzz.readers COUNT [SEED] [FOLDER]

Seeds are small files of each format. Each input is one of them with bytes changed, lengths put to
extremes, parts cut, doubled or taken from another. It is read, or refused by an error of the
package; anything else, 30 s, or a dead caller is a failure, and its file is kept in FOLDER.
"""

from __future__ import annotations

import io
import random
import resource
import shutil
import struct
import sys
import tempfile
import time
import traceback
import zipfile
from collections import Counter
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from openpyxl import Workbook
from scipy.io import savemat
from tests.recorded import DATA

from strapdown.errors import StrapdownError
from strapdown.formats import TABLE, open_stream, reader_of

SLOWEST = 30.0
#: Values at which lengths and counts go wrong.
EXTREMES = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 2**63 - 1)


def signals(count: int = 60) -> dict[str, np.ndarray]:
    """Stamps, rates and specific force of a body that turns a little."""
    draw = np.random.default_rng(1)
    time = np.arange(count) / 50.0
    gyro, accel = draw.normal(size=(2, count, 3)) * 0.05
    names = {f"gyro_{a}_rad_s": gyro[:, k] for k, a in enumerate("xyz")}
    names |= {f"accel_{a}_m_s2": accel[:, k] - 9.81 * (k == 2) for k, a in enumerate("xyz")}
    return {"time_s": time} | names


def seeds(folder: Path) -> list[Path]:
    """Write one small file of each format and layout; those of recorders are recorded ones."""
    folder.mkdir(parents=True, exist_ok=True)
    held, count = signals(), 60
    block = np.column_stack([held[n] for n in list(held)[1:]])
    time, unit = held["time_s"], np.tile([1.0, 0, 0, 0], (count, 1))

    def hdf5(name: str, arrays: dict[str, np.ndarray], **how: object) -> None:
        with h5py.File(folder / name, "w", track_order=True) as file:
            for key, values in arrays.items():
                file.create_dataset(key, data=values, **how).attrs["unit"] = "1"
            file.attrs["FileFormatVersion"] = 5

    hdf5("plain.h5", held)
    hdf5("packed.h5", held, chunks=(16,), compression="gzip", shuffle=True, fletcher32=True)
    broad = {"imu_gyr": block[:, :3], "imu_acc": block[:, 3:], "opt_quat": unit}
    hdf5("broad.h5", broad | {"sampling_rate": np.array(50.0)})
    ronin = {"synced/time": time, "synced/gyro": block[:, :3], "synced/acce": block[:, 3:]}
    hdf5("ronin.hdf5", ronin | {"pose/tango_ori": unit})
    apdm = {"Gyroscope": block[:, :3], "Accelerometer": block[:, 3:], "Time": time * 1e6}
    hdf5("apdm.h5", {f"Sensors/123/{n}": v for n, v in apdm.items()})
    hdf5("v73.mat", {"imu/t": time[None], "imu/fb": block[:, 3:].T, "imu/wb": block[:, :3].T})
    savemat(folder / "plain.mat", held)
    savemat(folder / "packed.mat", held, do_compression=True)
    navego = {"t": time, "fb": block[:, 3:], "wb": block[:, :3]}
    savemat(
        folder / "navego.mat", {"imu": navego, "note": "text", "cells": np.array([1, "a"], "O")}
    )
    savemat(folder / "foot.mat", {"timestamps": time, "imu_data": block})
    savemat(folder / "old.mat", held, format="4")
    np.savez(folder / "plain.npz", **held)
    np.savez_compressed(folder / "packed.npz", **held)
    truth = np.column_stack([np.full((count, 3), 1.0), np.zeros((count, 6))])
    fix = {"fix_time": time[::10], "fix": truth[::10, :3]}
    np.savez(folder / "python_ins.npz", time=time, imu=block, truth=truth, **fix)
    table = pa.table({**held, "dates": pa.array(np.arange(count), pa.timestamp("ms"))})
    lists = pa.array(list(block[:, :3]), pa.list_(pa.float64()))
    pq.write_table(table.append_column("list", lists), folder / "plain.parquet")
    pq.write_table(table, folder / "packed.parquet", compression="snappy")
    book = Workbook()
    for row in [list(held), *zip(*(v.tolist() for v in held.values()), strict=True)]:
        book.active.append(row)
    book.save(folder / "book.xlsx")
    with zipfile.ZipFile(folder / "phone.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for triad, columns in (("Gyroscope", block[:, :3]), ("Accelerometer", block[:, 3:])):
            text = io.StringIO("time,seconds_elapsed,z,y,x\n")
            text.seek(0, 2)
            for t, (x, y, z) in zip(time.tolist(), columns.tolist(), strict=True):
                text.write(f"{int(1.7e18 + t * 1e9)},{t},{z},{y},{x}\n")
            archive.writestr(f"{triad}.csv", text.getvalue())
    zoo = DATA / "zoo"
    recorded = {
        "flight.ulg": ("px4_ulg/sample_log_small.ulg", 90_000),
        "car.ubx": ("ubx/pygpsdata-SF-calibration.log", 30_000),
        "ride.fit": ("garmin_fit/garmin-edge-820-bike.fit", None),
        "track.gpx": ("gpx/around-visnjan-with-car.gpx", None),
    }
    for name, (source, size) in recorded.items():
        if (zoo / source).exists():
            (folder / name).write_bytes((zoo / source).read_bytes()[:size])
    _bags(folder, time, block)
    _telemetry(folder / "flight.tlog", block)
    return sorted(p for p in folder.iterdir() if p.is_file())


def _bags(folder: Path, time: np.ndarray, block: np.ndarray) -> None:
    """Write bags of ROS 1 and ROS 2, of one topic each."""
    from rosbags import rosbag1, rosbag2, typesys

    kind, mcap = "sensor_msgs/msg/Imu", rosbag2.StoragePlugin.MCAP
    with tempfile.TemporaryDirectory() as own:
        for ending in ("bag", "mcap", "db3"):
            made = Path(own) / f"ros.{ending}"
            old = ending == "bag"
            store = typesys.get_typestore(
                typesys.Stores.ROS1_NOETIC if old else typesys.Stores.LATEST
            )
            writer = rosbag1.Writer(made) if old else rosbag2.Writer(made, version=9)
            if ending == "mcap":
                writer = rosbag2.Writer(made, version=9, storage_plugin=mcap)
            with writer as bag:
                link = bag.add_connection("/imu", kind, typestore=store)
                for t, row in zip(time.tolist(), block.tolist(), strict=True):
                    at = 1_700_000_000_000_000_000 + int(t * 1e9)
                    message = _message(store.types, at, row, {"seq": 0} if old else {})
                    write = store.serialize_ros1 if old else store.serialize_cdr
                    bag.write(link, at, write(message, kind))
            inside = made if old else next(made.glob(f"*.{ending}"))
            shutil.copyfile(inside, folder / made.name)


def _message(types: Any, at: int, row: list[float], head: dict[str, int]) -> Any:
    vector, nine = types["geometry_msgs/msg/Vector3"], np.zeros(9)
    stamp = types["builtin_interfaces/msg/Time"](sec=at // 10**9, nanosec=at % 10**9)
    return types["sensor_msgs/msg/Imu"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="imu", **head),
        orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=nine,
        angular_velocity=vector(*row[:3]),
        angular_velocity_covariance=nine,
        linear_acceleration=vector(*row[3:]),
        linear_acceleration_covariance=nine,
    )


def _telemetry(path: Path, block: np.ndarray) -> None:
    try:
        from pymavlink.dialects.v20 import ardupilotmega as dialect
    except ImportError:
        return
    link, out = dialect.MAVLink(None, srcSystem=1, srcComponent=1), b""
    for k, row in enumerate(block.tolist()):
        imu = dialect.MAVLink_highres_imu_message(
            20_000 * k, *row[3:], *row[:3], 0.1, 0.2, 0.4, 950.0, 0.0, 540.0, 21.0, 0xFFFF
        )
        out += struct.pack(">Q", 1_700_000_000_000_000 + 20_000 * k) + bytes(imu.pack(link))
    path.write_bytes(out)


def mutated(data: bytes, other: bytes, draw: random.Random) -> bytes:
    """Return a seed with one to four faults."""
    out = bytearray(data)
    for _ in range(1 + draw.getrandbits(2)):
        if not out:
            break
        # Headers are where lengths are: a third of the faults are in the first hundredth.
        at = draw.randrange(len(out) if draw.random() > 0.3 else max(1, len(out) // 100))
        match draw.randrange(8):
            case 0 | 1:
                out[at] ^= 1 << draw.randrange(8)
            case 2:
                out[at] = draw.randrange(256)
            case 3 | 4:
                form = draw.choice("BHIQ")
                size = struct.calcsize(form)
                value = draw.choice(EXTREMES) % (1 << 8 * size)
                out[at : at + size] = struct.pack(draw.choice("<>") + form, value)
            case 5:
                if draw.random() < 0.3:
                    del out[at:]
                else:
                    del out[at : at + draw.randrange(1, 64)]
            case 6:
                size = draw.randrange(1, 256)
                out[at:at] = out[at : at + size]
            case 7:
                size, start = draw.randrange(1, 256), draw.randrange(len(other))
                out[at : at + size] = other[start : start + size]
    return bytes(out)


def outcome(path: Path) -> str:
    """Read every stream of a file, by the format that its content shows and by its seed's."""
    result = "refused"
    try:
        _, reader = reader_of(path)
        streams = [] if reader is None else ["imu" if s == TABLE else s for s in reader.streams]
    except StrapdownError as error:
        str(error)
        streams = []
    for stream in streams or ["imu"]:
        try:
            open_stream(path, stream)
            result = "read"
        except StrapdownError as error:
            str(error)
            if error.finding.code.startswith("io.parser-"):
                return error.finding.code
    return result


def main(count: int, seed: int = 0, keep: Path | None = None) -> Counter[str]:
    """Read `count` inputs; failures are printed, and kept in the folder `keep`."""
    draw = random.Random(seed)
    found: Counter[str] = Counter()
    slowest = 0.0
    with tempfile.TemporaryDirectory() as own:
        folder = Path(own)
        files = seeds(folder / "seeds")
        contents = {p.name: p.read_bytes() for p in files}
        begun = time.monotonic()
        for k in range(count):
            source = files[k % len(files)]
            other = contents[draw.choice(files).name]
            path = folder / f"{k}{source.suffix}"
            path.write_bytes(mutated(contents[source.name], other, draw))
            at = time.monotonic()
            try:
                said = outcome(path)
            except Exception:  # what is searched for
                said = "traceback"
                print(f"{source.name} {k}\n{traceback.format_exc()}", flush=True)
            took = time.monotonic() - at
            slowest = max(slowest, took)
            if took > SLOWEST:
                said = "slow"
            if said not in ("read", "refused") and keep is not None:
                keep.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, keep / f"{said}-{source.stem}-{seed}-{k}{source.suffix}")
            found[said] += 1
            found[f"{source.name}: {said}"] += 1
            path.unlink()
        took = time.monotonic() - begun
    most = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    own_most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    for name, number in sorted(found.items()):
        print(f"{number:8d}  {name}")
    print(f"{count} inputs in {took:.0f} s, the slowest {slowest:.1f} s; ", end="")
    print(f"at most {most:.0f} MiB in a process that ended, {own_most:.0f} MiB here")
    return found


if __name__ == "__main__":
    given = sys.argv[1:] + ["10000", "0"][len(sys.argv) - 1 :]
    total = main(int(given[0]), int(given[1]), Path(given[2]) if len(given) > 2 else None)
    sys.exit(1 if total["traceback"] or total["slow"] else 0)
