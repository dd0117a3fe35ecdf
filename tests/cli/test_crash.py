"""`strapdown crash`: from a case file to a sealed report, and that all of it says the same."""

from __future__ import annotations

import csv
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import numpy as np
import pytest

KMH = 3.6


class Text(HTMLParser):
    """What a reader sees of a page."""

    def __init__(self):
        super().__init__()
        self.parts, self.hidden = [], 0

    def handle_starttag(self, tag, attrs):
        self.hidden += tag in ("script", "style")

    def handle_endtag(self, tag):
        self.hidden -= tag in ("script", "style")

    def handle_data(self, data):
        if not self.hidden:
            self.parts.append(data)


def flat(text):
    """Text without its line breaks; those of a table's cells depend on where it is shown."""
    return re.sub(r"\s+", " ", text)


@pytest.fixture(scope="module")
def told(sealed_crash):
    return json.loads((sealed_crash.folder / "crash.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def truth(sealed_crash):
    return json.loads((sealed_crash.records / "scenario.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def page(sealed_crash):
    reader = Text()
    reader.feed((sealed_crash.folder / "report.html").read_text(encoding="utf-8"))
    return flat(" ".join(reader.parts))


@pytest.fixture(scope="module")
def paper(sealed_crash):
    if shutil.which("pdftotext") is None:
        pytest.skip("no pdftotext here")
    pdf = str(sealed_crash.folder / "report.pdf")
    done = subprocess.run(["pdftotext", "-layout", pdf, "-"], capture_output=True, check=True)
    return flat(done.stdout.decode("utf-8"))


def main_answer(told):
    (found,) = [a for a in told["answers"] if a["recorder"] == told["main"]]
    return found


def main_event(told):
    unit = main_answer(told)
    return unit["events"][unit["main_event"] - 1]


def rounded(bound):
    """Value and half width as a person rounds them: the half width to two digits."""
    half = (bound["high"] - bound["low"]) / 2.0
    places = max(0, 1 - int(np.floor(np.log10(half))))
    return f"{bound['value']:.{places}f} ± {half:.{places}f}".replace("-", "\u2212")


def scaled(bound):
    return {key: KMH * value for key, value in bound.items()}


def within(value, bound):
    return bound["low"] <= value <= bound["high"]


# -- what the folder holds ----------------------------------------------------------------------


def test_the_folder_holds_report_numbers_figures_and_everything_that_was_read(sealed_crash):
    files = {
        p.relative_to(sealed_crash.folder).as_posix() for p in sealed_crash.folder.rglob("*.*")
    }
    recorders = {p.name for p in sealed_crash.records.glob("imu*.csv")}
    assert len(recorders) == 6
    assert {f"inputs/record/{name}" for name in recorders} == {
        f for f in files if f.startswith("inputs/record/")
    }
    wanted = {
        "report.html",
        "report.pdf",
        "crash.json",
        "trajectory.csv",
        "signals-imu1.csv",
        "signals-imu2.csv",
        "signals-weighted-mean-of-imu1--imu2.csv",
        "manifest.json",
        "timing.json",
        "inputs/case/case.toml",
        "inputs/reference/cameras.csv",
    }
    assert wanted <= files
    rest = files - wanted - {f"inputs/record/{name}" for name in recorders}
    assert {f for f in rest if not f.startswith("figures/")} == set()
    assert {"figures/pdof-front.svg", "figures/path.svg", "figures/delta-v.svg"} <= rest
    assert all(f.endswith(".svg") for f in rest)
    assert (sealed_crash.folder / "report.pdf").read_bytes().startswith(b"%PDF-")


def test_what_is_kept_of_the_inputs_is_what_was_read(sealed_crash):
    for role, name in (("case", "case.toml"), ("record", "imu2_gyro.csv")):
        kept = sealed_crash.folder / "inputs" / role / name
        assert kept.read_bytes() == (sealed_crash.records / name).read_bytes()


# -- the answers are right ----------------------------------------------------------------------


@pytest.mark.parametrize("frame", ["body", "over_ground"])
def test_delta_v_holds_the_truth(told, truth, frame):
    (impact,) = truth["impacts"]
    key = "delta_v_along_turning_axes_m_per_s" if frame == "body" else "delta_v_m_per_s"
    axes = ("forward", "right", "down") if frame == "body" else ("north", "east", "down")
    change = main_event(told)[frame]["event"]
    for axis, value in zip(axes, impact[key], strict=True):
        bound = change[f"{axis}_m_per_s"]
        assert within(value, bound), axis
    assert within(np.linalg.norm(impact[key]), change["resultant_m_per_s"])


def test_the_direction_of_force_holds_the_truth(told, truth):
    (impact,) = truth["impacts"]
    event = main_event(told)
    found = event["body"]["event"]["direction_of_force"]
    assert found["low_deg"] <= impact["pdof_along_turning_axes_deg"] <= found["high_deg"]
    ground = event["over_ground"]["event"]["direction_of_force"]
    assert ground["low_deg"] <= impact["pdof_deg"] <= ground["high_deg"]
    assert (found["clock"], event["type"]) == (12, "front")


def test_the_end_of_the_path_holds_the_truth(told, truth):
    path = main_answer(told)["path"]
    assert path["end_s"] == truth["end"]["time_s"]
    for key in ("north_m", "east_m", "down_m", "heading_deg"):
        assert within(truth["end"][key], path["end"][key]), key


def test_no_bound_is_so_wide_that_it_says_nothing(told):
    change = main_event(told)["body"]["event"]["resultant_m_per_s"]
    assert change["high"] - change["low"] < 0.1 * change["value"]
    assert told["comparison"]["agree"] is True
    assert told["severity"][0]["model"].startswith("wang_2022_front")
    assert all(r["consistent"] for r in told["references"])


# -- everything says the same -------------------------------------------------------------------


def test_terminal_page_and_pdf_say_the_numbers_of_the_json(told, sealed_crash, page, paper):
    said = flat(sealed_crash.out)
    for unit in told["answers"]:
        (event,) = unit["events"]
        change = event["body"]["event"]
        for key in ("forward_m_per_s", "right_m_per_s", "down_m_per_s", "resultant_m_per_s"):
            number = rounded(scaled(change[key]))
            for text in (said, page, paper):
                assert number in text, (unit["recorder"], key, number)
        for key in ("north_m", "east_m", "down_m"):
            number = rounded(unit["path"]["end"][key])
            for text in (said, page, paper):
                assert number in text, (unit["recorder"], key, number)
    assert flat(told["headline"]) in said


def test_terminal_page_and_pdf_name_the_same_limits(told, sealed_crash, page, paper):
    assert len(told["limitations"]) >= 3
    for limit in told["limitations"]:
        for text in (flat(sealed_crash.out), page, paper):
            assert limit["what"] in text
        assert flat(limit["text"]) in page


def test_the_table_of_the_path_ends_where_the_json_says(told, sealed_crash):
    with (sealed_crash.folder / "trajectory.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    end = main_answer(told)["path"]["end"]
    assert float(rows[-1]["time_s"]) == main_answer(told)["path"]["end_s"]
    for key in ("north_m", "east_m", "VD_m_per_s", "heading_deg"):
        assert float(rows[-1][key]) == end[key]["value"]
    half = (end["north_m"]["high"] - end["north_m"]["low"]) / 2.0
    # 1.959964 of the normal distribution; low and high were rounded once each.
    assert 1.959963985 * float(rows[-1]["north_sd_m"]) == pytest.approx(half, rel=1e-9)


def test_it_says_what_to_open_and_the_seal(sealed_crash):
    import hashlib

    digest = hashlib.sha256((sealed_crash.folder / "manifest.json").read_bytes()).hexdigest()
    assert f"Open  {sealed_crash.folder / 'report.html'}" in sealed_crash.out
    assert sealed_crash.out.rstrip().endswith(f"Seal  sha256 {digest}")


# -- options ------------------------------------------------------------------------------------


@pytest.fixture
def quick(monkeypatch, sealed_crash):
    """The command with everything but the drawing, which the other tests have."""
    from strapdown.report import document_html, document_pdf

    def write(document, path, *, stills=None):
        path.write_bytes(b"%PDF-")

    monkeypatch.setattr(document_pdf, "write_pdf", write)
    monkeypatch.setattr(document_html, "draw_stills", lambda document: ["<svg/>"] * 99)
    monkeypatch.setattr(document_html, "document_page", lambda document, stills=(): "<html></html>")
    return sealed_crash.records / "case.toml"


@pytest.mark.usefixtures("quick")
def test_json_is_the_file_alone_and_replaces_when_forced(run_cli, light_case, tmp_path, told):
    out = tmp_path / "out"
    done = run_cli("crash", light_case, "--out", out, "--json")
    assert done.code == 0
    assert done.out == (out / "crash.json").read_text(encoding="utf-8")
    assert json.loads(done.out).keys() == told.keys()
    before = sorted(p.name for p in tmp_path.iterdir())
    refused = run_cli("crash", light_case, "--out", out)
    assert refused.code == 4
    assert "the folder exists" in refused.err
    assert "--force" in refused.err
    (out / "mine.txt").write_text("mine")
    assert run_cli("crash", light_case, "--out", out, "--force", "-q").code == 0
    assert not (out / "mine.txt").exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == before


@pytest.mark.usefixtures("quick")
def test_quiet_says_nothing_and_the_folder_is_named_after_the_case(
    run_cli, light_case, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    done = run_cli("crash", light_case, "--quiet")
    assert (done.code, done.out, done.err) == (0, "", "")
    assert [p.name for p in tmp_path.iterdir()] == ["case-crash"]


def test_a_folder_of_somebody_else_is_refused_even_when_forced(run_cli, quick, tmp_path):
    (tmp_path / "letter.txt").write_text("mine")
    done = run_cli("crash", quick, "--out", tmp_path, "--force")
    assert done.code == 4
    assert "exists and is not a bundle" in done.err
    assert [p.name for p in tmp_path.iterdir()] == ["letter.txt"]


def test_a_command_line_that_is_not_understood(run_cli):
    assert run_cli("crash").code == 2
    assert run_cli("crash", "case.toml", "--fast").code == 2


@pytest.mark.slow
def test_it_verifies_where_it_stands_without_its_records(sealed_crash, run_cli, copied_crash):
    done = run_cli("verify", copied_crash)
    assert done.out.startswith("identical\n"), done.out
    assert done.code == 0
    (own,) = set(re.findall(r"\b[0-9a-f]{64}\b", done.out))
    assert own in sealed_crash.out
