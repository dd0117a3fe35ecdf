"""Records and files that `strapdown align` cannot use, or only with a warning, and what it says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bad_command import said_by

from strapdown.sensors.catalogue import load_sensor
from strapdown.simulation import Origin, StationaryMotion, simulate_imu
from strapdown.tables import ACCEL, GYRO

__all__ = ["ALIGNMENT_CASES", "alignment_section"]

HEAD = """## strapdown align

Each record is two minutes of a body at rest at 55° north, 37° east, 100 m, heading 40°, at 50 Hz,
with sensors of the class fog-1000 where nothing else is said, and one thing changed. Where nothing
is said of the options, it is aligned with `--lat 55 --lon 37 --alt 100 --sensor fog-1000`.

"""
PLACE = ("--lat", "55", "--lon", "37", "--alt", "100")
USUAL = (*PLACE, "--sensor", "fog-1000")
RATE = 50.0
COLUMNS = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
FILE = """[log]
path = "rest.csv"

[site]
lat_deg = 55.0
lon_deg = 37.0
alt_m = 100.0

[sensors]
sensor = "fog-1000"
"""
PSINS = """% PSINS-format SIMU log file.
0 0 -40 0 0 0
55.0 37.0 100.0 0.0 20.0 9.8
0.1 0.1 0.1 125.0 125.0 125.0
"""


@cache
def _rest(sensor: str, lat: float) -> tuple[np.ndarray, np.ndarray]:
    motion = StationaryMotion(120.0, Origin(lat, 37.0, 100.0), 1.0, 2.0, 40.0)
    errors = load_sensor(sensor).draw(1)
    imu, _ = simulate_imu(motion, errors, rate=RATE, sampling="mean", seed=1)
    return imu.index.to_numpy(), imu[[*GYRO, *ACCEL]].to_numpy()


def _table(time, values, columns=COLUMNS) -> str:
    lines = ["# sampling: mean", "# axes: forward-right-down", ",".join(["time_s", *columns])]
    lines += [",".join(f"{x:.9g}" for x in row) for row in np.column_stack([time, values])]
    return "\n".join(lines) + "\n"


def record(change=None, *, sensor="fog-1000", lat=55.0) -> Callable[[Path], None]:
    """Write ``rest.csv``, with one thing changed."""

    def write(folder: Path) -> None:
        time, values = _rest(sensor, lat)
        values = values.copy()
        if change is not None:
            values = change(time, values)
        (folder / "rest.csv").write_text(_table(time[: len(values)], values))

    return write


def config(change=lambda text: text) -> Callable[[Path], None]:
    """Write ``rest.csv`` as it is, and ``align.toml`` with one thing changed."""

    def write(folder: Path) -> None:
        record()(folder)
        (folder / "align.toml").write_text(change(FILE))

    return write


def psins(text: str) -> Callable[[Path], None]:
    """Write ``rest.imu``."""
    return lambda folder: (folder / "rest.imu").write_text(text)  # type: ignore[return-value]


def _swell(time):
    """From 50 to 60 s, without a step: its integral is 5 s."""
    return np.where((time > 50) & (time < 60), np.sin(np.pi * (time - 50) / 10) ** 2, 0.0)


def turned(time, values):
    values[:, 2] += np.radians(10.0) * _swell(time)
    return values


def driven(time, values):
    values[:, 3] += 1.5 * _swell(time)
    return values


def dead(time, values):
    values[:, 1] = values[0, 1]
    return values


def no_gravity(time, values):
    values[:, 3:] -= values[:, 3:].mean(axis=0)
    return values


def upside_down(time, values):
    values[:, 3:] *= -1.0
    return values


def outliers(time, values):
    rng = np.random.default_rng(4)
    rows = rng.choice(len(time), 60, replace=False)
    values[rows, 0] += np.radians(3.0) * rng.normal(size=60)
    return values


def burst(time, values):
    rows = (time > 40) & (time < 42)
    values[rows, 4] += 5.0 * np.random.default_rng(0).normal(size=rows.sum())
    return values


def degrees(time, values):
    values[:, :3] = np.degrees(values[:, :3])
    return values


@dataclass(frozen=True)
class AlignmentCase:
    """What is given, and the exit code; 0 where it is done with a warning."""

    title: str
    make: Callable[[Path], None]
    what: str = ""
    options: tuple[str, ...] = USUAL
    source: str = "rest.csv"
    code: int = 3


def _own(title: str, old: str, new: str, code: int = 4) -> AlignmentCase:
    """A file with one line changed."""
    change = lambda text: text.replace(old, new) if old else text + new  # noqa: E731
    return AlignmentCase(
        title, config(change), f"`align.toml` has `{new.strip()}`", (), "align.toml", code
    )


ALIGNMENT_CASES = (
    AlignmentCase("It turns while it is aligned", record(turned), "By 50° after 50 s."),
    AlignmentCase("It drives off while it is aligned", record(driven), "After 50 s."),
    AlignmentCase(
        "North cannot be found at this latitude",
        record(lat=89.99),
        options=("--lat", "89.99", *PLACE[2:], "--sensor", "fog-1000"),
    ),
    AlignmentCase(
        "Sensors too poor to find north",
        record(sensor="icm-20602"),
        options=(*PLACE, "--sensor", "icm-20602"),
    ),
    AlignmentCase("One dead gyro", record(dead)),
    AlignmentCase("Outliers in a gyro", record(outliers), "60 samples of gyro x, of 3 deg/s."),
    AlignmentCase(
        "Outliers in a gyro, and a pre-filter",
        record(outliers),
        "The same record, and the outliers are replaced.",
        (*USUAL, "--prefilter", "robust_fir:rate_hz=25"),
        code=0,
    ),
    AlignmentCase(
        "A burst of outliers",
        record(burst),
        "Two seconds of accelerometer y.",
        (*USUAL, "--prefilter", "robust_fir:rate_hz=25"),
    ),
    AlignmentCase("Gyros in degrees, named as radians", record(degrees)),
    AlignmentCase("Acceleration without gravity", record(no_gravity)),
    AlignmentCase("Gravity upside down", record(upside_down), code=0),
    AlignmentCase("Another place", record(), options=("--lat", "35", *USUAL[2:]), code=0),
    AlignmentCase(
        "Latitude and longitude exchanged",
        record(),
        options=("--lat", "139.7", "--lon", "35.7", "--sensor", "fog-1000"),
        code=4,
    ),
    AlignmentCase("No place", record(), options=("--sensor", "fog-1000"), code=4),
    AlignmentCase("No word about the sensors", record(), options=PLACE, code=4),
    AlignmentCase("An unknown sensor", record(), options=(*PLACE, "--sensor", "fog"), code=4),
    AlignmentCase("An unknown method", record(), options=(*USUAL, "--method", "inertial"), code=4),
    AlignmentCase("A second of it", record(), options=(*USUAL, "--duration", "1")),
    AlignmentCase("A part that is not there", record(), options=(*USUAL, "--from", "200"), code=4),
    AlignmentCase(
        "A SIMU log whose header is cut",
        psins("\n".join(PSINS.splitlines()[:3]) + "\n"),
        source="rest.imu",
    ),
    AlignmentCase(
        "A SIMU log with a row that is short",
        psins(PSINS + "0 1 2 0 0 1568\n0 1 2 0 0\n0 1 2 0 0 1568\n"),
        source="rest.imu",
    ),
    AlignmentCase(
        "A SIMU log with fractions",
        psins(PSINS + "0 1 2 0 0 1568\n0 1 2.5 0 0 1568\n0 1 2 0 0 1568\n"),
        source="rest.imu",
    ),
    _own("A key without its unit", "lat_deg = 55.0", "lat = 55.0"),
    _own("An unknown key", "", "\n[coarse]\nblocks = 3\n"),
    _own("An unknown kind", "", '\n[fine]\nmechanization = "neb"\n'),
    _own("An option out of its range", "", "\n[fine]\ninterval_s = 600\n"),
    _own("A value that is still open", '"fog-1000"', '"?"'),
    _own("A log that is not there", "rest.csv", "rset.csv"),
    _own("A chain that does not fit", "", '\n[coarse]\nkind = "levelling"\n'),
    _own("A mirror image", "", "\n[axes]\nmatrix = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]\n"),
    _own("A matrix that is none", "", "\n[axes]\nmatrix = [[1, 0, 0], [0.1, 1, 0], [0, 0, 1]]\n"),
    AlignmentCase(
        "A transposed matrix",
        lambda folder: _transposed(folder),
        "`align.toml` has the transpose of what the sensor needs, and a body that stands on its "
        "nose can be aligned, too.",
        (),
        "align.toml",
        code=0,
    ),
    AlignmentCase(
        "Options beside a file", config(), options=("--lat", "55"), source="align.toml", code=4
    ),
)


def _transposed(folder: Path) -> None:
    matrix = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    record(lambda time, v: np.hstack([v[:, :3] @ matrix, v[:, 3:] @ matrix]))(folder)
    text = (folder / "rest.csv").read_text().replace("# axes: forward-right-down\n", "")
    (folder / "rest.csv").write_text(text)
    own = FILE + f"\n[axes]\nmatrix = {matrix.T.tolist()}\n"
    (folder / "align.toml").write_text(own)


def alignment_section(mktemp, run_cli) -> str:
    """What `strapdown align` says of each case, as the page has it."""
    import strapdown.report.document_html as module

    parts = [HEAD]
    with pytest.MonkeyPatch.context() as patch:
        # The drawing says nothing, and takes most of the time.
        patch.setattr(module, "draw_stills", lambda document: [])
        patch.setattr(module, "document_page", lambda document, stills=(): "<html></html>")
        patch.setattr(module, "write_drawings", lambda *given: None)
        for case in ALIGNMENT_CASES:
            said, code = alignment_said(case, mktemp("alignment"), run_cli)
            words = " ".join(case.options)
            given = "" if case.options in (USUAL, ()) else f"With `{words}`.\n\n"
            told = f"{case.what}\n\n" if case.what else ""
            parts.append(
                f"### {case.title}\n\n{told}{given}```text\n{said}```\n\nExit code {code}.\n\n"
            )
    return "".join(parts)


def alignment_said(case: AlignmentCase, folder: Path, run_cli) -> tuple[str, int]:
    """Run a case; whether anything is left behind is looked at here."""
    case.make(folder)
    return said_by("align", case, folder, case.options, run_cli)
