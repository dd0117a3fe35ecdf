"""`strapdown.attitude`, `OrientationFilter` and `compare_attitude`: one set of bits."""

from __future__ import annotations

import copy
import dataclasses
import json
import pickle
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from io import StringIO

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.attitude_algorithms import make_algorithm, run_attitude
from strapdown.attitude_algorithms.algorithm import CHUNK
from strapdown.errors import ConfigError, DataError, DivergenceError
from strapdown.formats.writers import WRITERS
from strapdown.increments import increments_from_imu
from strapdown.rotation import level
from strapdown.tables import EULER, QUATERNION, attitude_table, imu_table

RATE = 50.0


def samples(count=400):
    """A body that rests for 3 s, tilted, and then turns."""
    t = np.arange(count) / RATE
    turn = np.where(t > 3.0, 1.0, 0.0)[:, None]
    gyro = turn * np.column_stack([np.sin(2 * t), 0.4 * np.cos(3 * t), 0.3 + 0.0 * t])
    accel = np.tile([1.0, -0.5, -9.7], (count, 1)) + turn * np.sin(t)[:, None]
    return t, gyro, accel


def test_arrays_tables_and_files_give_the_same_bits(tmp_path):
    t, gyro, accel = samples()
    table = imu_table(t, gyro, accel)
    plain = pd.DataFrame(table).reset_index()
    plain.attrs = {}
    before = plain.copy()
    for form in ("csv", "npz"):
        WRITERS[form].write(tmp_path / f"log.{form}", {"imu": table})
    found = [
        sd.attitude(t, gyro, accel),
        sd.attitude(plain),
        sd.attitude(tmp_path / "log.csv"),
        sd.attitude(sd.read_imu(tmp_path / "log.npz")),
        sd.attitude((t, gyro, accel)),
    ]
    assert plain.equals(before)
    for one in found[1:]:
        assert np.array_equal(one.to_numpy(), found[0].to_numpy())
        assert np.array_equal(one.index, t)


