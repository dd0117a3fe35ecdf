"""Records and files that `strapdown navigate` cannot use, or only with a warning, and what it says.

A car drives for 80 s with a tactical unit at 50 Hz and a receiver at 1 Hz, and one thing is
changed.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from bad_command import said_by

from strapdown.sensors.catalogue import load_sensor
from strapdown.simulation import Origin, car, simulate_imu
from strapdown.simulation.gnss import GnssReceiver, simulate_gnss
from strapdown.simulation.vehicles import Accelerate, Straight, Turn
from strapdown.tables import ACCEL, GYRO

__all__ = ["FILE", "NAVIGATE_CASES", "navigate_said", "navigate_section", "write_drive"]

HEAD = """## strapdown navigate

A car drives for 80 s with a sensor of the class adis16495-1 at 50 Hz and a receiver at 1 Hz, and
one thing is changed. Where nothing is said of options, `navigate.toml` is given, which begins as

"""
FILE = """[log]
path = "drive.csv"

[start]
lat_deg = 55.75
lon_deg = 37.62
alt_m = 150.0
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 30.0
heading_sd_deg = 1.0

[sensors]
sensor = "adis16495-1"

[aiding.rtk]
kind = "gnss"
path = "fixes.csv"
lever_arm_m = [0.0, 0.0, -1.2]
"""
COLUMNS = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
FIXES = ["lat_deg", "lon_deg", "alt_m", *(f"V{a}_m_s" for a in "NED")]
FIXES += ["north_sd_m", "east_sd_m", "down_sd_m", *(f"V{a}_sd_m_s" for a in "NED")]


@cache
def drive() -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Imu and Gnss tables of the drive, and its exact trajectory."""
    steps = [
        ("stay", Straight(10.0)),
        ("accelerate", Accelerate(14.0, 10.0)),
        ("turn_left", Turn(-90.0, 60.0, 1.0)),
        ("straight", Straight(20.0)),
        ("turn_right", Turn(90.0, 60.0, 1.0)),
        ("straight", Straight(22.0)),
    ]
    motion = car(Origin(55.75, 37.62, 150.0), steps, heading_deg=30.0)
    imu, _ = simulate_imu(
        motion, load_sensor("adis16495-1").draw(1), rate=50.0, sampling="mean", seed=1
    )
    receiver = GnssReceiver(
        rate=1.0,
        position_noise=0.5,
        velocity_noise=0.05,
        antenna=(0.0, 0.0, -1.2),
        on_excess="unaffected",
    )
    return imu, simulate_gnss(motion, receiver, seed=1), motion.trajectory(imu.index.to_numpy())


def write_drive(
    folder: Path,
    *,
    samples: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]] | None = None,
    fixes: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]] | None = None,
    file: Callable[[str], str] = lambda text: text,
) -> None:
    """Write ``drive.csv``, ``fixes.csv`` and ``navigate.toml``, with one thing changed."""
    imu, gnss, _ = drive()
    for name, table, columns, names, change, head in (
        (
            "drive.csv",
            imu,
            [*GYRO, *ACCEL],
            COLUMNS,
            samples,
            ["# sampling: mean", "# axes: forward-right-down"],
        ),
        ("fixes.csv", gnss, list(gnss.columns[:12]), FIXES, fixes, []),
    ):
        time, values = table.index.to_numpy(), table[columns].to_numpy().copy()
        if change is not None:
            time, values = change(time, values)
        rows = [",".join(["time_s", *names])]
        rows += [",".join(f"{x:.12g}" for x in row) for row in np.column_stack([time, values])]
        (folder / name).write_text("\n".join([*head, *rows]) + "\n")
    (folder / "navigate.toml").write_text(file(FILE))


@dataclass(frozen=True)
class NavigateCase:
    """What is given, and the exit code; 0 where it is done with a warning."""

    title: str
    make: Callable[[Path], None]
    what: str = ""
    options: tuple[str, ...] = ()
    source: str = "navigate.toml"
    code: int = 3


def _samples(title: str, change, what: str = "", code: int = 3) -> NavigateCase:
    return NavigateCase(title, lambda f: write_drive(f, samples=change), what, code=code)


def _fixes(title: str, change, what: str = "", code: int = 3) -> NavigateCase:
    return NavigateCase(title, lambda f: write_drive(f, fixes=change), what, code=code)


