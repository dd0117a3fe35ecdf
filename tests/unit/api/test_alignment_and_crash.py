"""`strapdown.align`, `outage`, `reconstruct` and `read`: data out, and sealed as it was."""

from __future__ import annotations

import dataclasses

import numpy as np
import pandas as pd
import pytest
from tests.coded import coded

import strapdown as sd
from strapdown.config.crash_case import CaseSpec
from strapdown.crash.case import run_case
from strapdown.errors import ConfigError, DataError
from strapdown.formats.writers import WRITERS
from strapdown.sensors.catalogue import load_sensor
from strapdown.simulation import Origin, PathMotion, StationaryMotion, simulate_imu
from strapdown.simulation.motion import Track

SITE = (55.75, 37.62, 150.0)
SENSOR = "fog-1000"


@pytest.fixture(scope="module")
def rest():
    motion = StationaryMotion(120.0, Origin(*SITE), 1.0, -2.0, 40.0)
    imu, _ = simulate_imu(motion, load_sensor(SENSOR).draw(1), rate=50.0, sampling="mean", seed=1)
    return imu


def test_an_alignment_of_a_table_is_that_of_its_file_and_is_verified(rest, tmp_path):
    WRITERS["npz"].write(tmp_path / "imu.npz", {"imu": rest})
    before = rest.copy()
    ask = {"site": SITE, "sensor": SENSOR, "fine": False}
    one, two = sd.align(rest, **ask), sd.align(tmp_path / "imu.npz", **ask)
    assert rest.equals(before)
    pd.testing.assert_frame_equal(one.attitude, two.attitude, check_exact=True)
    assert np.array_equal(one.end.covariance, two.end.covariance)
    # Three standard deviations of what it says itself.
    error = np.abs(one.end.roll_pitch_heading - [1.0, -2.0, 40.0])
    assert (error < 3.0 * one.end.sd_deg + 1e-6).all()
    assert repr(one).startswith("<AlignmentRun imu.npz: at the end roll")
    assert one._repr_html_() and one.plot().panels and one.plot("heading").panels
    with pytest.raises(dataclasses.FrozenInstanceError):
        one.attitude = None
    one.save(tmp_path / "out", report=False)
    assert sd.verify(tmp_path / "out").verdict == "identical"
    path = tmp_path / "out" / "attitude.csv"
    path.write_text(path.read_text().replace("1", "2", 1))
    assert sd.verify(tmp_path / "out").verdict == "changed"


def test_an_alignment_reads_fixes_as_they_were_read(tmp_path):
    """Columns, standard deviations and repair, as arguments of `read_gnss` and as keys."""
    drive = PathMotion(
        30.0,
        Origin(*SITE),
        30.0,
        speed=Track((0.0, 15.0), (12.0, 18.0)),
        turn_rate=Track((0.0,), (4.0,)),
    )
    imu, _ = simulate_imu(drive, load_sensor("icm-42688-p").draw(7), rate=50.0, seed=7)
    WRITERS["npz"].write(tmp_path / "imu.npz", {"imu": imu})
    time = np.arange(0.0, 30.0, 0.5)
    rows = drive.trajectory(time)[["lat", "lon", "alt", "VN", "VE", "VD"]].round(9)
    rows.columns = ["breite", "lon_deg", "alt_m", "VN_m_s", "VE_m_s", "VD_m_s"]
    rows.index.name = "time_s"
    rows.to_csv(tmp_path / "fixes.csv")
    with (tmp_path / "fixes.csv").open("a") as file:
        file.write("29.6,nan,1,2,3,4,5\n")
    stated = {
        "columns": {"lat": "breite"},
        "position_sd_m": 1.0,
        "velocity_sd_m_per_s": 0.05,
        "repair": True,
    }
    asked = {"sensor": "icm-42688-p", "method": "gnss_course", "site": SITE}
    fixes = sd.read_gnss(tmp_path / "fixes.csv", **stated)
    run = sd.align(tmp_path / "imu.npz", gnss=fixes, **asked)
    assert run.spec.gnss.options().repair
    assert run.end.roll_pitch_heading[2] == pytest.approx(
        np.interp(run.attitude.index[-1], time, drive.trajectory(time)["heading"]), abs=3.0
    )
    (tmp_path / "align.toml").write_text(
        f"""
        site = {{ lat_deg = {SITE[0]}, lon_deg = {SITE[1]}, alt_m = {SITE[2]} }}
        log.path = "imu.npz"
        sensors.sensor = "icm-42688-p"
        coarse.kind = "gnss_course"
        fine.kind = "none"
        [gnss]
        path = "fixes.csv"
        columns.lat = "breite"
        position_sd_m = 1.0
        velocity_sd_m_per_s = 0.05
        repair = true
        """
    )
    by_keys = sd.align(tmp_path / "align.toml")
    pd.testing.assert_frame_equal(run.attitude, by_keys.attitude, check_exact=True)
    run.save(tmp_path / "out", report=False)
    assert sd.verify(tmp_path / "out").verdict == "identical"
    with pytest.raises(DataError):
        sd.align(tmp_path / "imu.npz", gnss=tmp_path / "fixes.csv", **asked)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        ({"site": SITE}, "sensor"),
        ({"sensor": SENSOR}, "lat"),
        ({"sensor": SENSOR, "site": (1.0,)}, "site"),
        ({"sensor": SENSOR, "site": SITE, "method": "inertial_frme"}, "inertial_frame"),
        ({"sensor": SENSOR, "site": {"lat_deg": 1.0, "lon_deg": 2.0, "height": 3.0}}, "height"),
    ],
)
def test_what_an_alignment_lacks_is_named_by_its_argument(rest, ask, words):
    with pytest.raises(ConfigError) as caught:
        sd.align(rest, **ask)
    assert words in str(caught.value)
    assert "--" not in str(caught.value)


