"""Results compared: small sealed folders with known numbers, against what is known of them."""

from __future__ import annotations

import json
import math

import numpy as np
import pandas as pd
import pymap3d
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.bundle import MANIFEST, input_files, write_bundle, write_json, write_timing
from strapdown.errors import ConfigError, DataError
from strapdown.formats import csv
from strapdown.formats.writers import write_trajectory
from strapdown.report.compare_document import (
    compare_document,
    hidden_numbers,
    is_finer,
    numbers_block,
    options_block,
    shown_row,
)
from strapdown.report.compare_tracks import Track, differences
from strapdown.report.document_html import document_page
from strapdown.report.values import spaced
from strapdown.tables import trajectory_table

SPEC = {
    "name": "run",
    "title": "",
    "sensors": {"sensor": "hg1700", "states": ["gyro_bias"]},
    "aiding": {"gnss": {"kind": "gnss", "lever_arm_m": [0.0, 0.0, 0.0]}},
    "smoother": {"kind": "none"},
}


def sealed(folder, command="navigate", configuration=None, inputs=(), files=None, write=None):
    """A sealed folder of some command, with JSON files as they are given."""
    seals = []
    whole = {"name": folder.name, "navigation": SPEC} if configuration is None else configuration
    with write_bundle(
        folder, command=command, configuration=whole, inputs=inputs, seals=seals
    ) as staging:
        for name, content in ({"navigation.json": {}} if files is None else files).items():
            write_json(staging / name, content)
        if write is not None:
            write(staging)
    return seals[0]


def navigated(folder, **options):
    """A sealed navigation with some options changed."""
    return sealed(folder, configuration={"name": folder.name, "navigation": {**SPEC, **options}})


def state(lat=55.75, lon=37.62, alt=150.0, sd=1.0, time=10.0, **more):
    """The last state of a navigation; every standard deviation is `sd`."""
    names = {**dict.fromkeys(("north", "east", "down"), "m")}
    names |= dict.fromkeys(("VN", "VE", "VD"), "m_per_s")
    names |= dict.fromkeys(("roll", "pitch", "heading"), "deg")
    values = {"VN": 1.0, "VE": 0.0, "VD": 0.0, "roll": 0.0, "pitch": 0.0, "heading": 0.0, **more}
    own = {f"{n}_{u}": values[n] for n, u in names.items() if n in values}
    spread = {f"{n}_sd_{u}": sd for n, u in names.items()}
    place = {"lat_deg": lat, "lon_deg": lon, "alt_m": alt, "time_s": time}
    return {"end": {**place, **own, **spread, "horizontal_bound_95_m": 2.4477 * sd}}


def row(result, key):
    return next(one for one in result.numbers if one.key == key)


def test_only_options_that_differ_are_listed(tmp_path):
    navigated(tmp_path / "a")
    navigated(tmp_path / "b", title="", smoother={"kind": "rts"}, aiding={"gnss": {"kind": "gnss"}})
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    assert {r.key: r.values for r in result.options} == {
        "aiding.gnss.lever_arm_m": ([0.0, 0.0, 0.0], None),
        "smoother.kind": ("none", "rts"),
    }
    # title, sensor, states, kind of the measurement
    assert result.equal_options == 4
    assert [run.name for run in result.runs] == ["a", "b"]


def test_true_is_no_one_and_tables_of_a_list_are_matched_by_name(tmp_path):
    units = [{"name": "x", "on": 1}, {"name": "y", "on": 1}]
    for name, list_ in (("a", units), ("b", [units[1], {"name": "x", "on": True}])):
        sealed(tmp_path / name, "crash", {"case": {"units": list_}}, files={"crash.json": {}})
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    assert {r.key: r.values for r in result.options} == {
        "units[x].on": (1, True),
        "units, order": (["x", "y"], ["y", "x"]),
    }


@pytest.fixture
def logs(tmp_path):
    found = {}
    for name, text in (("one.csv", "1"), ("same.csv", "1"), ("two.csv", "2"), ("fix.csv", "3")):
        found[name] = tmp_path / name
        found[name].write_text(text)
    return found


def reads(folder, files, sensor="hg1700"):
    inputs = [input_files(role, str(path), (path,)) for role, path in files]
    spec = {"log": {"path": str(files[0][1])}, "sensors": {"sensor": str(sensor)}}
    sealed(folder, configuration={"name": folder.name, "navigation": spec}, inputs=inputs)


def test_inputs_are_compared_by_their_bytes(tmp_path, logs):
    reads(tmp_path / "a", [("log", logs["one.csv"]), ("fixes", logs["fix.csv"])])
    reads(tmp_path / "b", [("log", logs["same.csv"])])
    reads(tmp_path / "c", [("log", logs["two.csv"]), ("fixes", logs["fix.csv"])])
    result = sd.compare_runs(*(tmp_path / n for n in "abc"))
    assert {r.role: (r.status, r.same) for r in result.inputs} == {
        "log": (("first", "renamed", "changed"), False),
        "fixes": (("first", "missing", "same"), False),
    }
    # The path of an input is no option.
    assert not result.options
    log = next(r for r in result.inputs if r.role == "log")
    assert [f[0] for f in log.files] == ["one.csv", "same.csv", "two.csv"]


