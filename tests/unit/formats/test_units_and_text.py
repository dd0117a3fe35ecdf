"""Units as people write them, raw counts, and text tables as programs of many countries write."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.formats import read_log
from strapdown.formats.columns import read_name
from strapdown.formats.recording import ReadOptions
from strapdown.formats.triad_units import _cause
from strapdown.tables import ACCEL, GYRO
from strapdown.units import ACCEL_UNITS, GYRO_UNITS, factor_of, parse_unit, unit_of

N = 50
ROWS = np.column_stack([np.arange(N) * 0.01, *(0.5 + 0.01 * k * np.arange(N) for k in range(6))])
NAMES = ["time_s", *(f"gyro_{a}_deg_s" for a in "xyz"), *(f"acc_{a}_m_s2" for a in "xyz")]


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("rad s^-1", "rad/s"),
        ("[rad·s⁻¹]", "rad/s"),
        ("RAD*S^-1", "rad/s"),
        ("m s^-2", "m/s2"),
        ("m·s⁻²", "m/s2"),
        ("m s^-1", "m/s"),
        ("deg s-1", "deg/s"),
        ("m s^-3", None),
    ],
)
def test_powers_of_a_second(text, unit):
    assert unit_of(text) == unit
    assert read_name(f"gyro_x [{text.strip('[]')}]").unit == unit


@pytest.mark.parametrize(
    ("text", "kind", "unit", "factor"),
    [
        ("deg/s/131", "gyro", "deg/s/131", GYRO_UNITS["deg/s"] / 131.0),
        ("1/131 deg/s", "gyro", "deg/s/131", GYRO_UNITS["deg/s"] / 131.0),
        ("dps/16.4", "gyro", "deg/s/16.4", GYRO_UNITS["deg/s"] / 16.4),
        ("0.07 deg/s", "gyro", "0.07 deg/s", GYRO_UNITS["deg/s"] * 0.07),
        ("g/16384", "accel", "g/16384", ACCEL_UNITS["g"] / 16384.0),
        ("-g/16384", "accel", "-g/16384", ACCEL_UNITS["-g"] / 16384.0),
        ("m/s2", "accel", "m/s2", 1.0),
        # A unit that ends in a digit.
        ("m/s2/100", "accel", "m/s2/100", 0.01),
        ("0.01 m/s^2", "accel", "m/s2/100", 0.01),
    ],
)
def test_raw_counts(text, kind, unit, factor):
    assert parse_unit(text, kind) == unit
    assert parse_unit(unit, kind) == unit
    assert factor_of(unit, {**GYRO_UNITS, **ACCEL_UNITS}) == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize("text", ["counts", "deg/s/0", "g/131", "131", "/131", "deg/s/-131"])
def test_what_is_no_unit_is_told_how_counts_are_stated(text):
    with pytest.raises(ConfigError, match=r"deg/s/131"):
        parse_unit(text, "gyro")


def test_counts_of_a_log(tmp_path):
    path = tmp_path / "mpu.csv"
    counts = np.round(ROWS[:, 1:] * 1000).astype(int)
    rows = [f"{10 * k}," + ",".join(map(str, row)) for k, row in enumerate(counts)]
    path.write_text("millis,gx,gy,gz,ax,ay,az\n" + "\n".join(rows) + "\n")
    with pytest.raises(DataError) as refused:
        read_log(path)
    asked = refused.value.finding.data["questions"]
    assert {q.code for q in asked} == {"io.counts-unit-undecided"}
    assert [q.quantity for q in asked] == ["gyro", "accel"]
    imu = read_log(path, ReadOptions(gyro_unit="deg/s/131", accel_unit="g/16384")).imu
    np.testing.assert_allclose(imu[GYRO], np.radians(counts[:, :3] / 131.0), rtol=1e-12)
    np.testing.assert_allclose(imu[ACCEL], counts[:, 3:] / 16384.0 * 9.80665, rtol=1e-12)


@pytest.mark.parametrize("turns", [True, False])
@pytest.mark.parametrize(("scale", "rate"), [(16384, 131), (8192, 65.5), (2048, 16.4)])
def test_counts_are_proposed_by_gravity_and_its_turns(tmp_path, scale, rate, turns):
    rng = np.random.default_rng(scale)
    time = 0.01 * np.arange(3000.0)
    omega = turns * np.column_stack([0.8 * np.sin(time / 2), 0.6 * np.cos(time / 1.3), 0 * time])
    force, turn = [], Rotation.identity()
    for step in omega:
        force.append(turn.inv().apply([0.0, 0.0, 1.0]))
        turn = turn * Rotation.from_rotvec(0.01 * step)
    accel = np.rint((np.array(force) + rng.normal(0, 0.004, (3000, 3))) * scale)
    gyro = np.rint(np.degrees(omega + rng.normal(0.01, 0.002, (3000, 3))) * rate)
    path = tmp_path / "mpu.csv"
    rows = np.column_stack([10 * np.arange(3000), accel, gyro]).astype(int)
    np.savetxt(path, rows, "%d", ",", header="millis,ax,ay,az,gx,gy,gz", comments="")
    with pytest.raises(DataError) as refused:
        read_log(path)
    answers = dict(refused.value.finding.data["answers"])
    assert answers["accel_unit"] == f"g/{scale}"
    # Without a turn of gravity the numbers cannot tell the scale of the gyro.
    assert answers["gyro_unit"] == (f"deg/s/{rate:g}" if turns else "UNIT")


def text_of(separator=",", decimal="."):
    rows = [separator.join(f"{v:.4f}".replace(".", decimal) for v in row) for row in ROWS]
    return separator.join(NAMES) + "\n" + "\n".join(rows) + "\n"


POINTS, GERMAN = text_of(), text_of(";", ",")
QUOTED = POINTS.split("\n", 1)[0] + "\n"
QUOTED += "\n".join(",".join('"' + f"{v:.4f}".replace(".", ",") + '"' for v in row) for row in ROWS)
TEXTS = {
    "German Excel": GERMAN.encode(),
    "German Excel, trailing delimiter": GERMAN.replace("\n", ";\n").encode(),
    "UTF-16": GERMAN.encode("utf-16"),
    "mark and CRLF": b"\xef\xbb\xbf" + GERMAN.replace("\n", "\r\n").encode(),
    "comments": ("% a\n// b\n; c\n# d\n" + POINTS).encode(),
    "separator of Excel": ("sep=;\n" + GERMAN).encode(),
    "units below": ("t;gx;gy;gz;ax;ay;az\ns;°/s;°/s;°/s;m s^-2;m s^-2;m s^-2\n"
                    + GERMAN.split("\n", 1)[1]).encode(),
    "trailing delimiter": POINTS.replace("\n", ",\n").encode(),
    "decimal commas in quotes": QUOTED.encode(),
}  # fmt: skip


@pytest.mark.parametrize("kind", TEXTS)
def test_texts_of_many_programs(tmp_path, kind):
    path = tmp_path / "log.csv"
    path.write_bytes(TEXTS[kind])
    imu = read_log(path).imu
    # Four decimals are written.
    np.testing.assert_allclose(np.degrees(imu[GYRO]), ROWS[:, 1:4], atol=5.1e-5)
    np.testing.assert_allclose(imu[ACCEL], ROWS[:, 4:], atol=5.1e-5)


def test_comments_among_the_rows_are_told(tmp_path):
    lines = POINTS.splitlines()
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*lines[:20], "# pause", *lines[20:]]) + "\n")
    recording = read_log(path)
    assert len(recording.imu) == N
    assert [f.row for f in recording.findings if "'# pause'" in f.what] == [21]


def test_a_comma_that_is_both_signs_is_told(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(text_of(",", ","))
    with pytest.raises(DataError, check=coded("io.csv-decimal-commas")):
        read_log(path)


def test_columns_without_names_are_shown(tmp_path):
    path = tmp_path / "ms25.csv"
    path.write_text("\n".join(f"{k * 10},1.5,-2.25,3,4,5,6,7,8,9" for k in range(N)) + "\n")
    with pytest.raises(DataError, match=r"1: 0, 2: 1.5, 3: -2.25, 4: 3") as caught:
        read_log(path)
    assert "--columns time=1,gyro_x=2" in caught.value.finding.advice("cli")


@pytest.mark.parametrize("text", ["forward-left-up", "x,-y,-z", "Forward, Left, Up"])
def test_axes_in_a_comment_are_those_of_the_sensor(tmp_path, text):
    rows = [f"# axes: {text}", ",".join(NAMES), *(",".join(map(str, row)) for row in ROWS)]
    (tmp_path / "log.csv").write_text("\n".join(rows))
    log = read_log(tmp_path / "log.csv")
    plain = ["# axes: forward-right-down", *rows[1:]]
    (tmp_path / "plain.csv").write_text("\n".join(plain))
    sensor = read_log(tmp_path / "plain.csv").imu[[*GYRO, *ACCEL]].to_numpy()
    assert np.array_equal(log.imu[[*GYRO, *ACCEL]].to_numpy(), sensor * [1, -1, -1, 1, -1, -1])
    assert not [f for f in log.findings if f.code.startswith("io.axes-not-stated")]


def test_attitude_beside_other_axes_is_no_truth(tmp_path):
    """Whose frames it has is not stated: the sensor's, or those of its program's world."""
    rows = [",".join([*NAMES, "q_w", "q_x", "q_y", "q_z"])]
    rows += [",".join([*map(str, row), "1", "0", "0", "0"]) for row in ROWS]
    for text, used in (("forward-left-up", False), ("forward-right-down", True)):
        (tmp_path / "log.csv").write_text("\n".join([f"# axes: {text}", *rows]))
        log = read_log(tmp_path / "log.csv")
        assert (log.truth is not None) == used
        assert ("io.attitude-not-used" in {f.code for f in log.findings}) != used


# Units of the field in a heading: each factor is by its definition.

_GRAVITY = 9.80665
OF_FORCE = {
    **dict.fromkeys(("cm/s²", "cm/s^2", "Gal"), 1e-2),
    "mm/s²": 1e-3,
    "ft/s²": 0.3048,
    "in/s²": 0.0254,
    "km/h/s": 1.0 / 3.6,
    "N/kg": 1.0,
    "mg": 1e-3 * _GRAVITY,
    "µg": 1e-6 * _GRAVITY,
    "gee": _GRAVITY,
    "mGal": 1e-5,
}
OF_RATE = {
    **dict.fromkeys(("rpm", "tr/min", "U/min", "r/min"), np.pi / 30.0),
    **dict.fromkeys(("rev/s", "rps", "turns/s"), 2.0 * np.pi),
    "deg/min": np.pi / 180.0 / 60.0,
    "°/h": np.pi / 180.0 / 3600.0,
    "rad/min": 1.0 / 60.0,
    "mrad/s": 1e-3,
    "µrad/s": 1e-6,
    "mdps": np.pi / 180e3,
    "gon/s": np.pi / 200.0,
    "arcsec/s": np.pi / 180.0 / 3600.0,
}


def tumbling(tmp_path, rate_unit, force_unit, rate, force, form):
    """A tumble of 20 s, in these units; the rates in rad/s and the forces in m/s² that it has."""
    t = 0.01 * np.arange(2000)
    angles = np.column_stack([0.7 * t, 0.5 * np.sin(0.8 * t), 0.6 * np.sin(1.3 * t)])
    turn = Rotation.from_euler("zyx", angles)
    w = np.vstack([(turn[:-1].inv() * turn[1:]).as_rotvec() / 0.01, np.zeros(3)])
    f = turn.inv().apply([0.0, 0.0, _GRAVITY])
    units = {"gyro": rate_unit, "acc": force_unit}
    names = ["time_s", *(form.format(f"{s}_{a}", u) for s, u in units.items() for a in "xyz")]
    rows = [",".join(names)]
    if form == "{}":
        rows += [",".join(["s", *[rate_unit] * 3, *[force_unit] * 3])]
    table = np.column_stack([t, w / rate, f / force])
    rows += [",".join(f"{v:.12g}" for v in row) for row in table]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path, w, f


UNITS_OF_BOTH = [*((u, "m/s²") for u in OF_RATE), *(("rad/s", u) for u in OF_FORCE)]


@pytest.mark.parametrize("form", ["{} ({})", "{}[{}]", "{}"])
@pytest.mark.parametrize(("rate_unit", "force_unit"), UNITS_OF_BOTH)
def test_units_of_the_field(tmp_path, rate_unit, force_unit, form):
    factors = OF_RATE.get(rate_unit, 1.0), OF_FORCE.get(force_unit, 1.0)
    path, w, f = tumbling(tmp_path, rate_unit, force_unit, *factors, form)
    imu = read_log(path).imu
    np.testing.assert_allclose(imu[GYRO], w, atol=1e-9)
    np.testing.assert_allclose(imu[ACCEL], f, atol=1e-9)


@pytest.mark.parametrize("form", ["{} ({})", "{}[{}]", "{}"])
@pytest.mark.parametrize(("rate_unit", "force_unit"), [("foo/s", "m/s²"), ("rad/s", "bar")])
def test_a_word_that_is_no_unit_of_the_sensor_is_asked_about(tmp_path, rate_unit, force_unit, form):
    """The numbers are in rad/s and m/s², and alone would be taken so."""
    path, w, f = tumbling(tmp_path, rate_unit, force_unit, 1.0, 1.0, form)
    with pytest.raises(DataError, check=coded("io.unit-unknown-word")) as refused:
        read_log(path)
    triad, word, unit = ("gyro", rate_unit, "rad/s")
    if rate_unit == "rad/s":
        triad, word, unit = ("accel", force_unit, "m/s2")
    assert refused.value.finding.data["text"] == word
    assert dict(refused.value.finding.data["answers"]) == {f"{triad}_unit": unit}
    imu = read_log(path, ReadOptions(**{f"{triad}_unit": unit})).imu
    np.testing.assert_allclose(imu[[*GYRO, *ACCEL]], np.column_stack([w, f]), atol=1e-9)


@pytest.mark.parametrize("word", ["calibrated", "filtered", "IMU1", "Sensor 2"])
def test_words_that_say_no_unit_are_no_question(tmp_path, word):
    path, w, _ = tumbling(tmp_path, word, "m/s²", 1.0, 1.0, "{} ({})")
    np.testing.assert_allclose(read_log(path).imu[GYRO], w, atol=1e-9)


# Scales that the numbers show beside a stated unit.


@pytest.mark.parametrize(
    ("off", "cause"),
    [
        (1.0, None),
        (0.9, None),
        (0.5, "io.cause-range"),
        (2.0, "io.cause-range"),
        (4.0, "io.cause-range"),
        (1.5, "io.cause-unknown"),
    ],
)
def test_a_gyro_at_another_scale_than_gravity_shows(tmp_path, off, cause):
    """Numbers that are `off` times those of the stated unit."""
    path, w, _ = tumbling(tmp_path, "deg/s", "m/s²", np.radians(1.0) / off, 1.0, "{} ({})")
    read = read_log(path)
    np.testing.assert_allclose(read.imu[GYRO], off * w, atol=1e-6)
    said = [f for f in read.findings if f.code == "io.gyro-scale"]
    assert len(said) == (cause is not None)
    for one in said:
        assert one.data["low"] < 1.0 / off < one.data["high"]
        assert one.data["factor"] * off == pytest.approx(1.0, abs=0.02)
        assert one.data["cause"].code == cause


@pytest.mark.parametrize(
    ("off", "cause"), [(1.0, None), (0.9, None), (1.1, None), (0.5, "range"), (1.25, "unknown")]
)
@pytest.mark.parametrize("turns", [True, False])
def test_a_steady_force_that_is_not_gravity(tmp_path, off, cause, turns):
    path, _, _ = tumbling(tmp_path, "rad/s", "m/s²", 1.0, 1.0 / off, "{} ({})")
    if not turns:
        lines = path.read_text(encoding="utf-8").splitlines()
        rows = [line.split(",", 1)[0] + ",0.01,0,0,0,0.1," + repr(off * 9.8) for line in lines[1:]]
        path.write_text("\n".join([lines[0], *rows]), encoding="utf-8")
    said = [f for f in read_log(path).findings if f.code == "io.force-scale"]
    assert [one.data["cause"].code for one in said] == ([f"io.cause-{cause}"] if cause else [])
    for one in said:
        assert one.data["factor"] == pytest.approx(1.0 / off, rel=1e-3)


def test_no_unit_is_proposed_that_the_turning_of_gravity_excludes(tmp_path):
    """Converted to degrees twice: no unit has that factor."""
    path, _, _ = tumbling(tmp_path, "deg/s", "m/s²", np.radians(np.radians(1.0)), 1.0, "{} ({})")
    with pytest.raises(DataError, check=coded("io.contradicts-unit")) as refused:
        read_log(path)
    assert dict(refused.value.finding.data["answers"]) == {"gyro_unit": "UNIT"}
    assert _cause(57.0, 58.0).code == _cause(0.017, 0.018).code == "io.cause-degrees"
