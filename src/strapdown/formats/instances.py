"""Tables whose rows are of several sensors of one kind, one after another.

Flight controllers write the rows of two or three inertial sensors under one header (``I`` 0, 1, 0,
1 …), programs those of several units (``DeviceName``). Read as one log they are a body that jumps.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from strapdown.errors import Finding
from strapdown.formats.columns import read_name
from strapdown.formats.known_formats import selected
from strapdown.formats.recording import RawLog

#: Names of the column that tells sensors apart, without signs and blanks, in lower case.
_NAMES = {
    *("i", "id", "instance", "imu", "imuid", "sensor", "sensorid", "sensorindex", "sensornumber"),
    *("device", "deviceid", "devicename", "unit", "unitid", "node", "nodeid", "board", "address"),
}
#: Most sensors of a table, fewest rows of each, and the share of the rows after which another
#: follows: a number that changes less often is a state.
MOST, FEWEST, CHANGES = 16, 10, 0.1
#: Largest scatter of the lengths of runs, as a share of that without order.
REGULAR = 0.5


def _all_have_rates(raw: RawLog, sensors: NDArray[np.str_]) -> bool:
    """Whether most rows of each sensor have a rate: kinds of sensors fill columns of their own."""
    rate = next(c for n, c in raw.columns.items() if read_name(n).quantity == "gyro_x")
    if rate.dtype.kind not in "iuf":
        return False
    known = np.isfinite(rate)
    return all(known[sensors == one].mean() > 0.5 for one in np.unique(sensors))


def _in_turns(sensors: NDArray[np.str_]) -> bool:
    """Whether the values follow each other as the numbers of sensors that are read in turns do.

    Runs of equal values then have one length, in blocks, too; those of a number without order have
    a geometric distribution, by the share of that value.
    """
    begins = np.flatnonzero(np.r_[True, sensors[1:] != sensors[:-1]])
    lengths = np.diff(np.r_[begins, sensors.size])
    for one in np.unique(sensors):
        runs = lengths[sensors[begins] == one]
        if runs.std() > REGULAR * runs.mean() * np.sqrt(np.mean(sensors == one)):
            return False
    return True


def of_one_sensor(raw: RawLog) -> RawLog:
    """Keep the rows of the first of several sensors, with a warning; the same log if it has one."""
    if all(read_name(name).quantity != "gyro_x" for name in raw.columns):
        return raw
    for name, values in raw.columns.items():
        if re.sub(r"[^a-z0-9]", "", name.lower()) not in _NAMES or values.dtype.kind not in "iuO":
            continue
        texts = values.astype(str)
        sensors, counts = np.unique(texts, return_counts=True)
        changes = np.count_nonzero(texts[1:] != texts[:-1])
        if not 1 < sensors.size <= MOST or counts.min() < FEWEST:
            continue
        if changes < CHANGES * texts.size or not _in_turns(texts):
            continue
        if not _all_have_rates(raw, texts):
            continue
        first = str(texts[0])
        finding = Finding(
            "io.rows-of-several-sensors",
            severity="warning",
            file=raw.name,
            name=name,
            count=int(sensors.size),
            sensors=[f"{s} ({n} rows)" for s, n in zip(sensors, counts, strict=True)],
            first=first,
        )
        raw = selected(raw, texts == first)
        raw.findings.append(finding)
        return raw
    return raw
