"""Each kind of case as its users run it, and a case by itself with its report."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from strapdown.campaign.case_process import run_case
from strapdown.campaign.design import Campaign
from strapdown.campaign.kinds import KINDS, at_path
from strapdown.campaign.run import case_of, differing, run_campaign, save_case
from strapdown.campaign.specification import CampaignSpec
from strapdown.config.outage import OutageSpec
from strapdown.config.spec import specify
from strapdown.navigation import outage
from strapdown.report.outage import outage_json
from strapdown.report.verify import verify
from strapdown.systems.outage_run import run_outage

FLEET = """
[base]
kind = "doctor"
logs = "logs/*.csv"
[[base.configuration.logs]]
gyro_unit = "rad/s"
accel_unit = "m/s2"
"""
DRIVE = Path(__file__).parents[2] / "docs" / "examples" / "navigate_drive.toml"


def run_of(folder: Path, text: str):
    (folder / "c.toml").write_text(text)
    return run_campaign(folder / "c.toml", workers=1)


@pytest.mark.slow
def test_a_simulated_crash_with_its_truth(tmp_path: Path) -> None:
    run = run_of(
        tmp_path,
        """
        [base]
        kind = "crash"
        simulate = "frontal"
        configuration = { options = { monte_carlo_runs = 0 } }
        [cases]
        draws = 2
        """,
    )
    run.save(tmp_path / "c")
    assert set(run.cases["status"]) == {"done"}
    # The bound is one of the truth, which is 17.5 m/s.
    assert (
        run.cases["delta_v_error_m_per_s"].abs() < 3.0 * run.cases["delta_v_bound_m_per_s"]
    ).all()
    assert run.cases["delta_v_m_per_s"].between(16.0, 19.0).all()
    result, row, recorded = case_of(tmp_path / "c", 1)
    assert recorded is not None
    assert differing(run.dataset.frozen, row, recorded) == []
    save_case(run.design, result, tmp_path / "one", False)
    found = json.loads((tmp_path / "one" / "crash.json").read_text())
    value = found["answers"][-1]["events"][0]["body"]["event"]["resultant_m_per_s"]["value"]
    assert value == recorded["delta_v_m_per_s"]
    assert (tmp_path / "one" / "report.html").exists()


@pytest.mark.slow
def test_drives_with_curves_and_their_seal(tmp_path: Path) -> None:
    run = run_of(
        tmp_path,
        f"""
        [base]
        kind = "navigate"
        file = "{DRIVE}"
        [cases]
        draws = 2
        [[parameter]]
        key = "simulation.gnss.rtk.position_noise_m"
        name = "noise_m"
        values = [0.02, 2.0]
        [keep]
        curves = ["horizontal_error_m"]
        axis = {{ to_s = 150.0, points = 4 }}
        """,
    )
    assert set(run.cases["status"]) == {"done"}
    by_noise = run.cases.groupby("noise_m")["horizontal_rms_m"].median()
    assert by_noise[2.0] > by_noise[0.02]
    run.save(tmp_path / "c")
    curves = next(run.dataset.curves()).to_pandas()
    assert curves["x"].unique().tolist() == [0.0, 50.0, 100.0, 150.0]
    assert verify(tmp_path / "c").verdict == "identical"


def test_a_fleet_and_a_gesture(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    for k in range(2):
        values = np.random.default_rng(k).normal(0.0, 0.01, (300, 6)) - [0, 0, 0, 0, 0, 9.8]
        rows = "".join(
            f"{0.01 * i:.2f},{','.join(f'{v:.6f}' for v in row)}\n" for i, row in enumerate(values)
        )
        text = "time_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z\n" + rows
        (tmp_path / "logs" / f"{k}.csv").write_text(text)
    (tmp_path / "logs" / "none.csv").write_text("a,b\n1,2\n")
    run = run_of(tmp_path, FLEET)
    assert run.cases["log"].tolist() == ["logs/0.csv", "logs/1.csv", "logs/none.csv"]
    assert run.cases["samples"].tolist()[:2] == [300.0, 300.0]
    assert run.cases["status"].tolist()[:2] == ["done", "done"]
    gesture = run_of(
        tmp_path,
        """
        [base]
        kind = "attitude"
        [base.configuration]
        algorithms = ["quaternion"]
        initial = "truth"
        [base.configuration.source]
        rate_hz = 50.0
        [base.configuration.source.motion]
        kind = "pulses"
        duration_s = 2.0
        x = [{ start_s = 0.5, duration_s = 0.6, turn_deg = 150.0, edge_s = 0.2 }]
        y = [{ start_s = 0.3, duration_s = 0.8, turn_deg = 60.0, edge_s = 0.4 }]
        [[parameter]]
        key = "source.rate_hz"
        values = [10.0, 100.0]
        """,
    )
    slow, fast = gesture.cases["largest_deg"]
    assert slow > 10.0 * fast  # of second order in the step


def test_attitude_along_a_motion_on_the_earth(tmp_path: Path) -> None:
    """A perfect gyro that stands still turns with the Earth, by 15.041 deg in an hour."""
    (tmp_path / "c.toml").write_text(
        """
        [base]
        kind = "attitude"
        [base.configuration]
        algorithms = ["quaternion"]
        initial = "truth"
        gyro_bias = "none"  # at rest the Earth's rate would be one
        [base.configuration.source]
        rate_hz = 10.0
        [base.configuration.source.motion]
        kind = "stationary"
        lat_deg = 45.0
        lon_deg = 15.0
        duration_s = 60.0
        [[parameter]]
        key = "source.motion.duration_s"
        values = [60.0, 120.0]
        """
    )
    design = Campaign.of(CampaignSpec.read(tmp_path / "c.toml", files=False), tmp_path)
    for number, seconds in enumerate((60.0, 120.0)):
        row, _ = run_case(design, number)
        assert row["status"] == "done"
        last = row["scalars"][list(design.scalars).index("final_deg")]
        # Rounding of so many steps of 1e-5 rad.
        assert last == pytest.approx(15.041067 / 3600.0 * seconds, rel=1e-6)


@pytest.mark.parametrize("name", ["crash", "gesture", "tunnel"])
def test_the_shipped_studies_keep_what_their_cases_have(name: str) -> None:
    """Of one case: a scalar that is not in the result would be NaN in all of them."""
    file = DRIVE.with_name(f"campaign_{name}.toml")
    design = Campaign.of(CampaignSpec.read(file, files=False), file.parent)
    row, _ = run_case(design, 0)
    assert row["status"] == "done"
    asked = {getattr(one, key) for one in design.spec.coverage for key in ("error", "bound")}
    asked |= {one.scalar for one in design.spec.rate}
    values = dict(zip(design.scalars, row["scalars"], strict=True))
    assert asked
    assert all(np.isfinite(values[name]) for name in asked)


def test_a_case_that_is_refused_says_why(tmp_path: Path) -> None:
    run = run_of(
        tmp_path,
        """
        [base]
        kind = "outage"
        configuration = { sensor = "mpu-6050", outage_s = 1.0 }
        [[parameter]]
        key = "sensorr"
        values = ["mpu-6050"]
        """,
    )
    run.save(tmp_path / "c", report=False)
    _, row, recorded = case_of(tmp_path / "c", 0)
    assert recorded is not None
    assert (row["status"], row["code"]) == ("refused", recorded["code"])
    assert [one.code for one in row["errors"]] == ["config.unknown-key"]


def test_a_case_computes_the_budget_that_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    table = {"sensor": "mpu-6050", "outage_s": 2.0, "start": {"aided_s": 0.0}}
    scaled, asked = outage.scaled, []
    monkeypatch.setattr(outage, "scaled", lambda *given: asked.append(1) or scaled(*given))
    kind = KINDS["outage"]
    run = kind.run(table, "case")
    data = kind.data(run)
    end = at_path(data, ("at_the_end", "horizontal_95_m"))
    assert kind.curves(run)["horizontal_95_m"].iloc[-1] == pytest.approx(end)
    assert not asked
    shares = [
        at_path(data, ("budget", "sources", k, "share", "horizontal"))
        for k in range(len(run.forecast.shares))
    ]
    # Each source larger and smaller, once however often it is read.
    assert len(asked) == 2 * len(shares)
    assert sum(shares) == pytest.approx(1.0)
    whole = outage_json(run_outage(specify(OutageSpec, **table)))
    assert whole == outage_json(run)
    assert [one["share"]["horizontal"] for one in whole["budget"]["sources"]] == shares
