"""PX4 flight logs (``.ulg``), by pyulog.

File: https://docs.px4.io/main/en/dev_log/ulog_file_format.html. Messages: msg/*.msg of
https://github.com/PX4/PX4-Autopilot. Stamps are microseconds since the start of the autopilot.
Vectors are in body axes forward, right, down; ``accelerometer_m_s2`` is specific force.
``sensor_combined`` has means over ``gyro_integral_dt`` and ``accelerometer_integral_dt`` (µs) up to
the stamp; the accelerometer's stamp is apart by ``accelerometer_timestamp_relative``. Fixes have
degrees times 1e7 and millimeters, or, since 1.15, ``latitude_deg`` and so on; ``eph`` and ``epv``
are accuracies in m. ``vehicle_attitude`` rotates body axes to north-east-down, w first.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats.clocks import RELATIVE, Clock
from strapdown.formats.join import join
from strapdown.formats.known_formats import Quantities, damage, interpolated, solution, turned
from strapdown.formats.recording import NoStreamError, RawLog
from strapdown.formats.signs import Signs
from strapdown.parsers import parse

TITLE = "PX4 flight log (.ulg)"
STREAMS = ("imu", "gnss", "reference", "magnetometer", "barometer")
MAGIC = b"ULog\x01\x12\x35"
AXES = "x,y,z"
DELAY = "EKF2_GPS_DELAY"  # parameter of the autopilot
NO_STAMP = 0x7FFFFFFF  # of the accelerometer: not valid
# Kind of fix to field 6 of NMEA GGA.
QUALITY = {2: 1, 3: 1, 4: 2, 5: 5, 6: 4, 7: 1, 8: 6}
Topic = dict[str, NDArray[Any]]


detect = Signs(first=rb"\A" + re.escape(MAGIC))


def _topics(path: Path, stream: str, *names: str) -> tuple[dict[str, Topic], list[Finding], Any]:
    """Read the first instance of topics; the first of `names` is needed, "a|b": either."""
    wanted = [n for name in names for n in name.split("|")]
    log = parse("recorders.ulog", path, wanted=wanted, parameter=DELAY)
    instances = sorted(log["topics"], key=lambda one: -one[1])
    found = {name: data for name, _, data in instances}
    findings = []
    if log["corrupt"]:
        findings.append(_note("io.log-partly-damaged", path, None, "warning"))
    if log["dropouts"]:
        lost = sum(log["dropouts"]) * 1e-3
        findings.append(_note("io.log-dropouts", path, None, count=len(log["dropouts"]), lost=lost))
    topics: dict[str, Topic] = {}
    for name in names:
        chosen = next((n for n in name.split("|") if n in found), "")
        topics[name.split("|")[0]] = found.get(chosen, {})
        if (count := sum(name == chosen for name, *_ in instances)) > 1:
            findings.append(_note("io.first-of-instances", path, chosen, count=count))
    if not topics[names[0].split("|")[0]]:
        raise NoStreamError(path.name, stream, TITLE, [s for s in STREAMS if s != stream])
    return topics, findings, log


def _note(code: str, path: Path, quantity: str | None, severity: Any = "note", **data: Any) -> Any:
    return Finding(code, file=path.name, quantity=quantity, severity=severity, **data)


def read(path: Path) -> RawLog:
    """Read rates and specific force of ``sensor_combined``, else of ``vehicle_imu``."""
    topics, findings, _ = _topics(path, "imu", "sensor_combined|vehicle_imu")
    data = topics["sensor_combined"]
    with damage(path):
        time = data["timestamp"].astype(np.int64)
        if "gyro_rad[0]" in data:
            dt = data["gyro_integral_dt"].astype(np.float64)
            dt *= 1e6 if dt.size and dt.max() < 1.0 else 1.0  # seconds before 1.4
            late = data.get("accelerometer_timestamp_relative", np.zeros(time.size, np.int64))
            gyro = [data[f"gyro_rad[{k}]"] for k in range(3)]
            accel = [data[f"accelerometer_m_s2[{k}]"] for k in range(3)]
        else:
            dt, late = data["delta_angle_dt"].astype(np.float64), np.zeros(time.size, np.int64)
            time = data["timestamp_sample"].astype(np.int64)
            gyro = [data[f"delta_angle[{k}]"] * (1e6 / dt) for k in range(3)]
            other = data["delta_velocity_dt"].astype(np.float64)
            accel = [data[f"delta_velocity[{k}]"] * (1e6 / other) for k in range(3)]
        gyros: Quantities = {f"gyro_{a}": (v, "rad/s") for a, v in zip("xyz", gyro, strict=True)}
        accels: Quantities = {f"accel_{a}": (v, "m/s2") for a, v in zip("xyz", accel, strict=True)}
        step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
        share = float(np.median(dt)) / step if step > 0.0 else 1.0
    # Logs of a lower rate keep some of the samples: their means are of a part of the interval.
    if not 0.9 < share < 1.1:
        findings.append(_note("io.means-of-a-part", path, "sampling", "warning", share=share))
    said = {"axes": AXES, "sampling": "mean" if 0.9 < share < 1.1 else "instantaneous"}
    stamps: Quantities = {"time": (time, "us")}
    valid = late != NO_STAMP
    if not (late[valid] != 0).any():
        return RawLog.of(
            path, {**stamps, **gyros, **accels}, findings=findings, clock=RELATIVE, **said
        )
    own: Quantities = {"time": (time[valid] + late[valid].astype(np.int64), "us")}
    part = {q: (v[valid], u) for q, (v, u) in accels.items()}
    logs = [RawLog.of(path, {**own, **part}, **said)]
    logs.insert(0, RawLog.of(path, {**stamps, **gyros}, findings=findings, **said))
    raw = join(logs, path.name, (path,))
    raw.clock = RELATIVE
    return raw


def _place(data: Topic) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return latitude and longitude in deg, heights over the ellipsoid and over the sea in m."""
    if "latitude_deg" in data:
        names = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "altitude_msl_m")
        lat, lon, alt, sea = (data[n].astype(np.float64) for n in names)
        return lat, lon, alt, sea
    scales = (("lat", 1e-7), ("lon", 1e-7), ("alt_ellipsoid", 1e-3), ("alt", 1e-3))
    lat, lon, alt, sea = (data[n].astype(np.float64) * scale for n, scale in scales)
    return lat, lon, alt, sea