def test_several_inputs_of_a_role_are_paired_by_content_then_by_name(tmp_path, logs):
    other = tmp_path / "other"
    other.mkdir()
    (other / "two.csv").write_text("changed")
    reads(tmp_path / "a", [("log", logs["one.csv"]), ("log", logs["two.csv"])])
    reads(tmp_path / "b", [("log", other / "two.csv"), ("log", logs["same.csv"])])
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    assert [r.status for r in result.inputs] == [("first", "renamed"), ("first", "changed")]


def test_a_sensor_file_is_an_option_by_its_bytes(tmp_path, logs):
    mine = []
    for name, text in (("m.toml", "x"), ("n.toml", "x"), ("o.toml", "y")):
        path = tmp_path / name
        path.write_text(text)
        inputs = [input_files("sensor", str(path), (path,))]
        spec = {"sensors": {"sensor": str(path)}}
        sealed(tmp_path / name[0], configuration={"navigation": spec}, inputs=inputs)
        mine.append(tmp_path / name[0])
    assert not sd.compare_runs(mine[0], mine[1]).options
    (one,) = sd.compare_runs(mine[0], mine[2]).options
    assert one.key == "sensors.sensor"
    assert [value.split(" (sha256 ")[0] for value in one.values] == ["m.toml", "o.toml"]


# Numbers.


def test_a_difference_has_the_bound_of_independent_errors(tmp_path):
    sensors = {"gyro_bias_x": {"unit": "rad/s", "estimate": 2e-4, "sd": 3e-5}}
    other = {"gyro_bias_x": {"unit": "rad/s", "estimate": 1e-4, "sd": 4e-5}}
    sealed(tmp_path / "a", files={"navigation.json": {**state(sd=3.0), "sensors": sensors}})
    sealed(
        tmp_path / "b",
        files={"navigation.json": {**state(alt=161.0, sd=4.0, heading=359.0), "sensors": other}},
    )
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    bias, height = row(result, "sensors.gyro_bias_x"), row(result, "end.alt_m")
    assert bias.differences == (None, pytest.approx(-1e-4))
    assert bias.combined == (None, pytest.approx(1.959964 * 5e-5, rel=1e-6))
    # 1.96 * 5 = 9.8 < 11
    assert height.combined[1] == pytest.approx(1.959964 * 5.0, rel=1e-6)
    assert (height.differences[1], height.within) == (pytest.approx(11.0), (None, False))
    # 359 is one degree left of 0.
    heading = row(result, "end.heading_deg")
    assert (heading.differences[1], heading.within[1]) == (pytest.approx(-1.0), True)
    assert row(result, "end.VN_m_per_s").differences == (None, 0.0)
    assert "2 by more than their 95 % bound" in result.summary
    table = sd.compare_runs(tmp_path / "a", tmp_path / "b").to_pandas()
    assert table.loc["end.alt_m", "b difference"] == pytest.approx(11.0)
    assert table.loc["end.alt_m", "a high"] == pytest.approx(150.0 + 1.959964 * 3.0)
    assert not table.loc["end.alt_m", "b within"]


def test_what_differs_by_less_than_is_shown_is_counted_apart(tmp_path):
    """A height of 150.0 ± 5.9 m and one a millimeter above are printed alike."""
    for name, alt, heading in (("a", 150.0, 0.0), ("b", 150.001, 0.0), ("c", 150.001, 9.0)):
        one = state(alt=alt, sd=3.0, heading=heading)
        sealed(tmp_path / name, files={"navigation.json": one})
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    height = row(result, "end.alt_m")
    assert not height.same and is_finer(height, result.units)
    assert shown_row(height, result.units)["differences"][1] == "0.0"
    # The height, and the position that it is a part of.
    assert numbers_block(result, short=True) is None and hidden_numbers(result) == 2
    count = len(result.numbers)
    assert f"No number differs by as much as is shown; 2 of {count} by less." in result.summary
    result = sd.compare_runs(tmp_path / "a", tmp_path / "c")
    assert f"1 of {count} numbers differs" in result.summary
    assert "; 2 more by less than is shown." in result.summary
    assert not is_finer(row(result, "end.heading_deg"), result.units)


