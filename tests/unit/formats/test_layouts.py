"""Layouts of strangers' tables: below and beside each other, turned round, with gaps; synthetic.

What is read is compared with what was written.
"""

from __future__ import annotations

import bz2
import gzip
import json
import lzma
import zipfile

import numpy as np
import pyarrow as pa
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.errors import DataError
from strapdown.tables import ACCEL, GYRO

N = 300
_RNG = np.random.default_rng(4)
RATES = np.round(_RNG.normal(0.0, 0.2, (N, 3)), 4)
FORCE = np.round(_RNG.normal((0.0, 0.0, -9.81), 0.1, (N, 3)), 4)
NAMES = "gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"
ROWS = [
    [k / 100, *r, *f] for k, (r, f) in enumerate(zip(RATES.tolist(), FORCE.tolist(), strict=True))
]


def written(tmp_path, name, lines):
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def table(rows, names=f"time_s,{NAMES}"):
    return [names, *(",".join(map(str, row)) for row in rows)]


def check(imu, rates=RATES, force=FORCE):
    np.testing.assert_array_equal(imu[GYRO], rates)
    np.testing.assert_array_equal(imu[ACCEL], force)
    np.testing.assert_allclose(imu.index, np.arange(len(rates)) / 100, atol=1e-12)


# Tables below and beside each other.


@pytest.mark.parametrize(
    "titles", [("[gyro]", "[accel]"), ("Gyroscope", "Accelerometer"), ("", "")]
)
def test_sections_are_joined(tmp_path, titles):
    names = ("t_s,x,y,z",) * 2 if titles[0][:1] == "[" else ("t_s,gx,gy,gz", "t_s,ax,ay,az")
    lines = []
    for title, its, values in zip(titles, names, (RATES, FORCE), strict=True):
        lines += [*([title] if title else []), its]
        lines += [f"{k / 100},{','.join(map(str, row))}" for k, row in enumerate(values)]
    path = written(tmp_path, "log.csv", lines)
    imu = sd.read_imu(path, units={"gyro": "rad/s", "accel": "m/s2"})
    check(imu)
    assert "io.csv-sections-joined" in [f.code for f in imu.findings]


@pytest.mark.parametrize("first", [False, True])
def test_a_section_of_fixes_is_a_stream_of_its_own(tmp_path, first):
    fixes = ["time,lat,lon,alt,north_sd,east_sd,down_sd"]
    fixes += [f"{k},48.0,11.{k:03d},500,1.0,1.0,2.0" for k in range(15)]
    samples = table(ROWS)
    lines = [*fixes, *samples] if first else [*samples, *fixes]
    path = written(tmp_path, "log.csv", lines)
    check(sd.read_imu(path))
    read = sd.read(path)
    assert set(read) >= {"imu", "gnss"}
    np.testing.assert_allclose(read["gnss"]["lon"], 11.0 + 1e-3 * np.arange(15))
    np.testing.assert_array_equal(read["gnss"].index, np.arange(15.0))
    np.testing.assert_allclose(sd.read_gnss(path)["lon"], read["gnss"]["lon"])


def test_rows_whose_first_word_says_their_kind_are_not_one_table(tmp_path):
    """Rows of samples and of fixes with as many fields, and no line of names."""
    rows = [f"IMU,{k / 100},0.01,0.02,0.03,0.1,0.2,9.8" for k in range(400)]
    rows += [f"GPS,{k},48.0,11.{k:03d},500,1.0,2.0,0.0" for k in range(4)]
    rows.sort(key=lambda row: float(row.split(",")[1]))
    with pytest.raises(DataError, check=coded("io.csv-rows-of-kinds")):
        sd.read_imu(written(tmp_path, "log.csv", rows))


@pytest.mark.parametrize("clocks", [("time", "time"), ("gyro_t_s", "accel_t_s"), ("t", "acc_time")])
def test_sensors_side_by_side_each_with_its_clock(tmp_path, clocks):
    """The accelerometer has half of the rate: its rows end before those of the gyro."""
    lines = [f"{clocks[0]},gyro_x,gyro_y,gyro_z,{clocks[1]},accel_x,accel_y,accel_z"]
    for k, rate in enumerate(RATES):
        force = [2 * k / 100, *FORCE[2 * k]] if 2 * k < len(FORCE) else [""] * 4
        lines.append(",".join(map(str, [k / 100, *rate, *force])))
    imu = sd.read_imu(written(tmp_path, "log.csv", lines), units={"gyro": "rad/s", "accel": "m/s2"})
    assert len(imu) == len(RATES) - 1  # the last has no force
    np.testing.assert_allclose(imu[GYRO], RATES[:-1])
    np.testing.assert_allclose(imu[ACCEL][::2], FORCE[:-1:2])
    np.testing.assert_allclose(imu[ACCEL][1::2], 0.5 * (FORCE[:-2:2] + FORCE[2::2]), atol=1e-12)


