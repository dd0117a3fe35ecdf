"""Parquet tables and folders of NumPy arrays."""

from __future__ import annotations

import io

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from tests.coded import coded

from strapdown import frames, rotation
from strapdown.errors import DataError
from strapdown.formats import READERS, read_log, read_raw
from strapdown.formats.arrays import as_rows
from strapdown.formats.recording import ReadOptions
from strapdown.tables import ACCEL, GYRO, QUATERNION

N = 80
T = np.round(np.arange(N) * 0.01, 2)
RATE = np.column_stack([0.1 + T, -0.2 * T, 0.3 * np.ones(N)])
FORCE = np.column_stack([0.4 * T, 0.2 - T, -9.8 + 0.1 * T])


def reader_of(path):
    return next(name for name, reader in READERS.items() if reader.detect(path))


# --- Parquet ----------------------------------------------------------------------------


def table(columns, units=(), meta=None):
    fields, arrays = [], []
    for name, values in columns.items():
        array = values if isinstance(values, pa.Array) else pa.array(values)
        unit = dict(units).get(name)
        fields.append(pa.field(name, array.type, metadata={"unit": unit} if unit else None))
        arrays.append(array)
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=meta))


def flat():
    return {"t": T} | {f"g{a}": RATE[:, k] for k, a in enumerate("xyz")} | {"note": ["x"] * N}


def test_parquet_columns_and_units_of_fields(tmp_path):
    units = {"t": "s", "gx": "deg/s", "gy": "deg/s", "gz": "deg/s"}
    meta = {"sampling": "mean", "axes": "forward-right-down"}
    path = tmp_path / "log.data"
    pq.write_table(table(flat(), units.items(), meta), path)
    assert reader_of(path) == "parquet"
    recording = read_log(path)
    assert np.array_equal(recording.imu[GYRO], RATE * (np.pi / 180.0))
    assert np.array_equal(recording.imu.index, T)
    assert recording.imu.attrs.get("sampling", "mean") == "mean"
    assert not any("taken as" in f.what for f in recording.findings)


def test_parquet_lists_structures_dates_and_dictionaries(tmp_path):
    stamps = np.datetime64("2026-03-01T12:00:00", "ns") + (T * 1e9).astype("timedelta64[ns]")
    structure = pa.StructArray.from_arrays(
        [pa.array(FORCE[:, k]) for k in range(3)], names=["x", "y", "z"]
    )
    columns = {
        "time": pa.array(stamps),
        "gyro": pa.array(RATE.tolist(), pa.list_(pa.float64(), 3)),
        "accel": structure,
    }
    path = tmp_path / "log.parquet"
    pq.write_table(table(columns), path)
    raw = read_raw(path)
    assert set(raw.columns) == {"time", *(f"gyro[{k}]" for k in range(3))} | {
        f"accel.{a}" for a in "xyz"
    }
    recording = read_log(path, ReadOptions(gyro_unit="rad/s", accel_unit="m/s2"))
    assert np.array_equal(recording.imu[GYRO], RATE)
    assert np.array_equal(recording.imu[ACCEL], FORCE)


def test_parquet_missing_values_are_missing(tmp_path):
    columns = flat()
    columns["gx"] = pa.array([None if k == 5 else 7 for k in range(N)], pa.int64())
    path = tmp_path / "log.parquet"
    pq.write_table(table(columns), path)
    with pytest.raises(
        DataError,
        check=coded("io.not-finite-in-rows", row=6, file="log.parquet", quantity="gyro_x"),
    ):
        read_log(path, ReadOptions(gyro_unit="rad/s"))


@pytest.mark.parametrize("rows", [500, 3000])
def test_parquet_of_numbers_alone_is_decoded_in_parts_to_rows_of_one_array(tmp_path, rows):
    """Every kind of number as Arrow converts the whole column, and missing ones as NaN."""
    draw = np.random.default_rng(1)
    doubles = {f"g{a}": draw.normal(size=rows) for a in "xyz"}
    doubles["gy"][7] = np.nan
    columns = {
        "t": np.arange(rows),
        **doubles,
        "small": draw.normal(size=rows).astype(np.float32),
        "count": np.arange(rows, dtype=np.uint16),
        "some": pa.array([None if k == 1234 else 0.5 * k for k in range(rows)]),
    }
    path, meta = tmp_path / "log.parquet", {"sampling": "mean"}
    pq.write_table(table(columns, {"gx": "deg/s"}.items(), meta), path, row_group_size=700)
    raw = read_raw(path)
    held = pq.read_table(path)
    assert list(raw.columns) == held.column_names
    for name, values in raw.columns.items():
        expected = held[name].to_numpy()
        assert (values.dtype, values.tobytes()) == (expected.dtype, expected.tobytes()), name
    assert raw.units == {"gx": "deg/s"}
    assert raw.sampling == "mean"
    assert as_rows([raw.columns[f"g{a}"] for a in "xyz"]).shape == (3, rows)


@pytest.mark.parametrize("keep", [3, 200, -30])
def test_parquet_that_was_cut(tmp_path, keep):
    path = tmp_path / "log.parquet"
    pq.write_table(table(flat()), path)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(DataError, check=coded("io.table-cannot-read", file="log.parquet")):
        read_log(path)


def test_parquet_that_claims_far_more_than_it_holds(tmp_path):
    path = tmp_path / "log.parquet"
    zeros = np.zeros(10_000_000)
    pq.write_table(pa.table({"t": zeros, "gx": zeros}), path, compression="zstd")
    assert path.stat().st_size < 160_000
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.claims-bytes-stored"
    ):
        read_raw(path)


# --- folders of arrays ------------------------------------------------------------------