def test_a_row_is_shown_with_the_digits_of_its_bounds(tmp_path):
    """What the page of the studio and that of the comparison show alike."""
    first, other = state(sd=3.0, roll=-1.28e-10), state(lat=55.75001, alt=161.0, sd=4.0, roll=0.5)
    for name, one in (("a", first), ("b", other)):
        sealed(tmp_path / name, files={"navigation.json": one})
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")

    def shown(key):
        texts = shown_row(row(result, key), result.units)
        return {k: [spaced(x) for x in v] if isinstance(v, list) else v for k, v in texts.items()}

    assert shown("end.alt_m") == {
        "unit": "m",
        "bound_unit": "m",
        "values": ["150.0", "161.0"],
        "bounds": ["± 5.9", "± 7.8"],
        "differences": ["", "+11.0"],
        "combined": ["", "± 9.8"],
    }
    # Zero to rounding, with its bound.
    assert (shown("end.roll_deg")["values"], shown("end.roll_deg")["differences"][1]) == (
        ["0.0", "0.5"],
        "+0.5",
    )
    lat = shown("end.lat_deg")
    assert (lat["unit"], lat["bound_unit"], lat["bounds"]) == ("", "m", ["± 5.9", "± 7.8"])
    # A ten-millionth of a degree is a centimeter: a meter has six decimals.
    assert lat["values"] == ["55.750000°", "55.750010°"]
    # The same speed with a wider bound is not the same result; a wholly equal one is.
    assert shown("end.VN_m_per_s")["differences"][1] == "0.0"
    sealed(tmp_path / "c", files={"navigation.json": first})
    result = sd.compare_runs(tmp_path / "a", tmp_path / "c")
    assert shown("end.VN_m_per_s")["differences"][1] == "same"


@pytest.mark.parametrize("lon", [37.62, 179.999995])
def test_positions_differ_in_metres(tmp_path, lon):
    """Against another library; over the date line, too."""
    east = (lon + 2e-5 + 180.0) % 360.0 - 180.0
    sealed(tmp_path / "a", files={"navigation.json": state(lon=lon)})
    sealed(tmp_path / "b", files={"navigation.json": state(lat=55.75001, lon=east, sd=0.2)})
    e, n, _ = pymap3d.geodetic2enu(55.75001, east, 150.0, 55.75, lon, 150.0)
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    north, right = row(result, "end.lat_deg"), row(result, "end.lon_deg")
    assert (north.differences[1], north.difference_unit) == (pytest.approx(n, abs=1e-5), "m")
    assert right.differences[1] == pytest.approx(e, abs=1e-5)
    both = row(result, "end.horizontal_m")
    assert both.differences[1] == pytest.approx(math.hypot(n, e), abs=1e-5)
    assert both.combined[1] == pytest.approx(2.4477 * math.hypot(1.0, 0.2), rel=1e-6)


def test_states_of_different_instants_have_no_difference(tmp_path):
    sealed(tmp_path / "a", files={"navigation.json": state(time=10.0)})
    sealed(tmp_path / "b", files={"navigation.json": state(time=10.5, alt=999.0)})
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    assert row(result, "end.alt_m").differences == (None, None)
    assert row(result, "end.lat_deg").differences == (None, None)
    assert row(result, "end.time_s").differences == (None, pytest.approx(0.5))
    cells = {r[0]: r for r in numbers_block(result).rows}
    assert cells["height, m"][3] == "other instant"


def test_facing_sides_of_bounds_are_combined(tmp_path):
    def noise(value, low, high):
        term = {"value": value, "low": low, "high": high, "observable": True}
        return {"allan.json": {"channels": {"gyro_x": {"terms": {"N": term}}}}}

    spec = {"allan": {"target": "none"}}
    sealed(tmp_path / "a", "allan", spec, files=noise(10.0, 9.0, 13.0))
    sealed(tmp_path / "b", "allan", spec, files=noise(14.0, 10.0, 15.0))
    upward = row(sd.compare_runs(tmp_path / "a", tmp_path / "b"), "gyro_x.N")
    assert (upward.differences[1], upward.combined[1], upward.within[1]) == (4.0, 5.0, True)
    downward = row(sd.compare_runs(tmp_path / "b", tmp_path / "a"), "gyro_x.N")
    assert (downward.differences[1], downward.combined[1]) == (-4.0, 5.0)
    sealed(tmp_path / "c", "allan", spec, files=noise(5.0, 4.0, 6.0))
    # From 10 - 1 down to 5 + 1: root of 1 + 1.
    assert row(sd.compare_runs(tmp_path / "a", tmp_path / "c"), "gyro_x.N").combined[1] == (
        pytest.approx(math.sqrt(2.0))
    )


def test_errors_of_other_units_have_no_bound(tmp_path, logs):
    def run(name, log, bias):
        inputs = [input_files("log", str(logs[log]), (logs[log],))]
        one = {"gyro_bias_x": {"unit": "rad/s", "estimate": bias, "sd": 1e-6}}
        spec = {"navigation": {"log": {"path": str(logs[log])}}}
        data = {"navigation.json": {"sensors": one}}
        sealed(tmp_path / name, configuration=spec, inputs=inputs, files=data)

    run("a", "one.csv", 0.0)
    run("b", "two.csv", 1.0)
    run("c", "same.csv", 1.0)
    other = row(sd.compare_runs(tmp_path / "a", tmp_path / "b"), "sensors.gyro_bias_x")
    assert (other.differences[1], other.combined[1]) == (1.0, None)
    own = row(sd.compare_runs(tmp_path / "a", tmp_path / "c"), "sensors.gyro_bias_x")
    assert own.within[1] is False


