"""Tests of two vehicles: written in the layouts of NHTSA and ISO MME, read back, and proposed."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from tests.coded import coded
from tests.unit.crash.two_vehicles import TESTS, TIME, felt, recorded

from strapdown.config.crash_case import CaseSpec
from strapdown.crash.template import draft_case, draft_cases
from strapdown.errors import ConfigError, DataError
from strapdown.formats.crash_json import write_crash_json
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_table import write_crash_csv
from strapdown.formats.crash_triad import triad_of_channels
from strapdown.formats.crash_writers import write_mme, write_nhtsa

LAYOUTS = {"nhtsa": write_nhtsa, "mme": write_mme}
# Positions, headings and what no gyro says: nothing else is asked of a test with a complete header.
ONLY_A_PERSON_KNOWS = {"position_m", "heading_deg", "heading_sd_deg", "turn_sd_deg", "because"}
SAID = ("name", "quantity", "axis", "unit", "sampling", "place", "body", "vehicle", "point",
        "low_pass", "full_scale", "bandwidth")  # fmt: skip


@pytest.fixture(
    scope="module",
    params=[(test, layout) for test in TESTS for layout in LAYOUTS],
    ids=" ".join,
)
def written(request, tmp_path_factory):
    """A record, and the same written and read."""
    test, layout = request.param
    folder = tmp_path_factory.mktemp("written")
    record = recorded(test, layout)
    names = LAYOUTS[layout](folder / "record", record)
    assert names == {c.name: c.name for c in record.channels}
    return test, record, read_crash_record(folder / "record"), folder


@pytest.fixture(scope="module")
def drafts(written):
    _, _, read, folder = written
    return draft_cases([read], folder=folder)


def test_what_is_written_is_read(written):
    _, record, read, _ = written
    assert (read.title, read.findings) == (record.title, ())
    for one, other in zip(record.channels, read.channels, strict=True):
        assert {k: getattr(other, k) for k in SAID} == {k: getattr(one, k) for k in SAID}
        for mine, back in zip(one.load(), other.load(), strict=True):
            np.testing.assert_array_equal(mine, back)
    assert {n: dict(facts) for n, facts in read.vehicles.items()} == record.vehicles


def test_json_and_csv_keep_vehicles_and_points(written):
    _, record, read, folder = written
    write_crash_json(folder / "a.json", read)
    write_crash_csv(folder / "a.csv", read)
    kept = ("name", "place", "body", "vehicle", "point")
    for path in ("a.json", "a.csv"):
        again = read_crash_record(folder / path)
        channels = [c for c in again.channels if c.quantity != "time"]
        assert [[getattr(c, k) for k in kept] for c in channels] == [
            [getattr(c, k) for k in kept] for c in record.channels
        ]
        drafts = draft_cases([again], folder=folder)
        found = [[u["name"] for u in tomllib.loads(d.text)["units"]] for d in drafts]
        assert found == [rigid(test) for test in TESTS[written[0]]]
    assert read_crash_record(folder / "a.json").vehicles == record.vehicles


def rigid(vehicle):
    return [at.words for at in vehicle[0] if at.body == "vehicle"]


def test_each_vehicle_gets_its_case(written, drafts):
    test, _, read, _ = written
    assert [d.vehicle for d in drafts] == ["1", "2"]
    for draft, vehicle in zip(drafts, TESTS[test], strict=True):
        table = tomllib.loads(draft.text)
        facts = vehicle[1]
        assert [u["name"] for u in table["units"]] == rigid(vehicle)
        assert table["vehicle"]["name"] == facts["vehicle"] == draft.name
        assert table["vehicle"]["mass_kg"] == float(facts["mass_kg"])
        assert table["title"] == f"{read.title}, vehicle {draft.vehicle}"
        speed = float(facts["speed_m_per_s"])
        if speed:
            said = table["entry"]["speed_km_per_h"]
            assert said == pytest.approx(speed * 3.6, rel=1e-9)
        else:
            assert table["entry"]["kind"] == "standstill"
        assert {a.key for a in draft.asked} <= ONLY_A_PERSON_KNOWS


def test_every_channel_is_used_or_left_out_with_its_reason(written, drafts):
    _, record, _, _ = written
    for draft in drafts:
        used = re.findall(r'[xyz] = "([^"]+)"', draft.text)
        left = {name: s.why for s in draft.left_out for name in s.names}
        own = [c for c in record.channels if c.vehicle == draft.vehicle]
        assert sorted([*used, *left]) == sorted(c.name for c in own)
        for channel in own:
            if channel.name in left:
                assert left[channel.name] == f"it moves with the {channel.body}"


def test_the_cases_hold_what_the_points_felt(written, drafts):
    test, _, _, folder = written
    for draft, vehicle in zip(drafts, TESTS[test], strict=True):
        lines = [
            re.sub(r'"\?"', '"said"' if line.startswith("because") else "1.0", line)
            if re.match(r'\w+ = .*"\?"', line)
            else line
            for line in draft.text.splitlines()
        ]
        path = folder / f"case-{draft.vehicle}.toml"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        spec = CaseSpec.read(path)
        points = [at for at in vehicle[0] if at.body == "vehicle"]
        for unit, at in zip(spec.units, points, strict=True):
            (part,) = unit.accelerometers
            triad = triad_of_channels(
                read_crash_record(folder / part.path), part.channels, quantity="acceleration",
                unit=part.unit,
            )  # fmt: skip
            np.testing.assert_array_equal(triad.index, TIME)
            np.testing.assert_array_equal(triad.to_numpy(), felt(vehicle[3], at.position))


def test_one_case_of_two_vehicles_is_refused():
    with pytest.raises(ConfigError, check=coded("crash.records-of-several-vehicles")):
        draft_case([recorded("car to car", "nhtsa")])


def commented(record, comment):
    """The record with a comment for each channel in place of its position."""
    texts = [comment(c) for c in record.channels]
    return replace(
        record,
        channels=tuple(
            replace(c, place=text) for c, text in zip(record.channels, texts, strict=True)
        ),
    )


@pytest.mark.parametrize(
    "comment",
    [
        lambda c: "NO COMMENTS",
        lambda c: "NA",
        lambda c: f"MFG: ENDEVCO SN: P7{c.name}",
        lambda c: "REAR FLOOR",
    ],
    ids=["none", "not applicable", "serial numbers", "one for all"],
)
def test_comments_that_name_no_position_make_no_points(comment, tmp_path):
    record = recorded("car to car", "nhtsa")
    write_nhtsa(tmp_path, commented(record, comment))
    drafts = draft_cases([read_crash_record(tmp_path)], folder=tmp_path)
    found = [[u["name"] for u in tomllib.loads(d.text)["units"]] for d in drafts]
    assert found == [rigid(vehicle) for vehicle in TESTS["car to car"]]


def test_comments_tell_two_points_of_one_code_apart(tmp_path):
    record = recorded("car to car", "nhtsa")
    channels = tuple(
        replace(c, point="FLLR", place="LEFT SEAT MOUNT" if c.point == "FLRR" else c.place.upper())
        if c.vehicle == "1" and c.point in ("FLLR", "FLRR")
        else c
        for c in record.channels
    )
    write_nhtsa(tmp_path, replace(record, channels=channels))
    first, _ = draft_cases([read_crash_record(tmp_path)], folder=tmp_path)
    table = tomllib.loads(first.text)
    assert [(u["name"], u["accelerometers"][0]["channels"]) for u in table["units"]][:2] == [
        ("LEFT REAR FLOORPAN", {"x": "1", "y": "2", "z": "3"}),
        ("LEFT SEAT MOUNT", {"x": "4", "y": "5", "z": "6"}),
    ]


def test_a_second_sensor_that_nothing_tells_apart_is_left_out_by_name(tmp_path):
    record = recorded("car to car", "nhtsa")
    channels = tuple(
        replace(c, point="FLLR", place="NO COMMENTS") if c.point == "FLRR" else c
        for c in record.channels
    )
    write_nhtsa(tmp_path, replace(record, channels=channels))
    first, _ = draft_cases([read_crash_record(tmp_path)], folder=tmp_path)
    (why,) = [s.why for s in first.left_out if s.names == ("4", "5", "6")]
    assert "not distinguished from the first" in why


def test_an_unknown_code_is_a_point_and_it_is_said(tmp_path):
    record = recorded("car to car", "nhtsa")
    channels = tuple(
        replace(c, point=c.point.replace("VECG", "ZZZZ"), place="") for c in record.channels
    )
    write_nhtsa(tmp_path, replace(record, channels=channels))
    read = read_crash_record(tmp_path)
    (finding,) = read.findings
    assert (finding.code, finding.severity) == ("io.location-code-unknown", "note")
    assert finding.data["word"] == "ZZZZ"
    first, _ = draft_cases([read], folder=tmp_path)
    assert [u["name"] for u in tomllib.loads(first.text)["units"]][-1] == "ZZZZ"


def of_one(record, change):
    """The first vehicle of a record, its channels changed."""
    return replace(record, channels=tuple(change(c) for c in record.channels if c.vehicle == "1"))


def test_a_record_of_moving_parts_alone_is_no_case():
    record = recorded("car to car", "nhtsa")
    moving = tuple(c for c in record.channels if c.body != "vehicle")
    with pytest.raises(DataError, check=coded("crash.no-accelerometer-on-structure")) as caught:
        draft_cases([replace(record, channels=moving)])
    assert "it moves with the engine" in str(caught.value)


def test_points_stay_two_under_one_name():
    record = of_one(
        recorded("car to car", "nhtsa"),
        lambda c: replace(c, place="floor") if c.point in ("FLLR", "FLRR") else c,
    )
    (draft,) = draft_cases([record])
    units = {
        u["name"]: u["accelerometers"][0]["channels"] for u in tomllib.loads(draft.text)["units"]
    }
    assert units["floor"] == {"x": "1", "y": "2", "z": "3"}
    assert units["floor 2"] == {"x": "4", "y": "5", "z": "6"}


def test_a_point_that_is_clipped_is_no_low_range_of_another():
    def clipped(c):
        time, values = c.load()
        limit = 0.4 * np.abs(values).max()
        return replace(c, load=lambda: (time, np.clip(values, -limit, limit)))

    record = of_one(
        recorded("car to car", "nhtsa"), lambda c: clipped(c) if c.point == "FLLR" else c
    )
    (draft,) = draft_cases([record])
    units = tomllib.loads(draft.text)["units"]
    assert [len(u["accelerometers"]) for u in units] == [1, 1, 1]


def test_a_gyro_belongs_to_its_point_and_is_lent_to_the_others():
    record = recorded("car to car", "nhtsa")
    gyros = tuple(
        replace(c, name=f"g{c.axis}", quantity="rate", unit="rad/s", full_scale=None)
        for c in record.channels
        if c.point == "VECG"
    )
    whole = replace(record, channels=(*record.channels, *gyros))
    first, second = (tomllib.loads(d.text)["units"] for d in draft_cases([whole]))
    center = "vehicle center of gravity"
    assert {u["name"]: u.get("gyro_from") for u in first} == {
        "left rear floorpan": center,
        "right rear floorpan": center,
        center: None,
    }
    # That of another vehicle is of no use.
    assert all("gyro_from" not in u and "gyro" not in u for u in second)


def test_a_fixed_barrier_is_no_vehicle(tmp_path):
    record = recorded("car to car", "nhtsa")
    channels = tuple(
        replace(c, vehicle="", body="barrier") if c.vehicle == "2" and c.body == "vehicle" else c
        for c in record.channels
        if c.vehicle == "1" or c.body == "vehicle"
    )
    cars = {"1": record.vehicles["1"]}
    write_nhtsa(tmp_path, replace(record, channels=channels, vehicles=cars))
    read = read_crash_record(tmp_path)
    assert {(c.vehicle, c.body) for c in read.channels if c.vehicle != "1"} == {("", "barrier")}
    (only,) = draft_cases([read], folder=tmp_path)
    assert any(s.why == "it is fixed to the barrier" for s in only.left_out)


def test_records_of_one_number_are_of_one_vehicle_unless_they_name_two(tmp_path):
    record = recorded("car to car", "mme")
    own = [c for c in record.channels if c.vehicle == "1"]
    halves = [
        replace(record, channels=tuple(c for c in own if (c.point == "0VEHCCG0000") == second))
        for second in (False, True)
    ]
    for name, other in (("Car A, 2018", 1), ("Car C", 2)):
        car = {"1": {**record.vehicles["1"], "vehicle": name}}
        paths = [tmp_path / name / part for part in "ab"]
        write_mme(paths[0], replace(halves[0], vehicles={"1": record.vehicles["1"]}))
        write_mme(paths[1], replace(halves[1], vehicles=car))
        drafts = draft_cases([read_crash_record(p) for p in paths], folder=tmp_path)
        assert [d.vehicle for d in drafts] == ["1", "2"][:other]
        assert drafts[-1].name == name


def test_a_table_beside_two_vehicles_is_left_out_with_its_reason(tmp_path):
    record = recorded("car to car", "mme")
    write_mme(tmp_path / "test", record)
    force = felt((-9.0, 0.0, 0.0), (0.0, 0.0, 0.0)) + np.array([0.0, 0.0, -9.80665])
    rows = np.column_stack([TIME + 1.0, force])
    np.savetxt(tmp_path / "box.csv", rows, fmt="%.6f", delimiter=",",
               header="t [s],ax [m/s2],ay [m/s2],az [m/s2]", comments="")  # fmt: skip
    records = [read_crash_record(tmp_path / name) for name in ("test", "box.csv")]
    drafts = draft_cases(records, folder=tmp_path)
    for draft in drafts:
        assert "nothing says which of the vehicles" in "".join(s.why for s in draft.left_out)
    # With one vehicle it is of that one.
    one = replace(records[0], channels=tuple(c for c in records[0].channels if c.vehicle == "1"))
    (only,) = draft_cases([one, records[1]], folder=tmp_path)
    assert "box" in {u["name"] for u in tomllib.loads(only.text)["units"]}


def test_what_the_layout_of_nhtsa_cannot_hold_is_refused(tmp_path):
    record = recorded("car to car", "nhtsa")
    one = record.channels[0]
    for channel, code in (
        (replace(one, body="gearbox", point=""), "io.part-without-location-code"),
        (replace(one, load=lambda: (TIME**3, TIME)), "io.stamps-not-even"),
        (replace(one, load=lambda: (TIME, TIME * np.nan)), "io.not-finite-number"),
    ):
        with pytest.raises(DataError, check=coded(code)):
            write_nhtsa(tmp_path, replace(record, channels=(channel,)))
