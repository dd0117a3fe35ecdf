"""Crash cases that cannot be reconstructed: what is done to a good one."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

__all__ = ["CRASH_CASES", "BadCase"]

Change = Callable[[Path], None]


@dataclass(frozen=True)
class BadCase:
    """A folder that `strapdown simulate pole` wrote, with one thing changed.

    Attributes
    ----------
    title : str
    what : str
        What is done, in words.
    change : callable
        Does it to a copy of the folder.
    code : int
        Exit code; zero where a note is all.
    """

    title: str
    what: str
    change: Change
    code: int = 3

    def make(self, records: Path, folder: Path) -> Path:
        shutil.copytree(records, folder)
        self.change(folder)
        return folder / "case.toml"


def case(*changes: tuple[str, str]) -> Change:
    """The case file with pieces of it replaced, each once."""

    def change(folder: Path) -> None:
        path = folder / "case.toml"
        text = path.read_text(encoding="utf-8")
        for old, new in changes:
            assert old in text, old
            text = text.replace(old, new, 1)
        path.write_text(text, encoding="utf-8")

    return change


def rows(name: str, edit: Callable[[list[str]], list[str]]) -> Change:
    """A table whose rows, the header first, are edited."""

    def change(folder: Path) -> None:
        path = folder / name
        lines = path.read_text(encoding="utf-8").splitlines()
        path.write_text("\n".join(edit(lines)) + "\n", encoding="utf-8")

    return change


def field(row: int, column: int, text: str) -> Callable[[list[str]], list[str]]:
    def edit(lines: list[str]) -> list[str]:
        parts = lines[row].split(",")
        parts[column] = text
        return [*lines[:row], ",".join(parts), *lines[row + 1 :]]

    return edit


def scaled(name: str, factor: float) -> Change:
    def edit(lines: list[str]) -> list[str]:
        table = np.array([line.split(",") for line in lines[1:]], dtype=float)
        table[:, 1:] *= factor
        return [lines[0], *(",".join(f"{v:.10g}" for v in row) for row in table)]

    return rows(name, edit)


def stamps(name: str, of: Callable[[float], bool]) -> Change:
    """A table with the rows alone whose stamp is so."""
    return rows(
        name, lambda lines: [lines[0], *(x for x in lines[1:] if of(float(x.split(",")[0])))]
    )


def both(*changes: Change) -> Change:
    def change(folder: Path) -> None:
        for one in changes:
            one(folder)

    return change


def empty(name: str) -> Change:
    return lambda folder: (folder / name).write_text("") and None


def another_crash(folder: Path) -> None:
    """The second recorder's record is of a crash half as hard, to the other side."""
    for name in ("imu2_low_g.csv", "imu2_high_g.csv"):

        def edit(lines: list[str]) -> list[str]:
            table = np.array([line.split(",") for line in lines[1:]], dtype=float)
            struck = (table[:, 0] > 5.74) & (table[:, 0] < 5.9)
            table[struck, 1:3] *= (0.4, -3.0)
            table[struck, 2] += 30.0
            return [lines[0], *(",".join(f"{v:.10g}" for v in row) for row in table)]

        rows(name, edit)(folder)


GYRO_1 = 'channels = { x = "wx [deg/s]", y = "wy [deg/s]", z = "wz [deg/s]" }'