def test_the_drift_of_an_outage_is_data(tmp_path):
    run = sd.outage("adis16470", 20.0, motion={"speed_m_per_s": 15.0}, start={"aided_s": 0.0})
    assert run.bound_m.index[-1] == 20.0
    assert run.bound_m.is_monotonic_increasing
    assert len(run.to_pandas()) == len(run.bound_m)
    assert "after 20 s" in repr(run)
    assert run.plot().panels and run._repr_html_()
    run.save(tmp_path / "out", report=False)
    assert sd.verify(tmp_path / "out").verdict == "identical"
    with pytest.raises(ConfigError):
        sd.outage("adis16470", 20.0, motion={"speed": 15.0})


@pytest.mark.slow
def test_a_case_is_reconstructed_as_by_the_engine(tmp_path, run_cli):
    assert run_cli("simulate", "pole", "-q", "--out", tmp_path / "pole").code == 0
    path = tmp_path / "pole" / "case.toml"
    case = sd.reconstruct(path)
    engine = run_case(CaseSpec.read(path), path)
    change = case.vehicles["1"].delta_v
    assert change.resultant == engine.reconstruction.main.body[0].event.resultant > 1.0
    assert change.resultant_bound > 0.0
    assert set(case.recorders) == {u.name for u in engine.reconstruction.units}
    assert case.to_pandas().equals(engine.reconstruction.summary())
    assert "delta-V" in repr(case) and "<table" in case._repr_html_()
    assert case.plot("delta-v").panels
    with pytest.raises(ConfigError, check=coded("api.unknown-case-chart", quantity="kind")):
        case.plot("nothing")
    with pytest.raises(TypeError):
        case.vehicles["1"] = None
    case.save(tmp_path / "out", report=False)
    assert not list((tmp_path / "out").glob("report.*"))
    assert sd.verify(tmp_path / "out").verdict == "identical"


def test_several_vehicles_are_numbered_in_the_order_of_their_cases(tmp_path, run_cli):
    assert run_cli("simulate", "pole", "-q", "--out", tmp_path / "pole").code == 0
    path = tmp_path / "pole" / "case.toml"
    # One vehicle by a file, the other by what was read; a recorder each, and no drawn paths.
    text = path.read_text().replace("monte_carlo_runs = 2000", "monte_carlo_runs = 0")
    path.write_text(text)
    spec = CaseSpec.read(path)
    single = spec.model_copy(update={"units": spec.units[:1]})
    first = text.index("[[units]]")
    path.write_text(text[:first] + text[text.index("[[units]]", first + 1) :])
    both, alone = sd.reconstruct(path, single), sd.reconstruct(single)
    assert list(both.vehicles) == ["1", "2"]
    assert list(alone.vehicles) == ["1"]
    # Each is what its case gives by itself, to the bit.
    assert both.vehicles["1"].delta_v.resultant == both.reconstruction.main.delta_v.resultant
    assert both.vehicles["2"].delta_v.resultant == alone.vehicles["1"].delta_v.resultant
    assert both.vehicles["2"].name == spec.units[0].name != both.vehicles["1"].name
    table = both.to_pandas()
    assert table.loc["1"].equals(both.reconstruction.summary())
    assert table.loc["2"].equals(alone.to_pandas())
    assert repr(both).count("<CrashRun") == 2
    both.save(tmp_path / "out", report=False)
    assert sd.verify(tmp_path / "out" / "1").verdict == "identical"
    assert sd.verify(tmp_path / "out" / "2").verdict == "identical"


def test_streams_of_a_file_by_name(tmp_path, rest):
    WRITERS["csv"].write(tmp_path / "log.csv", {"imu": rest})
    streams = sd.read(tmp_path / "log.csv")
    assert list(streams) == ["imu"]
    assert np.array_equal(streams["imu"].to_numpy(), rest.to_numpy())
    assert "imu: 6001 rows" in repr(streams) or "imu: 6000 rows" in repr(streams)
    with pytest.raises(DataError, check=coded("api.unknown-stream", file="log.csv")):
        streams["gnss"]
    assert streams.get("gnss") is None
    assert streams.get("imu") is streams["imu"]
    (tmp_path / "fixes.csv").write_text(
        "time_s,lat_deg,lon_deg,alt_m,north_sd_m,east_sd_m,down_sd_m\n0,1,2,3,1,1,1\n1,1,2,3,1,1,1\n"
    )
    assert list(sd.read(tmp_path / "fixes.csv")) == ["gnss"]
    with pytest.raises(ConfigError, check=coded("io.no-such-log")):
        sd.read(tmp_path / "none.csv")
