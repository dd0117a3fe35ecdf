"""Summary of a campaign against pandas on the same cases, and what it says of failures."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from tests.campaign_cases import (
    AXIS,
    FLEET_SCALARS,
    GRID_SCALARS,
    ISHIGAMI_TOTAL,
    batches,
    fleet,
    frozen,
    grid,
    ishigami,
)

from strapdown.campaign import run as campaign_run
from strapdown.campaign.run import Stopping
from strapdown.campaign.summary import LEVELS, summarise


@pytest.fixture(scope="module")
def gridded():
    spec, cases, curves = grid()
    return spec, cases, curves, summarise(spec, batches(cases, 100), batches(curves, 5000))


def test_summary_is_the_same_in_any_batches(gridded) -> None:
    spec, cases, curves, found = gridded
    text = json.dumps(found, allow_nan=False)
    for rows in (17, 10_000):
        other = summarise(spec, batches(cases, rows), batches(curves, 37 * rows))
        assert json.dumps(other, allow_nan=False) == text


def test_scalars_of_each_cell_are_those_of_pandas(gridded) -> None:
    spec, cases, _, found = gridded
    assert [one["parameters"] for one in found["cells"]] == spec["cells"]
    for one in found["cells"]:
        own = cases[(cases["cell"] == one["cell"]) & (cases["status"] == "done")]
        for name in GRID_SCALARS:
            scalar, column = one["scalars"][name], own[name]
            assert scalar["count"] == len(own)
            assert scalar["missing"] == one["count"] - len(own)
            assert scalar["mean"] == pytest.approx(column.mean(), rel=1e-12, abs=1e-15)
            assert scalar["sd"] == pytest.approx(column.std(), rel=1e-12)
            quantiles = [one["value"] for one in scalar["quantiles"]]
            np.testing.assert_allclose(quantiles, np.quantile(column, LEVELS), rtol=1e-12)
            assert scalar["minimum_case"] == cases.loc[column.idxmin(), "case"]
            assert scalar["maximum"] == column.max()
            interval = stats.t.interval(0.95, len(own) - 1, column.mean(), stats.sem(column))
            np.testing.assert_allclose((scalar["mean_low"], scalar["mean_high"]), interval)
            shape = scalar["histogram"]
            assert shape["below"] + sum(shape["counts"]) + shape["above"] == len(own)


def test_tests_of_each_cell_have_their_verdicts(gridded) -> None:
    _, cases, _, found = gridded
    for one in found["cells"]:
        own = cases[(cases["cell"] == one["cell"]) & (cases["status"] == "done")]
        ((coverage,), (rate,), (test,)) = (one[k] for k in ("coverage", "rates", "consistency"))
        assert coverage["hits"] == int((own["north_error_m"].abs() <= own["north_bound_m"]).sum())
        assert rate["hits"] == int((own["horizontal_end_m"] > 10.0).sum())
        assert test["inside"]["hits"] == int(
            (own["nees_position"] <= stats.chi2.ppf(0.95, 3)).sum()
        )
        assert {coverage["of"], rate["of"], test["count"]} == {len(own)}
        bad = one["parameters"]["sensor"] == "mpu-6050"
        assert coverage["verdict"] == test["verdict"] == ("optimistic" if bad else "consistent")
        ends = stats.binomtest(coverage["hits"], len(own)).proportion_ci(0.99)
        assert (coverage["low_99"], coverage["high_99"]) == pytest.approx((ends.low, ends.high))


def test_failures_and_findings_have_the_numbers_of_their_cases(gridded) -> None:
    _, cases, _, found = gridded
    failed = cases[cases["status"] == "refused"]
    (error,) = found["errors"]
    assert (error["status"], error["code"]) == ("refused", "navigation.too-short")
    assert error["count"] == found["failure"]["hits"] == len(failed) > 0
    assert error["cases"] == failed["case"].tolist()[:5]
    (finding,) = found["findings"]
    assert finding["hits"] == int((cases["findings"] != "").sum())
    for one in found["cells"]:
        assert one["failure"]["hits"] == int((failed["cell"] == one["cell"]).sum())
        assert sum(state["hits"] for state in one["status"].values()) == one["count"]


def test_a_scalar_of_a_case_that_is_not_done_does_not_count() -> None:
    cases = pd.DataFrame(
        {
            "case": [0, 1, 2],
            "cell": 0,
            "draw": [0, 1, 2],
            "seed": 0,
            "status": ["done", "hung", "done"],
            "code": "",
            "findings": "",
            "y_m": [1.0, 99.0, 3.0],
        }
    )
    spec = frozen(keep={"scalars": {"y_m": "y"}, "curves": []})
    spec["rate"] = [{"name": "far", "scalar": "y_m", "above": 2.0}]
    (cell,) = summarise(spec, batches(cases, 2))["cells"]
    assert cell["scalars"]["y_m"]["maximum"] == 3.0
    assert (cell["rates"][0]["hits"], cell["rates"][0]["of"]) == (1, 2)
    assert cell["status"]["hung"]["hits"] == 1


def test_a_cell_without_cases_says_nothing() -> None:
    spec, cases, _ = grid(draws=20)
    spec["keep"]["curves"] = []
    found = summarise(spec, batches(cases[cases["cell"] != 3], 50))
    empty = found["cells"][3]
    assert empty["count"] == 0
    assert empty["coverage"][0]["verdict"] is None
    assert empty["coverage"][0]["share"] is None
    assert empty["scalars"]["nees_position"]["mean"] is None
    assert json.dumps(found, allow_nan=False)


def test_curves_have_their_bands(gridded) -> None:
    _, cases, curves, found = gridded
    assert found["x"] == AXIS.tolist()
    cells = dict(zip(cases["case"], cases["cell"], strict=True))
    for one in found["cells"][::5]:
        own = curves[curves["case"].map(cells) == one["cell"]]
        at = own.groupby("x")["horizontal_m"]
        band = one["curves"]["horizontal_m"]
        for key, level in (("low", 0.05), ("median", 0.5), ("high", 0.95)):
            np.testing.assert_allclose(band[key], at.quantile(level), rtol=1e-12)
        np.testing.assert_allclose(band["mean"], at.mean(), rtol=1e-12)
        assert band["count"] == at.count().tolist()


def test_curves_of_cases_that_do_not_count_are_left_out(gridded) -> None:
    """A cell that was stopped keeps its first draws; curves of later ones may be there."""
    spec, cases, curves, _ = gridded
    first = cases[cases["draw"] < 25]
    kept = curves[curves["case"].isin(first["case"])]
    one = summarise(spec, batches(first, 64), batches(curves, 999))
    other = summarise(spec, batches(first, 64), batches(kept, 999))
    assert one == other
    assert max(one["cells"][0]["curves"]["horizontal_m"]["count"]) <= 25


def test_curves_on_another_axis_are_refused(gridded) -> None:
    spec, cases, curves, _ = gridded
    off = curves.copy()
    off.loc[100, "x"] += 0.125
    with pytest.raises(ValueError, match="different axes"):
        summarise(spec, batches(cases, 100), batches(off, 5000))


def test_sensitivity_is_by_the_drawn_parameters() -> None:
    spec, cases = ishigami(800, 1)
    found = summarise(spec, batches(cases, 333))["cells"][0]["sensitivity"]["y"]
    assert found["base_samples"] == 800
    assert [one["parameter"] for one in found["parameters"]] == ["a", "b", "c"]
    for one, truth in zip(found["parameters"], ISHIGAMI_TOTAL, strict=True):
        half = 0.5 * (one["total_high"] - one["total_low"])
        assert abs(one["total"] - truth) < 2.0 * half < 0.3


def test_outliers_of_a_fleet_have_their_logs() -> None:
    spec, table = fleet()
    found = summarise(spec, batches(table, 30))
    far = found["cells"][0]["scalars"]["gyro_bias_deg_per_h"]["outliers"]
    assert (far["below"], far["above"]) == (1, 1)
    assert far["worst"] == [
        {"case": 30, "value": -700.0, "log": "drives/log-030.csv"},
        {"case": 11, "value": 500.0, "log": "drives/log-011.csv"},
    ]
    first, third = table["gyro_bias_deg_per_h"].quantile([0.25, 0.75])
    assert far["high_fence"] == pytest.approx(third + 3.0 * (third - first))
    gaps, vibration = found["findings"]
    assert (gaps["code"], gaps["hits"]) == ("log.gaps", 8)
    assert gaps["logs"] == [f"drives/log-{k:03d}.csv" for k in (3, 13, 23, 33, 43)]
    assert vibration["hits"] == 8
    assert [one["case"] for one in found["logs"]] == list(range(len(table)))
    for name in FLEET_SCALARS:
        values = [one["scalars"][name] for one in found["logs"]]
        np.testing.assert_array_equal(np.array(values, float), table[name])


@pytest.mark.parametrize("value", [0.0, 7.5])
def test_a_constant_has_neither_histogram_nor_outliers(value: float) -> None:
    _, table = fleet(40)
    table["lost_share"] = value
    spec, _ = fleet(40)
    (cell,) = summarise(spec, batches(table, 7))["cells"]
    assert "histogram" not in cell["scalars"]["lost_share"]
    assert "outliers" not in cell["scalars"]["lost_share"]


def test_half_widths_for_stopping() -> None:
    spec, cases, _ = grid()
    own = cases[(cases["cell"] == 5) & (cases["status"] == "done")]
    names = list(spec["keep"]["scalars"])
    rows = [
        {"cell": 0, "draw": k, "scalars": [one[name] for name in names]}
        for k, one in enumerate(own.to_dict("records"))
    ]
    north, sem = own["north_error_m"], stats.sem(own["north_error_m"])
    hits = {
        ("coverage", "north"): north.abs() <= own["north_bound_m"],
        ("rate", "beyond 10 m"): own["horizontal_end_m"] > 10.0,
    }
    halves = {("scalar", "north_error_m"): stats.t.ppf(0.975, len(own) - 1) * sem}
    for rule, hit in hits.items():
        ends = stats.binomtest(int(hit.sum()), len(own)).proportion_ci()
        halves[rule] = 0.5 * (ends.high - ends.low)
    for (key, name), half in halves.items():
        for factor, stops in ((1.0 + 1e-9, True), (1.0 - 1e-9, False)):
            stop = {key: name, "half_width": factor * half, "every": len(own)}
            frozen = {**spec, "stop": stop, "cells": [{}], "total": 10 * len(own)}
            stopping = Stopping(frozen)
            for row in reversed(rows):  # as they arrive
                stopping.add(row)
            assert (stopping.stopped == {0: len(own)}) is stops


def test_rows_are_read_in_order_once_and_a_window_at_a_time(tmp_path, monkeypatch):
    """Of parts in any order, that overlap and repeat each other; blocks have the same bytes."""
    monkeypatch.setattr(campaign_run, "WINDOW", 16)
    monkeypatch.setattr(campaign_run, "BLOCK", 48)
    frozen = {
        "base": {},
        "parameters": [],
        "logs": [],
        "keep": {"scalars": {"y": "x"}, "curves": ["c"], "axis": {"to_s": 1.0, "points": 3}},
        "total": 200,
        "schema": "strapdown campaign 1",
        **dict.fromkeys(("identity", "digests", "source"), "x"),
    }
    value = np.random.default_rng(3).normal(size=200)
    value[17] = np.nan

    def row(case):
        kept = {
            "scalars": [value[case]],
            "values": {},
            "status": "done",
            "code": "",
            "findings": "",
        }
        curve = None if 96 <= case < 112 or case % 7 == 0 else [[case, case + 0.5, case + 1.0]]
        return {
            "case": case,
            "cell": case % 2,
            "draw": case // 2,
            "seed": 1,
            **kept,
            "curves": curve,
        }

    def written(name, parts):
        made = campaign_run.Dataset.begin(tmp_path / name, frozen)
        for part in parts:
            made.add([row(case) for case in part])
        return made

    # 130 to 149 were not run; 60 to 69 twice.
    rng = np.random.default_rng(4)
    there = [*range(130), *range(150, 200)]
    mixed = rng.permutation(there).tolist()
    one = written("one", [mixed[k : k + 23] for k in range(0, 180, 23)] + [range(60, 70)])
    other = written("other", [there])
    for made in (one, other):
        tables = list(made.cases())
        assert max(map(len, tables)) <= 16
        assert [c for t in tables for c in t["case"].to_pylist()] == there
        assert [y for t in tables for y in t["y"].to_pylist()] == [
            None if np.isnan(value[c]) else value[c] for c in there
        ]
    some = {0: 60, 1: 30}

    def keep(table):
        limit = np.where(table["cell"].to_numpy() == 0, some[0], some[1])
        return table.filter(table["draw"].to_numpy() < limit)

    for made in (one, other):
        out = tmp_path / f"{made.folder.name}-out"
        out.mkdir()
        made.write_blocks(out, keep)
    files = sorted(
        p.relative_to(tmp_path / "one-out") for p in (tmp_path / "one-out").rglob("*.parquet")
    )
    assert [f.name for f in files[:3]] == [
        f"part-{first:010d}-{first + 47:010d}-block.parquet" for first in (0, 48, 96)
    ]
    for file in files:
        assert (tmp_path / "one-out" / file).read_bytes() == (
            tmp_path / "other-out" / file
        ).read_bytes()
    kept = [c for c in there if c // 2 < some[c % 2]]
    table = pd.read_parquet(tmp_path / "one-out" / "cases")
    assert table["case"].tolist() == kept
    curves = pd.read_parquet(tmp_path / "one-out" / "curves")
    with_curve = [c for c in kept if not (96 <= c < 112 or c % 7 == 0)]
    assert curves["case"].tolist() == np.repeat(with_curve, 3).tolist()
    assert curves["c"].tolist() == [c + d for c in with_curve for d in (0.0, 0.5, 1.0)]
