"""A file is detected once, anew when it changes; an archive of many tables is refused unopened."""

from __future__ import annotations

import os
import zipfile

import pytest

from strapdown.errors import DataError
from strapdown.formats import READERS, open_stream, reader_of, sensor_folder
from strapdown.formats.signs import state_of

SENSOR = "time,seconds_elapsed,z,y,x\n" + "".join(f"{k},0,0,0,{k}\n" for k in range(5))


@pytest.fixture
def detections(monkeypatch):
    """Count detections by the first reader of the table."""
    counted = []
    first = next(iter(READERS))
    original = READERS[first]

    def detect(path, data=None):
        counted.append(path)
        return False

    monkeypatch.setitem(READERS, first, original.__class__(original.title, detect, {}))
    return counted


def test_a_file_that_stays_as_it_is_is_detected_once(detections, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,gyro_x\n0,1\n1,2\n")
    assert [reader_of(path)[0] for _ in range(3)] == ["csv"] * 3
    assert detections == [path]


def test_a_file_of_the_same_size_and_time_is_detected_by_its_content(tmp_path):
    path = tmp_path / "log.dat"
    path.write_text("time_s,gyro_x\n0,1\n1,2\n")
    about = path.stat()
    assert reader_of(path)[0] == "csv"
    path.write_bytes(b"ULog\x01\x12\x35\x01".ljust(about.st_size, b"\0"))
    os.utime(path, ns=(about.st_atime_ns, about.st_mtime_ns))
    assert reader_of(path)[0] == "px4"


def test_a_folder_is_detected_anew_when_a_file_in_it_changes(detections, tmp_path):
    (tmp_path / "Gyroscope.csv").write_text(SENSOR)
    assert [reader_of(tmp_path)[0] for _ in range(2)] == ["sensor-logger"] * 2
    assert detections == [tmp_path]
    (tmp_path / "Gyroscope.csv").write_text("t,x,y,z\n0,1,2,3\n1,2,3,4\n")
    assert reader_of(tmp_path)[0] == "sensor-folder"


def test_a_folder_of_very_many_files_and_a_missing_one_have_no_state(tmp_path):
    for k in range(201):
        (tmp_path / f"{k}.csv").touch()
    assert state_of(tmp_path) == state_of(tmp_path / "none") == ()


def archive_of(path, tables, others=0):
    with zipfile.ZipFile(path, "w") as archive:
        for k in range(tables - 1):
            archive.writestr(f"a{k}.csv", "")
        archive.writestr("Gyroscope.csv", SENSOR)
        for k in range(others):
            archive.writestr(f"Camera/{k}.jpg", "")
    return path


@pytest.mark.parametrize("stream", ["imu", "gnss", "reference"])
def test_an_archive_of_more_tables_than_a_recording_has_is_refused(stream, monkeypatch, tmp_path):
    path = archive_of(tmp_path / "z.zip", sensor_folder.MOST_TABLES + 1)
    opened = []
    monkeypatch.setattr(sensor_folder.Member, "_bytes", lambda self, _: opened.append(self) or b"")
    with pytest.raises(DataError) as caught:
        open_stream(path, stream)
    found = caught.value.finding
    assert (found.code, found.data["count"]) == (
        "io.too-many-members",
        sensor_folder.MOST_TABLES + 1,
    )
    assert not opened


def test_pictures_beside_the_tables_of_a_phone_do_not_count(tmp_path):
    path = archive_of(tmp_path / "z.zip", 3, others=300)
    assert reader_of(path)[0] == "sensor-logger"
    assert "gyro_x" in {q for q, _ in open_stream(path, "imu").stated.values()}
