"""Crash case files that cannot be meant: what is changed in a good one, and what is said."""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "unit" / "config"))

from good_case import TEXT, read

from strapdown.errors import ConfigError

__all__ = ["CASE_FILES", "TEXT", "CaseFile"]

SPEED = "speed_km_per_h = 25.2"
GYRO_2 = 'gyro_from = "IMU1"'
SENSOR_2 = 'sensor = "lis302dlh"'
PLACE = "position_mm = [600, -500, 200]"
FRONT = "front_m = 2.0"
WINDOW = "window_s = [-0.1, 0.75]"


@dataclass(frozen=True)
class CaseFile:
    title: str
    changes: tuple[tuple[str, str], ...]

    @property
    def difference(self) -> str:
        lines = []
        for old, new in self.changes:
            lines += [f"-{line}" for line in old.splitlines()]
            lines += [f"+{line}" for line in new.splitlines()]
        return "\n".join(lines)

    @property
    def said(self) -> str:
        with tempfile.TemporaryDirectory() as folder, pytest.raises(ConfigError) as caught:
            read(Path(folder), *self.changes)
        return f"ConfigError: {caught.value}"


def case(title: str, *changes: tuple[str, str]) -> CaseFile:
    return CaseFile(title, changes)


CASE_FILES = (
    case(
        "Values that are still open",
        (SPEED, 'speed_km_per_h = "?"'),
        ("[-1.2, 0.4, 0.1]", '["?", "?", "?"]'),
    ),
    case("A quantity without its unit", (SPEED, "speed = 25.2")),
    case("A unit that there is not", (SPEED, "speed_kmh = 25.2")),
    case("One quantity in two units", (SPEED, f"{SPEED}\nspeed_mph = 16")),
    case("A key that is not known", (FRONT, "fornt_m = 2.0")),
    case("A key below the wrong header", (GYRO_2, ""), (SENSOR_2, f"{SENSOR_2}\n{GYRO_2}")),
    case("A key that is missing", ('title = "Impact on a pole"', "")),
    case("A key twice", (FRONT, f"{FRONT}\n{FRONT}")),
    case("One table where several may be", ("[[references]]", "[references]")),
    case("A decimal comma", (SPEED, "speed_km_per_h = 25,2")),
    case("A unit beside its number", (SPEED, "speed_km_per_h = 25.2 km/h")),
    case("A number in quotation marks", (SPEED, 'speed_km_per_h = "25.2"')),
    case("A number for text", ('number = "2016-07"', "number = 2016")),
    case("A path of Windows", ('path = "cameras.csv"', 'path = "C:\\records\\cameras.csv"')),
    case("A file that is not there", ('path = "cameras.csv"', 'path = "camera.csv"')),
    case("Not a number", (PLACE, "position_mm = [600, nan, 200]")),
    case("Two numbers of three", (PLACE, "position_mm = [600, -500]")),
    case("A control character in a name", ('name = "IMU1"', 'name = "IMU\\u001b[31m1"')),
    case("Standstill with a speed", ('kind = "speed"', 'kind = "standstill"')),
    case("Fixes with a speed", ('kind = "speed"', 'kind = "gnss"\npath = "imu1.csv"')),
    case("Fixes without their file", ('kind = "speed"', 'kind = "gnss"'), (SPEED, "")),
    case("A speed that nobody measured", ('source = "speed trap"', "")),
    case("A speed without its uncertainty", ("speed_sd_km_per_h = 0.36", "")),
    case("A speed that is known without error", ("_sd_km_per_h = 0.36", "_sd_km_per_h = 0")),
    case("A speed in km/h taken for m/s", (SPEED, "speed_m_per_s = 97")),
    case("An entry outside of the window", (SPEED, f"{SPEED}\ntime_s = -2")),
    case("A position in mm taken for m", (PLACE, "position_m = [600, -500, 200]")),
    case("A position outside of the vehicle", ("[-1.2, 0.4, 0.1]", "[-1.2, 1.9, 0.1]")),
    case("A position that nobody measured", (PLACE, "")),
    case("An origin outside of the vehicle", (FRONT, "front_m = 4.5")),
    case("An outline and a size", (FRONT, "outline_m = [[2, -0.8], [2, 0.8], [-2, 0]]")),
    case(
        "An outline of two corners",
        ("length_m = 4.2\nwidth_m = 1.7\nfront_m = 2.0", "outline_m = [[2, -0.8], [2, 0.8]]"),
    ),
    case("A mass in tonnes", ("mass_kg = 1300", "mass_kg = 1.3")),
    case("Two units of one name", ('name = "IMU2"', 'name = "imu1"')),
    case("A gyro and a borrowed one", ("trigger_s = 6.9", 'gyro_from = "IMU2"')),
    case("A unit that borrows from itself", (GYRO_2, 'gyro_from = "IMU2"')),
    case("A gyro borrowed from nobody", (GYRO_2, 'gyro_from = "IMU3"')),
    case("No gyro, and nothing assumed", (GYRO_2, "")),
    case("A missing axis, and nothing assumed", ("x = 1, ", "")),
    case("An axis that one range has and the other not", ('{ x = "hx", ', "{ ")),
    case(
        "Something assumed that is there",
        ("[units.gyro]", '[units.assumed]\nturn_sd_deg = 2\nbecause = "a pole"\n\n[units.gyro]'),
    ),
    case("Something assumed without a reason", (GYRO_2, "assumed = { turn_sd_deg = 2 }")),
    case("One channel for two axes", ('y = "ay"', 'y = "-ax"')),
    case("A wide range before a narrow one", ("full_scale_g = 8", "full_scale_g = 200")),
    case("Nothing about how good a sensor is", (SENSOR_2, "")),
    case("A sensor without such a triad", (SENSOR_2, 'sensor = "idg-500-isz-500"')),
    case("The unit of another triad", ('unit = "deg/s"', 'unit = "g"')),
    case("Levelling without its uncertainty", ("trigger_s = 6.9", "levelling_deg = [0.5, 1]")),
    case("An uncertainty of no levelling", ("trigger_s = 6.9", "levelling_sd_deg = 0.5")),
    case("A unit without a trigger", ("trigger_s = 0\n", "")),
    case("A rest after the impact", ("trigger_s = 6.9", "rest_s = [0.5, 2]")),
    case("A trigger's uncertainty in ms taken for s", ("_sd_ms = 1.4", "_sd_s = 1.4")),
    case("A window that ends before it begins", (WINDOW, "window_s = [0.75, -0.1]")),
    case("A window in ms taken for s", (WINDOW, "window_s = [-100, 750]")),
    case("A peak that is longer than the window", (WINDOW, f"{WINDOW}\npeak_window_s = 0.9")),
    case("A severity model that there is not", ("_front_mais3", "_front_mais9")),
    case("A reference path without its file", ('path = "cameras.csv"', "")),
    case(
        "A change of velocity with a file",
        ("over_ms = [0, 115]", 'over_ms = [0, 115]\npath = "cameras.csv"'),
    ),
    case("Two references of one name", ('name = "barrier"', 'name = "cameras"')),
)
