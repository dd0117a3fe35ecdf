"""RoNIN: HDF5 files of a carried phone, with another phone on the chest.

``synced/time`` in s, ``synced/gyro`` in rad/s, ``synced/acce`` in m/s² and ``synced/magnet`` in µT
are of the carried phone, at 200 Hz, in its own axes (Herath, Yan and Furukawa, RoNIN, ICRA 2020;
source/preprocessing/compile_dataset_h5.py and gen_dataset_v2.py of
https://github.com/Sachini/ronin). ``pose/tango_ori`` is the attitude of the phone on the chest, not
of the carried one; ``synced/game_rv`` is the attitude that the carried phone computes itself.
"""

from __future__ import annotations

from pathlib import Path

from strapdown.errors import DataError, Finding
from strapdown.formats import hdf5
from strapdown.formats.arrays import raw_log
from strapdown.formats.known_formats import AXES
from strapdown.formats.recording import RawLog
from strapdown.formats.signs import Signs

TIME, GYRO, FORCE, MAG = "synced/time", "synced/gyro", "synced/acce", "synced/magnet"
TRIADS = {GYRO: ("gyro", "rad/s"), FORCE: ("accel", "m/s2"), MAG: ("mag", "uT")}
CHEST = "pose/tango_ori"


def _has_datasets(path: Path) -> bool:
    """Whether HDF5 has the stamps and both sensors."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return all(name in file for name in (TIME, GYRO, FORCE))
    except OSError:
        return False


detect = Signs(suffixes=hdf5.SUFFIXES, also=_has_datasets)


def read(path: Path) -> RawLog:
    """Read rates, specific force and, if present, the magnetic field.

    Raises
    ------
    DataError
        The file is damaged, or an array has the wrong shape.
    """
    import h5py

    arrays, _, _ = hdf5.read_arrays(path, (TIME, *TRIADS))
    samples = arrays[TIME].size
    for name in TRIADS:
        if name in arrays and arrays[name].shape != (samples, 3):
            raise DataError(
                "io.shape-stamps",
                file=path.name,
                name=name,
                shape=arrays[name].shape,
                samples=samples,
            )
    raw = raw_log(path, arrays, {}, {})
    stated: dict[str, tuple[str, str | None]] = {TIME: ("time", "s")}
    for name, (triad, unit) in TRIADS.items():
        if name in arrays:
            stated |= {f"{name}[{k}]": (f"{triad}_{a}", unit) for k, a in enumerate("xyz")}
    with h5py.File(path, "r") as file:
        if CHEST in file:
            raw.findings.append(
                Finding(
                    "io.attitude-of-other-phone",
                    file=path.name,
                    quantity="attitude",
                    severity="note",
                    name=CHEST,
                )
            )
    raw.stated, raw.axes = stated, AXES
    return raw