# Rows: their order, and what is missing in them.


def test_rows_in_descending_order(tmp_path):
    imu = sd.read_imu(written(tmp_path, "log.csv", table(ROWS[::-1])))
    check(imu)
    assert "io.rows-in-descending-order" in [f.code for f in imu.findings]


@pytest.mark.parametrize("code", ["-9999", "9999", "-999.25", "-32768", "#N/A", "n/a"])
@pytest.mark.parametrize("columns", [(2,), (4, 5, 6)])
def test_codes_of_missing_values(tmp_path, code, columns):
    rows = [[*row] for row in ROWS]
    for column in columns:
        rows[100][column] = code
    path = written(tmp_path, "log.csv", table(rows))
    word = code.strip("#").isupper() or code.islower()
    expected = "io.not-finite-in-rows" if word else "io.missing-value-code"
    with pytest.raises(DataError, check=coded(expected)) as error:
        sd.read_imu(path)
    assert error.value.finding.row == 102
    assert error.value.finding.data["flags"] == "--repair"
    imu = sd.read_imu(path, repair=True)
    keep = np.arange(N) != 100
    np.testing.assert_array_equal(imu[GYRO], RATES[keep])
    np.testing.assert_array_equal(imu[ACCEL], FORCE[keep])


def test_a_reading_at_the_end_of_a_range_is_no_code(tmp_path):
    """A shock of -32768 counts beside others of 20000 is clipped, and of whole numbers alone."""
    rows = [[k / 100, 1, -2, 3, 100, -200, 2048] for k in range(N)]
    rows[100][4] = -32768
    path = written(tmp_path, "log.csv", table(rows, "time_s,gx,gy,gz,ax,ay,az"))
    imu = sd.read_imu(path, units={"gyro": "deg/s/131", "accel": "g/16384"})
    assert len(imu) == N


# Objects of JSON, and files that are compressed.


def objects(names, values):
    return [
        dict(zip(("t_s", *names), [k / 100, *row], strict=True))
        for k, row in enumerate(values.tolist())
    ]


COLUMNS = {n: [row[k] for row in ROWS] for k, n in enumerate(["time_s", *NAMES.split(",")])}
TIME = COLUMNS["time_s"]
UNITS = {"gyro": "rad/s", "accel": "m/s2"}
SHAPES = {
    "data of columns": {"data": COLUMNS},
    "data of rows": {"header": list(COLUMNS), "rows": ROWS},
    "rows": [list(COLUMNS), *ROWS],
    "lists": {"gyro": objects("xyz", RATES), "accel": objects("xyz", FORCE)},
    "named lists": {
        "imu": objects(("gx", "gy", "gz"), RATES),
        "force": objects(("ax", "ay", "az"), FORCE),
    },
    "columns of sensors": {
        "info": "a logger",
        "gyro": {"t_s": TIME, **dict(zip("xyz", RATES.T.tolist(), strict=True))},
        "accel": {"t_s": TIME, **dict(zip("xyz", FORCE.T.tolist(), strict=True))},
    },
}


@pytest.mark.parametrize("shape", SHAPES)
def test_shapes_of_json(tmp_path, shape):
    path = written(tmp_path, "log.json", [json.dumps(SHAPES[shape])])
    check(sd.read_imu(path, units=UNITS))


def test_fixes_beside_sensors_in_json(tmp_path):
    sd_m = {"north_sd": 1.0, "east_sd": 1.0, "down_sd": 2.0}
    fixes = [{"time": k, "lat": 48.0 + k / 1e4, "lon": 11.0, "alt": 500, **sd_m} for k in range(9)]
    held = {"gps": fixes, **SHAPES["lists"]}
    path = written(tmp_path, "log.json", [json.dumps(held)])
    check(sd.read_imu(path, units=UNITS))
    np.testing.assert_allclose(sd.read_gnss(path)["lat"], 48.0 + np.arange(9) / 1e4)


def zst(data):
    sink = pa.BufferOutputStream()
    with pa.CompressedOutputStream(sink, "zstd") as stream:
        stream.write(data)
    return sink.getvalue().to_pybytes()


PACKERS = {".gz": gzip.compress, ".bz2": bz2.compress, ".xz": lzma.compress, ".zst": zst}


