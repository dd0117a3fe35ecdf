"""Bags of ROS 1 and ROS 2, by rosbags; those of SQLite by its own library."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from strapdown.parsers.limits import damage, library

#: States of an inertial solution: good, free, alignment complete.
SOLVED = (3, 6, 7)


def has_messages(path: Path) -> bool:
    """Whether a database has the tables of a bag of ROS 2."""
    try:
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as base:
            names = {name for (name,) in base.execute("select name from sqlite_master")}
    except (sqlite3.Error, UnicodeDecodeError):  # damaged, or names in no encoding
        return False
    return {"messages", "topics"} <= names


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    bags, types = library("rosbags.highlevel", path), library("rosbags.typesys", path)
    known = types.get_typestore(types.Stores.LATEST)
    with damage("io.log-damaged", path), bags.AnyReader([path], default_typestore=known) as bag:
        yield bag


def topics(path: Path) -> list[list[Any]]:
    """List topic, type and count of the messages of each connection that has some."""
    with _opened(path) as bag:
        return [[c.topic, c.msgtype, c.msgcount] for c in bag.connections if c.msgcount > 0]


def columns(path: Path, topic: str, kinds: Sequence[str], values: str) -> dict[str, Any]:
    """Read one topic: stamps of its headers and of the record, ns, and the values of each message.

    `kinds`: types of its messages; of others none is read, unless all are. `values`: a key of
    `_VALUES`.
    """
    take = _VALUES[values]
    samples: dict[str, list[Any]] = {"time": [], "record": []}
    with _opened(path) as bag:
        found = [c for c in bag.connections if c.topic == topic and c.msgcount > 0]
        chosen = [c for c in found if c.msgtype in kinds] or found
        for one, record, data in bag.messages(connections=chosen):
            message = bag.deserialize(data, one.msgtype)
            stamp = message.header.stamp
            samples["time"].append(int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec))
            samples["record"].append(int(record))
            for name, value in take(message).items():
                samples.setdefault(name, []).append(value)
        return {name: np.array(held) for name, held in samples.items()}


def _vector(prefix: str, v: Any) -> dict[str, Any]:
    return {f"{prefix}_x": v.x, f"{prefix}_y": v.y, f"{prefix}_z": v.z}


def _imu(m: Any) -> dict[str, Any]:
    values = _vector("gyro", m.angular_velocity) | _vector("accel", m.linear_acceleration)
    values["frame"] = m.header.frame_id
    values["gyro_none"] = m.angular_velocity_covariance[0] == -1.0
    return values | {"accel_none": m.linear_acceleration_covariance[0] == -1.0}


def _fix(m: Any) -> dict[str, Any]:
    known = m.position_covariance_type != 0
    variance = [m.position_covariance[k] if known else np.nan for k in (4, 0, 8)]
    values = {"lat": m.latitude, "lon": m.longitude, "alt": m.altitude, "variance": variance}
    return values | {"status": m.status.status, "frame": m.header.frame_id}


def _twist(m: Any) -> dict[str, Any]:
    twist, variance = m.twist, [np.nan] * 3
    if hasattr(twist, "covariance"):
        variance, twist = [twist.covariance[k] for k in (7, 0, 14)], twist.twist
    v = twist.linear
    return {"ned": [v.y, v.x, -v.z], "variance": variance, "frame": m.header.frame_id}


def _solution(m: Any) -> dict[str, Any]:
    status, up = getattr(m, "ins_status", None), getattr(m, "undulation", 0.0)
    status = m.status if status is None else status
    place = [m.latitude, m.longitude, m.height + up]  # INSPVAX has the height over the geoid
    velocity = [m.north_velocity, m.east_velocity, -m.up_velocity]
    values = [*place, *velocity, m.roll, m.pitch, m.azimuth]
    return {"values": values if status.status in SOLVED else [np.nan] * 9}


#: Fields taken of a message, by stream.
_VALUES: dict[str, Callable[[Any], dict[str, Any]]] = {
    "imu": _imu,
    "fix": _fix,
    "twist": _twist,
    "solution": _solution,
    "magnetometer": lambda m: _vector("mag", m.magnetic_field),
    "barometer": lambda m: {"pressure": m.fluid_pressure},
    "diagnostics": lambda m: {"text": " ".join(f"{s.name}: {s.message}" for s in m.status)},
}