def test_a_folder_of_arrays(tmp_path):
    for name, array in {"time": T, "gyro": RATE, "accel_m_s2": FORCE, "fs": 100.0}.items():
        np.save(tmp_path / f"{name}.npy", array)
    np.save(tmp_path / "gps.npy", np.zeros((7, 2)))
    assert reader_of(tmp_path) == "npy-folder"
    with pytest.raises(DataError, check=coded("io.unit-undecided")):
        read_log(tmp_path)
    recording = read_log(tmp_path, ReadOptions(gyro_unit="rad/s"))
    assert np.array_equal(recording.imu[GYRO], RATE)
    assert np.array_equal(recording.imu[ACCEL], FORCE)
    assert np.array_equal(recording.imu.index, T)
    assert any("gps[0] (7 values)" in f.what for f in recording.findings)
    assert len(recording.files) == 5


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda b: b[:300], r"gyro\.npy: .*the header states"),
        (lambda b: b[:7], r"gyro\.npy: the array cannot be read"),
        (lambda b: b"hello", r"gyro\.npy: the array cannot be read"),
        (lambda b: b"", r"gyro\.npy: the array cannot be read"),
        (lambda b: b.replace(b"(80, 3)", b"(80,30)"), r"gyro\.npy: .*the header states"),
    ],
)
def test_a_damaged_array(tmp_path, damage, message):
    stream = io.BytesIO()
    np.save(stream, RATE)
    (tmp_path / "gyro.npy").write_bytes(damage(stream.getvalue()))
    np.save(tmp_path / "t.npy", T)
    with pytest.raises(DataError, match=message):
        read_log(tmp_path)


def test_an_array_of_python_objects_is_not_loaded(tmp_path):
    np.save(tmp_path / "gyro.npy", np.array([{"run": "me"}, None], dtype=object))
    with pytest.raises(DataError, check=coded("io.holds-python-objects-not-loaded")):
        read_log(tmp_path)


# --- comma2k19 --------------------------------------------------------------------------

RATE_TRUE = np.array([0.02, -0.05, 0.3])
PLACE = np.array([37.7, -122.4, 10.0])
FRAMES = np.arange(0.0, 8.0, 0.05)


def segment(folder, flat):
    """A device that turns at one rate, as the arrays of a segment; synthetic."""
    q_ne = frames.q_ne(*PLACE[:2])
    t = np.arange(0.003, 7.9, 0.0096)
    start = rotation.quaternion_from_euler([1.0, -4.0, 30.0])
    q_nd = rotation.compose(
        start, rotation.quaternion_from_rotation_vector(np.outer(FRAMES, RATE_TRUE))
    )
    arrays = {
        ("IMU", "gyro", "t"): 46408.0 + t,
        ("IMU", "gyro", "value"): np.tile(RATE_TRUE, (t.size, 1)),
        ("IMU", "accelerometer", "t"): 46408.0 + t,
        ("IMU", "accelerometer", "value"): np.tile([0.0, 0.0, -9.81], (t.size, 1)),
        ("IMU", "magnetometer", "t"): 46408.0 + FRAMES,
        ("IMU", "magnetometer", "value"): np.tile([20.0, 0.0, 40.0], (FRAMES.size, 1)),
        ("global_pose", "frame_times"): 46408.0 + FRAMES,
        ("global_pose", "frame_positions"): np.tile(
            frames.ecef_from_geodetic(PLACE), (FRAMES.size, 1)
        ),
        ("global_pose", "frame_orientations"): rotation.compose(rotation.conjugate(q_ne), q_nd),
    }
    folder.mkdir()
    for parts, array in arrays.items():
        if flat:
            np.save(folder / ("__".join(parts) + ".npy"), array)
            continue
        root = folder / "processed_log" if parts[0] == "IMU" else folder
        root.joinpath(*parts).parent.mkdir(parents=True, exist_ok=True)
        with root.joinpath(*parts).open("wb") as stream:
            np.save(stream, array)
    return t, start


@pytest.mark.parametrize("flat", [True, False])
def test_comma2k19(tmp_path, flat):
    folder = tmp_path / "10"
    t, start = segment(folder, flat)
    assert reader_of(folder) == "comma2k19"
    recording = read_log(folder)
    assert np.array_equal(recording.imu.index, 46408.0 + t)
    assert np.array_equal(recording.imu[GYRO], np.tile(RATE_TRUE, (t.size, 1)))
    assert len(recording.files) == 9
    turned = np.outer(recording.truth.index - 46408.0, RATE_TRUE)
    expected = rotation.compose(start, rotation.quaternion_from_rotation_vector(turned))
    # Stamps of 46408 s are known to 7e-12 s; the rate is 0.3 rad/s.
    angle = rotation.rotation_angle(recording.truth[QUATERNION].to_numpy(), expected)
    assert np.degrees(np.max(angle)) < 1e-6
    # Each frame has the sample nearest to it; the last two have the same one.
    nearest = np.abs(t[:, None] - FRAMES).argmin(axis=0)
    assert len(recording.truth) == recording.scored.sum() == np.unique(nearest).size


def test_comma2k19_of_another_shape_is_refused(tmp_path):
    folder = tmp_path / "10"
    segment(folder, True)
    np.save(folder / "IMU__gyro__value.npy", np.zeros((5, 3)))
    with pytest.raises(
        DataError,
        match=r"10/IMU__gyro__value\.npy, gyro",
        check=lambda refused: refused.finding.code == "io.stamps-shape-values-numbers-shapes",
    ):
        read_log(folder)
    (folder / "IMU__gyro__value.npy").unlink()
    with pytest.raises(
        DataError, check=lambda refused: refused.finding.code == "io.values-gyro-not"
    ):
        read_log(folder)