def _own(title: str, old: str, new: str, code: int = 4) -> NavigateCase:
    """A file with one line changed."""
    change = lambda text: text.replace(old, new) if old else text + new  # noqa: E731
    return NavigateCase(
        title,
        lambda folder: write_drive(folder, file=change),
        f"`navigate.toml` has `{' '.join(new.split())}`.",
        code=code,
    )


def gap(time, values):
    kept = (time < 30.0) | (time > 34.0)
    return time[kept], values[kept]


def burst_of_nan(time, values):
    values[1000:1003, 1] = np.nan
    return time, values


def dead(time, values):
    values[:, 2] = values[0, 2]
    return time, values


def upside_down(time, values):
    values[:, 3:] *= -1.0
    return time, values


def degrees(time, values):
    values[:, :3] = np.degrees(values[:, :3])
    return time, values


def in_g(time, values):
    values[:, 3:] /= 9.80665
    return time, values


def another_hour(time, values):
    return time + 3600.0, values


def gps_week(time, values):
    return time + 243_261.0, values


def zero_sd(time, values):
    values[:, 6:9] = 0.0
    return time, values


def negative_sd(time, values):
    values[5, 6] = -0.5
    return time, values


def wild(time, values):
    values[2000, 3] = 1e6
    return time, values


def exchanged(time, values):
    values[:, :2] = values[:, [1, 0]]
    return time, values


def exchanged_at_rest(time, values):
    """Two fixes, so that no way between them tells of it."""
    values[:, :2] = values[:, [1, 0]]
    return time[:2], values[:2]


def elsewhere(time, values):
    values[:, 0] += 1.0
    return time, values


def no_sd_of_places(time, values):
    values[:, 6:9] = np.inf
    return time, values


def radians(time, values):
    values[:, :2] = np.radians(values[:, :2])
    return time, values


def late_first_fix(time, values):
    return time[time >= 25.0], values[time >= 25.0]


def outage(time, values):
    kept = (time < 35.0) | (time > 55.0)
    return time[kept], values[kept]


def _velocities(folder: Path) -> None:
    write_drive(folder)
    fixes = pd.read_csv(folder / "fixes.csv")
    kept = [name for name in fixes.columns if "_m_s" in name or name == "time_s"]
    fixes[kept].to_csv(folder / "fixes.csv", index=False)


def _empty(folder: Path) -> None:
    write_drive(folder)
    (folder / "fixes.csv").write_text("")


def _course(text: str) -> str:
    coarse = (
        '[coarse]\nkind = "gnss_course"\nuntil_heading_sd_deg = 3.0\n\n[fine]\nkind = "none"\n\n'
    )
    text = text[: text.index("[start]")] + coarse + text[text.index("[sensors]") :]
    return text[: text.index("[aiding")]


def _several(text: str) -> str:
    return (
        text.replace("lat_deg = 55.75", "lat_deg = 137.62")
        .replace('"adis16495-1"', '"adis16495"')
        .replace('path = "fixes.csv"\n', "")
    ) + '\n[filter]\nerror_model = "quaternions"\n'


