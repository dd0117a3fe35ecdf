"""A case drafted from records of unknown layout, against what the simulation put into them."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.coded import coded

from strapdown import rotation
from strapdown.config.crash_case import CaseSpec
from strapdown.crash.template import draft_case, read_records
from strapdown.errors import ConfigError, DataError
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_triad import triad_of_channels
from strapdown.simulation.crash_motion import find_crash
from strapdown.simulation.crash_recording import paper_units, record_crash

G = 9.80665
UP = (180.0, 0.0, 0.0)
# As a user who knows answers; other questions are zero.
ANSWERS = {
    "title": '"Pole"',
    "source": '"light barrier"',
    "because": '"centric"',
    "mass_kg": "1300.0",
    "speed_km_per_h": "25.56",
    "speed_sd_km_per_h": "0.36",
    "turn_sd_deg": "3.0",
    "delta_v_sd_m_per_s": "1.0",
    "rate_hz": "200.0",
    "time_unit": '"ms"',
    "unit": '"g"',
}


def record(name, unit, seed=3):
    crash = find_crash(name)
    design = next(u for u in paper_units() if u.name == unit)
    return record_crash(crash.motion, design, impact=crash.start, seed=seed)[0]


@pytest.fixture(scope="module")
def pole():
    return {unit: record("pole", unit) for unit in ("IMU1", "IMU2", "LAB1")}


def tables(unit, angles=(0.0, 0.0, 0.0)):
    """Stamps, and the triads as sensors would read that are turned so."""
    C = rotation.dcm_from_euler(angles)
    parts = [*unit.accelerometers, *([unit.gyro] if unit.gyro else [])]
    index = parts[0].table.index.to_numpy()
    return index, [p.table.to_numpy() @ C for p in parts]


def write(path: Path, header: str, columns, *, fmt="%.4f", sep=",", comma=False):
    """A text table; `comma` for a decimal comma."""
    rows = [sep.join((fmt % x).replace(".", "," if comma else ".") for x in r) for r in columns]
    text = "\n".join([header, *rows] if header else rows) + "\n"
    path.write_text(text, encoding="utf-8")
    return path


def drafted(folder, *paths):
    draft = draft_case(read_records(paths), folder=folder)
    return draft, tomllib.loads(draft.text)


def filled(draft, folder):
    """Answer every question, by its key, and read the case."""
    lines = draft.text.splitlines()
    for k, line in enumerate(lines):
        if match := re.match(r'(\w+) = .*"\?"', line):
            answer = ANSWERS.get(match[1], "0.0")
            lines[k] = line.partition("  #")[0].replace('"?"', answer)
    path = folder / "case.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return CaseSpec.read(path)


def triad(spec, quantity):
    return triad_of_channels(
        read_crash_record(spec.path),
        spec.channels,
        quantity=quantity,
        unit=spec.unit,
        time=spec.time,
        time_unit=spec.time_unit,
        rate_hz=spec.rate_hz,
        sampling=spec.sampling,
    )


@pytest.fixture(scope="module")
def german(pole, tmp_path_factory):
    """Semicolons, decimal comma, German headings, z up, in g."""
    time, (low, high, gyro) = tables(pole["IMU1"], UP)
    heads = ["Zeit [s]"]
    heads += [
        f"{w} {a} [{u}]" for w, u in (("Beschl. ND", "g"), ("Beschl. HD", "g")) for a in "XYZ"
    ]
    heads += [f"Drehrate {a} [°/s]" for a in "XYZ"]
    values = np.column_stack([time, low / G, high / G, np.degrees(gyro)])
    folder = tmp_path_factory.mktemp("german")
    return write(folder / "Messung links.csv", ";".join(heads), values, sep=";", comma=True)


@pytest.fixture(scope="module")
def bare(pole, tmp_path_factory):
    """No heading at all; ms; 10 kHz."""
    unit = pole["LAB1"]
    table = unit.accelerometers[0].table
    near = (table.index > unit.trigger - 0.5) & (table.index < unit.trigger + 0.7)
    values = np.column_stack([table.index[near] * 1e3, table.to_numpy()[near]])
    return write(tmp_path_factory.mktemp("bare") / "data0042.txt", "", values)


@pytest.fixture(scope="module")
def cryptic(pole, tmp_path_factory):
    """A count, µs, whole mg, deg/s, a temperature; z up."""
    time, (low, high, gyro) = tables(pole["IMU2"], UP)
    drift = 23.5 + np.round(np.cumsum(np.random.default_rng(1).normal(0.0, 3e-3, time.size)), 1)
    count, stamps = np.arange(time.size), np.round(time * 1e6)
    whole = np.round(np.column_stack([low, high]) / G * 1e3)
    values = np.column_stack([count, stamps, whole, np.degrees(gyro), drift])
    head = "n,ts,a0,a1,a2,b0,b1,b2,r0,r1,r2,tmp"
    path = tmp_path_factory.mktemp("cryptic") / "DL_R.CSV"
    return write(path, head, values, fmt="%.10g")


@pytest.fixture(scope="module")
def three(german, bare, cryptic, tmp_path_factory):
    folder = tmp_path_factory.mktemp("case")
    draft, table = drafted(folder, german, bare, cryptic)
    return folder, draft, table


@pytest.mark.slow
def test_three_files_are_three_units(three):
    _, _, table = three
    units = {u["name"]: u for u in table["units"]}
    assert list(units) == ["Messung links", "data0042", "DL_R"]
    assert [len(u["accelerometers"]) for u in units.values()] == [2, 1, 2]
    assert ["gyro" in u for u in units.values()] == [True, False, True]
    assert units["data0042"]["gyro_from"] == "Messung links"
    assert table["options"]["clock"] == "correlation"


def test_columns_axes_and_units_are_found(three):
    _, _, table = three
    german, bare, cryptic = table["units"]
    low, high = german["accelerometers"]
    assert low["channels"] == {a: f"Beschl. ND {a.upper()} [g]" for a in "xyz"}
    assert high["channels"]["z"] == "Beschl. HD Z [g]"
    assert german["gyro"]["unit"] == "deg/s"
    assert bare["accelerometers"][0]["channels"] == {
        "x": "column 2",
        "y": "column 3",
        "z": "column 4",
    }
    assert (bare["accelerometers"][0]["time_unit"], bare["accelerometers"][0]["unit"]) == (
        "ms",
        "m/s2",
    )
    assert [p["unit"] for p in cryptic["accelerometers"]] == ["mg", "mg"]
    assert (cryptic["gyro"]["unit"], cryptic["gyro"]["time_unit"]) == ("deg/s", "us")
    assert (cryptic["gyro"]["time"], cryptic["gyro"]["channels"]["x"]) == ("ts", "r0")


def test_mounting_and_range_are_found(three):
    _, draft, table = three
    assert [u["angles_deg"] for u in table["units"]] == [
        [180.0, 0.0, "?"],
        [0.0, 0.0, "?"],
        [180.0, 0.0, "?"],
    ]
    # ±2 g is reached, and one part of the catalogue has it.
    assert table["units"][0]["accelerometers"][0]["sensor"] == "lis302dlh"
    assert "it stood at the end of its range" in draft.text


def test_the_trigger_is_within_the_interval_that_time_zero_begins(three, pole):
    _, _, table = three
    for unit, name in zip(table["units"], ("IMU1", "LAB1", "IMU2"), strict=True):
        # Time zero is the first point of an interval of 20 ms in which 0.8 km/h are lost: of a
        # blow of 15 g that takes 5 ms, so that it is up to 20 ms before the contact and hardly
        # after it.
        assert -0.020 <= unit["trigger_s"] - pole[name].trigger <= 0.010


def test_what_is_left_out_is_said(three):
    _, draft, _ = three
    assert "column 'n': a count of samples" in draft.text
    assert "column 'tmp': its heading names something else" in draft.text


def test_only_what_a_person_knows_is_asked(three):
    _, draft, _ = three
    keys = [a.key for a in draft.asked]
    assert keys == [
        *("title", "mass_kg", "speed_km_per_h", "speed_sd_km_per_h", "source"),
        *("position_m", "angles_deg") * 3,
    ]
    lines = draft.text.splitlines()
    assert all(lines[a.line - 1].startswith(f"{a.key} = ") for a in draft.asked)


def test_the_filled_case_reads_the_records_as_they_were_written(three, pole):
    folder, draft, _ = three
    spec = filled(draft, folder)
    assert spec.entry.speed_m_per_s == pytest.approx(7.1)
    # Texts of 0.0001 g (0.00005 g of rounding), 0.001 m/s² and 1 mg; the last deg/s in full.
    for unit, name, rounding in zip(
        spec.units, ("IMU1", "LAB1", "IMU2"), (5e-4, 1e-3, 5e-3), strict=True
    ):
        C_vs = rotation.dcm_from_euler(unit.angles_deg)
        for got, was in zip(unit.accelerometers, pole[name].accelerometers, strict=True):
            table = triad(got, "acceleration")
            there = was.table.to_numpy()
            there = there[np.isin(np.round(was.table.index, 5), np.round(table.index, 5))]
            assert len(there) == len(table)
            np.testing.assert_allclose(table.to_numpy() @ C_vs.T, there, atol=1.01 * rounding)
        if unit.gyro is not None:
            table = triad(unit.gyro, "rate")
            C = table.to_numpy() @ C_vs.T
            np.testing.assert_allclose(C, pole[name].gyro.table.to_numpy(), atol=2e-6)


def test_files_of_one_recorder_are_put_together(pole, tmp_path):
    time, parts = tables(pole["IMU1"])
    heads = {"low": "t,ax,ay,az", "high": "t,ax,ay,az", "gyro": "t,wx,wy,wz"}
    files = [
        write(tmp_path / f"imu1_{k}.csv", head, np.column_stack([time, values]))
        for (k, head), values in zip(heads.items(), parts, strict=True)
    ]
    _, table = drafted(tmp_path, *files)
    (unit,) = table["units"]
    assert unit["name"] == "imu1"
    assert [p["path"] for p in unit["accelerometers"]] == ["imu1_low.csv", "imu1_high.csv"]
    assert unit["gyro"]["unit"] == "rad/s"


def test_a_gyro_of_another_clock_is_left_out(pole, tmp_path):
    time, (low, _, gyro) = tables(pole["IMU1"])
    one = write(tmp_path / "acc.csv", "t,ax,ay,az", np.column_stack([time, low]))
    two = write(tmp_path / "gyr.csv", "t,wx,wy,wz", np.column_stack([time + 1.0, gyro]))
    draft, table = drafted(tmp_path, one, two)
    assert "gyro" not in table["units"][0]
    assert "its clock fits no accelerometer" in " ".join(draft.text.split("\n# "))


@pytest.mark.parametrize(
    ("angles", "front"),
    [((0.0, 0.0, 90.0), 90), ((90.0, 0.0, 0.0), 0), ((0.0, -90.0, -90.0), -90)],
)
def test_a_heading_that_nothing_tells_is_asked_with_what_each_would_mean(
    pole, tmp_path, angles, front
):
    time, (low, high, gyro) = tables(pole["IMU1"], angles)
    head = "t_s,lo_ax,lo_ay,lo_az,hi_ax,hi_ay,hi_az,wx,wy,wz"
    path = write(tmp_path / "r.csv", head, np.column_stack([time, low, high, gyro]))
    draft, table = drafted(tmp_path, path)
    assert table["units"][0]["angles_deg"] == [*angles[:2], "?"]
    (asked,) = [a for a in draft.asked if a.key == "angles_deg"]
    said = asked.what.replace("deg: ", ", ")
    assert re.search(rf", {front}( \(its x [a-z ]+\))? makes it an impact from the front", said)


def test_a_gyro_whose_rest_is_as_long_as_gravity_stays_a_gyro(pole, tmp_path):
    time, (low, _, gyro) = tables(pole["IMU1"])
    rates = np.degrees(gyro)
    rates += np.array([0.0, 0.0, 9.8]) - rates[:200].mean(axis=0)
    path = write(tmp_path / "all.txt", "", np.column_stack([time, low, rates]), sep=" ")
    _, table = drafted(tmp_path, path)
    (unit,) = table["units"]
    assert unit["gyro"]["channels"]["x"] == "column 5"
    assert unit["gyro"]["unit"] == "deg/s"


def test_a_heading_of_one_letter_is_told_by_its_numbers(pole, tmp_path):
    time, (low, _, _) = tables(pole["IMU1"])
    path = write(tmp_path / "r.csv", "t,gx,gy,gz", np.column_stack([time, low / G]))
    draft, _ = drafted(tmp_path, path)
    spec = filled(draft, tmp_path)
    # Written in steps of 0.0001 g.
    read = triad(spec.units[0].accelerometers[0], "acceleration")
    np.testing.assert_allclose(read.to_numpy(), low, atol=5.01e-5 * G)


def test_without_time_the_rate_is_asked(pole, tmp_path):
    unit = pole["IMU1"]
    _, (low, _, gyro) = tables(unit)
    head = "Sample,AX,AY,AZ,WX,WY,WZ"
    values = np.column_stack([np.arange(len(low)), low / G, gyro])
    path = write(tmp_path / "count.csv", head, values, fmt="%.5g")
    draft, table = drafted(tmp_path, path)
    (of,) = table["units"]
    part = of["accelerometers"][0]
    assert (part["rate_hz"], of["trigger_s"], part["unit"]) == ("?", "?", "g")
    assert "time" not in part
    # Of 200 Hz; the end of the range hides the beginning by some samples.
    near = (unit.trigger - unit.accelerometers[0].table.index[0]) * 200.0
    said = int(re.search(r"begins at sample (\d+)", " ".join(draft.text.split("\n# ")))[1])
    assert abs(said - near) < 30
    filled(draft, tmp_path)


def test_without_a_crash_it_says_how_near_it_came(tmp_path):
    unit = record("hard-braking", "IMU1", seed=4)
    time, (low, high, gyro) = tables(unit)
    head = "t_s,lo_ax,lo_ay,lo_az,hi_ax,hi_ay,hi_az,wx,wy,wz"
    path = write(tmp_path / "r.csv", head, np.column_stack([time, low, high, gyro]))
    draft, table = drafted(tmp_path, path)
    assert table["units"][0]["trigger_s"] == "?"
    (told,) = draft.found
    # Braking: below 1 g over 150 ms, that is 5.3 km/h.
    said = float(re.search(r"no crash found: ([\d.]+) km/h within 150 ms", told)[1])
    assert 3.0 < said < 8.0


def test_without_a_unit_no_crash_is_not_said(tmp_path):
    """In g it is one: the terminal said that none was found, in m/s²."""
    time = np.arange(-0.05, 0.2, 0.001)
    force = np.where((time > 0) & (time < 0.1), -25.0 * np.sin(np.pi * time / 0.1), 0.0)
    values = np.column_stack([time, force, 0.1 * force, 0.0 * force])
    draft, table = drafted(tmp_path, write(tmp_path / "r.csv", "t,ax,ay,az", values))
    assert table["units"][0]["accelerometers"][0]["unit"] == "?"
    (told,) = draft.found
    assert "no crash" not in told
    assert '"g" makes a peak of' in told


def test_a_table_of_an_event_data_recorder(tmp_path):
    time = np.arange(0.0, 0.251, 0.01)
    s = np.clip(time / 0.1, 0.0, 1.0)
    change = np.round(-25.9 * s**2 * (3.0 - 2.0 * s))
    head = "Time (msec),Delta-V Longitudinal (km/h),Delta-V Lateral (km/h)"
    values = np.column_stack([1e3 * time, change, np.round(0.05 * change)])
    path = write(tmp_path / "edr.csv", head, values, fmt="%.0f")
    draft, table = drafted(tmp_path, path)
    (unit,) = table["units"]
    assert unit["trigger_s"] == 0.0
    assert unit["assumed"] == {"turn_sd_deg": "?", "delta_v_sd_m_per_s": "?", "because": "?"}
    # Delta-V counts from time zero, and so does the path.
    assert table["entry"]["time_s"] == 0.0
    assert table["options"]["sampling"] == "mean"
    # The last whole km/h of the forward change, with 1 km/h of the lateral.
    assert "26 km/h" in draft.found[0]
    spec = filled(draft, tmp_path)
    table = triad(spec.units[0].accelerometers[0], "acceleration")
    assert table["accel_x"].sum() * 0.01 == pytest.approx(-26.0 / 3.6, rel=1e-9)


def test_a_gyro_about_the_vertical_alone_leaves_the_other_turns_to_the_user(pole, tmp_path):
    time, (low, _, gyro) = tables(pole["IMU1"])
    path = write(
        tmp_path / "yaw.csv",
        "t [s],ax [m/s2],ay [m/s2],az [m/s2],yaw rate [deg/s]",
        np.column_stack([time, low, np.degrees(gyro[:, 2])]),
    )
    draft, table = drafted(tmp_path, path)
    (unit,) = table["units"]
    assert set(unit["gyro"]["channels"]) == {"z"}
    assert unit["assumed"] == {"turn_sd_deg": "?", "because": "?"}
    assert filled(draft, tmp_path).units[0].assumed.turn_sd_deg == 3.0


def test_the_crash_test_of_nhtsa(recordings, tmp_path):
    draft, table = drafted(tmp_path, recordings("crash_nhtsa_10146"))
    assert table["vehicle"]["mass_kg"] == 1719.0
    assert table["entry"]["speed_km_per_h"] == pytest.approx(57.09)
    # Of the first touch, which is zero of the record; it begins 50 ms before.
    assert table["entry"]["time_s"] == 0.0
    left, right = table["units"]
    assert left["name"] == "LEFT REAR SEAT CROSSMEMBER"
    assert [u["accelerometers"][0]["channels"] for u in (left, right)] == [
        {"x": "93", "z": "97"},
        {"x": "94", "z": "98"},
    ]
    assert left["trigger_s"] == 0.0
    # Zeroed before the impact: all of the rest is bias, and the floor rings.
    assert left["rest_s"] == [-0.05, -0.005]
    assert left["accelerometers"][0]["uncertainty"]["bias_sd_mg"] > 1000.0
    assert (table["options"]["rate_hz"], table["options"]["sampling"]) == (1000.0, "mean")
    assert left["assumed"]["delta_v_sd_m_per_s"] == "?"
    flat = " ".join(draft.text.split("\n# "))
    assert "channels 99: redundant at 'LEFT REAR SEAT CROSSMEMBER'" in flat
    assert "channels 95, 96: it moves with the engine" in flat
    spec = filled(draft, tmp_path)
    accel = triad(spec.units[0].accelerometers[0], "acceleration")["accel_x"]
    # The folder's notes: 18.35 m/s of channel 93 at 115 ms.
    lost = -np.trapezoid(accel[(accel.index >= 0.0) & (accel.index <= 0.115)], dx=1e-4)
    assert lost == pytest.approx(18.35, abs=0.05)


def test_one_record_named_twice_is_refused(german):
    with pytest.raises(
        ConfigError,
        check=coded("crash.record-named-twice", quantity="RECORD", file="Messung links.csv"),
    ):
        read_records([german, german.parent / "." / german.name])


@pytest.mark.parametrize(
    ("text", "what", "row"),
    [
        ("t,ax,ay,az\n0,1,2,3\n", "1 sample is too few for a crash", None),
        ("t,temp\n" + "".join(f"0.{k:03},21.{k}\n" for k in range(50)), "no accelerometer", None),
        ("t,ax,ay,az\n" + "".join(f"{k},0,0,0\n" for k in range(50)), "they are constant", None),
        (
            "t,ax,ay,az\n"
            + "".join(f"{0.01 * (k if k != 30 else 5):.2f},1,{k},9.8\n" for k in range(50)),
            "time decreases from 0.29 to 0.05",
            32,
        ),
        (
            # Stamps of ten digits, twice the same.
            "t_ns,ax,ay,az\n"
            + "".join(f"{1495000000 + 5000000 * (k - (k > 30))},1,{k},9.8\n" for k in range(50)),
            "time does not increase at",
            33,
        ),
        (
            "t,ax,ay,az\n"
            + "".join(f"0.{k:03},1,{k if k != 7 else 'ERR'},9.8\n" for k in range(50)),
            "'ERR' is not a number",
            9,
        ),
    ],
)
def test_what_cannot_be_a_case_is_refused(tmp_path, text, what, row):
    path = tmp_path / "r.csv"
    path.write_text(text)
    with pytest.raises(DataError) as caught:
        drafted(tmp_path, path)
    finding = caught.value.finding
    assert what in finding.what
    assert (finding.file, finding.row) == ("r.csv", row)
    assert finding.remedy


def column(name, values, quantity="other", unit=""):
    return CrashChannel(
        name, quantity, "", unit, lambda: (np.arange(values.size), values), samples=lambda: values
    )


names = st.lists(
    st.text(st.characters(exclude_categories=("Cs",)), min_size=1, max_size=30),
    min_size=4,
    max_size=4,
    unique=True,
)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(names, st.text(max_size=40), st.text(max_size=40))
def test_hostile_text_of_a_record_stays_text(names, title, fact):
    rng = np.random.default_rng(0)
    time = np.arange(200) * 0.005
    pulse = np.where((time > 0.5) & (time < 0.6), -100.0, 0.0)
    values = [time, pulse, np.zeros(200), np.full(200, -G)]
    values = [v if k == 0 else v + rng.normal(0.0, 0.05, 200) for k, v in enumerate(values)]
    channels = tuple(column(n, v) for n, v in zip(names, values, strict=True))
    hostile = CrashRecord(
        Path("r.csv"), "table", title, {"vehicle": fact, "test": fact}, channels, (), ()
    )
    try:
        draft = draft_case([hostile])
    except DataError:
        # Some names say that a column holds something else.
        return
    table = tomllib.loads(draft.text)
    assert table["vehicle"]["name"] == fact
    used = [n for u in table["units"] for p in u["accelerometers"] for n in p["channels"].values()]
    # A minus before a name turns its axis.
    assert all(n in names or n[1:] in names for n in used)


def test_a_draft_is_the_same_every_time(german):
    first, _ = drafted(german.parent, german)
    second, _ = drafted(german.parent, german)
    assert first.text == second.text


def test_the_path_is_named_from_the_folder_of_the_case(german, tmp_path):
    _, table = drafted(german.parent / "sub", german)
    assert table["units"][0]["gyro"]["path"] == "../Messung links.csv"


def test_samples_of_the_two_ranges_say_why_they_are_one(three):
    _, draft, _ = three
    flat = " ".join(draft.text.split("\n# "))
    assert "are low and high range of one recorder" in flat and "the first ends at 2 g" in flat
    assert "If they are separate boxes: give each its own [[units]] table" in flat


def test_a_clock_of_1970_is_counted_from_midnight(pole, tmp_path):
    time, (low, _, _) = tables(pole["IMU1"])
    stamps = 1_710_000_000_000 + np.round((time - time[0]) * 1e3)
    path = write(
        tmp_path / "unix.csv", "timestamp,ax,ay,az", np.column_stack([stamps, low]), fmt="%.15g"
    )
    draft, table = drafted(tmp_path, path)
    (unit,) = table["units"]
    spec = filled(draft, tmp_path)
    read = triad(spec.units[0].accelerometers[0], "acceleration")
    assert isinstance(read, pd.DataFrame)
    # 1710000000 s are 57600 s after a midnight.
    assert read.index[0] == 57_600.0
    # On the clock of the case, as the table is read.
    assert abs(unit["trigger_s"] - 57_600.0 - (pole["IMU1"].trigger - time[0])) < 0.05


def test_records_are_not_changed(german):
    before = german.read_bytes()
    drafted(german.parent, german)
    assert german.read_bytes() == before
    assert replace(read_records([german])[0]).path == german
