"""What is proposed for fixes that state no standard deviations, but their kind."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))

import town_drive as town
from strapdown.config.logs import FixesTable, LogTable
from strapdown.config.navigation import NavigationSpec
from strapdown.sensors.triad_errors import ImuErrors
from strapdown.simulation import simulate_imu
from strapdown.systems.navigation_draft import draft_navigation
from strapdown.systems.navigation_run import run_navigation
from strapdown.tables import ACCEL, GYRO, VELOCITY_SD
from strapdown.tables.checks import POSITION_SD

SD = {4.0: 0.02, 5.0: 0.5, 1.0: 5.0}


def kinds(n):
    """Every tenth of forty fixes a float solution in a row, and one autonomous among them."""
    k = np.arange(n) % 40
    return np.where(k == 3, 1.0, np.where(k < 6, 5.0, 4.0))


@pytest.fixture
def drive(tmp_path):
    """A drive, and its fixes with a column of their kinds and no standard deviations."""
    imu = simulate_imu(town.motion(), ImuErrors(), rate=50.0, sampling="mean")[0]
    names = [*(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
    text = imu[[*GYRO, *ACCEL]].set_axis(names, axis=1).rename_axis("time_s").to_csv()
    (tmp_path / "log.csv").write_text("# sampling: mean\n" + text)
    table = town.fixes(rate=4.0, position_noise=0.02, velocity_noise=0.03)
    table = table.drop(columns=[*POSITION_SD, *VELOCITY_SD]).assign(quality=kinds(len(table)))
    table.rename_axis("time").to_csv(tmp_path / "fixes.csv")
    return tmp_path


def draft_of(folder):
    return draft_navigation(
        LogTable(path=str(folder / "log.csv")),
        gnss=FixesTable(path=str(folder / "fixes.csv")),
        sensor="adis16495-1",
        folder=folder,
    )


def test_a_run_has_the_standard_deviations_that_were_proposed(drive, monkeypatch):
    """The configuration states one number, and it gives each fix what its kind was proposed."""
    monkeypatch.chdir(drive)
    draft = draft_of(drive)
    table = tomllib.loads(draft.text)
    aid = table["aiding"]["gnss"]
    assert aid["position_sd_m"] == 0.02
    # Between 0.02 m and 0.5 m: float and autonomous solutions have errors of their own.
    assert aid["float_position_sd_m"] == 0.1
    assert "of the best kind of fix, others have more" in " ".join(
        line.removeprefix("# ") for line in draft.text.splitlines()
    )
    run = run_navigation(NavigationSpec.checked(table))
    fixes = run.source.tables["gnss"]
    quality = kinds(len(fixes))
    assert fixes["quality"].tolist() == quality.tolist()
    wanted = np.array([SD[q] for q in quality])
    np.testing.assert_allclose(fixes[POSITION_SD], np.tile(wanted[:, None], 3), rtol=1e-15)
    codes = {f.code for f in run.findings}
    assert "io.sd-by-quality" in codes


def test_fixes_of_one_kind_have_one_standard_deviation(drive):
    path = drive / "fixes.csv"
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([head, *(row.rpartition(",")[0] + ",4.0" for row in rows)]) + "\n")
    draft = draft_of(drive)
    aid = tomllib.loads(draft.text)["aiding"]["gnss"]
    assert aid["position_sd_m"] == 0.02 and "float_position_sd_m" not in aid
    assert "of the best kind of fix" not in draft.text