NAVIGATE_CASES = (
    _fixes("Fixes of another hour", another_hour, "3600 s were added to their stamps."),
    _fixes("Fixes that count from the GPS week", gps_week, "And the samples from their start."),
    _fixes("No fix for the first 25 s", late_first_fix, code=0),
    _fixes("An outage of 20 s", outage, code=0),
    _fixes("Standard deviations of zero", zero_sd),
    _fixes("A negative standard deviation", negative_sd),
    _fixes("Latitude and longitude exchanged", exchanged),
    _fixes("Two fixes, exchanged", exchanged_at_rest),
    _fixes("Fixes a degree from the start", elsewhere),
    _fixes("No standard deviation of any place", no_sd_of_places, code=0),
    _fixes("Places in radians", radians),
    NavigateCase("Velocities without positions", _velocities, "And no origin is stated."),
    NavigateCase("An empty file of fixes", _empty),
    _samples("A dead gyro", dead),
    _samples("Four seconds without samples", gap),
    _samples("Samples that are no numbers", burst_of_nan),
    _samples("Gravity upside down", upside_down),
    _samples("One wild sample", wild, code=5),
    _samples("Gyros in degrees, named as radians", degrees),
    _samples("Accelerometers in g, named as m/s²", in_g),
    _own("A lever arm without its unit", "lever_arm_m", "lever_arm"),
    _own("An unknown key of a run", "", "\n[coarze]\nblocks = 3\n"),
    _own("An unknown aid", 'kind = "gnss"', 'kind = "gps"'),
    _own("An aid without its file", 'path = "fixes.csv"\n', ""),
    _own("A file of an aid that is not there", "fixes.csv", "fixs.csv"),
    _own(
        "An error model without its mechanization", "", '\n[filter]\nerror_model = "quaternions"\n'
    ),
    _own("A height that is damped", "", '\n[mechanization]\nheight = "damped"\n'),
    _own(
        "A barometer and a height that is held",
        "",
        '\n[mechanization]\nheight = "held"\n\n[aiding.baro]\nkind = "barometer"\n'
        'path = "fixes.csv"\n',
    ),
    _own(
        "A smoother of states that are not corrected",
        "",
        '\n[damping]\nkind = "none"\n\n[smoother]\nkind = "rts"\n',
    ),
    NavigateCase(
        "A course without fixes",
        lambda folder: write_drive(folder, file=_course),
        '`navigate.toml` has `[coarse] kind = "gnss_course"` in place of `[start]`, and no aid.',
        code=4,
    ),
    _own("A fine alignment beside a known start", "", '\n[fine]\nkind = "filter"\n'),
    NavigateCase(
        "A state of which nothing states the size",
        lambda folder: write_drive(
            folder,
            file=lambda text: text.replace(
                '"adis16495-1"\n',
                '"fog-1000"\nstates = ["gyro_bias", "g_sensitivity"]\n',
            ),
        ),
        '`navigate.toml` has `states = ["gyro_bias", "g_sensitivity"]` of a fog-1000.',
        code=4,
    ),
    _own("A start that is still open", "heading_deg = 30.0", 'heading_deg = "?"'),
    _own(
        "A standard deviation below zero",
        "heading_sd_deg = 1.0",
        "heading_sd_deg = 1.0\nposition_sd_m = -1.0",
    ),
    _own("A heading of more than a turn", "heading_deg = 30.0", "heading_deg = 400.0"),
    _own("A pre-filter of another rate", "", '\n[prefilter]\nkind = "robust_fir"\n'),
    _own("A new alignment after a gap, and none before", "", '\n[gaps]\nbeyond = "align"\n'),
    _own("Two aids of one name", "", '\n[aiding.rtk]\nkind = "no_slip"\n'),
    NavigateCase(
        "Several things at once",
        lambda folder: write_drive(folder, file=_several),
        "Four lines are changed.",
        code=4,
    ),
    NavigateCase(
        "Options beside a file of a run", write_drive, options=("--sensor", "stim300"), code=4
    ),
    NavigateCase(
        "A log alone",
        write_drive,
        options=("--gnss", "FOLDER/fixes.csv"),
        source="drive.csv",
        code=4,
    ),
    NavigateCase(
        "A log without fixes",
        write_drive,
        options=("--sensor", "adis16495-1"),
        source="drive.csv",
        code=4,
    ),
)


def undrawn(patch: pytest.MonkeyPatch) -> None:
    """Without figures and page, which take most of the time and change no number."""
    import strapdown.report.document_html as module

    patch.setattr(module, "draw_stills", lambda document: [])
    patch.setattr(module, "write_drawings", lambda *given: None)
    patch.setattr(module, "document_page", lambda document, stills=(): "<html></html>")


def navigate_section(mktemp, run_cli) -> str:
    """What `strapdown navigate` says of each case, as the page has it."""
    parts = [HEAD, f"```toml\n{FILE}```\n\n"]
    with pytest.MonkeyPatch.context() as patch:
        undrawn(patch)
        for case in NAVIGATE_CASES:
            said, code = navigate_said(case, mktemp("navigate"), run_cli)
            words = " ".join(case.options).replace("FOLDER" + os.sep, "")
            given = f"{case.source} with `{words}`.\n\n" if case.options else ""
            told = f"{case.what}\n\n" if case.what else ""
            parts.append(
                f"### {case.title}\n\n{told}{given}```text\n{said}```\n\nExit code {code}.\n\n"
            )
    return "".join(parts)


def navigate_said(case: NavigateCase, folder: Path, run_cli) -> tuple[str, int]:
    """Run a case; whether anything is left behind is looked at here."""
    case.make(folder)
    options = [o.replace("FOLDER", str(folder)) for o in case.options]
    return said_by("navigate", case, folder, options, run_cli)
