"""Page of a campaign: answers first, figures with units, and nothing beyond its size."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from tests.campaign_cases import batches, fleet, frozen, grid, ishigami

from strapdown.campaign.page import campaign_document
from strapdown.campaign.summary import summarise
from strapdown.report.chart import Chart
from strapdown.report.document import Document, Items, KeyFigures, Paragraph, TableBlock
from strapdown.report.document_html import document_page
from strapdown.report.values import spaced


def document_of(spec, cases, curves=None) -> Document:
    """As it is made later again, from the JSON of its summary."""
    found = summarise(spec, batches(cases, 200), curves if curves is None else batches(curves, 999))
    plain = json.loads(json.dumps([spec, found], allow_nan=False))
    return campaign_document(*plain, "results")


def words_of(document: Document) -> str:
    page = re.sub(r"<(style|script|svg).*?</\1>", " ", document_page(document), flags=re.DOTALL)
    return spaced(re.sub(r"<[^>]+>", " ", page))


def blocks_of(document: Document, kind: type) -> list:
    every = (*document.front, *(b for s in document.sections for b in s.blocks))
    return [block for block in every if isinstance(block, kind)]


@pytest.fixture(scope="module")
def gridded() -> Document:
    return document_of(*grid())


def test_a_grid_says_first_where_its_bounds_hold(gridded: Document) -> None:
    items = dict(gridded.front[1].rows)
    north = spaced(items["north"])
    assert north.startswith("Consistent with 95 % in 8 of 12 cells; optimistic:")
    assert north.endswith("in 4 of 12 cells (mpu-6050).")
    assert "Consistent in 8 of 12 cells" in items["position"]
    assert spaced(items["beyond 10 m"]).startswith("Horizontal end above 10 m: from ")
    table = gridded.front[2]
    assert isinstance(table, TableBlock)
    assert table.columns[:2] == ("sensor", "outage, s")
    assert len(table.rows) == 12
    assert {row for row, _ in table.passed} == set(range(4, 12))


def test_scalars_over_the_grid_have_one_line_a_sensor(gridded: Document) -> None:
    chart = next(c for c in blocks_of(gridded, Chart) if c.slug == "grid-horizontal_end_m")
    assert (chart.x_label, chart.log_x) == ("outage, s", True)
    (panel,) = chart.panels
    assert panel.log
    assert panel.y_label == "horizontal end, m"
    assert [line.name for line in panel.lines] == ["mpu-6050", "icm-42688-p", "adis16505"]
    spec, cases, _ = grid()
    for line, fill in zip(panel.lines, panel.fills, strict=True):
        own = cases[(cases["sensor"] == line.name)].groupby("outage_s")["horizontal_end_m"]
        np.testing.assert_allclose(line.y, own.median(), rtol=1e-12)
        np.testing.assert_allclose(fill.low, own.quantile(0.05), rtol=1e-12)
        np.testing.assert_allclose(fill.high, own.quantile(0.95), rtol=1e-12)
        assert line.x.tolist() == spec["parameters"][1]["values"]


def test_more_parameters_become_panels_and_many_become_a_table() -> None:
    spec, cases, _ = grid(draws=20)
    spec["keep"]["curves"] = []
    more = [{**cell, "site": f"site {k}"} for cell in spec["cells"] for k in range(3)]
    spread = cases.loc[cases.index.repeat(3)].reset_index(drop=True)
    spread["cell"] = 3 * spread["cell"] + np.tile([0, 1, 2], len(cases))
    spread["case"] = np.arange(len(spread))
    document = document_of({**spec, "cells": more}, spread)
    chart = next(c for c in blocks_of(document, Chart) if c.slug == "grid-horizontal_end_m")
    assert len(chart.panels) == 3
    assert {len(panel.lines) for panel in chart.panels} == {3}
    many = [{"site": f"site {k}"} for k in range(45)]
    cases["cell"] = np.arange(len(cases)) % 45
    document = document_of({**spec, "cells": many}, cases)
    assert not [c for c in blocks_of(document, Chart) if c.slug.startswith("grid")]
    assert len(document.front[2].rows) == 45


def test_every_page_is_laid_out_below_two_megabytes(gridded: Document) -> None:
    for document in (gridded, document_of(*fleet()), document_of(*ishigami(200, 1))):
        page = document_page(document)
        assert len(page.encode()) < 2e6
        assert "nan" not in words_of(document).lower().split()
        assert not re.findall(r"(?:src|href)=\"http", page)


def test_failures_have_the_command_that_repeats_one(gridded: Document) -> None:
    _, cases, _ = grid()
    first = cases.loc[cases["status"] == "refused", "case"].iloc[0]
    commands = [p.text for p in blocks_of(gridded, Paragraph) if p.kind == "mono"]
    assert f"strapdown campaign case results {first}" in commands
    assert "navigation.too-short" in words_of(gridded)


def test_errors_are_on_page_one(gridded: Document) -> None:
    _, cases, _ = grid()
    refused = cases.loc[cases["status"] == "refused", "case"]
    (state, text) = gridded.front[-1].rows[0]
    assert state.startswith("refused")
    first = f"the first is {refused.iloc[0]}"
    assert spaced(text) == f"navigation.too-short: {len(refused)} cases, {first}"


def test_one_cell_has_key_figures_with_interval_and_verdict() -> None:
    spec, cases, _ = grid()
    spec = {**spec, "cells": [{}], "parameters": spec["parameters"][2:]}
    spec["keep"] = {**spec["keep"], "curves": []}
    own = cases[cases["cell"] == 0].assign(cell=0)
    document = document_of(spec, own)
    coverage, rate, test = blocks_of(document, KeyFigures)[0].figures
    done = own[own["status"] == "done"]
    share = (done["north_error_m"].abs() <= done["north_bound_m"]).mean()
    assert spaced(coverage.value) == f"{100.0 * share:.1f} %"
    assert coverage.note.startswith("Optimistic: the bound is too small")
    assert rate.name == "beyond 10 m: horizontal end above 10 m".replace(
        " m", "\u00a0m", 2
    ).replace("beyond 10\u00a0m", "beyond 10 m")
    assert "expected 3" in test.bound
    assert document.front[0].kind == "warning"


def test_without_a_question_page_one_has_the_scalars() -> None:
    document = document_of(*ishigami(300, 5))
    (figure,) = blocks_of(document, KeyFigures)[0].figures
    assert figure.name == "y, median"
    assert "Most sensitive to a: total index 0." in figure.note
    assert document.front[0].kind == "lead"
    (chart,) = (c for c in blocks_of(document, Chart) if c.slug.startswith("sobol"))
    assert chart.panels[0].categories == ("a", "b", "c")


def test_a_fleet_shows_its_outliers_and_their_logs() -> None:
    document = document_of(*fleet())
    words = words_of(document)
    assert "drives/log-030.csv (30)" in words
    assert "80 logs: 76 done, 4 not" in words
    # What most logs do not have is on page one.
    found = {
        head: spaced(text)
        for block in document.front
        if isinstance(block, Items)
        for head, text in block.rows
    }
    refused = "refused (input or configuration)"
    assert set(found) == {"log.gaps", "sensors.vibration", refused}
    assert found["log.gaps"].startswith("drives/log-003.csv (3), drives/log-013.csv (13), ")
    assert found["log.gaps"].endswith("and 3 more: 10.0 % (4.4 to 18.8 %).")
    chart = next(c for c in blocks_of(document, Chart) if c.slug == "logs-0")
    far = [line for line in chart.panels[1].lines if line.name == "far out"]
    assert far[0].x.tolist() == [11.0, 30.0]


def test_linear_propagation_is_beside_the_cases_in_bulk() -> None:
    rng = np.random.default_rng(6)
    values = 3.0 + 2.0 * rng.standard_normal(800)
    _, cases, _ = grid(draws=1)
    own = {"cell": 0, "draw": range(800), "case": range(800), "seed": 1}
    cases = cases.iloc[[0] * 800].reset_index(drop=True).assign(**own, end_m=values)
    cases["status"] = "done"
    spec = frozen(keep={"scalars": {"end_m": "end_m"}, "curves": []}, total=800)
    linear = {"nominal": {"end_m": 3.1}, "linear_sd": {"end_m": 1.6}}
    document = document_of({**spec, "linear": linear}, cases)
    (section,) = (s for s in document.sections if s.slug == "linear")
    (table,) = section.blocks
    (row,) = table.rows
    mean, sd = values.mean(), values.std(ddof=1)
    assert row == ("end, m", "3.1", f"{mean:.1f}", "1.60", f"{sd:.2f}", f"{sd / 1.6:.3f}")
    assert "2.5" in table.caption  # per cent: 1 / sqrt(2 n)
    plain = document_of(spec, cases)
    assert not next(s for s in plain.sections if s.slug == "linear").blocks


def test_a_campaign_without_cases_is_a_page() -> None:
    spec, cases, _ = grid()
    assert "0 cases of 720 planned: 0 done." in words_of(document_of(spec, cases.head(0)))


def test_a_campaign_without_scalars_is_a_page() -> None:
    _, cases, _ = grid(draws=5)
    document = document_of(frozen(total=60), cases.assign(cell=0))
    assert "60 cases" in words_of(document)


def test_words_of_the_user_are_escaped() -> None:
    spec, cases, _ = grid(draws=5)
    spec["title"] = "<script>alert(1)</script>"
    spec["cells"][0]["sensor"] = cases.loc[0, "sensor"] = "<b>"
    assert "<script>alert" not in document_page(document_of(spec, cases))


@pytest.mark.parametrize(("logs", "drawn"), [(18, 0), (40, 3)])
def test_few_values_have_no_histogram(logs: int, drawn: int) -> None:
    spec, table = fleet(40)
    document = document_of(spec, table.head(logs))
    charts = [c for c in blocks_of(document, Chart) if c.slug.startswith("distribution")]
    assert len(charts) == drawn
