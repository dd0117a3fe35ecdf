"""NaveGo (https://github.com/rodralez/NaveGo): MATLAB structures of sensors, fixes and reference.

A structure with ``t`` (s), ``fb`` (n, 3; specific force in m/s²) and ``wb`` (n, 3; rad/s) about
body axes forward, right, down is an IMU; with ``t``, ``lat``, ``lon`` (rad), ``h`` (m) and ``vel``
(n, 3; north, east, down in m/s) a receiver, where ``stdm`` (m) and ``stdv`` (m/s) are the standard
deviations of all its fixes; with ``roll``, ``pitch``, ``yaw`` (rad), too, a reference. Their names
are free; of several of a kind the first is read.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown.errors import DataError, Finding
from strapdown.formats import hdf5
from strapdown.formats.clocks import RELATIVE, Clock, with_clock
from strapdown.formats.known_formats import lacking
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs
from strapdown.tables import trajectory_table

TITLE = "structures of NaveGo (.mat)"
Array = NDArray[np.float64]
EULERS = {"roll", "pitch", "yaw"}
FIELDS = {
    "imu": {"t", "fb", "wb"},
    "gnss": {"t", "lat", "lon", "h"},
    "reference": {"t", "lat", "lon", "h", "vel", *EULERS},
}


def _has_structures(path: Path) -> bool:
    """Whether a file of MATLAB has structures with the fields of NaveGo."""
    from scipy.io import whosmat

    try:
        # Reading a file is dear; most have no structure.
        if not hdf5.detect(path) and all(kind != "struct" for _, _, kind in whosmat(path)):
            return False
        return bool(_kinds(_structures(path)))
    except Exception:  # damaged, or of another version
        return False


detect = Signs(suffixes=(".mat",), also=_has_structures)


def _structures(path: Path) -> dict[str, dict[str, Array]]:
    new = hdf5.detect(path)
    arrays: dict[str, Any] = hdf5.read_arrays(path)[0] if new else hdf5.read_matlab_arrays(path)[0]
    found: dict[str, dict[str, Array]] = {}
    for name, values in arrays.items():
        of, dot, field = name.rpartition("/" if new else ".")
        if dot and np.asarray(values).dtype.kind in "iuf":
            # MATLAB stores columns first, HDF5 rows first.
            found.setdefault(of, {})[field] = np.asarray(
                values.T if new else values, dtype=np.float64
            )
    return found


def _kinds(structures: dict[str, dict[str, Array]]) -> dict[str, list[str]]:
    kinds: dict[str, list[str]] = {}
    for name, fields in structures.items():
        for kind in ("imu", "reference", "gnss"):
            if fields.keys() >= FIELDS[kind]:
                kinds.setdefault(kind, []).append(name)
                break
    return kinds


def _first(path: Path, kind: str) -> tuple[dict[str, Array], int, list[Finding]]:
    structures = _structures(path)
    names = _kinds(structures).get(kind, [])
    if not names:
        raise lacking(path, kind, TITLE, _kinds(structures))
    findings = []
    if len(names) > 1:
        findings.append(
            Finding("io.first-of-structures", file=path.name, quantity=kind, names=names)
        )
    fields = structures[names[0]]
    count = fields["t"].size
    for field in FIELDS[kind] | ({"vel"} & fields.keys()):
        width = 3 if field in ("fb", "wb", "vel") else 1
        if fields[field].size != count * width:
            raise DataError(
                "io.rows-not-those-of-stamps",
                file=path.name,
                quantity=f"{names[0]}.{field}",
                size=len(fields[field]),
                count=count,
            )
    return fields, count, findings


def read(path: Path) -> RawLog:
    """Read the rates and specific force of the first IMU."""
    fields, count, findings = _first(path, "imu")
    held = {"time": (fields["t"].ravel(), "s")}
    for triad, field, unit in (("gyro", "wb", "rad/s"), ("accel", "fb", "m/s2")):
        block = fields[field].reshape(count, 3)
        held |= {f"{triad}_{a}": (block[:, k], unit) for k, a in enumerate("xyz")}
    return RawLog.of(path, held, axes="x,y,z", clock=RELATIVE, findings=findings)


def read_fixes(path: Path) -> RawLog:
    """Read the fixes of the first receiver."""
    fields, count, findings = _first(path, "gnss")
    held: dict[str, tuple[Array, str | None]] = {"time": (fields["t"].ravel(), "s")}
    for quantity, field, unit in (("lat", "lat", "rad"), ("lon", "lon", "rad"), ("alt", "h", "m")):
        held[quantity] = (fields[field].ravel(), unit)
    if "vel" in fields:
        block = fields["vel"].reshape(count, 3)
        held |= {v: (block[:, k], "m/s") for k, v in enumerate(("VN", "VE", "VD"))}
    for field, names, unit in (
        ("stdm", ("north_sd", "east_sd", "down_sd"), "m"),
        ("stdv", ("VN_sd", "VE_sd", "VD_sd"), "m/s"),
    ):
        if fields.get(field, np.empty(0)).size == 3 and (field != "stdv" or "vel" in fields):
            sds = fields[field].ravel()
            held |= {n: (np.full(count, sds[k]), unit) for k, n in enumerate(names)}
    return RawLog.of(path, held, clock=RELATIVE, findings=findings)


def read_reference(path: Path) -> pd.DataFrame:
    """Read the first reference."""
    fields, count, findings = _first(path, "reference")
    lat, lon, alt, *euler = (fields[f].ravel() for f in ("lat", "lon", "h", "roll", "pitch", "yaw"))
    table = trajectory_table(
        fields["t"].ravel(),
        np.column_stack([np.degrees(lat), np.degrees(lon), alt]),
        fields["vel"].reshape(count, 3),
        np.degrees(np.column_stack(euler)),
        source=path.name,
    )
    table.attrs["findings"] = tuple(findings)
    return with_clock(table, Clock(RELATIVE))
