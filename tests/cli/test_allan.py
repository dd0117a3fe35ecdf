"""`strapdown allan`: what it prints and writes, how it ends, and that a filter takes its sensor."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

import strapdown as sd
from strapdown.errors import ConfigError, DataError
from strapdown.formats import csv
from strapdown.formats.clocks import RELATIVE, Clock, with_clock
from strapdown.sensors import TriadErrors, apply, load_sensor

NAMES = ["time_s", *(f"gyro_{a}_rad_s" for a in "xyz"), *(f"accel_{a}_m_s2" for a in "xyz")]
RATE = 50.0
GYRO = TriadErrors(noise_density=1e-4, random_walk=(1e-5, 2e-5, 3e-5))
ACCEL = TriadErrors(noise_density=1e-3, random_walk=5e-5)


def samples(seconds=2400.0):
    """A sensor of known noise, unmoved."""
    time = np.arange(1, int(seconds * RATE) + 1) / RATE
    level = np.tile([0.0, 0.0, -9.81], (time.size, 1))
    gyro = apply(GYRO, time, np.zeros_like(level), seed=1, sampling="mean")
    return time, gyro, apply(ACCEL, time, level, seed=2, sampling="mean")


def written(path, *triads):
    """A log of a time and one or two triads."""
    columns = dict(zip(NAMES, [triads[0], *np.hstack(triads[1:]).T], strict=False))
    csv.write(path, columns, {"axes": "forward-right-down", "sampling": "mean"})
    return path


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return written(tmp_path_factory.mktemp("allan") / "unmoved.csv", *samples())


@pytest.fixture(scope="module")
def gyros(tmp_path_factory):
    """A log without accelerometers: what it takes is the fit, of each channel on its own."""
    return written(tmp_path_factory.mktemp("allan") / "gyros.csv", *samples(600.0)[:2])


@pytest.fixture(scope="module")
def run():
    return sd.allan(samples())


def test_the_terminal_and_the_folder(log, run_cli, tmp_path):
    own = tmp_path / "mine.toml"
    out = tmp_path / "out"
    options = ["--sensor-file", own, "--for", "kf-gins", "--out", out]
    done = run_cli("allan", log, *options)
    assert done.code == 0, done.err
    assert len(done.out.splitlines()) <= 40
    assert "arw" in done.out
    assert sorted(p.name for p in out.iterdir() if p.suffix in (".csv", ".toml", ".html")) == [
        "deviations.csv",
        "report.html",
        "sensor.toml",
    ]
    assert own.read_bytes() == (out / "sensor.toml").read_bytes()
    found = json.loads((out / "allan.json").read_text())
    assert found["channels"]["gyro_z"]["terms"]["N"]["observable"] is True
    assert found["channels"]["gyro_z"]["terms"]["B"]["value"] is None
    assert found["parameters"]["program"] == "KF-GINS"
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Allan deviation" in page
    assert len(page) < 2_000_000


def test_json_alone_and_what_was_asked_is_verified(gyros, run_cli, tmp_path):
    options = ["--sensor-file", tmp_path / "mine.toml", "--for", "kf-gins"]
    done = run_cli("allan", gyros, *options, "--json", "--out", tmp_path / "a")
    found = json.loads(done.out)
    assert set(found) == {"record", "channels", "sensor", "findings", "parameters"}
    assert run_cli("verify", tmp_path / "a").code == 0


def test_refusals(log, run_cli, tmp_path):
    done = run_cli("allan", log, "--for", "KFGINS", "--out", tmp_path / "b")
    assert done.code == 4
    assert "--for" in done.err
    assert "KF-GINS" in done.err
    assert run_cli("allan", log, "--sensor-file", tmp_path / "x.txt").code == 4
    (tmp_path / "there.toml").write_text("")
    assert run_cli("allan", log, "--sensor-file", tmp_path / "there.toml").code == 4
    assert run_cli("allan", tmp_path / "none.csv").code == 4
    assert run_cli("allan", log, "--to", "30").code == 3


def test_the_intervals_contain_the_specification_of_the_simulated_sensor(run):
    """The loop is closed: simulated by the error model, fitted, and given back to it."""
    truth = {("gyro", "N"): [1e-4] * 3, ("gyro", "K"): [1e-5, 2e-5, 3e-5]}
    truth |= {("accel", "N"): [1e-3] * 3, ("accel", "K"): [5e-5] * 3}
    inside, seen = [], 0
    for (triad, term), values in truth.items():
        for axis, value in zip("xyz", values, strict=True):
            found = run.noise[f"{triad}_{axis}"].term(term)
            seen += found.observable
            inside.append(found.low <= value <= found.high)
    # Twelve intervals of 95 %: three or more outside have a probability of 2 %.
    assert sum(inside) >= 10
    # Of a walk, a Gauss-Markov process slower than the record shows is not always excluded.
    assert seen >= 10
    assert run.errors.gyro.axis("random_walk") == pytest.approx([1e-5, 2e-5, 3e-5], rel=0.3)


def test_the_sensor_file_is_the_error_model(run):
    sensor = load_sensor(run.sensor)
    for triad in ("gyro", "accel"):
        for name in ("noise_density", "random_walk", "bias_instability"):
            written = getattr(sensor.imu_errors, triad).axis(name)
            # The file has six digits.
            assert written == pytest.approx(getattr(run.errors, triad).axis(name), rel=1e-5)
    aligned = sd.align(
        samples(120.0), site=(45.0, 0.0, 0.0), sensor=run.sensor, method="levelling", fine=False
    )
    assert aligned.spec.sensors.sensor == str(run.sensor)


def test_a_result_in_memory(run, tmp_path):
    assert isinstance(run.deviations, pd.DataFrame)
    assert set(run.deviations.columns) >= {"channel", "tau", "allan", "modified", "hadamard"}
    white = run.deviations.query("channel == 'gyro_x' and tau < 0.5")
    # White noise dominates: N/√tau, within the scatter of 120,000 samples.
    np.testing.assert_allclose(white["allan"] * np.sqrt(white["tau"]), 1e-4, rtol=0.03)
    assert list(run.to_pandas().columns) == [
        *("channel", "term", "value", "low", "high", "observable")
    ]
    table = run.parameters("kalibr").set_index("parameter")
    assert table.loc["gyroscope_noise_density", "x"] == run.errors.gyro.axis("noise_density")[0]
    assert run.plot().svg().startswith("<svg")
    seal = run.save(tmp_path / "out")
    assert (seal.path / "inputs").is_dir()
    assert sd.verify(seal.path).verdict == "identical"


@pytest.mark.parametrize("where", ["column", "stream"])
def test_the_temperature_of_a_log_is_regarded(where, monkeypatch, tmp_path):
    time, gyro, _ = samples(600.0)
    warm = 25.0 + 3.0 * np.sin(2.0 * np.pi * time / 400.0)
    gyro[:, 0] += 1e-3 * warm
    columns = dict(zip(NAMES, [time, *gyro.T], strict=False))
    if where == "column":
        columns |= {"IMU temp [degF]": 1.8 * warm + 32.0, "humidity": warm}
    csv.write(tmp_path / "log.csv", columns, {"axes": "forward-right-down"})

    def stream(path, name, form):
        assert name == "barometer"
        table = pd.DataFrame({"temperature": warm}, index=pd.Index(time, name="time"))
        return with_clock(table, Clock(RELATIVE))

    if where == "stream":
        monkeypatch.setattr("strapdown.formats.aid_table.holds", lambda path, stream: True)
        monkeypatch.setattr("strapdown.formats.aid_table.read_stream", stream)
    run = sd.allan(tmp_path / "log.csv")
    effect = run.noise["gyro_x"].term("C")
    assert effect.observable
    assert effect.low < 1e-3 < effect.high
    assert not run.noise["gyro_y"].term("C").observable
    unused = [f.data["names"] for f in run.findings if f.code == "io.columns-not-used"]
    assert unused == ([("humidity",)] if where == "column" else [])
    if where == "column":
        page = (run.save(tmp_path / "out").path / "report.html").read_text(encoding="utf-8")
        assert "effect of temperature" in page


def test_several_logs_of_one_sensor_are_fitted_together(run_cli, log, tmp_path):
    time, gyro, accel = samples(600.0)
    short = sd.allan((time, gyro), (time, gyro[::-1]))
    assert short.length == pytest.approx(2.0 * (time[-1] - time[0]))
    assert [one.name for one in short.stretches] == ["imu.npz", "imu-2.npz"]
    seal = short.save(tmp_path / "two")
    assert sd.verify(seal.path).verdict == "identical"
    assert "of 2 logs" in (seal.path / "sensor.toml").read_text()
    with pytest.raises(DataError) as refused:
        sd.allan((time, gyro, accel), (2.0 * time, gyro, accel))
    assert refused.value.finding.code == "allan.logs-differ"
    done = run_cli("allan", log, tmp_path / "none.csv", "--out", tmp_path / "x")
    assert done.code == 4
    assert "none.csv" in done.err


def test_a_log_that_moved_is_cut_or_refused(run):
    time, gyro, accel = samples(300.0)
    gyro[(time > 200.0) & (time < 210.0)] += 0.5
    cut = sd.allan((time, gyro, accel))
    assert 195.0 < cut.end - cut.start < 201.0
    assert {"allan.moved", "allan.short"} <= {f.code for f in cut.findings}
    with pytest.raises(DataError) as refused:
        sd.allan(samples(40.0))
    assert refused.value.finding.code == "allan.too-short-to-rest"
    with pytest.raises(ConfigError):
        sd.allan((time, gyro, accel), rate_hz=100.0)
    short = samples(40.0)[:2]
    with pytest.raises(DataError) as refused:
        sd.allan(short)
    assert refused.value.finding.code == "allan.too-short-to-rest"
    moving = samples(90.0)
    moving[1][:] += 0.5 * np.sin(moving[0])[:, None]
    with pytest.raises(DataError) as refused:
        sd.allan(moving)
    assert refused.value.finding.code == "allan.not-at-rest"
    only = sd.allan(short, at_rest=True)
    assert only.end == pytest.approx(40.0)
    assert set(only.noise) == {"gyro_x", "gyro_y", "gyro_z"}
    assert only.errors.accel is None
