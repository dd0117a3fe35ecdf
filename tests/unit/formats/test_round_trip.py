"""Every writer's file is read back by its reader to the same bits."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from strapdown.attitude_algorithms import make_algorithm, run_attitude
from strapdown.formats import read_log
from strapdown.formats.references import read_truth
from strapdown.formats.writers import LOG_FORMATS, WRITERS, write_attitude_csv
from strapdown.increments import increments_from_imu
from strapdown.tables import QUATERNION, imu_table


def tables(sampling: str, *, accel: bool):
    rng = np.random.default_rng(1)
    time = 5.0 + np.cumsum(rng.uniform(0.001, 0.03, 200))
    imu = imu_table(
        time,
        rng.normal(size=(200, 3)),
        rng.normal(size=(200, 3)) - [0.0, 0.0, 9.8] if accel else None,
        sampling=sampling,
        source="log",
    )
    truth = run_attitude(make_algorithm("quaternion"), increments_from_imu(imu)).attitude
    return imu, truth


@pytest.mark.parametrize("accel", [False, True])
@pytest.mark.parametrize("sampling", ["instantaneous", "mean"])
@pytest.mark.parametrize("suffix", LOG_FORMATS)
def test_a_log_and_its_truth_come_back_as_they_were(tmp_path, suffix, sampling, accel):
    imu, truth = tables(sampling, accel=accel)
    path = tmp_path / f"log.{suffix}"
    WRITERS[suffix].write(path, {"imu": imu, "reference": truth})
    back = read_log(path)
    assert np.array_equal(back.imu.to_numpy(), imu.to_numpy())
    assert np.array_equal(back.imu.index, imu.index)
    assert list(back.imu.columns) == list(imu.columns)
    assert back.imu.attrs["sampling"] == sampling
    assert np.array_equal(back.truth[QUATERNION], truth[QUATERNION])
    assert back.findings == ()  # our own files leave nothing to guess


@pytest.mark.parametrize("suffix", LOG_FORMATS)
def test_without_truth_there_is_none(tmp_path, suffix):
    imu, _ = tables("mean", accel=False)
    WRITERS[suffix].write(tmp_path / f"log.{suffix}", {"imu": imu})
    assert read_log(tmp_path / f"log.{suffix}").truth is None


@pytest.mark.parametrize("suffix", LOG_FORMATS)
def test_the_same_log_gives_the_same_bytes(tmp_path, suffix):
    imu, truth = tables("mean", accel=True)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        WRITERS[suffix].write(tmp_path / name / f"log.{suffix}", {"imu": imu, "reference": truth})
    a, b = ((tmp_path / n / f"log.{suffix}").read_bytes() for n in ("a", "b"))
    assert a == b


def test_an_attitude_comes_back(tmp_path):
    _, truth = tables("mean", accel=False)
    write_attitude_csv(tmp_path / "truth.csv", truth)
    back = read_truth(tmp_path / "truth.csv")
    assert np.array_equal(back[QUATERNION], truth[QUATERNION])
    assert np.array_equal(back.index, truth.index)


@pytest.mark.skipif(sys.platform == "win32", reason="no limit of a file's size")
def test_a_full_disk_is_an_error_of_the_system_and_nothing_else(tmp_path):
    """The limit of a file's size stands for the disk; HDF5 itself ended the process at it."""
    code = f"""
import resource, signal
from pathlib import Path
import numpy as np
from strapdown.formats.writers import WRITERS
from strapdown.tables import imu_table
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
time = np.arange(1.0, 3001.0) / 100.0
log = imu_table(time, np.random.default_rng(1).normal(size=(3000, 3)), None, sampling="mean")
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
for suffix in {tuple(LOG_FORMATS)!r}:
    try:
        WRITERS[suffix].write(Path("log").with_suffix("." + suffix), {{"imu": log}})
    except OSError:
        print(suffix, "refused", flush=True)
"""
    run = [sys.executable, "-c", code]
    done = subprocess.run(run, cwd=tmp_path, capture_output=True, text=True, check=True)
    refused = "".join(f"{suffix} refused\n" for suffix in LOG_FORMATS)
    assert (done.stdout, done.stderr) == (refused, "")