def read_fixes(path: Path) -> RawLog:
    """Read the fixes that the autopilot selects, on the clock of its sensors."""
    topics, findings, log = _topics(path, "gnss", "vehicle_gps_position|sensor_gps")
    with damage(path):
        data = topics["vehicle_gps_position"]
        use = data["fix_type"] >= 2
        data = {name: values[use] for name, values in data.items()}
        time = data.get("timestamp_sample", data["timestamp"])
        time = data["timestamp"] if (time == 0).any() else time
        lat, lon, alt, _ = _place(data)
        sd = np.where(data["s_variance_m_s"] > 0.0, data["s_variance_m_s"], np.nan)
        known = data["vel_ned_valid"] != 0
        out: Quantities = {
            "time": (time.astype(np.int64), "us"),
            "lat": (lat, "deg"),
            "lon": (lon, "deg"),
        }
        out |= {"alt": (alt, "m"), "horizontal_accuracy": (data["eph"], "m")}
        out |= {"vertical_accuracy": (data["epv"], "m")}
        for axis in "NED":
            velocity = np.where(known, data[f"vel_{axis.lower()}_m_s"], np.nan)
            out |= {f"V{axis}": (velocity, "m/s"), f"V{axis}_sd": (sd, "m/s")}
        out["quality"] = (np.array([QUALITY.get(int(k), 1) for k in data["fix_type"]]), None)
        if "satellites_used" in data:
            out["satellites"] = (data["satellites_used"].astype(np.float64), None)
        delay = log["parameter"]
    if not use.any():
        raise DataError("io.no-usable-fix", file=path.name, quantity="lat, lon")
    if not use.all():
        findings.append(
            _note("io.fixes-without-position-left-out", path, None, count=int((~use).sum()))
        )
    if delay:
        findings.append(_note("io.fixes-late-by-parameter", path, "time", delay=float(delay)))
    return RawLog.of(path, out, clock=RELATIVE, findings=findings)