@pytest.mark.parametrize("ending", PACKERS)
def test_compressed_tables(tmp_path, ending):
    path = tmp_path / f"log.csv{ending}"
    packed = PACKERS[ending]("\n".join(table(ROWS)).encode() + b"\n")
    path.write_bytes(packed)
    imu = sd.read_imu(path)
    check(imu)
    assert imu.attrs["source"] == path.name
    path.write_bytes(packed[: len(packed) // 2])
    with pytest.raises(DataError):
        sd.read_imu(path)


def test_an_archive_of_one_table(tmp_path):
    path = tmp_path / "log.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a folder/log.csv", "\n".join(table(ROWS)) + "\n")
        archive.writestr("__MACOSX/a folder/._log.csv", b"\0\5\26\7")
    check(sd.read_imu(path))


def test_a_bomb_and_an_archive_in_another_are_refused(tmp_path):
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(gzip.compress(b"time_s")))
    with pytest.raises(DataError, check=coded("io.packed-twice")):
        sd.read_imu(path)
    path.write_bytes(gzip.compress(b"0" * (300 << 20)))
    with pytest.raises(DataError, check=coded("io.unpacks-too-far")):
        sd.read_imu(path)


# Names in two lines, vectors in cells, and one value a row.


HEADS = {
    "groups repeated": ["time_s,gyro,gyro,gyro,accel,accel,accel", ",x,y,z,x,y,z"],
    "and units": [
        "time,gyro,gyro,gyro,accel,accel,accel",
        ",x,y,z,x,y,z",
        "s,rad/s,rad/s,rad/s,m/s2,m/s2,m/s2",
    ],
    "groups once": ["time_s,gyro,,,accel,,", ",x,y,z,x,y,z"],
}


@pytest.mark.parametrize("head", HEADS)
def test_names_in_two_lines(tmp_path, head):
    path = written(tmp_path, "log.csv", [*HEADS[head], *table(ROWS)[1:]])
    check(sd.read_imu(path, units=UNITS))


def test_a_mark_that_names_the_numbers_of_rows(tmp_path):
    rows = [[k, *row] for k, row in enumerate(ROWS, 1)]
    check(sd.read_imu(written(tmp_path, "log.csv", table(rows, f"#,time_s,{NAMES}"))))


@pytest.mark.parametrize("form", ['"[{}, {}, {}]"', "({} {} {})", '"{{{};{};{}}}"'])
def test_vectors_in_cells(tmp_path, form):
    rows = [[r[0], form.format(*r[1:4]), form.format(*r[4:])] for r in ROWS]
    path = written(tmp_path, "log.csv", table(rows, "time_s,gyro,accel"))
    check(sd.read_imu(path, units=UNITS))


def test_a_unit_in_every_cell(tmp_path):
    """As `writetimetable` of MATLAB writes durations."""
    rows = [[f"{r[0]:.2f} sec", *r[1:4], *(f"{f} m/s^2" for f in r[4:])] for r in ROWS]
    path = written(tmp_path, "log.csv", table(rows, f"Time,{NAMES}"))
    check(sd.read_imu(path, units={"gyro": "rad/s"}))
    rows[7][4] = "1.0 g"
    path = written(tmp_path, "log.csv", table(rows, f"Time,{NAMES}"))
    mixed = sd.read_imu(path, units={"gyro": "rad/s"})
    assert ACCEL[0] not in mixed.columns
    assert any(f.quantity == "accel" and f.severity == "warning" for f in mixed.findings)


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("texts", [False, True])
def test_one_value_a_row(tmp_path, apart, texts):
    """Names as ``gyro_x``, or sensor and axis in two columns; 9:59 is before 10:00."""
    rows = []
    for k, row in enumerate(ROWS):
        stamp = (
            f"9:59:{58 + k // 100}.{k % 100:02d}"
            if k < 200
            else f"10:00:0{(k - 200) // 100}.{k % 100:02d}"
        )
        for quantity, value in zip([*GYRO, *ACCEL], row[1:], strict=True):
            name = quantity.split("_") if apart else [quantity]
            rows.append([stamp if texts else row[0], *name, value])
    names = "time,sensor,axis,value" if apart else "time,name,value"
    imu = sd.read_imu(written(tmp_path, "log.csv", table(rows, names)), units=UNITS)
    np.testing.assert_array_equal(imu[GYRO], RATES)
    np.testing.assert_array_equal(imu[ACCEL], FORCE)
    np.testing.assert_allclose(imu.index - imu.index[0], np.arange(N) / 100, atol=1e-9)


def test_a_temperature_is_no_clock_of_its_sensor(tmp_path):
    """gyro_t is warm, from 2.0 to 2.9: within the stamps, which it does not follow."""
    rows = [[r[0], 2.0 + (k % 10) / 10, *r[1:4], r[0], *r[4:]] for k, r in enumerate(ROWS)]
    names = "time_s,gyro_t,gyro_x,gyro_y,gyro_z,accel_t,accel_x,accel_y,accel_z"
    check(sd.read_imu(written(tmp_path, "log.csv", table(rows, names)), units=UNITS))
