"""``strapdown convert`` as a person meets it, on made logs and on recordings."""

from __future__ import annotations

import json

import numpy as np
import pytest
from tests.contracts.test_writers import ROWS, streams
from tests.recorded import DATA, without

import strapdown as sd
from strapdown.formats import read_log
from strapdown.formats.clocks import own_ns
from strapdown.formats.gnss_files import read_gnss
from strapdown.formats.gnss_fixes import GnssOptions
from strapdown.formats.recording import ReadOptions
from strapdown.tables import ACCEL, GYRO


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_way_there_and_back(here, run_cli):
    made = streams()
    made.pop("wheel")
    sd.write(made["imu"], "imu.csv")
    sd.write(made["gnss"], "gnss.csv")
    done = run_cli("convert", "imu.csv", "gnss.csv", "a.mcap")
    assert done.code == 0
    assert "forward-left-up" in done.out
    assert "Wrote a.mcap" in done.out
    done = run_cli("convert", "a.mcap", "back.parquet", "--axes", "forward-left-up")
    assert done.code == 0
    assert "--streams gnss" in done.err
    back = read_log("back.parquet").imu
    assert np.array_equal(back[[*GYRO, *ACCEL]], made["imu"][[*GYRO, *ACCEL]])
    assert np.array_equal(own_ns(back), own_ns(made["imu"]))
    done = run_cli("convert", "a.mcap", "fixes.csv", "--streams", "gnss")
    assert done.code == 0
    assert np.array_equal(read_gnss("fixes.csv")["lat"], made["gnss"]["lat"])


def test_json_names_what_was_written_and_what_was_not(here, run_cli):
    sd.write(streams()["imu"], "imu.csv")
    sd.write(streams()["gnss"], "gnss.csv")
    found = json.loads(
        run_cli("convert", "imu.csv", "gnss.csv", "o", "--as", "euroc", "--json").out
    )
    written = {f["quantity"]: f for f in found["findings"] if f["code"] == "io.stream-written"}
    assert list(written) == ["imu"]
    assert written["imu"]["data"]["rows"] == ROWS
    left = [f["quantity"] for f in found["findings"] if f["code"] == "io.stream-not-written"]
    assert left == ["gnss"]


def test_it_keeps_what_exists_and_asks_for_what_it_does_not_know(here, run_cli):
    sd.write(streams("relative")["gnss"], "gnss.csv")
    (here / "a.nmea").write_text("mine")
    assert run_cli("convert", "gnss.csv", "a.nmea").code == 4
    refused = run_cli("convert", "gnss.csv", "b.nmea")
    assert refused.code == 3
    assert "--epoch" in refused.err
    assert not (here / "b.nmea").exists()
    assert (here / "a.nmea").read_text() == "mine"
    more = ("--epoch", "2026-05-01T12:00:00Z", "--geoid", "46.5", "--force", "--quiet")
    done = run_cli("convert", "gnss.csv", "a.nmea", *more)
    assert (done.code, done.out, done.err) == (0, "", "")
    back = read_gnss("a.nmea", GnssOptions(unstated_velocity_sd=1.0))
    assert back["alt"].iloc[0] == pytest.approx(520.0, abs=1e-3)
    assert run_cli("convert", "gnss.csv", "c.nmea", "--epoch", "2026-05-01T12:00:00").code == 4
    assert run_cli("convert", "gnss.csv").code == 4
    assert run_cli("convert", "gnss.csv", "gnss.csv", "d.nmea", "--epoch", more[1]).code == 4


def test_an_unknown_target_is_told_all_formats(here, run_cli):
    sd.write(streams()["imu"], "imu.csv")
    refused = run_cli("convert", "imu.csv", "a.xyz")
    assert refused.code == 4
    assert "euroc" in refused.err
    assert "kf-gins" in refused.err
    assert run_cli("convert", "imu.csv", "a", "--as", "eurok").code == 4
    assert [p.name for p in here.iterdir()] == ["imu.csv"]


def test_a_part_of_every_stream(here, run_cli):
    made = streams("relative")
    for name in ("imu", "gnss"):
        sd.write(made[name], f"{name}.csv")
    done = run_cli(
        "convert", "imu.csv", "gnss.csv", "o", "--as", "kf-gins", "--from", "1", "--to", "2"
    )
    assert done.code == 0
    for name in ("imu", "gnss"):
        time = np.loadtxt(here / "o" / f"{name}.txt")[:, 0]
        assert 1.0 <= time.min() < 1.3
        assert 1.7 < time.max() <= 2.0