def test_any_other_result_has_every_number_of_its_json(tmp_path):
    for name, depth in (("a", 1.0), ("b", 2.5)):
        named = [{"name": "x", "n": 1}, {"name": "y", "n": 2}]
        truth = {"depth_m": depth, "words": "x"}
        own = {"truth": truth, "list": [1, 2], "named": named if name == "a" else named[::-1]}
        data = {"scenario.json": own}
        sealed(tmp_path / name, "simulate", {"scenario": {"seed": 1}}, files=data)
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    depth = row(result, "truth.depth_m")
    assert (depth.any.unit, depth.differences[1]) == ("m", 1.5)
    same = [r.key for r in result.numbers if r.same]
    assert same == ["list[1]", "list[2]", "named[x].n", "named[y].n"]
    # Without a bound of any number there is no column for it.
    assert numbers_block(result).columns == ("", "a", "b", "difference")


def test_findings_that_one_run_has(tmp_path):
    def found(*codes):
        return [{"code": c, "severity": "warning", "sentence": f"says {c}"} for c in codes]

    trust = {"trust": {"verdict": "reserve", "against": found("x.a", "x.d")}}
    sealed(tmp_path / "a", files={"navigation.json": {"findings": found("x.a", "x.b", "x.b")}})
    sealed(tmp_path / "b", files={"navigation.json": {"findings": found("x.a"), **trust}})
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    assert {c.code: (c.counts, c.differs) for c in result.codes} == {
        "x.a": ((1, 1), False),
        "x.b": ((2, 0), True),
        "x.d": ((0, 1), True),
    }


def test_versions_and_times_are_compared(tmp_path):
    first, second = (navigated(tmp_path / name) for name in "ab")
    write_timing(first, {"reading": 1.5})
    write_timing(second, {"reading": 2.0, "writing": 0.25})
    path = tmp_path / "b" / MANIFEST
    manifest = json.loads(path.read_text())
    manifest["versions"]["numpy"] = "0.1"
    path.write_text(json.dumps(manifest))
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    assert [(c.name, c.values[1]) for c in result.conditions] == [("numpy", "0.1")]
    assert result.seconds == ({"reading": 1.5}, {"reading": 2.0, "writing": 0.25})
    assert not result.changed  # a manifest alone says nothing about itself


# Over time.


def straight(folder, name, *, north=0.0, rate=10.0, sd=1.0, heading=0.0, time=(0.0, 20.0)):
    """A sealed navigation due east along the equator at 10 m/s, shifted north by metres."""
    t = np.arange(time[0], time[1] + 0.5 / rate, 1.0 / rate)
    degrees = 360.0 / (2.0 * math.pi * 6378137.0)
    place = np.column_stack(
        [np.full_like(t, north / 110574.276), 10.0 * t * degrees, np.zeros_like(t)]
    )
    velocity = np.column_stack([np.zeros_like(t), np.full_like(t, 10.0), np.zeros_like(t)])
    euler = np.column_stack([np.zeros_like(t), np.zeros_like(t), np.full_like(t, heading)])
    table = trajectory_table(t, place, velocity, euler)
    spread = sd(t) if callable(sd) else np.full_like(t, sd)
    units = {**dict.fromkeys(("north", "east", "down"), "m")}
    units |= dict.fromkeys(("VN", "VE", "VD"), "m_s") | dict.fromkeys(
        ("roll", "pitch", "heading"), "deg"
    )

    def write(staging):
        write_trajectory(staging / "trajectory.csv", table, name="t")
        columns = {f"{n}_sd_{u}": spread for n, u in units.items()}
        csv.write(staging / "sd.csv", {"time_s": t, **columns}, {})

    data = {"navigation.json": {"ellipsoid": "wgs84"}}
    sealed(folder / name, configuration={"navigation": SPEC}, files=data, write=write)
    return folder / name


def test_a_constant_shift_over_time(tmp_path):
    """5 m to the north, heading from 359 to 1 degree; the bound holds in the second half."""
    first = straight(tmp_path, "a", heading=359.0, sd=0.0001)
    # 2.4477 * 3 = 7.3 > 5 after 10 s, 2.4477 * 1 = 2.4 < 5 before.
    other = straight(
        tmp_path, "b", north=5.0, heading=1.0, sd=lambda t: np.where(t > 10.0, 3.0, 1.0)
    )
    result = sd.compare_runs(first, other)
    (one,) = result.differences
    score = one.score("horizontal")
    assert score.rms == pytest.approx(5.0, abs=1e-3)
    assert (score.largest, score.last) == pytest.approx((5.0, 5.0), abs=1e-3)
    # The instant of 10 s counts for a step of 0.1 s, half of it beyond.
    assert score.share == pytest.approx(0.5, abs=0.006)
    assert score.bound == pytest.approx(2.447747 * math.sqrt(0.5 * (1.0 + 9.0)), rel=6e-3)
    heading = one.score("heading")
    assert (heading.rms, heading.last) == pytest.approx((2.0, 2.0), abs=1e-9)
    assert heading.share == pytest.approx(0.5, abs=0.006)  # 1.96 < 2 < 5.88
    assert one.score("VE").largest == pytest.approx(0.0, abs=1e-9)
    assert {n: u for n, _, u in one.place} == {"lat": "deg", "lon": "deg"}
    assert result.plot("plan").chart.panels[0].lines[0].name == "a"


