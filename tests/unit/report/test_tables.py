"""Words, tables, JSON, CSV and the face in a notebook."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

from strapdown.attitude_algorithms import Cost
from strapdown.attitude_comparison.references import FilterErrors
from strapdown.cli.attitude import print_comparison
from strapdown.errors import ConfigError
from strapdown.formats import read_raw
from strapdown.report import attitude_tables as tables
from strapdown.report.attitude import attitude_json, write_attitude
from strapdown.report.attitude_document import KINDS, attitude_document
from strapdown.report.attitude_words import standing
from strapdown.report.content import compare_files
from strapdown.report.document_html import document_page

EVIL = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"
TERMINAL = 112  # columns


def page_of(bench):
    return document_page(attitude_document(bench))


def test_the_answer_comes_first(full_bench):
    assert standing(full_bench).startswith("At 7 s, ")
    page = page_of(full_bench)
    order = [
        full_bench.answer.sentence,
        "Remedies",
        "Cost against error.</b>",
        "Error against rate.</b>",
        "<span>Results</span></h2>",
        "Gyro signals and reference points.</b>",
        "Attitude.</b>",
        "The body in space.</b>",
        "Error against the truth.</b>",
        "Parts of the error.</b>",
        "<span>Findings</span></h2>",
        "<span>Conventions</span></h2>",
    ]
    places = [page.index(text) for text in order]
    assert places == sorted(places)


def test_the_results_say_whose_error_it_is_and_what_it_costs(make_bench):
    bench = make_bench(references=("end same as start",))
    (table,) = tables.result_tables(bench)
    assert table.columns == (
        "algorithm",
        "final",
        "RMS",
        "largest",
        "at R1",
        "alg. error",
        "sensor",
        "≤ 2° to",
        "float32",
        "cycles",
        "memory",
    )
    cells = dict(zip(table.columns, table.rows[1], strict=True))
    share, cost = bench.shares[1], bench.costs[1]
    assert float(cells["alg. error"].rstrip("°")) == pytest.approx(share.own_deg[2], rel=0.005)
    assert float(cells["sensor"].rstrip("°")) == pytest.approx(share.sensor_deg[2], rel=0.005)
    assert (cells["cycles"], cells["memory"]) == (f"{cost.cycles:.0f}", str(cost.memory))
    assert "Exact: " in table.caption


def test_many_references_leave_the_parts_to_a_second_table(make_bench):
    two = tables.result_tables(make_bench(references=("end same as start",) * 4))
    assert [len(t.columns) for t in two] == [8, 7]
    assert two[1].columns[1:] == (
        "alg. error",
        "sensor",
        "≤ 2° to",
        "float32",
        "cycles",
        "memory",
    )


def test_without_a_truth_no_sensor_is_blamed(make_bench):
    (table,) = tables.result_tables(make_bench(truth=False))
    assert table.columns == (
        "algorithm",
        "alg. error",
        "≤ 2° to",
        "float32",
        "cycles",
        "memory",
    )
    assert "sensor and" not in table.caption


def test_a_tick_stands_exactly_where_the_tolerance_is_kept(full_bench):
    summed, drop = tables.sweep_tables(full_bench)
    assert drop.columns == ("algorithm", "100 Hz", "50 Hz", "20 Hz", "10 Hz", "4 Hz")
    assert summed.title == "Error by rate, samples averaged"
    ticked = {
        (i, j) for i, row in enumerate(drop.rows) for j, c in enumerate(row) if c.startswith("✓")
    }
    assert ticked == drop.passed
    rows = full_bench.sweep[full_bench.sweep["meaning"] == "drop"]
    assert len(ticked) == int((rows["error_deg"] <= full_bench.answer.tolerance_deg).sum())
    assert 0 < len(ticked) < len(rows)


def test_where_an_algorithm_did_not_run_the_cell_is_empty(make_bench):
    bench = make_bench()
    lost = (bench.sweep["algorithm"] == "dcm") & (bench.sweep["rate_hz"] == 20.0)
    drop, _ = tables.sweep_tables(replace(bench, sweep=bench.sweep[~lost]))
    assert drop.rows[1][3] == "–"


@pytest.mark.parametrize("sweep", [None, pd.DataFrame()])
def test_no_sweep_is_no_table(make_bench, sweep):
    bench = make_bench(sweep=False)
    assert tables.sweep_tables(bench if sweep is None else replace(bench, sweep=sweep)) == []


@pytest.mark.parametrize(
    ("luck", "words"),
    [(0.001, "significant (0.001)"), (0.3, "not significant (0.3)"), (math.nan, "–")],
)
def test_luck_in_words(luck, words):
    assert tables.luck_words(luck) == words


def test_aided_errors_stand_in_their_own_column(full_bench):
    table = tables.peer_table(full_bench)
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows["ahrs 0.4.0 AngularRate"] == ("1.82°", "", "gyro")
    assert rows["vqf 2.1.1"] == ("", "0.56°", "gyro+accel")
    assert all(aided == "" for who, (_, aided, _) in rows.items() if who.startswith("strapdown"))


def test_aided_filters_have_errors_by_parts_and_their_cost(full_bench):
    errors = FilterErrors(1.234, 0.5, 0.321, 1.19, 0.9, 0.75, (0.991, 0.5))
    cost = Cost("error-state", 100.0, 120.5, 3.0, 1.0, 0.5, 500.0, 223)
    own = replace(
        full_bench.peers[1],
        peer="strapdown error-state",
        aiding="gyro+accel+mag",
        errors=errors,
        cost=cost,
        single_deg=0.004,
        lowest_level_hz=12.5,
    )
    table = tables.filter_table(replace(full_bench, peers=(*full_bench.peers, own)))
    none = ("",) * 10
    assert table.rows == (
        ("vqf 2.1.1", "6D", *none),
        ("imufusion 1.2.5", "9D", *none),
        (
            *("error-state", "9D", "1.23°", "0.5°", "0.321°", "1.19°"),
            *("0.75°", "99% / 50%", "(12.5 Hz)", "0.004°", "225", "892"),
        ),
    )
    assert tables.filter_table(replace(full_bench, peers=full_bench.peers[:1])) is None
    found = attitude_json(replace(full_bench, peers=(own,)))["peers"][0]
    assert found["errors"]["covered"] == [0.991, 0.5]
    assert (found["cost"]["memory"], found["single_precision_deg"]) == (223, 0.004)


def test_each_algorithm_names_its_own_source(make_bench):
    table = tables.condition_table(make_bench(("naive", "rotvec")))
    assert [row[1] for row in table.rows] == [
        "Alexiev (2021) Eq. (2)",
        "Bortz (1971), Miller (1983), Savage (1998)",
    ]


def test_nine_algorithms_fit_a_terminal(full_bench, capsys):
    print_comparison(full_bench, verbose=True)
    lines = capsys.readouterr().out.splitlines()
    ruled = [k for k, line in enumerate(lines) if "───" in line]
    assert len(ruled) == 6
    for k in ruled:
        assert len(lines[k]) <= TERMINAL
        assert len(lines[k - 1].rstrip()) <= TERMINAL
    assert "  samples=4" not in lines
    assert any(line.rstrip() == "   coefficients=fit" for line in lines)


def test_little_prints_as_well(make_bench, capsys):
    print_comparison(make_bench(("quaternion",), truth=False, sweep=False))
    out = capsys.readouterr().out
    assert "quaternion ran over the log." in out
    assert "away two thirds of what is left" in out


def test_without_a_known_attitude_no_table_has_an_empty_column(make_bench, full_bench, capsys):
    bench = replace(
        full_bench, scores=(), peers=tuple(replace(p, scores=()) for p in full_bench.peers)
    )
    assert tables.peer_table(bench) is None
    own = replace(bench.peers[1], errors=None, ran=None, lowest_hz=None, lowest_level_hz=None)
    table = tables.filter_table(replace(bench, peers=(own,)))
    assert table.columns == ("filter", "uses", "float32", "ops", "bytes")
    assert all(len(row) == len(table.columns) for row in table.rows)
    assert "against the truth" not in table.caption


def test_the_terminal_names_the_tables_that_only_verbose_prints(full_bench, capsys):
    print_comparison(full_bench)
    brief = capsys.readouterr().out
    print_comparison(full_bench, verbose=True)
    whole = capsys.readouterr().out
    first, *others = [table.title for table in tables.sweep_tables(full_bench)]
    assert others
    assert f"\n{first}\n" in brief
    for title in others:
        assert f"\n{title}\n" not in brief
        assert f"\n{title}\n" in whole
    assert f"With --verbose, and on the page: {'; '.join(others)}." in brief
    assert "--verbose" not in whole


def test_json_has_everything_and_every_number_its_unit(full_bench):
    text = json.dumps(attitude_json(full_bench), allow_nan=False)
    data = json.loads(text)
    assert data["answer"]["sentence"] == full_bench.answer.sentence
    assert data["headline"].startswith(data["answer"]["sentence"])
    first = data["algorithms"][0]
    assert first["cost"]["cortex_m4f_cycles_per_sample"] == full_bench.costs[0].cycles
    assert first["share"]["own_deg"]["max"] == full_bench.shares[0].own_deg[2]
    assert len(data["sweep"]) == len(full_bench.sweep)
    assert data["sweep"][0]["reference_deg"] is None
    assert data["trials"]["ranking"][-1]["luck"] is None
    assert [p["aiding"] for p in data["peers"]] == ["gyro", "gyro+accel", "gyro+accel+mag"]
    units = re.compile(
        r"(_deg|_hz|_s|_per_sample|_rad_per_s|_m_per_s2|_numbers|_samples)$|^(luck|factor|row|q_?[wxyz0-3]|"
        r"final|rms|max|first|orthogonality_loss|norm_error)$"
    )

    def leaves(value, keys):
        if isinstance(value, dict):
            for key, item in value.items():
                yield from leaves(item, [*keys, key])
        elif isinstance(value, list):
            for item in value:
                yield from leaves(item, keys)
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield keys

    for keys in leaves(data, []):
        assert any(units.search(key) for key in keys), keys


def test_json_of_little(make_bench):
    data = attitude_json(make_bench(("dcm",), truth=False, sweep=False))
    assert (data["sweep"], data["trials"], data["peers"]) == ([], None, [])
    assert data["algorithms"][0]["share"]["sensor_deg"] is None


def test_the_sweep_comes_back_from_its_file(make_bench, tmp_path):
    names = ("naive", "rotvec:samples=4,coefficients=fit")
    bench = make_bench(names)
    seal = write_attitude(bench, tmp_path / "out")
    path = seal.path / "sweep.csv"
    assert b"\r" not in path.read_bytes()
    assert "nan" not in path.read_text().lower()
    columns = read_raw(path).columns
    assert list(columns) == list(bench.sweep.columns)
    for name in columns:
        assert (
            np.array_equal(columns[name].tolist(), bench.sweep[name].tolist(), equal_nan=True)
            if bench.sweep[name].dtype.kind == "f"
            else (columns[name].tolist() == bench.sweep[name].tolist())
        )
    # Options in the headings of the other table must not be taken for columns.
    assert len(read_raw(seal.path / "attitude.csv").columns) == 1 + 7 * len(names)


def test_verify_compares_the_sweep_word_for_word_and_number_for_number(make_bench, tmp_path):
    seal = write_attitude(make_bench(), tmp_path / "out")
    text = (seal.path / "sweep.csv").read_text()
    other = tmp_path / "other.csv"
    for changed, expected in [
        (text, 0.0),
        (text.replace('"naive"', '"other"'), math.inf),
        (re.sub(r",100,(\d+\.\d{8})\d*", r",100,\1", text, count=1), 1e-7),
    ]:
        other.write_text(changed)
        found = compare_files(seal.path / "sweep.csv", other, drawn_alike=True).within
        assert found == expected or 0.0 < found < expected


def test_little_is_written_without_a_sweep(make_bench, tmp_path):
    bench = make_bench(("dcm",), truth=False, sweep=False)
    names = {p.name for p in write_attitude(bench, tmp_path / "out").path.rglob("*")}
    assert "sweep.csv" not in names
    assert "cost.svg" in names
    assert not [name for name in names if name.endswith(".png")]


def test_the_page_is_the_same_every_time_and_modest(full_bench):
    page = page_of(full_bench)
    assert page == page_of(full_bench)
    assert len(page) < 1_500_000


def test_words_of_the_answer_and_of_peers_stay_text(full_bench):
    answer = replace(full_bench.answer, sentence=EVIL, why=(EVIL,), helps=(EVIL,))
    peers = tuple(replace(p, peer=EVIL) for p in full_bench.peers)
    trials = replace(
        full_bench.trials, names=(EVIL,), errors=full_bench.trials.errors.assign(trial=EVIL)
    )
    bench = replace(full_bench, answer=answer, peers=peers, trials=trials, source=EVIL)
    for text in (page_of(bench), bench._repr_html_()):
        assert "<script>alert" not in text
        assert "<img" not in text
        assert "&lt;img" in text


def test_a_notebook_shows_the_answer_and_the_table(full_bench):
    html = full_bench._repr_html_()
    assert full_bench.answer.sentence in html
    assert html.count("<tr>") == 1 + len(full_bench.runs)
    assert len(html) < 20_000


@pytest.mark.parametrize("kind", ["cost", "sweep", "error", "share", "trials", "peers"])
def test_a_bench_plots_itself_without_global_state(full_bench, kind):
    figure = full_bench.plot(kind)
    assert figure.panels
    assert figure._repr_svg_().startswith("<svg")


def test_what_cannot_be_plotted_is_said(make_bench):
    bench = make_bench(("dcm",), truth=False, sweep=False)
    with pytest.raises(
        ConfigError, check=coded("report.no-chart-bench", quantity="kind")
    ) as unknown:
        bench.plot("swep")
    assert "sweep" in str(unknown.value)
    for kind in KINDS.keys() - {"cost", "gyro", "attitude", "share"}:
        with pytest.raises(ConfigError, match=re.escape(KINDS[kind])):
            bench.plot(kind)


def test_to_pandas_has_comparisons_shares_and_costs(make_bench):
    bench = make_bench(references=("end same as start",))
    table = bench.to_pandas()
    assert len(table) == len(bench.scores)
    dcm = table[table["algorithm"] == "dcm"].iloc[0]
    assert dcm["own_max_deg"] == bench.shares[1].own_deg[2]
    assert dcm["cycles"] == bench.costs[1].cycles
    assert list(table.columns[: len(bench.summary.columns)]) == list(bench.summary.columns)
    alone = make_bench(truth=False).to_pandas()
    assert alone["algorithm"].tolist() == ["naive", "dcm", "quaternion"]
    assert alone["sensor_max_deg"].isna().all()
    assert alone["own_max_deg"].notna().all()


def test_of_many_references_the_worst_is_shown(make_bench):
    table = tables.result_tables(make_bench(references=("end same as start",) * 9))[0]
    assert table.columns[-1] == "worst of R1 to R9" or "worst of R1 to R9" in table.columns


def test_the_rate_down_to_which_it_is_good(full_bench):
    table = next(t for t in tables.result_tables(full_bench) if "≤ 2° to" in t.columns)
    column = table.columns.index("≤ 2° to")
    for row in table.rows:
        cells = full_bench.sweep[
            (full_bench.sweep["algorithm"] == row[0]) & (full_bench.sweep["meaning"] == "sum")
        ].sort_values("factor")
        rate = None
        for own, hz in zip(cells["own_deg"], cells["rate_hz"], strict=True):
            if own > 2.0:
                break
            rate = hz
        assert row[column] == ("–" if rate is None else f"{rate:.3g} Hz")