CRASH_CASES = (
    BadCase(
        "A record that is not there",
        "imu2_gyro.csv is deleted.",
        lambda f: (f / "imu2_gyro.csv").unlink(),
        4,
    ),
    BadCase("A record without a byte", "imu1_low_g.csv is empty.", empty("imu1_low_g.csv")),
    BadCase(
        "A record that is cut within a row",
        "imu1_high_g.csv ends within row 900.",
        rows("imu1_high_g.csv", lambda x: [*x[:899], x[899][:20]]),
    ),
    BadCase(
        "A record that ends before the trigger",
        "IMU2's three records end 1 s before it.",
        both(*(stamps(f"imu2_{p}.csv", lambda t: t < 4.75) for p in ("low_g", "high_g", "gyro"))),
    ),
    BadCase(
        "A record that ends within the crash",
        "IMU2's three records end 50 ms after the trigger.",
        both(*(stamps(f"imu2_{p}.csv", lambda t: t < 5.8) for p in ("low_g", "high_g", "gyro"))),
        0,
    ),
    BadCase(
        "No number within the crash",
        "Row 1416 of imu1_gyro.csv holds nan.",
        rows("imu1_gyro.csv", field(1415, 3, "nan")),
    ),
    BadCase(
        "Text for a number",
        "Row 1001 of imu1_gyro.csv holds n/a.",
        rows("imu1_gyro.csv", field(1000, 3, "n/a")),
    ),
    BadCase(
        "Time that runs backwards",
        "Row 1003 of imu2_low_g.csv stands before row 1002.",
        rows("imu2_low_g.csv", lambda x: [*x[:1001], x[1002], x[1001], *x[1003:]]),
    ),
    BadCase(
        "A column that there is not",
        "The case names ax [g] of imu1_low_g.csv.",
        case(('x = "ax [m/s2]"', 'x = "ax [g]"')),
    ),
    BadCase(
        "Accelerations in g said to be in m/s²",
        "imu1_low_g.csv and imu1_high_g.csv hold g.",
        both(scaled("imu1_low_g.csv", 1 / 9.80665), scaled("imu1_high_g.csv", 1 / 9.80665)),
    ),
    BadCase(
        "Accelerations in m/s² said to be in g",
        "imu1_low_g.csv and imu1_high_g.csv, unit = g.",
        case(('time = "time [s]"', 'unit = "g"\ntime = "time [s]"')),
        4,
    ),
    BadCase(
        "A gyro in deg/s said to be in rad/s",
        "The header of imu1_gyro.csv says rad/s.",
        both(
            rows("imu1_gyro.csv", lambda x: ["time [s],wx [rad/s],wy [rad/s],wz [rad/s]", *x[1:]]),
            case((GYRO_1, GYRO_1.replace("deg/s", "rad/s"))),
        ),
    ),
    BadCase("Two records of two crashes", "IMU2's record is of another crash.", another_crash, 0),
    BadCase(
        "A trigger outside of the record",
        "IMU2's trigger_s is that of IMU1's clock.",
        case(("trigger_s = 5.749553 ", "trigger_s = 10.748534 ")),
    ),
    BadCase(
        "A window outside of the record",
        "window_s ends 5 s after the trigger.",
        case(("rate_hz = 200.0", "window_s = [-0.1, 5.0]\nrate_hz = 200.0")),
    ),
    BadCase(
        "An entry speed in km/h said to be in m/s",
        "speed_m_per_s = 25.5.",
        case(("speed_m_per_s = 7.08 ", "speed_m_per_s = 25.5 ")),
        0,
    ),
    BadCase(
        "A reference that does not cover the path",
        "cameras.csv begins 1.5 s after the trigger.",
        both(
            rows(
                "cameras.csv",
                lambda x: [
                    x[0],
                    *(f"{float(r.split(',')[0]) + 1.6:.6f}," + r.split(",", 1)[1] for r in x[1:]),
                ],
            )
        ),
    ),
    BadCase(
        "A reference without a column that is needed",
        "cameras.csv has no column time.",
        rows("cameras.csv", lambda x: [x[0].replace("time", "tame"), *x[1:]]),
    ),
    BadCase(
        "Two values that contradict each other",
        "The entry is a standstill with a speed.",
        case(('kind = "speed"', 'kind = "standstill"')),
        4,
    ),
    BadCase(
        "A position that contradicts the size of the vehicle",
        "IMU1 sits 6 m ahead.",
        case(("position_m = [0.6, -0.5, 0.2]", "position_m = [6.0, -0.5, 0.2]")),
        4,
    ),
)