def read_reference(path: Path) -> pd.DataFrame:
    """Read the autopilot's own solution: position, velocity and attitude of its filter."""
    names = ("vehicle_global_position", "vehicle_local_position", "vehicle_attitude")
    topics, findings, _ = _topics(path, "reference", *names, "vehicle_gps_position|sensor_gps")
    place, local, attitude = (topics[n] for n in names)
    if not attitude or not (local or "vel_n" in place):
        raise NoStreamError(path.name, "reference", TITLE, ["imu", "gnss"])
    with damage(path):
        time = place["timestamp"] * 1e-6
        if "vel_n" in place:
            velocity = np.column_stack([place[n] for n in ("vel_n", "vel_e", "vel_d")])
        else:
            velocity = interpolated(
                time, local["timestamp"] * 1e-6, [local[n] for n in ("vx", "vy", "vz")]
            )
        alt = _over_ellipsoid(path, place, topics["vehicle_gps_position"])
        q = np.column_stack([attitude[f"q[{k}]"] for k in range(4)]).astype(np.float64)
        euler = turned(time, attitude["timestamp"] * 1e-6, q)
        position = np.column_stack([place["lat"], place["lon"], alt]).astype(np.float64)
    return solution(path, (time, position, velocity, euler), Clock(RELATIVE), findings)


def _over_ellipsoid(path: Path, place: Topic, fixes: Topic) -> NDArray[Any]:
    """Height over the ellipsoid: as stated, else with the geoid of the fixes."""
    stated = place.get("alt_ellipsoid")
    if stated is not None and np.isfinite(stated).all() and (stated != 0.0).any():
        return stated
    _, _, alt, sea = _place(fixes) if fixes else (np.zeros(0),) * 4
    use = (alt != 0.0) & np.isfinite(alt)
    if not use.any():
        raise DataError("io.reference-height-over-sea", file=path.name, quantity="alt")
    return np.asarray(place["alt"] + np.median(alt[use] - sea[use]))


def read_magnetometer(path: Path) -> RawLog:
    """Read the magnetic field, gauss."""
    topics, findings, _ = _topics(path, "magnetometer", "vehicle_magnetometer|sensor_mag")
    data = topics["vehicle_magnetometer"]
    with damage(path):
        form = "magnetometer_ga[{}]" if "magnetometer_ga[0]" in data else "{}"
        keys = range(3) if "magnetometer_ga[0]" in data else "xyz"
        out = {
            f"mag_{a}": (data[form.format(k)], "gauss") for a, k in zip("xyz", keys, strict=True)
        }
        time = {"time": (data["timestamp"].astype(np.int64), "us")}
    return RawLog.of(path, time | out, axes=AXES, clock=RELATIVE, findings=findings)


def read_barometer(path: Path) -> RawLog:
    """Read air pressure and the sensor's temperature."""
    topics, findings, _ = _topics(path, "barometer", "vehicle_air_data|sensor_baro")
    data = topics["vehicle_air_data"]
    with damage(path):
        pressure = data["baro_pressure_pa" if "baro_pressure_pa" in data else "pressure"]
        # sensor_baro had millibar before 1.14; no atmosphere has both.
        unit = "mbar" if float(np.median(pressure)) < 2000.0 else "Pa"
        out: Quantities = {
            "time": (data["timestamp"].astype(np.int64), "us"),
            "pressure": (pressure, unit),
        }
        names = ("baro_temp_celcius", "temperature", "ambient_temperature")
        warm = next((data[n] for n in names if n in data), None)
    out |= {} if warm is None else {"temperature": (warm, "degC")}
    return RawLog.of(path, out, clock=RELATIVE, findings=findings)