def test_other_rates_and_spans_meet_on_the_common_time(tmp_path):
    first = straight(tmp_path, "a", rate=4.0, time=(0.0, 20.0))
    other = straight(tmp_path, "b", rate=10.0, time=(12.05, 30.05), north=2.0)
    (one,) = sd.compare_runs(first, other).differences
    assert (one.table.index[0], one.table.index[-1]) == pytest.approx((12.05, 19.95))
    # The interpolation of a straight line is exact; curvature of the equator over 0.25 s is not.
    assert one.score("horizontal").rms == pytest.approx(2.0, abs=1e-3)


def test_three_runs_are_compared_with_the_first(tmp_path):
    paths = [straight(tmp_path, n, north=m) for n, m in (("a", 0.0), ("b", 1.0), ("c", 3.0))]
    result = sd.compare_runs(*paths)
    assert [(d.run, round(d.score("horizontal").rms, 2)) for d in result.differences] == [
        (1, 1.0),
        (2, 3.0),
    ]
    page = document_page(compare_document(result, "out"))
    assert "b: Horizontal positions differ by" in page
    assert page.count("<figure") == 2


def test_no_common_time_and_other_ellipsoids_are_said(tmp_path):
    first = straight(tmp_path, "a")
    late = straight(tmp_path, "b", time=(100.0, 120.0))
    result = sd.compare_runs(first, late)
    assert not result.differences
    assert [f.code for f in result.findings] == ["compare.no-difference"]
    navigated(tmp_path / "c")
    result = sd.compare_runs(first, tmp_path / "c")
    assert [f.code for f in result.findings] == ["compare.track-not-read"]


def local(rate, **columns):
    """A track in the axes of a plane over a second; each quantity a number or a function of t."""
    t = np.arange(0.0, 1.0 + 0.5 / rate, 1.0 / rate)
    names = ("north", "east", "down", "VN", "VE", "VD", "roll", "pitch", "heading")

    def table(given, other):
        found = {n: given.get(n, other) for n in names}
        made = {n: v(t) if callable(v) else np.full_like(t, v) for n, v in found.items()}
        return pd.DataFrame(made, index=t)

    sds = {name.removesuffix("_sd"): v for name, v in columns.items() if name.endswith("_sd")}
    return Track("", "local", "over ground", table(columns, 0.0), table(sds, 1.0))


def test_the_horizontal_bound_is_that_of_the_ellipse():
    """3 m north, 4 m east; standard deviations of the difference 2 m and 1 m."""
    first = local(10.0, north_sd=1.2, east_sd=0.6)
    other = local(10.0, north=3.0, east=4.0, north_sd=1.6, east_sd=0.8)
    ((one,), _) = differences((first,), (other,), 1, "b")
    assert one.table["horizontal"].to_numpy() == pytest.approx(5.0)
    # At a distance of 2.4477 the ellipse is met, which these are beyond.
    distance = math.sqrt((3.0 / 2.0) ** 2 + (4.0 / 1.0) ** 2)
    assert one.table["horizontal_combined"].to_numpy() == pytest.approx(2.447747 / distance * 5.0)
    assert one.score("horizontal").share == 0.0
    assert one.table["horizontal_other"].to_numpy() == pytest.approx(2.447747 * 1.6)


def test_a_heading_through_north_is_interpolated_through_north():
    def heading(t):
        return (359.9 + 10.0 * t) % 360.0

    ((one,), _) = differences(
        (local(4.0, heading=heading),), (local(50.0, heading=heading),), 1, ""
    )
    assert np.abs(one.table["heading"]).max() < 1e-9


def test_a_covariance_holds_from_its_mark_on(tmp_path):
    """The first has a mark each second, of which the value says the second."""
    first = straight(tmp_path, "a", rate=1.0, sd=lambda t: 1.0 + t)
    other = straight(tmp_path, "b", rate=4.0)
    (one,) = sd.compare_runs(first, other).differences
    time = one.table.index.to_numpy()
    expected = 1.959964 * (1.0 + np.floor(time + 1e-9))
    assert one.table["VN_first"].to_numpy() == pytest.approx(expected, rel=1e-6)
    assert one.table["VN_other"].to_numpy() == pytest.approx(1.959964, rel=1e-6)


def turning(folder, name, rate, ahead=0.0):
    """A sealed comparison of algorithms: 20 deg/s about down, some degrees ahead."""
    t = np.arange(0.0, 5.0 + 0.5 / rate, 1.0 / rate)
    half = np.radians(0.5 * (20.0 * t + ahead))
    columns = {
        "rk4 q_w": np.cos(half),
        "rk4 q_x": 0.0 * t,
        "rk4 q_y": 0.0 * t,
        "rk4 q_z": np.sin(half),
    }
    sweep = [
        {"algorithm": "rk4", "meaning": m, "rate_hz": rate, "error_deg": e}
        for m, e in (("sum", 0.5), ("drop", 0.7))
    ]
    data = {"answer": {"verdict": "enough", "rate_hz": rate}, "sweep": sweep, "algorithms": []}
    sealed(
        folder / name,
        "attitude",
        {"source": {"rate_hz": rate}},
        files={"attitude.json": data},
        write=lambda staging: csv.write(staging / "attitude.csv", {"time_s": t, **columns}, {}),
    )
    return folder / name


