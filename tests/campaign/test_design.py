"""The cases of a campaign: a function of their number alone."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from strapdown.campaign.design import Campaign
from strapdown.campaign.kinds import at_path, with_value
from strapdown.campaign.specification import CampaignSpec, key_path
from strapdown.errors import ConfigError

BASE = """
[base]
kind = "outage"
configuration = { outage_s = 30.0, sensor = "mpu-6050", motion = { speed_m_per_s = 15.0 } }
"""


def design(folder: Path, text: str, base: str = BASE) -> Campaign:
    (folder / "c.toml").write_text(base + text)
    return Campaign.of(CampaignSpec.read(folder / "c.toml", files=False), folder)


def refused(folder: Path, text: str, base: str = BASE) -> str:
    with pytest.raises(ConfigError) as caught:
        design(folder, text, base)
    return str(caught.value)


def test_a_grid_is_the_product_of_its_values_and_cells_progress_together(tmp_path: Path) -> None:
    made = design(
        tmp_path,
        """
        [cases]
        draws = 3
        [[parameter]]
        key = "sensor"
        values = ["mpu-6050", "icm-42688-p"]
        [[parameter]]
        key = "motion.speed_m_per_s"
        name = "speed"
        values = [0.0, 10.0, 20.0]
        """,
    )
    assert made.total == 18
    assert [made.case(n).cell for n in range(7)] == [0, 1, 2, 3, 4, 5, 0]
    assert made.cells[4] == {"sensor": "icm-42688-p", "speed": 10.0}
    case = made.case(6 + 4)
    assert (case.draw, case.values) == (1, made.cells[4])
    table = made.table(case)
    assert table["sensor"] == "icm-42688-p"
    assert table["motion"] == {"speed_m_per_s": 10.0}
    assert made.base["motion"] == {"speed_m_per_s": 15.0}  # not written to
    # Cells share the seed of a draw, draws do not.
    assert len({made.case(n).seed for n in range(6)}) == 1
    assert len({made.case(6 * n).seed for n in range(3)}) == 3


def test_a_case_depends_on_its_number_alone(tmp_path: Path) -> None:
    text = """
    [cases]
    draws = {draws}
    seed = {seed}
    [[parameter]]
    key = "outage_s"
    draw = "uniform"
    low = 10.0
    high = 60.0
    """
    few = design(tmp_path, text.format(draws=10, seed=1))
    many = design(tmp_path, text.format(draws=1000, seed=1))
    other = design(tmp_path, text.format(draws=10, seed=2))
    assert [few.case(n) for n in range(10)] == [many.case(n) for n in range(10)]
    assert many.case(7) == many.case(7)
    assert few.case(3).values != other.case(3).values
    assert few.case(3).seed != other.case(3).seed


@pytest.mark.parametrize("method", ["random", "latin", "sobol"])
def test_draws_have_their_distributions(tmp_path: Path, method: str) -> None:
    made = design(
        tmp_path,
        f"""
        [cases]
        draws = 512
        method = "{method}"
        [[parameter]]
        key = "a"
        draw = "uniform"
        low = 2.0
        high = 4.0
        [[parameter]]
        key = "b"
        draw = "normal"
        mean = 1.0
        sd = 3.0
        [[parameter]]
        key = "c"
        draw = "log-uniform"
        low = 0.01
        high = 10.0
        [[parameter]]
        key = "d"
        draw = "log-normal"
        median = 2.0
        factor = 3.0
        [[parameter]]
        key = "e"
        draw = "truncated-normal"
        mean = 0.0
        sd = 1.0
        low = -0.5
        high = 2.0
        [[parameter]]
        key = "f"
        draw = "integer"
        low = 1
        high = 4
        [[parameter]]
        key = "g"
        draw = "choice"
        values = ["x", "y"]
        """,
    )
    rows = [made.case(n).values for n in range(made.total)]
    exact = {
        "a": stats.uniform(2.0, 2.0),
        "b": stats.norm(1.0, 3.0),
        "c": stats.loguniform(0.01, 10.0),
        "d": stats.lognorm(math.log(3.0), scale=2.0),
        "e": stats.truncnorm(-0.5, 2.0),
    }
    for name, law in exact.items():
        # One seed of each method: by chance in one of 10,000.
        p = stats.kstest([row[name] for row in rows], law.cdf).pvalue
        assert p > 1e-4, name
        if method == "latin":  # one in each of 512 strata
            strata = np.floor(law.cdf([row[name] for row in rows]) * 512)
            assert np.unique(np.clip(strata, 0, 511)).size >= 511
    counts = np.bincount([row["f"] for row in rows], minlength=5)
    assert counts[0] == 0
    assert stats.chisquare(counts[1:]).pvalue > 1e-4
    assert {row["g"] for row in rows} == {"x", "y"}


def test_the_design_for_sensitivities_is_that_of_saltelli(tmp_path: Path) -> None:
    made = design(
        tmp_path,
        """
        [cases]
        draws = 8
        method = "sensitivity"
        [[parameter]]
        key = "a"
        draw = "uniform"
        low = 0.0
        high = 1.0
        [[parameter]]
        key = "b"
        draw = "uniform"
        low = 0.0
        high = 1.0
        """,
    )
    assert made.total == 8 * 4
    for j in range(8):
        a, b, first, second = (made.case(4 * j + k) for k in range(4))
        assert first.values == {"a": b.values["a"], "b": a.values["b"]}
        assert second.values == {"a": a.values["a"], "b": b.values["b"]}
        assert a.values["a"] != b.values["a"]
        assert len({one.seed for one in (a, b, first, second)}) == 1


def test_a_table_of_cases_and_a_fleet_of_logs(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("outage_s,sensor\n10,mpu-6050\n20.5,icm-42688-p\n")
    made = design(
        tmp_path,
        """
        [cases]
        table = "t.csv"
        [[parameter]]
        key = "outage_s"
        [[parameter]]
        key = "sensor"
        """,
    )
    assert [made.case(n).values for n in range(2)] == [
        {"outage_s": 10.0, "sensor": "mpu-6050"},
        {"outage_s": 20.5, "sensor": "icm-42688-p"},
    ]
    (tmp_path / "logs" / "two").mkdir(parents=True)
    for name in ("logs/b.csv", "logs/a.csv", "logs/two/c.csv"):
        (tmp_path / name).write_text("time\n")
    base = '[base]\nkind = "navigate"\nlogs = "logs/**/*.csv"\n'
    fleet = design(tmp_path, '[base.configuration.gnss]\npath = "{folder}/{stem}.pos"\n', base)
    assert fleet.logs == ("logs/a.csv", "logs/b.csv", "logs/two/c.csv")
    table = fleet.table(fleet.case(2))
    assert table["log"]["path"] == str(tmp_path / "logs/two/c.csv")
    assert table["gnss"]["path"] == str(tmp_path / "logs/two/c.pos")
    assert design(tmp_path, "", '[base]\nkind = "doctor"\nlogs = "logs"\n').total == 3


def test_what_no_case_could_run_is_refused_with_its_place(tmp_path: Path) -> None:
    assert "values" in refused(tmp_path, '[[parameter]]\nkey = "a"\n')
    assert "draw" in refused(tmp_path, '[[parameter]]\nkey = "a"\nlow = 1.0\n')
    assert "low and high" in refused(tmp_path, '[[parameter]]\nkey = "a"\ndraw = "uniform"\n')
    text = '[[parameter]]\nkey = "outage_s.b"\nvalues = [1]\n'
    assert "outage_s.b" in refused(tmp_path, text)
    text = '[[parameter]]\nkey = "sensor"\nname = "status"\nvalues = ["mpu-6050"]\n'
    assert "taken" in refused(tmp_path, text)
    text = '[[rate]]\nname = "r"\nscalar = "horizontal_m"\nabove = 1.0\n'
    assert "horizontal_95_m" in refused(tmp_path, text)
    assert "no log" in refused(tmp_path, "", '[base]\nkind = "doctor"\nlogs = "none/*.csv"\n')
    text = '[cases]\nmethod = "sensitivity"\n'
    assert "distribution" in refused(tmp_path, text)


def test_in_bulk_what_cannot_be_kept_is_refused(tmp_path: Path) -> None:
    base = """
    [base]
    kind = "outage"
    bulk = true
    configuration = { outage_s = 10.0, sensor = "mpu-6050", start = { aided_s = 0.0 } }
    """
    varied = '[[parameter]]\nkey = "start.tilt_sd_deg"\ndraw = "uniform"\nlow = 0.1\nhigh = 1.0\n'
    made = design(tmp_path, "[cases]\ndraws = 70\n" + varied, base)
    assert made.total == 70
    again = Campaign.thawed(made.frozen())
    assert list(again.scalars) == list(made.linear["nominal"])
    np.testing.assert_array_equal(again.bulk().run(60, 70), made.bulk().run(0, 70)[60:])
    for text in (
        '[stop]\nscalar = "horizontal_95_m"\nhalf_width = 1.0\n',
        '[keep]\nscalars = { a = "b" }\n',
        '[keep]\ncurves = ["horizontal_95_m"]\naxis = { to_s = 1.0 }\n',
    ):
        assert "in bulk" in refused(tmp_path, varied + text, base)
    assert "in bulk" in refused(tmp_path, varied.replace("uniform", "log-uniform"), base)


def test_keys_and_places() -> None:
    assert key_path('observations."gnss.position".mean_nis') == (
        "observations",
        "gnss.position",
        "mean_nis",
    )
    assert key_path("a.0.b") == ("a", 0, "b")
    data = {"a": [{"b": 1.0}], "gnss.position": 2.0}
    assert at_path(data, ("a", 0, "b")) == 1.0
    assert at_path(data, ("a", 1, "b")) is None
    assert with_value(data, ("a", 0, "c"), 3.0)["a"] == [{"b": 1.0, "c": 3.0}]
    assert data["a"] == [{"b": 1.0}]
    for text in ("a b", "", "a = 1\nb", "[a]"):
        with pytest.raises(ValueError, match=r".*"):
            key_path(text)


def test_a_campaign_is_the_same_thawed_and_elsewhere(tmp_path: Path) -> None:
    text = '[[parameter]]\nkey = "sensor"\nvalues = ["mpu-6050", "icm-42688-p"]\n'
    one = design(tmp_path, text)
    (tmp_path / "else").mkdir()
    other = design(tmp_path / "else", text)
    assert one.identity == other.identity == Campaign.thawed(one.frozen()).identity
    assert [Campaign.thawed(one.frozen()).case(k) for k in range(2)] == [one.case(0), one.case(1)]
    more = design(tmp_path, text.replace("icm-42688-p", "adis16470"))
    assert more.identity != one.identity
