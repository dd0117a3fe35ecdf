"""What a case's report is made of: limitations, plain data, tables, severity, references."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

from strapdown import simulate
from strapdown.bundle import to_json
from strapdown.config.crash_case import AssumedSpec, CaseSpec, ReferenceSpec
from strapdown.crash.case import case_severity, compare_reference, run_case
from strapdown.crash.case_contact import main_event
from strapdown.crash.measuring_point import MISSING_AXIS
from strapdown.crash.reconstruction import summary_table
from strapdown.errors import ConfigError, DataError, Finding
from strapdown.formats import read_raw
from strapdown.report.crash_case import (
    crash_json,
    file_name,
    signals_table,
    trajectory_table,
    write_table,
)
from strapdown.report.crash_document import crash_document
from strapdown.report.crash_tables import answers_table, reference_tables, severity_table
from strapdown.report.crash_words import (
    GRAVE,
    assumption_words,
    contradictions,
    headline,
    key_figures,
    lead,
    limitations,
    not_shown,
    sentences,
)
from strapdown.report.document import Items
from strapdown.report.values import mass_words, shown_in, spaced
from strapdown.report.verify import changed_case

USUAL = {
    "ringing",
    "rigid-vehicle",
    "entry-speed-stated",
}


@pytest.fixture(scope="module")
def case_file(tmp_path_factory):
    return simulate("pole").save(tmp_path_factory.mktemp("pole") / "pole").path / "case.toml"


@pytest.fixture(scope="module")
def result(case_file):
    return run_case(CaseSpec.read(case_file), case_file)


@pytest.fixture(scope="module")
def main(result):
    return result.reconstruction.main


def codes(result):
    return {code for code, _, _ in limitations(result)}


def texts_of(result):
    return {code: text for code, _, text in limitations(result)}


def with_main(result, **changes):
    """The result with another main answer."""
    made = result.reconstruction
    return replace(result, reconstruction=replace(made, combined=replace(made.combined, **changes)))


def with_event(result, **changes):
    events = result.reconstruction.main.events
    (event,) = events.events
    return with_main(result, events=replace(events, events=(replace(event, **changes),)))


def with_entry(result, **changes):
    spec = result.spec
    return replace(
        result, spec=spec.model_copy(update={"entry": spec.entry.model_copy(update=changes)})
    )


# -- limitations: each when its fact happens, and only then -------------------------------------


def test_a_case_without_further_faults_has_the_usual_limits_alone(result):
    assert codes(result) == USUAL


def with_change(result, **changes):
    """The result with another change of velocity of its event."""
    (body,) = result.reconstruction.main.body
    return with_main(result, body=(replace(body, event=replace(body.event, **changes)),))


def test_what_makes_an_answer_wrong_has_its_sentences():
    # Of an assumed axis they are put together from what the case assumes.
    assert GRAVE - {"assumed"} <= sentences()["limitations"].keys()


def test_an_event_that_is_cut_by_the_record(result):
    # What the regulation calls its end does not matter: a tail that rings misses nothing.
    assert codes(with_event(result, lasts_beyond_record=True)) == USUAL
    every = (True, True, True)
    for missing, code in (("after", "event-beyond-record"), ("before", "event-before-record")):
        cut = with_change(result, missing=(missing,), open_axes=every)
        assert codes(cut) - USUAL == {code}


def test_a_record_that_ends_before_its_blow_is_an_event(result):
    events = replace(result.reconstruction.main.events, events=(), cut_change=2.0)
    cut = with_main(result, events=events, body=(), ned=(), types=())
    assert codes(cut) - USUAL == {"blow-beyond-record"} < GRAVE
    figure, *_ = key_figures(cut)
    assert spaced(figure.value) == "at least 7.2 km/h" and "7.2 km/h" in spaced(headline(cut))
    assert "at least 2.00 m/s" in repr(cut.reconstruction.main)


def test_a_part_is_told_as_at_least_everywhere(result):
    whole = result.reconstruction.main.body[0].event
    cut = with_change(result, missing=("after",), open_axes=(True, True, True))
    size = f"{3.6 * whole.resultant:.2f}"
    said = spaced(headline(cut))
    assert said.startswith(f"Delta-V at least {size} km/h (above ")
    assert "direction of force of the recorded part" in said and "±" not in said.split(";")[0]
    assert spaced(headline(result)).startswith(f"Delta-V {size} ±")
    first, second, *_ = key_figures(cut)
    assert spaced(first.value) == f"at least {size} km/h"
    assert "without an upper bound" in first.bound
    assert second.name == "Direction of force of the recorded part"
    assert "the record ends within the contact" in lead(cut)
    table = answers_table(cut)
    assert any(cell.startswith("at least ") for cell in table.rows[table.strong[0]])
    rows = summary_table([cut.reconstruction.main])
    quantity = rows.index.get_level_values("quantity")
    assert rows[quantity == "delta-V resultant m/s"]["high"].tolist() == [math.inf]
    assert "PDOF of the recorded part deg" in quantity
    told = crash_json(cut)
    main = next(a for a in told["answers"] if a["recorder"] == told["main"])
    change = main["events"][0]["body"]["event"]
    assert change["at_least"] and change["missing"] == ["after"]
    assert change["resultant_m_per_s"]["high"] is None
    # Backward, and beyond; to the side, where the sign is not determined, in either direction.
    assert change["forward_m_per_s"]["low"] is None and change["forward_m_per_s"]["high"] < 0.0
    found = case_severity(cut.spec, cut.reconstruction.main)
    assert found and all(a.at_least for a in found if a.risk is not None)
    risky = replace(cut, severity=found)
    assert all(s["high"] is None and s["at_least"] for s in crash_json(risky)["severity"])
    assert all(row[1].startswith("at least ") for row in severity_table(risky).rows)
    assert "at least" in repr(cut.reconstruction.main)


def test_the_end_of_the_path_is_final_only_at_rest(result, main):
    def last_figure(speed):
        table = main.path.table.copy()
        table[["VN", "VE", "VD"]] *= 0.0
        table.loc[table.index[-5:], "VN"] = speed
        exact = {name: 0.0 * getattr(main.path, name) for name in ("errors", "noise_covariance")}
        path = replace(main.path, table=table, **exact)
        return key_figures(with_main(result, path=path))[-1].name

    at = spaced(f"{main.path.time[-1]:.4g} s")
    assert at in spaced(key_figures(result)[-1].name)
    assert at in spaced(last_figure(0.51)) and at not in spaced(last_figure(0.49))


def test_no_event(result):
    events = result.reconstruction.main.events
    none = with_main(result, events=replace(events, events=()), body=(), ned=(), types=())
    assert codes(none) - USUAL == {"no-event"}
    text = texts_of(none)["no-event"]
    assert "IMU1 and IMU2 alone" in text
    assert case_severity(none.spec, none.reconstruction.main) == ()
    assert main_event(none.reconstruction.main) is None


def test_an_event_outside_of_the_path(result):
    found = codes(with_main(result, ned=(None,)))
    assert found - USUAL == {"event-outside-path"}


def test_recorders_that_do_not_agree(result):
    made = result.reconstruction
    apart = replace(made, comparison=replace(made.comparison, agree=False))
    texts = texts_of(replace(result, reconstruction=apart))
    assert set(texts) - USUAL == {"recorders-disagree"}
    assert texts["recorders-disagree"].startswith("All together: ")
    assert next(iter(texts)) == "recorders-disagree"


def test_one_recorder_alone(result):
    made = result.reconstruction
    alone = replace(
        result,
        spec=result.spec.model_copy(update={"units": result.spec.units[:1]}),
        units=result.units[:1],
        reconstruction=replace(made, units=made.units[:1], combined=None, comparison=None),
    )
    assert codes(alone) - USUAL == {"one-recorder"}


def test_a_standstill_has_no_entry_speed_that_could_be_wrong(result):
    assert codes(with_entry(result, kind="standstill")) == USUAL - {"entry-speed-stated"}


def test_nothing_to_compare_with_and_what_does_not_agree(result):
    assert codes(replace(result, references=())) - USUAL == {"no-reference"}
    first, *others = result.references
    assert first.unit == result.reconstruction.main.name
    off = replace(result, references=(replace(first, consistent=False), *others))
    assert codes(off) - USUAL == {"reference-contradicts"}
    # That of a recorder by itself stands in the table, and does not limit the answer.
    other = replace(result, references=(first, replace(others[0], consistent=False)))
    assert codes(other) == USUAL


def test_what_was_assumed_is_said_with_its_reason(result):
    assumed = AssumedSpec(turn_sd_deg=2.0, over_s=(0.0, 0.2), because="film of IMU1")
    one, two = result.spec.units
    spec = result.spec.model_copy(
        update={"units": (one, two.model_copy(update={"assumed": assumed}))}
    )
    ((_, head, text),) = (
        one for one in limitations(replace(result, spec=spec)) if one[0] == "assumed"
    )
    assert codes(replace(result, spec=spec)) - USUAL == {"assumed"}
    assert head.startswith("IMU2: ")
    assert "standard deviation of 2° between 0 s and 0.2 s" in spaced(text)
    assert text.endswith("Reason stated: film of IMU1.")


def test_page_one_says_which_of_its_numbers_rest_on_an_assumption(result, main):
    assert assumption_words(result) == ""
    assert "assumption" not in headline(result)

    def assumed(share):
        """Of the variance across the force, which comes from the front, this share is assumed."""
        bound = main.body[0].event.bound
        parts = pd.DataFrame(0.0, ["timing", MISSING_AXIS], bound.by_contributor.columns)
        parts.loc["timing", ["xx", "yy"]] = [1.0, 1.0 - share]
        parts.loc[MISSING_AXIS, "yy"] = share
        whole = replace(main.body[0].event, bound=replace(bound, by_contributor=parts))
        body = (replace(main.body[0], event=whole), *main.body[1:])
        made = replace(result.reconstruction, combined=replace(main, body=body))
        return replace(result, reconstruction=made)

    known = main.body[0].event.delta_v.vector
    assert abs(known[1]) < 0.1 * abs(known[0])
    assert assumption_words(assumed(0.4)) == ""
    assert assumption_words(assumed(0.6)).endswith(" rest: direction of force.")
    assert "with 95 %, by assumption)" in spaced(headline(assumed(0.6)))
    assert "direction of force" in crash_json(assumed(0.6))["on_assumption"]


def test_a_reference_of_delta_v_is_one_difference_with_the_bound_of_both(result, main):
    whole = main.body[0].event
    spec = ReferenceSpec(
        kind="delta_v",
        name="EDR",
        axis="resultant",
        delta_v_m_per_s=whole.resultant + 1.0,
        delta_v_sd_m_per_s=1.0,
    )
    answer = compare_reference(spec, main, result.spec.options.gravity_m_per_s2, {})
    both = replace(result, references=(answer,))
    (table,) = reference_tables(both)
    half = 1.959963984540054 * math.hypot(answer.sd, 1.0)
    assert answer.difference == pytest.approx((-1.0, half))
    said = f"−3.6 ± {3.6 * half:.1f}"
    assert spaced(table.rows[0][5]) == said
    assert sum("±" in cell for cell in table.rows[0]) == 1
    assert f"differs by {said} km/h" in spaced(lead(both))
    (against,) = contradictions(replace(both, references=(replace(answer, consistent=False),)))
    assert said in spaced(against[1])


def prepared_of(result, change):
    """The first recorder with another preparation."""
    made = result.reconstruction
    unit = made.units[0]
    at = unit.at_point
    own = replace(unit, at_point=replace(at, prepared=change(at.prepared)))
    return replace(result, reconstruction=replace(made, units=(own, *made.units[1:])))


@pytest.mark.parametrize(
    ("part", "code"),
    [("clipped", "clipped-accelerometer"), ("gyro_clipped", "clipped-gyro")],
)
def test_a_sensor_at_its_end(result, part, code):
    def change(prepared):
        flags = np.zeros_like(getattr(prepared, part))
        flags[100:103, 1] = True
        return replace(prepared, **{part: flags})

    texts = texts_of(prepared_of(result, change))
    assert set(texts) - USUAL == {code}
    assert texts[code].startswith("IMU1: its axis y, 3 samples between ")
    assert "not in the bounds" in texts[code]


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda p: replace(p, rest=None), "no-rest"),
        (
            lambda p: replace(p, rest=replace(p.rest, grade="steady")),
            "steady-rest",
        ),
        (
            lambda p: replace(p, rest=replace(p.rest, end=p.rest.start + 1.9)),
            "short-rest",
        ),
    ],
)
def test_a_rest_that_is_none_or_short(result, change, code):
    assert codes(prepared_of(result, change)) - USUAL == {code}


# -- plain data ---------------------------------------------------------------------------------

UNITS = ("_s", "_deg", "_m", "_m2", "_m_per_s", "_m_per_s2")
# Numbers without a unit: counts, probabilities, a chi-square, a clock's hour, and the case's own.
BARE = {
    *("limit", "logit", "logit_sd", "logit_sd_of_model"),
    "main_event", "event", "clock", "probability", "chi_square", "freedom", "value", "low", "high",
    "share_of_delta_v", "turning_of_assumed",
}  # fmt: skip


def numbers(value, place=()):
    if isinstance(value, dict):
        for key, item in value.items():
            yield from numbers(item, (*place, key))
    elif isinstance(value, list | tuple):
        for item in value:
            yield from numbers(item, place)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield place, value


def test_every_number_is_finite_and_its_key_says_its_unit(result):
    told = crash_json(result)
    case = told.pop("case")
    for place, value in (*numbers(told), *numbers(case)):
        assert math.isfinite(value), place
    for place, _ in numbers(told):
        named = [key for key in place if str(key).endswith(UNITS)]
        assert named or place[-1] in BARE, place
    assert json.loads(to_json(told)) == json.loads(json.dumps(told))


def test_units_of_the_united_states_are_those_of_labels_and_numbers(result):
    options = result.spec.options.model_copy(update={"units": "us"})
    other = replace(result, spec=result.spec.model_copy(update={"options": options}))
    si, us = crash_json(result), crash_json(other)
    assert (si["units"], us["units"]) == ("metric", "us")
    first, second = (told["answers"][0]["path"]["end"] for told in (si, us))
    for axis in ("value", "low", "high"):
        assert second["north_ft"][axis] == pytest.approx(first["north_m"][axis] / 0.3048)
        assert second["VN_mph"][axis] == pytest.approx(first["VN_m_per_s"][axis] / 0.44704)
        assert second["roll_deg"] == first["roll_deg"]
    variances = [told["answers"][0]["path"] for told in (si, us)]
    some = next(iter(variances[0]["variances_at_the_end_m2"]))
    assert variances[1]["variances_at_the_end_ft2"][some]["north"] == pytest.approx(
        variances[0]["variances_at_the_end_m2"][some]["north"] / 0.3048**2
    )
    peaks = [told["answers"][0]["events"][0] for told in (si, us)]
    assert peaks[1]["peak_g"] == pytest.approx(peaks[0]["peak_m_per_s2"] / 9.80665)
    for place, _ in numbers({k: v for k, v in us.items() if k != "case"}):
        assert not any(str(key).endswith(("_m", "_m2", "_m_per_s", "_m_per_s2")) for key in place)
    thiv = (
        [next(i for i in told["indices"] if i["index"] == "THIV") for told in (si, us)]
        if si["indices"]
        else []
    )
    for one in thiv[:1]:
        assert thiv[1]["unit"] == "mph"
        assert thiv[1]["value"] == pytest.approx(one["value"] / 0.44704)


def test_units_are_those_of_tables_and_sentences(result):
    with shown_in("us"):
        table = answers_table(result)
        assert table.columns[3] == "forward, mph"
        assert "mph" in headline(result) and "ft" in lead(result)
        assert mass_words(1786.0) == "3937 lb"
    assert "km/h" in headline(result) and "mph" not in lead(result)


def test_a_reference_that_contradicts_is_on_page_one(result):
    first = next(r for r in result.references if r.unit == result.reconstruction.main.name)
    others = tuple(r for r in result.references if r is not first)
    assert not contradictions(replace(result, references=others, findings=()))
    wrong = replace(first, consistent=False)
    told = contradictions(replace(result, references=(wrong, *others), findings=()))
    assert [where for where, _ in told] == [first.spec.name]
    front = crash_document(replace(result, references=(wrong, *others)), "").front
    items = [row for block in front if isinstance(block, Items) for row in block.rows]
    assert items[0] == told[0]


def test_a_finding_against_the_answer_is_on_page_one_and_a_note_is_not(result):
    known = replace(result, references=())
    finding = Finding("crash.others-agree-another-not", file="IMU1")
    note = Finding("crash.index-not-reached", severity="note", quantity="OLC")
    told = contradictions(replace(known, findings=(note, finding)))
    assert [where for where, _ in told] == ["IMU1"]


def test_what_cannot_be_shown_depends_on_the_case(result):
    heads = [head for head, _ in not_shown(result)]
    single = replace(
        result,
        reconstruction=replace(
            result.reconstruction, units=result.reconstruction.units[:1], combined=None
        ),
    )
    alone = [head for head, _ in not_shown(single)]
    assert len(set(heads)) == len(heads) >= 8
    assert set(alone) != set(heads)


def test_what_is_no_number_is_null(result):
    first, *others = result.references
    told = crash_json(replace(result, references=(replace(first, delta_v=math.inf), *others)))
    assert told["references"][0]["delta_v_m_per_s"] is None
    assert told["references"][0]["sd_m_per_s"] is None


def test_where_files_lay_is_no_result(result, case_file):
    text = to_json(crash_json(result))
    assert str(case_file.parent) not in text
    assert crash_json(result)["case"]["units"][0]["gyro"]["path"] == "imu1_gyro.csv"


# -- tables -------------------------------------------------------------------------------------


def test_the_path_comes_back_bit_for_bit(main, tmp_path):
    table = trajectory_table(main.path)
    write_table(table, tmp_path / "trajectory.csv", {"time": "s"})
    back = read_raw(tmp_path / "trajectory.csv").columns
    assert list(back) == ["time_s", *table.columns]
    for name in table:
        assert (
            np.asarray(back[name], dtype=np.float64).tobytes() == table[name].to_numpy().tobytes()
        )
    assert np.array_equal(table.index, main.path.time)
    assert np.array_equal(back["time_s"], main.path.time)
    assert np.array_equal(table["north_m"], main.path.table["north"])
    assert np.array_equal(table["heading_sd_deg"], main.path.sd["heading"])
    assert all(re.search(r"_(s|m|m_per_s|deg)$", name) for name in table)


def test_signals_come_back_with_which_range_spoke(result, tmp_path):
    for unit in result.reconstruction.answers:
        table = signals_table(unit)
        write_table(table, tmp_path / "signals.csv", {})
        back = read_raw(tmp_path / "signals.csv").columns
        assert np.array_equal(back["time_s"], unit.at_point.imu.index)
        for name in table:
            assert np.array_equal(np.asarray(back[name], dtype=np.float64), table[name])
        if unit.at_point.prepared is not None:
            assert set(table["range_x"]) == {0, 1}
    assert "range_x" not in signals_table(result.reconstruction.main)


def test_names_of_recorders_become_names_of_files():
    made = set()
    names = ["IMU1", "imu 1", "imu-1", "../..", "-o", "ёж", "a" * 300, "CON.csv"]
    found = [file_name(name, made) for name in names]
    assert found[:6] == ["imu1", "imu-1", "imu-1-2", "recorder", "o", "recorder-2"]
    assert len(found[6]) == 60
    assert len(set(found)) == len(names)


# -- severity and references --------------------------------------------------------------------


def test_models_of_the_type_are_asked_or_those_that_are_named(result, main):
    assert {a.model.name for a in result.severity} == {
        f"wang_2022_front_{k}" for k in ("mais1", "mais2", "mais3", "mais4", "mais5", "fatal")
    }
    assert all(a.risk is not None and a.because is None for a in result.severity)

    def asked(**options):
        own = result.spec.options.model_copy(update=options)
        return case_severity(result.spec.model_copy(update={"options": own}), main)

    (one,) = asked(severity=("wang_2022_front_mais3",))
    assert one.model.name == "wang_2022_front_mais3"
    assert asked(severity=()) == ()
    rear = replace(main, types=(replace(main.types[0], name="rear"),))
    front = {"severity": ("wang_2022_front_mais3",)}
    own = result.spec.options.model_copy(update=front)
    (other,) = case_severity(result.spec.model_copy(update={"options": own}), rear)
    assert other.risk is None
    assert other.because.code == "crash.model-for-others-refused"
    assert other.because.data["category"] == "rear"
    with pytest.raises(ConfigError, match="mais9"):
        asked(severity=("wang_2022_front_mais9",))


def test_models_of_every_crash_are_asked_where_the_type_is_open(result, main):
    kind = replace(main.types[0], name="undetermined")
    found = case_severity(result.spec, replace(main, types=(kind,)))
    assert found
    assert all(not a.model.applies for a in found)
    assert {a.model.outcome for a in found} >= {"MAIS3+"}


def test_a_change_of_velocity_is_held_against_another(result, main):
    whole = main.body[0].event
    gravity = result.spec.options.gravity_m_per_s2

    def held(**given):
        spec = ReferenceSpec(kind="delta_v", name="EDR", **{"axis": "resultant"} | given)
        return compare_reference(spec, main, gravity, {})

    ours = whole.resultant
    same = held(delta_v_m_per_s=ours, delta_v_sd_m_per_s=0.1)
    assert same.delta_v == pytest.approx(ours, rel=1e-12)
    assert same.sd * 1.959963984540054 == pytest.approx(whole.resultant_bound, rel=1e-6)
    assert same.consistent
    assert same.span == (whole.delta_v.start, whole.delta_v.end)
    limit = 1.959963984540054 * math.hypot(same.sd, 0.1)
    assert held(delta_v_m_per_s=ours + 0.999 * limit, delta_v_sd_m_per_s=0.1).consistent
    assert not held(delta_v_m_per_s=ours + 1.001 * limit, delta_v_sd_m_per_s=0.1).consistent
    right = held(delta_v_m_per_s=0.0, delta_v_sd_m_per_s=0.1, axis="right", over_s=(0.0, 0.1))
    assert abs(right.delta_v) < 0.5
    assert right.span == (0.0, 0.1)
    with pytest.raises(DataError, check=coded("crash.reference-span-outside-record")):
        held(delta_v_m_per_s=1.0, delta_v_sd_m_per_s=0.1, over_s=(0.5, 9.0))


def test_without_event_or_span_nobody_knows_what_is_meant(result, main):
    none = replace(main, events=replace(main.events, events=()), body=(), ned=(), types=())
    spec = ReferenceSpec(kind="delta_v", name="EDR", delta_v_m_per_s=7.0, delta_v_sd_m_per_s=0.1)
    with pytest.raises(ConfigError, match="over_s"):
        compare_reference(spec, none, 9.8, {})


# -- what changed -------------------------------------------------------------------------------


def test_options_that_differ_from_the_file_are_named_with_both_values(result, case_file):
    sealed = result.spec.model_dump(mode="json", exclude_none=True)
    manifest = {"command": "crash", "configuration": {"case": sealed, "case_path": "case.toml"}}
    assert changed_case(case_file.parent, manifest) == []
    sealed["options"]["seed"] = 3
    sealed["units"][0]["trigger_s"] = 1.0
    assert [found.text() for found in changed_case(case_file.parent, manifest)] == [
        "case.toml: unit 'IMU1', trigger_s: 1.0 before, 10.748534 now",
        "case.toml: options, seed: 3 before, 0 now",
    ]
    for other in (
        {"command": "attitude", "configuration": {}},
        {"command": "crash", "configuration": 3},
    ):
        assert changed_case(case_file.parent, other) == []
    gone = {"command": "crash", "configuration": {"case": sealed, "case_path": "none.toml"}}
    assert changed_case(case_file.parent, gone) == []
