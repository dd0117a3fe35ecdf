"""``strapdown reproduce``: the folder it writes, what it refuses, and the manual's table of it."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest

from strapdown.report.reproduction import (
    REPRODUCTIONS,
    make_reproduction,
    reproduction_specification,
)

sys.path.insert(0, str(Path(__file__).parents[1]))
from statements_of_a_paper import check_manual

pytestmark = pytest.mark.usefixtures("sketched_module")

PAGE = Path(__file__).parents[2] / "docs" / "alexiev.md"


@pytest.fixture(scope="module")
def bundle(tmp_path_factory, run_cli, sketched_module):
    out = tmp_path_factory.mktemp("reproduce") / "alexiev"
    found = run_cli("reproduce", "alexiev", "--out", out)
    assert found.code == 0, found.err
    return out, found


def test_it_writes_page_figures_numbers_and_seal(bundle):
    out, found = bundle
    result = json.loads((out / "reproduction.json").read_text())
    curves = json.loads((out / "curves.json").read_text())
    assert {f["slug"] for f in result["figures"]} == {f["slug"] for f in curves["figures"]}
    assert {p.stem for p in (out / "figures").iterdir()} == {f["slug"] for f in result["figures"]}
    assert {"fig2", "fig4", "fig5", "fig6"} <= {f["slug"] for f in result["figures"]}
    assert sum(result["verdicts"].values()) == len(result["statements"])
    assert "Seal  sha256" in found.out
    assert result["headline"] in found.out


def test_the_page_shows_every_statement_table_and_figure_and_fetches_nothing(bundle):
    out, _ = bundle
    result = json.loads((out / "reproduction.json").read_text())
    page = (out / "report.html").read_text()
    for s in result["statements"]:
        assert f'id="{s["key"]}"' in page
        assert not s["figure"] or f'id="figure-{s["figure"]}"' in page
    for kind in ("tables", "figures"):
        for item in result[kind]:
            assert item["title"].replace("'", "&#39;") in page
    head = page.split("</main>")[0]
    assert not re.search(r'(src|href)="(?!#)', head)


def test_verify_makes_it_again_to_the_bit(bundle, run_cli):
    out, _ = bundle
    assert run_cli("verify", out).out.startswith("identical")
    path = out / "reproduction.json"
    before = path.read_bytes()
    path.write_bytes(before.replace(b'"holds"', b'"does not hold"', 1))
    try:
        found = run_cli("verify", out)
    finally:
        path.write_bytes(before)
    assert found.code == 6
    assert "reproduction.json: changed after it was sealed" in found.out


def test_json_quiet_and_force_are_as_everywhere(bundle, run_cli):
    out, _ = bundle
    refused = run_cli("reproduce", "alexiev", "--out", out)
    assert refused.code == 4
    assert "--force" in refused.err
    found = run_cli("reproduce", "alexiev", "--out", out, "--force", "--json")
    assert json.loads(found.out) == json.loads((out / "reproduction.json").read_text())


def test_an_unknown_paper_gets_the_nearest(run_cli):
    found = run_cli("reproduce", "alexeev")
    assert found.code == 4
    assert "'alexeev' is no paper that is re-made here" in found.err
    assert "alexiev" in found.err.partition("Remedy")[2]


@pytest.mark.parametrize("paper", REPRODUCTIONS)
def test_every_reproduction_can_be_made_by_its_name(paper, run_cli):
    assert reproduction_specification(paper.upper()).paper == paper


def test_the_manual_has_the_statements_of_this_code():
    check_manual(make_reproduction(reproduction_specification("alexiev")), PAGE)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("paper", "figures"), [("tadic", (6, 7, 8, 9)), ("chernodarov", range(4, 12))]
)
def test_the_longer_ones_are_written_and_verified_like_the_other(paper, figures, tmp_path, run_cli):
    out = tmp_path / paper
    found = run_cli("reproduce", paper, "--out", out)
    assert found.code == 0, found.err
    result = json.loads((out / "reproduction.json").read_text())
    assert {f"fig{k}" for k in figures} <= {p.stem for p in (out / "figures").iterdir()}
    assert result["headline"] in found.out
    page = (out / "report.html").read_text()
    assert not re.search(r'(src|href)="(?!#)', page.split("</main>")[0])
    assert run_cli("verify", out).out.startswith("identical")


def test_the_help_names_every_paper(run_cli):
    text = run_cli("reproduce", "--help").out
    for paper in REPRODUCTIONS:
        assert paper in text