def test_a_question_of_the_log_stops(here, run_cli):
    lines = ["time_s,wx,wy,wz,ax,ay,az"] + [f"{0.01 * k:.2f},0,0,{k % 7},0,0,0" for k in range(300)]
    (here / "log.csv").write_text("\n".join(lines) + "\n")
    refused = run_cli("convert", "log.csv", "a.mcap")
    assert refused.code == 3
    assert "--gyro-unit" in refused.err
    assert not (here / "a.mcap").exists()


def test_a_result_gives_its_log_and_its_trajectory(here, run_cli):
    assert run_cli("simulate", "drive-town", "--rate", "10", "--out", "town", "--quiet").code == 0
    for out in ("town.tum", "town.kml", "town.geojson", "town.nav"):
        assert run_cli("convert", "town", out, "--quiet").code == 0, out
    assert run_cli("convert", "town", "town.nmea").code == 3
    dateless = run_cli("convert", "town", "dateless.gpx")
    assert dateless.code == 0 and "--epoch" in dateless.out + dateless.err
    for out in ("town.gpx", "town.nmea", "town.geoparquet"):
        assert run_cli("convert", "town", out, "--epoch", "2026-05-01T12:00:00Z").code == 0, out
    date = ("--epoch", "2026-05-01T12:00:00Z")
    assert run_cli("convert", "town", "k", "--as", "kitti", "--quiet", *date).code == 0
    back, truth = read_log("k"), read_log("town/log.csv")
    assert np.array_equal(back.imu[[*GYRO, *ACCEL]], truth.imu[[*GYRO, *ACCEL]])


def test_python_writes_a_table_or_streams(here):
    made = streams()
    found = {f.code: f for f in sd.write({"imu": made["imu"], "gnss": made["gnss"]}, "a.mcap")}
    assert found["io.stream-written"].severity == "note"
    assert len(sd.read("a.mcap")["gnss"]) == len(made["gnss"])
    sd.write(made["reference"], "a.tum", origin=(48.1, 11.5, 500.0))
    with pytest.raises(sd.errors.DataError):
        sd.write(made["imu"].rename(columns=str.upper), "b.csv")


# Recordings.


def recorded(path: str):
    if not (DATA / path).exists():
        without(path)
    return str(DATA / path)


def test_a_flight_log(here, run_cli):
    log = recorded("zoo/px4_ulg/sample_log_small.ulg")
    assert run_cli("convert", log, "a.mcap", "--quiet").code == 0
    options = ReadOptions(axes="x,-y,-z", sampling="mean")
    back, direct = read_log("a.mcap", options), read_log(log)
    assert np.array_equal(back.imu[GYRO], direct.imu[GYRO])
    assert np.array_equal(own_ns(back.imu), own_ns(direct.imu))
    assert run_cli("convert", log, "kf", "--as", "kf-gins", "--quiet").code == 0
    again = read_log("kf").imu
    # A product with the interval and a division by it; stamps are rounded to ns of 5 ms.
    assert again[GYRO].to_numpy() == pytest.approx(direct.imu[GYRO].to_numpy(), rel=1e-6, abs=1e-12)


def test_a_drive_with_rtk(here, run_cli):
    imu, gnss = (recorded(f"car_rtk/part1_{n}.csv") for n in ("imu_frd_si", "gnss_rtk"))
    assert run_cli("convert", imu, gnss, "a.mcap", "--quiet").code == 0
    fixes, direct = read_gnss("a.mcap"), read_gnss(gnss)
    for column in ("lat", "lon", "alt", "VN", "VE", "VD"):
        assert np.array_equal(fixes[column], direct[column])
    assert fixes["north_sd"].to_numpy() == pytest.approx(direct["north_sd"].to_numpy(), rel=4e-16)


def test_a_phone_with_fixes_without_accuracy(here, run_cli):
    phone = recorded("phone_comma2k19")
    assert run_cli("convert", phone, "a.mcap", "--quiet").code == 0
    fixes = read_gnss("a.mcap", GnssOptions(unstated_position_sd=5.0, unstated_velocity_sd=1.0))
    direct = read_gnss(phone, GnssOptions(position_sd=5.0, velocity_sd=1.0))
    assert np.array_equal(fixes[["VN", "VE"]], direct[["VN", "VE"]])
    back = read_log("a.mcap", ReadOptions(axes="x,-y,-z"))
    assert np.array_equal(back.imu[ACCEL], read_log(phone).imu[ACCEL])
