"""What a live run received, as a record: the same numbers again, at once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd

from strapdown.config.navigation import NavigationSpec, aids_of
from strapdown.config.navigation_file import navigation_spec
from strapdown.formats.log_writers import LOG_WRITERS
from strapdown.live.reception import Reception
from strapdown.tables import ACCEL, GYRO

__all__ = ["live_spec", "write_received"]

SAMPLES = "received.csv"


def _plain(spec: NavigationSpec) -> dict[str, Any]:
    whole = spec.plain()
    for name in aids_of(spec):
        aid = whole["aiding"][name]
        for key in ("path", "columns", "repair"):
            aid.pop(key, None)
    return whole


def live_spec(spec: NavigationSpec) -> NavigationSpec:
    """Return a specification that takes from lines what it would take from files.

    Parameters
    ----------
    spec : NavigationSpec
        With ``[live]``, or of a record: what it says of the record's files is left out.

    Returns
    -------
    NavigationSpec
    """
    whole = _plain(spec)
    whole.pop("simulation", None)
    log = whole.pop("log", {})
    sampling = log.get("sampling")
    whole.setdefault("live", {} if sampling is None else {"sampling": sampling})
    return navigation_spec(whole)


def write_received(spec: NavigationSpec, got: Reception, folder: Path) -> NavigationSpec:
    """Write what a chain was given, and return the specification of a run over it.

    Parameters
    ----------
    spec : NavigationSpec
        By which it was received.
    got : Reception
    folder : Path
        Where it is written: ``received.csv`` in body axes, and a file for each aid.

    Returns
    -------
    NavigationSpec
        Its aids without a row have no file.
    """
    whole = _plain(spec)
    samples = got.samples
    imu = pd.DataFrame(samples[:, 1:], index=samples[:, 0], columns=[*GYRO, *ACCEL])
    imu.attrs["sampling"] = got.sampling
    LOG_WRITERS["csv"](folder / SAMPLES, imu, None)
    # Without what the reader may learn from the numbers: it is known.
    whole["log"] = {
        "path": str(folder / SAMPLES),
        "sampling": got.sampling,
        "gyro_unit": "rad/s",
        "accel_unit": "m/s2",
        "time_unit": "s",
    }
    whole["axes"] = {}
    for name, rows in got.rows.items():
        if rows.count:
            path = folder / f"{name}.csv"
            rows.write(path)
            whole["aiding"][name]["path"] = str(path)
    if not all(rows.count for rows in got.rows.values()):
        # Of an aid that sent nothing there is nothing to keep back.
        whole.pop("withhold", None)
    commands = [one.model_dump(mode="json") for one in got.commands]
    whole["commands"] = [*whole.get("commands", []), *commands]
    return navigation_spec(whole)
