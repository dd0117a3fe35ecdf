"""What is run, what is left out, and what is said of it."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from tests.coded import coded

from strapdown.errors import ConfigError, DataError
from strapdown.peers import AIDINGS, PEERS, available_peers, run_peers
from strapdown.tables import MAG, QUATERNION, imu_table

IDENTITY = (1.0, 0.0, 0.0, 0.0)


def imu(samples=50, accel=True, mag=True, jitter=0.0):
    time = np.arange(samples) * 0.01 + jitter * (np.arange(samples) % 2)
    rate = np.full((samples, 3), 0.01)
    table = imu_table(time, rate, np.tile([0, 0, -9.8], (samples, 1)) if accel else None)
    if mag:
        table[MAG] = [20.0, 0.0, 45.0]
    return table


def need(*names):
    for name in names:
        if not PEERS[name].available:
            pytest.skip(f"{name} is not installed")


def test_all_that_the_columns_allow_in_the_order_of_aiding():
    need(*PEERS)
    runs, findings = run_peers(list(PEERS), imu(), IDENTITY)
    assert [a for _, a, _ in runs] == sorted((a for _, a, _ in runs), key=AIDINGS.index)
    assert len(runs) == (1 + 1 + 2) + (1 + 1 + 3) * 2
    assert len({(label, a) for label, a, _ in runs}) == len(runs)
    assert findings == ()
    assert {a for _, a, _ in run_peers(list(PEERS), imu(mag=False), IDENTITY)[0]} == set(
        AIDINGS[:2]
    )
    assert {a for _, a, _ in run_peers(["vqf"], imu(accel=False, mag=False), IDENTITY)[0]} == {
        "gyro"
    }


def test_one_filter_of_a_library_by_name():
    need("ahrs")
    runs, _ = run_peers(["ahrs:madgwick", "ahrs:madgwick"], imu(), IDENTITY, ["gyro+accel"])
    version = PEERS["ahrs"].version
    assert [(label, a) for label, a, _ in runs] == [(f"ahrs {version} madgwick", "gyro+accel")]


def test_neither_the_table_nor_another_run_is_changed():
    need("ahrs")
    table = imu()
    before = table.copy()
    first, _ = run_peers(["ahrs:mahony", "ahrs:ekf"], table, IDENTITY)
    again, _ = run_peers(["ahrs:mahony", "ahrs:ekf"], table, IDENTITY)
    assert table.equals(before)
    for (_, _, a), (_, _, b) in zip(first, again, strict=True):
        assert np.array_equal(a[QUATERNION], b[QUATERNION])


@pytest.mark.parametrize("name", PEERS)
def test_a_library_that_is_not_there(monkeypatch, name):
    monkeypatch.setitem(sys.modules, name, None)
    assert name not in available_peers()
    with pytest.raises(ConfigError, match=rf"{name} is not installed\n.*strapdown\[peers\]"):
        run_peers([name], imu(), IDENTITY)
    with pytest.raises(ConfigError, check=coded("peers.not-installed")):
        PEERS[name].run(imu(), IDENTITY, "gyro")


@pytest.mark.parametrize(
    ("names", "aidings", "says"),
    [
        (["vqv"], None, "did you mean 'vqf'"),
        (["ahrs:madgwik"], None, "did you mean 'madgwick'"),
        (["vqf"], ["gyro+acc"], "did you mean 'gyro\\+accel'"),
    ],
)
def test_words_that_are_not_known(names, aidings, says):
    need("vqf", "ahrs")
    with pytest.raises(ConfigError, match=says):
        run_peers(names, imu(), IDENTITY, aidings)


def test_columns_that_are_not_there_are_named():
    need("vqf")
    with pytest.raises(DataError, check=coded("peers.needs-log", quantity="mag_x")):
        run_peers(["vqf"], imu(mag=False), IDENTITY, ["gyro+accel+mag"])
    with pytest.raises(DataError, check=coded("peers.needs-log", quantity="accel_x")):
        run_peers(["vqf"], imu(accel=False, mag=False), IDENTITY, ["gyro+accel"])
    table = imu()
    table.iloc[3, table.columns.get_loc("mag_y")] = np.nan
    with pytest.raises(DataError, check=coded("tables.not-finite-number", row=4, quantity="mag_y")):
        run_peers(["vqf"], table, IDENTITY, ["gyro+accel+mag"])


def test_a_filter_without_that_aiding():
    need("ahrs")
    with pytest.raises(ConfigError, check=coded("peers.does-not-run", quantity="peers: ahrs")):
        PEERS["ahrs"].run(imu(), IDENTITY, "gyro", "madgwick")


@pytest.mark.parametrize(("jitter", "said"), [(0.00004, False), (0.0001, True)])
def test_uneven_steps_are_said_once(jitter, said):
    need("vqf", "imufusion")
    # A jitter of j changes steps of 10 ms by j either way: 0.4 % and 1 % of it, and the mean.
    _, findings = run_peers(["vqf", "imufusion"], imu(samples=51, jitter=jitter * 1.01), IDENTITY)
    assert [("vqf" in f.what, "constant rate" in f.what) for f in findings] == [(True, True)] * said


def test_what_would_take_too_long_is_left_out():
    need("vqf", "ahrs")
    heard = []
    runs, findings = run_peers(
        ["vqf", "ahrs:ekf"], imu(), IDENTITY, ["gyro+accel"], longest_s=0.005, progress=heard.append
    )
    assert [label.split()[0] for label, _, _ in runs] == ["vqf"]
    assert len(heard) == 1
    assert "vqf" in heard[0]
    assert ["left out" in f.what and "ekf" in str(f) for f in findings] == [True]


@pytest.mark.parametrize("name", PEERS)
def test_the_licence_is_the_one_that_the_library_states(name):
    need(name)
    from importlib import metadata

    meta = metadata.metadata(name)
    files = [f for f in metadata.files(name) or () if "LICENSE" in f.name.upper()]
    stated = f"{meta.get('License')} {meta.get('License-Expression')} " + " ".join(
        f.read_text()[:100] for f in files
    )
    assert PEERS[name].licence in stated
