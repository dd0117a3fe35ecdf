"""Names of version 0.1: neutral terms of the list of runs to its commands, and its files back.

Frozen with version 0.1. Neutral terms are the field's; what is not in a table has the same name in
both.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import ClassVar

# --- what Python offers -------------------------------------------------------------------------


def _table(table, prefix=""):
    """Return the columns of a table, and its index if it is numbers, as arrays by quantity."""
    out = {}
    if table.index.dtype.kind in "fiu":
        out[f"{prefix}{table.index.name or 'row'}"] = table.index.to_numpy()
    for name in table.columns:
        if table[name].dtype.kind in "fiub":
            out[f"{prefix}{name}"] = table[name].to_numpy()
    return out


def _refused(error):
    """Return the word of an error of the package; any other error is a fault of the record."""
    name = type(error).__name__
    if not type(error).__module__.startswith("strapdown"):
        raise error
    words = {"DataError": "data", "ConfigError": "configuration", "DivergenceError": "divergence"}
    return {"refused": words.get(name, name)}


def read_log(path):
    import strapdown

    try:
        log = strapdown.read_log(path)
    except Exception as error:
        return _refused(error)
    out = _table(log.imu, "imu/")
    if log.truth is not None:
        out |= _table(log.truth, "reference/")
    if log.scored is not None:
        out["reference/scored"] = log.scored
    return out


def read_crash(path):
    import strapdown

    try:
        record = strapdown.read_crash_record(path)
    except Exception as error:
        return _refused(error)
    out = {}
    for channel in record.channels:
        if channel.quantity != "time":
            out[f"{channel.name}/time"], out[f"{channel.name}/values"] = channel.load()
    return out


def read_trajectory(path):
    import strapdown

    try:
        return _table(strapdown.read_trajectory(path))
    except Exception as error:
        return _refused(error)


def _start(trajectory):
    """Return the state at the first row of a trajectory."""
    import strapdown

    row = trajectory.iloc[0]
    return strapdown.NavState.from_degrees(
        float(row["lat"]),
        float(row["lon"]),
        float(row["alt"]),
        v_n=tuple(float(row[name]) for name in ("VN", "VE", "VD")),
        roll_deg=float(row["roll"]),
        pitch_deg=float(row["pitch"]),
        heading_deg=float(row["heading"]),
        time=float(trajectory.index[0]),
    )


def mechanize(log, truth):
    """Mechanizations over a log from the true start: at once, backward and sample by sample."""
    import strapdown

    imu = strapdown.read_log(log).imu
    truth = strapdown.read_trajectory(truth)
    start = _start(truth)
    increments = strapdown.motion_increments(imu)
    out = _table(increments, "increments/")
    for samples in (2, 3, 4):
        rows = strapdown.motion_increments(imu, samples=samples)
        out |= _table(rows, f"increments {samples}/")
    kinds = {
        "ned": strapdown.NorthEastDown(),
        "ned held": strapdown.NorthEastDown(height="held"),
        "wander_azimuth": strapdown.WanderAzimuth(),
    }
    for name, kind in kinds.items():
        run = strapdown.run_mechanization(kind, start, increments)
        out |= _table(run.trajectory, f"{name}/")
        if name == "ned":
            back = strapdown.run_mechanization(kind, run.end, increments, backward=True)
            out |= _table(back.trajectory, "ned backward/")
            apart = strapdown.trajectory_differences(run.trajectory, truth)
            out |= _table(apart, "ned error/")
    return out


def health(log):
    """Tests of the channels of a log, as far as they are numbers."""
    import strapdown

    found = strapdown.check_imu_channels(strapdown.read_log(log).imu)
    out = {"faults": float(len(found.faults)), "rest_time": found.rest_time}
    return out | {f"noise/{name}": value for name, value in found.noise.items()}


def crash_paths(folder):
    """A crash from its records, and possible paths of it by drawn errors."""
    from pathlib import Path

    import strapdown

    deg = math.pi / 180.0
    here = Path(folder)

    def triad(name, uncertainty):
        record = strapdown.read_crash_record(here / name)
        import numpy as np
        import pandas as pd

        read = [c.load() for c in record.channels if c.quantity != "time"]
        columns = [np.asarray(values) for _, values in read]
        stamps = pd.Index(np.asarray(read[0][0]), name="time")
        kind = "accel" if "g.csv" in name else "gyro"
        table = pd.DataFrame(
            {f"{kind}_{axis}": values for axis, values in zip("xyz", columns, strict=True)},
            index=stamps,
        )
        table.attrs["sampling"] = "instantaneous"
        return strapdown.RecordedTriad(table, uncertainty, name)

    low = strapdown.TriadUncertainty(
        noise_density=0.002, bias=0.2, scale=0.02, misalignment=0.01, full_scale=19.6
    )
    high = strapdown.TriadUncertainty(
        noise_density=0.02, bias=2.0, scale=0.02, misalignment=0.01, full_scale=490.0
    )
    turn = strapdown.TriadUncertainty(
        noise_density=0.014 * deg,
        bias=2.0 * deg,
        scale=0.02,
        misalignment=0.01,
        full_scale=500.0 * deg,
    )
    unit = strapdown.CrashUnit(
        "IMU1",
        (triad("imu1_low_g.csv", low), triad("imu1_high_g.csv", high)),
        triad("imu1_gyro.csv", turn),
        strapdown.Mounting((0.6, -0.5, 0.2), position_sd=0.01, angles_sd_deg=1.0),
        trigger=10.7485,
        trigger_sd=0.0014,
    )
    crash = strapdown.reconstruct_crash([unit], strapdown.Entry.from_speed(7.1, 0.1))
    path = crash.main.path
    samples = strapdown.sample_paths(path, runs=200, seed=1)
    out = {"draws": samples.draws, "path/drawn": samples.errors, "path/time": path.time}
    out |= {f"path/share/{k}": v for k, v in _table(path.variances()).items()}
    return out


class Names:
    """Neutral terms in the words of version 0.1, and its results in neutral terms."""

    # --- from neutral terms to this version -------------------------------------------------------

    COMMANDS: ClassVar[dict[str, str]] = {"outage": "coast"}

    # An option without an entry is `--` and its name.
    OPTIONS: ClassVar[dict[str, str]] = {
        "export": "--export-c",
        "smoothed": "--smooth",
        "trajectory-reference": "--truth",
        "control-points": "--points",
    }

    # Names of modules and modes, in documents and options; the same table, read backward, names the
    # words that a result holds.
    WORDS: ClassVar[dict[str, str]] = {
        "nonholonomic": "no_slip",
        "zupt": "zero_velocity",
        "zaru": "zero_rate",
        "closed_loop": "feedback",
        "open_loop": "feedforward",
        "trusted": "green",
        "unverified": "amber",
        "rejected": "red",
    }

    # Leaf keys of documents.
    KEYS: ClassVar[dict[str, str]] = {}
    # Tables of documents.
    TABLES: ClassVar[dict[str, str]] = {}

    # --- from this version to neutral terms -------------------------------------------------------

    # Replaced in turn, once each, in paths such as `label/file/column` and `label/file/key/…`.
    QUANTITIES: ClassVar[list[tuple[str, str]]] = [
        (r"/heading_light\.csv/", "/heading_integrity/"),
        (r"/verdict\.json/", "/integrity/"),
        (r"/light$", "/heading_status"),
        (r"/at_end$", "/heading_status_at_end"),
    ]

    # Clocks, seals and pages: nothing that the inputs determine, or no numbers.
    LEFT_OUT = re.compile(
        r"/(timing|latency|manifest|scenario)\.json|/stdout/(seal|seconds|digest|out|report)\b"
    )

    # Keys and columns whose strings are words of a stated list, and no sentences.
    STATUS_KEYS = frozenset(
        [
            "verdict",
            "light",
            "at_end",
            "reason",
            "kind",
            "mode",
            "algorithm",
            "meaning",
            "witness",
            "status",
            "type",
            "zero_at",
            "outcome",
            "result",
            "aid",
            "state",
            "known",
            "against",
        ]
    )

    FILES: ClassVar[dict[str, str]] = {
        "trajectory": "trajectory.csv",
        "attitude": "attitude.csv",
        "motion": "motion.csv",
    }

    def command(self, name):
        return self.COMMANDS.get(name, name)

    def option(self, name):
        return self.OPTIONS.get(name, f"--{name}")

    def value(self, text):
        """An option's value, with every neutral word in it as this version has it."""
        return re.sub(r"[a-z_]+", lambda m: self.WORDS.get(m[0], m[0]), text)

    def arguments(self, step):
        """Return the words of a command line, without the folder of the result."""
        words = [*self.command(step.command).split(), *step.arguments]
        for name, said in step.options.items():
            for one in said if isinstance(said, tuple) else (said,):
                if one is True:
                    words.append(self.option(name))
                elif name in ("with", "method", "prefilter", "algorithms"):
                    words += [self.option(name), self.value(one)]
                else:
                    words += [self.option(name), str(one)]
        return words

    def document(self, kind, content):
        """Return a neutral document as this version wants it; the command `kind` reads it."""

        def translated(item, key=""):
            if isinstance(item, dict):
                return {
                    (self.TABLES if isinstance(part, dict) else self.KEYS).get(
                        name, name
                    ): translated(part, name)
                    for name, part in item.items()
                }
            if isinstance(item, list):
                return [translated(part, key) for part in item]
            return self.WORDS.get(item, item) if isinstance(item, str) and key == "kind" else item

        return translated(content)

    def lines(self, text):
        return text

    def file(self, name):
        return self.FILES[name]

    def word(self, text):
        backward = {theirs: neutral for neutral, theirs in self.WORDS.items()}
        return backward.get(text, text)

    def quantity(self, path):
        """Return the neutral name of a quantity, or None where it is not compared."""
        if self.LEFT_OUT.search(path):
            return None
        for pattern, neutral in self.QUANTITIES:
            path = re.sub(pattern, neutral, path, count=1)
        return "/".join(self.word(part) for part in path.split("/"))

    CALLS: ClassVar[dict[str, Callable]] = {
        "read_log": read_log,
        "read_crash": read_crash,
        "read_trajectory": read_trajectory,
        "mechanize": mechanize,
        "health": health,
        "crash_paths": crash_paths,
    }


ADAPTER = Names()