def test_it_is_what_the_algorithm_gives():
    t, gyro, accel = samples()
    increments = increments_from_imu(imu_table(t, gyro, accel))
    run = run_attitude(make_algorithm("rotvec:samples=2"), increments)
    made = sd.attitude(t, gyro, accel, algorithm="rotvec:samples=2", initial="zero")
    assert np.array_equal(made.to_numpy(), run.attitude.to_numpy())
    levelled = sd.attitude(t, gyro, accel)
    # C_nb turns the force at rest to (0, 0, -g).
    force = levelled.rotation[0].apply(accel[0])
    assert np.allclose(force[:2], 0.0, atol=1e-12)
    assert levelled.attrs["initial"].startswith("levelled")
    quarter = sd.attitude(t, gyro * 0.0, initial=(0.0, 0.0, 90.0))
    assert np.allclose(quarter.rotation[-1].apply([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0])


def test_a_bias_is_subtracted():
    t, gyro, accel = samples()
    clean = sd.attitude(t, gyro, accel)
    bias = np.array([0.01, -0.02, 0.005])
    stated = sd.attitude(t, gyro + bias, accel, gyro_bias=bias)
    found = sd.attitude(t, gyro + bias, accel, gyro_bias="rest")
    for one in (stated, found):
        assert np.allclose(one[QUATERNION], clean[QUATERNION], atol=1e-12)


@pytest.mark.parametrize("algorithm", ["quaternion", "rotvec:samples=2", "dcm:order=3"])
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_streaming_and_batch_agree_to_the_bit(algorithm, sampling):
    _, gyro, accel = samples()
    bias = (0.01, -0.02, 0.005)
    first = 5
    filt = sd.OrientationFilter(
        RATE, algorithm, gyro_bias=bias, level_samples=first, sampling=sampling
    )
    streamed = np.array([filt.update(g, a) for g, a in zip(gyro, accel, strict=True)])
    t = np.arange(len(gyro)) / RATE
    roll, pitch = level(sum(accel[:first]) / first)
    batch = sd.attitude(
        t[first - 1 :],
        gyro[first - 1 :],
        algorithm=algorithm,
        initial=(roll, pitch, 0.0),
        gyro_bias=bias,
        sampling=sampling,
    )
    # An algorithm of two increments a step holds its attitude between them, as the batch does.
    assert np.array_equal(streamed[first - 1 :], batch[QUATERNION].to_numpy())
    assert np.allclose(filt.rotation.as_quat()[3], streamed[-1, 0])
    assert "400 samples" in repr(filt)


@pytest.mark.parametrize(
    "algorithm", ["quaternion", "rotvec:samples=3", "dcm:order=3", "euler", "naive", "rk4"]
)
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
def test_long_record_has_the_bits_of_one_run(algorithm, sampling):
    """Samples are taken in chunks, whose ends are no ends of blocks of three."""
    rng = np.random.default_rng(2)
    t = np.cumsum(rng.uniform(0.005, 0.015, 2 * CHUNK + 11))
    gyro = rng.normal(size=(len(t), 3))
    increments = increments_from_imu(imu_table(t, gyro, sampling=sampling))
    run = run_attitude(make_algorithm(algorithm), increments)
    made = sd.attitude(t, gyro, algorithm=algorithm, sampling=sampling)
    assert np.array_equal(made.to_numpy(), run.attitude.to_numpy())


def test_overflow_is_at_the_same_row_in_any_chunk():
    t = np.arange(2 * CHUNK) / 100.0
    gyro = np.zeros((len(t), 3))
    gyro[CHUNK + 7] = 1e149
    call = partial(sd.attitude, t, gyro, algorithm="quaternion:order=1,normalise=false")
    with pytest.raises(DivergenceError) as refused:
        call()
    increments = increments_from_imu(imu_table(t, gyro))
    with pytest.raises(DivergenceError) as whole:
        run_attitude(make_algorithm("quaternion:order=1,normalise=false"), increments)
    assert refused.value.finding.row == whole.value.finding.row > CHUNK


@pytest.mark.parametrize(
    "use",
    [
        lambda a: a.copy(),
        lambda a: pickle.loads(pickle.dumps(a)),
        lambda a: copy.deepcopy(a),
        lambda a: copy.copy(a),
        lambda a: a.iloc[:],
        lambda a: pd.concat([a.iloc[:5], a.iloc[5:]]),
        lambda a: pd.read_json(StringIO(a.to_json(double_precision=15))).rename_axis("time"),
        lambda a: a.assign(),
        lambda a: a * 1.0,
        lambda a: a[[*a.columns]],
    ],
)
def test_angles_are_there_whatever_is_done_first(use):
    t, gyro, _ = samples()
    made = sd.attitude(t, gyro)
    known = attitude_table(t, run_quaternions(t, gyro))
    used = use(made)
    assert list(used.columns) == [*QUATERNION, *EULER]
    pd.testing.assert_frame_equal(pd.DataFrame(used), known, rtol=1e-13, check_index_type=False)
    assert np.array_equal(made["roll"], known["roll"])


def run_quaternions(t, gyro):
    run = run_attitude(make_algorithm("quaternion"), increments_from_imu(imu_table(t, gyro)))
    return run.attitude[QUATERNION].to_numpy()


def test_column_is_an_attribute_and_a_rotation_needs_no_angles():
    t, gyro, _ = samples()
    made = sd.attitude(t, gyro)
    turned = made.rotation.as_quat()
    # scipy scales each to norm 1 again.
    assert np.abs(np.roll(turned, 1, axis=1) - made[QUATERNION].to_numpy()).max() < 3e-16
    assert np.array_equal(sd.attitude(t, gyro).heading, made["heading"])
    assert np.array_equal(sd.attitude(t, gyro).rotation.as_quat(), made.rotation.as_quat())
    assert isinstance(made[10:20], type(made))
    assert "heading" in repr(sd.attitude(t, gyro))


def test_a_table_of_the_caller_is_not_shared():
    t = np.arange(0.0, 1.0, 0.01)
    gyro = np.column_stack([0.1 + 0.0 * t, 0.0 * t, 0.0 * t])
    columns = {"gyro_x": gyro[:, 0], "gyro_y": gyro[:, 1], "gyro_z": gyro[:, 2]}
    given = pd.DataFrame({"time": t.copy(), **columns})
    out = sd.attitude(given)
    given.loc[:, "time"] += 100.0
    np.testing.assert_array_equal(out.index, t)
    stamps = t.copy()
    imu = imu_table(stamps, gyro)
    stamps += 100.0
    np.testing.assert_array_equal(imu.index, t)


def test_the_first_use_of_a_result_may_be_in_several_threads():
    t = np.arange(0.0, 50.0, 0.01)
    gyro = np.column_stack([0.1 + 0.0 * t, 0.0 * t, 0.0 * t])

    def read(out, together):
        together.wait()
        return float(out["heading"].iloc[-1])

    for _ in range(20):
        out, together = sd.attitude(t, gyro), threading.Barrier(4)
        with ThreadPoolExecutor(4) as pool:
            found = list(pool.map(read, [out] * 4, [together] * 4))
        assert len(set(found)) == 1


def test_arrays_of_the_caller_are_not_shared():
    t, gyro, _ = samples()
    made = sd.attitude(t, gyro)
    before = sd.attitude(t.copy(), gyro.copy())
    t += 1.0
    gyro *= 2.0
    pd.testing.assert_frame_equal(made, before, check_exact=True)


@pytest.mark.parametrize(
    "algorithm", ["quaternion", "rotvec", "rk4", "dcm", "dcm:order=2", "euler"]
)
def test_angles_of_one_sample_are_those_of_the_table(algorithm):
    t, gyro, _ = samples()
    filt = sd.OrientationFilter(RATE, algorithm, initial=(1.0, 0.1, -0.2))
    table = sd.attitude(t, gyro, algorithm=algorithm, initial=(1.0, 0.1, -0.2))
    for k, rate in enumerate(gyro):
        filt.update(rate)
        assert np.array_equal(filt.roll_pitch_heading, table[EULER].to_numpy()[k])
        assert np.array_equal(filt.quaternion, table[QUATERNION].to_numpy()[k])


def test_a_filter_refuses_what_it_cannot_take_and_stays_as_it_was():
    filt = sd.OrientationFilter(rate_hz=100)
    with pytest.raises(DataError, check=coded("api.no-specific-force-to-level")):
        filt.update([0.0, 0.0, 0.0])
    with pytest.raises(DataError, match="accel"):
        filt.update([0.0, 0.0, 0.0], [0.0, 0.0, -1.0])
    filt.update([0.0, 0.0, 0.0], [0.0, 0.0, -9.8])
    before = filt.update([0.1, 0.0, 0.0])
    with pytest.raises(DataError, check=coded("api.not-three-numbers")):
        filt.update([np.nan, 0.0, 0.0])
    assert np.array_equal(filt.quaternion, before)
    with pytest.raises(ConfigError):
        sd.OrientationFilter(rate_hz=0.0)


def test_algorithms_are_compared_on_a_table_as_on_its_file(tmp_path):
    t, gyro, accel = samples(800)
    table = imu_table(t, gyro, accel)
    WRITERS["npz"].write(tmp_path / "imu.npz", {"imu": table})
    ask = {"rates_hz": [50, 25], "algorithms": ["naive", "quaternion"]}
    of_table = sd.compare_attitude(table, **ask)
    of_file = sd.compare_attitude(tmp_path / "imu.npz", **ask)
    of_imu = sd.compare_attitude(sd.read_imu(tmp_path / "imu.npz", span_s=(None, 10.0)), **ask)
    assert of_table.answer == of_file.answer
    pd.testing.assert_frame_equal(of_table.sweep, of_file.sweep, check_exact=True)
    assert of_imu.imu.index[-1] <= 10.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        of_table.answer = None
    assert of_table._repr_html_().startswith("<div>")
    assert of_table.plot("gyro").panels

    of_table.save(tmp_path / "out", report=False)
    of_file.save(tmp_path / "file", report=False)
    names = ("attitude.csv", "sweep.csv", "attitude.json")
    for name in names:
        assert (tmp_path / "out" / name).read_bytes() == (tmp_path / "file" / name).read_bytes()
    kept, given = np.load(tmp_path / "out/inputs/log/imu.npz"), np.load(tmp_path / "imu.npz")
    assert all(np.array_equal(kept[name], given[name]) for name in given)
    assert sd.verify(tmp_path / "out").verdict == "identical"
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["configuration"]["source"]["path"] == "inputs/log/imu.npz"
    path = tmp_path / "out" / "attitude.csv"
    path.write_text(path.read_text().replace("1", "2", 1))
    assert sd.verify(tmp_path / "out").verdict == "changed"


@pytest.mark.parametrize(
    ("ask", "error", "words"),
    [
        (lambda: sd.attitude(pd.DataFrame({"time": [0.0, 1.0]})), DataError, "gyro_x"),
        (lambda: sd.compare_attitude(pd.DataFrame({"time": [0.0, 1.0]})), DataError, "gyro_x"),
        (lambda: sd.attitude(np.arange(3.0)), ConfigError, "gyro"),
        (lambda: sd.attitude(*samples(), algorithm="quaternoin"), ConfigError, "quaternion"),
        (lambda: sd.attitude(*samples(), initial=(1.0, 2.0)), ConfigError, "initial"),
        (lambda: sd.compare_attitude("x", sed=1), ConfigError, "seed"),
        (
            lambda: sd.attitude(
                pd.DataFrame({"time": [0, 1], **{f"gyro_{axis}": ["a", "b"] for axis in "xyz"}})
            ),
            DataError,
            "numbers",
        ),
    ],
)
def test_what_cannot_be_is_said_clearly(ask, error, words):
    with pytest.raises(error) as caught:
        ask()
    assert words in str(caught.value)


@pytest.mark.slow
def test_the_function_is_there_whatever_was_imported_before():
    call = "print(sd.attitude([0.0, 1.0], [[0.0] * 3] * 2)['q_w'].iloc[-1])"
    for first in ("", "import strapdown.api.attitude, strapdown.attitude_algorithms"):
        done = subprocess.run(
            [sys.executable, "-c", f"import strapdown as sd\n{first}\n{call}"],
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.strip() == "1.0"


def test_the_import_stays_free():
    code = (
        "import sys, strapdown; "
        "print([m for m in ('numpy', 'pandas', 'numba', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("algorithm", ["quaternion", "complementary"])
@pytest.mark.parametrize(
    ("clock", "unit", "code"),
    [
        (1.0, 1.0, None),
        (1e3, 1.0, "attitude.turn-between-samples"),
        (1.0, np.degrees(1.0), "attitude.rate-implausible"),
    ],
)
def test_arrays_in_other_units_are_doubted(algorithm, clock, unit, code):
    time = np.arange(3000) * 0.01
    gyro = np.column_stack([np.sin(time), np.cos(0.7 * time), 0.5 * np.sin(2.0 * time)])
    accel = np.tile([0.0, 0.0, -9.8], (3000, 1))
    out = sd.attitude(clock * time, unit * gyro, accel, algorithm=algorithm)
    codes = {f.code for f in out.attrs["findings"]}
    wrong = {"attitude.turn-between-samples", "attitude.rate-implausible"}
    assert codes & wrong == ({code} if code else set())


def test_a_table_in_place_of_a_path_is_said_to_need_no_reading():
    table = pd.DataFrame({"gyro_x": [0.0]})
    with pytest.raises(ConfigError, check=coded("api.table-for-path", kind="DataFrame")):
        sd.read(table)
    for read in (sd.read_imu, sd.read_gnss):
        with pytest.raises(ConfigError, check=coded("api.table-for-path", kind="ndarray")):
            read(np.zeros((3, 7)))


@pytest.mark.parametrize("algorithm", ["quaternion", "error-state"])
@pytest.mark.parametrize("exchanged", [False, True])
@pytest.mark.parametrize("spun", [0.0, 9.8])
def test_exchanged_arguments_are_doubted(algorithm, exchanged, spun):
    """A gyro that reads gravity beside an accelerometer that has none; a spin has both."""
    time = np.arange(3000) * 0.01
    gyro = np.column_stack([0.1 * np.sin(time), 0.2 * np.cos(0.7 * time), spun + 0.0 * time])
    sway = 0.5 * np.sin(9.0 * time)
    accel = np.column_stack([sway, -sway, -9.8 + sway])
    given = (accel, gyro) if exchanged else (gyro, accel)
    out = sd.attitude(time, *given, algorithm=algorithm)
    found = [f for f in out.findings if f.code == "attitude.gyro-and-accel-exchanged"]
    assert bool(found) == (exchanged and not spun)
    assert all(f.severity == "warning" for f in found)