def test_attitudes_at_two_rates(tmp_path):
    """Between samples the first turns at its constant rate: 2 degrees apart at every instant."""
    slow, fast = turning(tmp_path, "slow", 7.0), turning(tmp_path, "fast", 50.0, ahead=2.0)
    result = sd.compare_runs(slow, fast)
    (one,) = result.differences
    assert one.label == "rk4"
    assert one.table["angle"].to_numpy() == pytest.approx(np.full(len(one.table), 2.0), abs=1e-9)
    assert one.score("angle").share is None
    assert row(result, "answer.rate_hz").differences[1] == 43.0
    # Errors at a rate that the other has not.
    assert row(result, "sweep.averaged.rk4.7").values[1] is None
    assert {result.plot(kind).chart.slug for kind in ("attitude", "sweep")} == {"attitude", "sweep"}


def crashed(folder, name, *, north, rate, system="metric", heading=None, speed=1.0):
    """A sealed crash whose path goes north at `speed` from `north`; delta-V of 10 and 12 m/s."""
    t = np.arange(-0.1, 0.5 + 0.5 / rate, 1.0 / rate)
    length, velocity = (1.0, 1.0) if system == "metric" else (1.0 / 0.3048, 1.0 / 0.44704)
    ends = {"m": ("m", length), "m_per_s": ("m_per_s", velocity), "deg": ("deg", 1.0)}
    if system == "us":
        ends |= {"m": ("ft", length), "m_per_s": ("mph", velocity)}
    columns, sds = {}, {}
    for axis, unit in (
        *((n, "m") for n in ("north", "east", "down")),
        *((n, "m_per_s") for n in ("VN", "VE", "VD")),
        *((n, "deg") for n in ("roll", "pitch", "heading")),
    ):
        ending, factor = ends[unit]
        value = {"north": north + speed * t, "VN": np.full_like(t, speed)}.get(axis, 0.0 * t)
        columns[f"{axis}_{ending}"] = factor * value
        sds[f"{axis}_sd_{ending}"] = np.full_like(t, factor * 0.5)
    change = f"resultant_{ends['m_per_s'][0]}"
    event = {
        "event": 1,
        "body": {
            "event": {
                change: {
                    k: velocity * v
                    for k, v in zip(("value", "low", "high"), (10.0, 9.0, 12.0), strict=True)
                },
                "direction_of_force": {
                    "horizontal_deg": 2.0,
                    "low_deg": 353.0,
                    "high_deg": 11.0,
                    "clock": 12,
                },
            }
        },
        "peak_g" if system == "us" else "peak_m_per_s2": 1.0 if system == "us" else 9.80665,
    }
    data = {
        "units": system,
        "main": "IMU",
        "answers": [{"recorder": "IMU", "main_event": 1, "events": [event]}],
        "case": {"entry": {"kind": "speed", "heading_deg": heading}},
    }
    sealed(
        folder / name,
        "crash",
        {"case": {"options": {"units": system}}},
        files={"crash.json": data},
        write=lambda s: csv.write(s / "trajectory.csv", {"time_s": t, **columns, **sds}, {}),
    )
    return folder / name


def test_paths_of_crashes_in_any_units(tmp_path):
    first = crashed(tmp_path, "a", north=0.0, rate=100.0)
    other = crashed(tmp_path, "b", north=0.3, rate=70.0, system="us")
    result = sd.compare_runs(first, other)
    (one,) = result.differences
    assert one.table["horizontal"].to_numpy() == pytest.approx(np.full(len(one.table), 0.3))
    assert one.score("horizontal").share == 1.0
    assert one.score("horizontal").bound == pytest.approx(2.447747 * math.sqrt(0.5), rel=1e-5)
    delta_v = row(result, "main.event.1.delta_v_m_per_s")
    assert delta_v.differences[1] == pytest.approx(0.0, abs=1e-12)
    assert delta_v.same
    assert delta_v.combined[1] == pytest.approx(math.hypot(2.0, 1.0))
    pdof = row(result, "main.event.1.pdof_deg").values[0]
    assert (pdof.below, pdof.above) == pytest.approx((9.0, 9.0))
    assert row(result, "main.event.1.peak_m_per_s2").same
    # Shown as the first shows them.
    cells = {r[0]: r[1:] for r in numbers_block(result, every=True).rows}
    assert cells["delta-V, km/h"][0] == "36.0 +7.2 −3.6"
    turned = sd.compare_runs(other, first)
    assert "delta-V, mph" in {r[0] for r in numbers_block(turned, every=True).rows}


def test_paths_in_other_axes_have_no_difference(tmp_path):
    first = crashed(tmp_path, "a", north=0.0, rate=100.0)
    other = crashed(tmp_path, "b", north=0.3, rate=100.0, heading=30.0)
    result = sd.compare_runs(first, other)
    assert not result.differences
    assert "compare.other-frames" in [f.code for f in result.findings]


def test_vehicles_are_compared_one_by_one(tmp_path):
    for name, north in (("a", 0.0), ("b", 0.5)):
        for number, more in (("1", 0.0), ("2", 1.0)):
            crashed(tmp_path / name, number, north=north * (1.0 + more), rate=50.0)
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    shifts = {d.label: round(d.score("horizontal").rms, 6) for d in result.differences}
    assert shifts == {"vehicle 1": 0.5, "vehicle 2": 1.0}
    assert row(result, "vehicle 2.main.event.1.delta_v_m_per_s").same
    result.save(tmp_path / "out", report=False)
    assert sd.verify(tmp_path / "out").verdict == "identical"


# What is refused, said, or escaped.


def test_runs_without_anything_in_common_are_refused(tmp_path):
    navigated(tmp_path / "a")
    sealed(tmp_path / "b", "outage", {"outage": {"outage_s": 3.0}}, files={"outage.json": {}})
    with pytest.raises(ConfigError, check=coded("compare.nothing-in-common")):
        sd.compare_runs(tmp_path / "a", tmp_path / "b")


def test_runs_of_different_commands_share_options(tmp_path):
    navigated(tmp_path / "a")
    own = {"outage": {"outage_s": 3.0}, "navigation": {**SPEC, "smoother": {"kind": "rts"}}}
    sealed(tmp_path / "b", "outage", own, files={"outage.json": {}})
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    assert {r.key: r.values for r in result.options} == {"smoother.kind": ("none", "rts")}
    assert (result.numbers, result.same_command) == ((), False)
    assert [f.code for f in result.findings] == ["compare.other-commands"]
    assert "Numbers that differ" not in document_page(compare_document(result, "out"))


def test_what_is_no_run_is_refused(tmp_path):
    navigated(tmp_path / "a")
    (tmp_path / "log.csv").write_text("1")
    (tmp_path / "campaign.toml").write_text('[base]\nkind = "navigate"\n')
    for code, error, runs in (
        ("compare.one-run", ConfigError, ["a"]),
        ("compare.same-run", ConfigError, ["a", "a"]),
        ("compare.no-run", ConfigError, ["a", "log.csv"]),
        ("compare.file-of-no-run", ConfigError, ["a", "campaign.toml"]),
        ("bundle.no-such-folder", DataError, ["a", "b"]),
        ("config.no-such-file", ConfigError, ["a", "b.toml"]),
        ("bundle.no-manifest", DataError, ["a", "."]),
    ):
        with pytest.raises(error, check=coded(code)):
            sd.compare_runs(*(tmp_path / name for name in runs))
    with pytest.raises(ConfigError, check=coded("compare.no-run")):
        sd.compare_runs(tmp_path / "a", 3)


@pytest.mark.parametrize(
    "text", ["{", "[1]", '{"a": 1, "a": 2}', "[" * 100_000, '"word"', "\xff"], ids=range(6)
)
def test_a_damaged_answer_is_refused(tmp_path, text):
    navigated(tmp_path / "a")
    navigated(tmp_path / "b")
    (tmp_path / "b" / "navigation.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(DataError, check=coded("compare.file-damaged")):
        sd.compare_runs(tmp_path / "a", tmp_path / "b")
    (tmp_path / "b" / "navigation.json").unlink()
    with pytest.raises(DataError, check=coded("compare.file-missing")):
        sd.compare_runs(tmp_path / "a", tmp_path / "b")


def test_links_are_not_followed(tmp_path):
    navigated(tmp_path / "a")
    navigated(tmp_path / "b")
    own = tmp_path / "b" / "navigation.json"
    content = own.read_text()
    own.unlink()
    (tmp_path / "secret.json").write_text(content)
    own.symlink_to(tmp_path / "secret.json")
    with pytest.raises(DataError, check=coded("compare.links")):
        sd.compare_runs(tmp_path / "a", tmp_path / "b")


def test_a_changed_run_is_said_everywhere(tmp_path):
    sealed(tmp_path / "a", files={"navigation.json": state()})
    sealed(tmp_path / "b", files={"navigation.json": state()})
    path = tmp_path / "b" / "navigation.json"
    path.write_text(path.read_text().replace("150.0", "151.0"))
    (tmp_path / "b" / "more.txt").write_text("x")
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    assert result.changed
    (finding,) = (f for f in result.findings if f.code == "compare.changed")
    assert (finding.code, finding.severity, finding.file) == ("compare.changed", "warning", "b")
    assert set(finding.data["names"]) == {"navigation.json", "more.txt"}
    listed = result.to_json()["runs"]
    assert [len(one["changed_after_sealing"]) for one in listed] == [0, 2]
    assert "Changed after it was sealed: b." in document_page(compare_document(result, "out"))
    assert row(result, "end.alt_m").differences[1] == pytest.approx(1.0)


HOSTILE = '<script>alert(1)</script>\x1b[2J\u202e"&'


def test_hostile_words_are_escaped(tmp_path, run_cli):
    for name, value in (("a", HOSTILE), ("b", "x")):
        data = {
            "trust": {"verdict": value},
            "sensors": {f"{value}<img src=x>": {"unit": HOSTILE, "estimate": 1.0, "sd": 1.0}},
            "findings": [{"code": value, "severity": HOSTILE, "sentence": HOSTILE}],
        }
        spec = {"navigation": {"title": value, HOSTILE: {value: value}}}
        sealed(tmp_path / name, configuration=spec, files={"navigation.json": data})
    done = run_cli("compare", tmp_path / "a", tmp_path / "b", "--out", tmp_path / "out", "-v")
    assert done.code == 0, done.err
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    for text in (page, done.out, done.err):
        assert "\x1b[2J" not in text
        assert "\u202e" not in text
    assert "<script>alert" not in page
    assert "<img" not in page
    assert "&lt;script&gt;alert(1)" in page


@pytest.mark.parametrize(
    "value", [1e308, -1e308, 10**400, "12", None, [1.0], {"value": 1.0}, True, float("1e-320")]
)
def test_hostile_numbers_give_no_traceback(tmp_path, value):
    data = {**state(), "sensors": {"x": {"estimate": value, "sd": value}}, "trust": value}
    data["end"]["alt_m"] = value
    data["end"]["lat_deg"] = value
    data["observations"] = value
    for name in "ab":
        sealed(tmp_path / name, files={"navigation.json": {**data, "findings": value}})
    path = tmp_path / "b" / "navigation.json"
    path.write_text(path.read_text().replace(" 1e+308", " -1e+308"))
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    json.dumps(result.to_json(), allow_nan=False)
    document_page(compare_document(result, "out"))


def test_deep_configurations_end(tmp_path):
    deep: dict = {"x": 1}
    for _ in range(200):
        deep = {"d": deep}
    for name in "ab":
        sealed(tmp_path / name, configuration={"navigation": {"n": name, **deep}})
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    assert [r.key for r in result.options] == ["n"]


def test_names_tell_folders_apart(tmp_path):
    for name in ("x/run", "y/run"):
        (tmp_path / name).parent.mkdir()
        navigated(tmp_path / name)
    result = sd.compare_runs(tmp_path / "x/run", str(tmp_path / "y/run"))
    assert [run.name for run in result.runs] == ["x/run", "y/run"]
    result.save(tmp_path / "out", report=False)
    # In the comparison both folders have another place, and their names stay.
    stored = json.loads((tmp_path / "out" / "compare.json").read_text())
    assert [one["name"] for one in stored["runs"]] == ["x/run", "y/run"]
    assert sd.verify(tmp_path / "out").verdict == "identical"


def test_a_comparison_is_not_written_into_a_run(tmp_path):
    navigated(tmp_path / "a")
    navigated(tmp_path / "b")
    result = sd.compare_runs(tmp_path / "a", tmp_path / "b")
    with pytest.raises(ConfigError, check=coded("compare.inside")):
        result.save(tmp_path / "a" / "out")
    with pytest.raises(ConfigError, check=coded("compare.no-chart")):
        result.plot("plan")
    assert isinstance(result.to_pandas(), pd.DataFrame)
    assert repr(result).startswith("<RunComparison a | b\n2 runs of navigate.")
    assert options_block(result) is None
    assert "<b>" in result._repr_html_()


def test_paths_in_a_repeated_comparison_are_its_own(tmp_path):
    """A comparison whose configuration was damaged and sealed again gives a clear error."""
    navigated(tmp_path / "a")
    navigated(tmp_path / "b")
    sd.compare_runs(tmp_path / "a", tmp_path / "b").save(tmp_path / "out", report=False)
    path = tmp_path / "out" / MANIFEST
    manifest = json.loads(path.read_text())
    del manifest["configuration"]["compare"]["runs"][0]["parts"]
    path.write_text(json.dumps(manifest))
    with pytest.raises(DataError, check=coded("report.configuration-not-understood")):
        sd.verify(tmp_path / "out")


def test_an_index_by_two_standards_or_two_sets_of_sensors_is_two_numbers(tmp_path):
    def index(name, of, standard, *channels):
        return {"index": name, "of": of, "standard": standard, "value": 1.0, "unit": ""} | {
            "channels": list(channels)
        }

    found = [index("ASI", "car", "A"), index("ASI", "car", "B"), index("OLC", "car", "C")]
    found += [index("HIC15", "driver", "D", "1", "2"), index("HIC15", "driver", "D", "4", "5")]
    found += [index("HIC15", "passenger", "D", "7"), index("HIC15", "driver", "E", "9")]
    case = {"case": {"units": []}}
    for name in "ab":
        sealed(tmp_path / name, "crash", case, files={"crash.json": {"indices": found}})
    numbers = sd.compare_runs(tmp_path / "a", tmp_path / "b").numbers
    labels = [one.any.label for one in numbers if one.any.group == "Severity"]
    assert labels == [
        "ASI, A, car",
        "ASI, B, car",
        "OLC, car",
        "HIC15, D, channels 1, 2, driver",
        "HIC15, D, channels 4, 5, driver",
        "HIC15, passenger",
        "HIC15, E, driver",
    ]
    assert len({one.key for one in numbers}) == len(numbers)
