"""Files that are dropped: whole or not at all, within limits, over nothing that was there."""

from __future__ import annotations

import shutil
import time
import unicodedata
from contextlib import suppress

import pytest

from strapdown.studio.folder import STATE


def left_over(studio):
    return list((studio.folder / STATE / "uploads").iterdir())


def test_a_file_comes_as_it_was_sent(studio):
    data = bytes(range(256)) * 1000
    found = studio.put("Messung 1.csv", data)
    assert found.status == 201
    assert found.json["name"] == "Messung 1.csv" and found.json["bytes"] == len(data)
    assert (studio.folder / "Messung 1.csv").read_bytes() == data
    assert not left_over(studio)


def test_a_file_is_not_written_over_unasked(studio):
    assert studio.put("once.csv", b"first").status == 201
    again = studio.put("once.csv", b"second")
    assert (again.status, again.code) == (409, "studio.file-exists")
    assert (studio.folder / "once.csv").read_bytes() == b"first"
    assert studio.put("once.csv", b"third", "?replace=1").status == 201
    assert (studio.folder / "once.csv").read_bytes() == b"third"


def test_a_name_that_is_taken_in_another_form_or_case(studio):
    assert studio.put("Größe.csv", b"1").status == 201
    for name in ("größe.csv", "GRÖSSE.csv", unicodedata.normalize("NFD", "größe.csv")):
        for query in ("", "?replace=1"):
            assert studio.put(name, b"2", query).code == "studio.name-taken"
    (studio.folder / "folder.csv").mkdir()
    assert studio.put("folder.csv", b"2", "?replace=1").code == "studio.name-taken"
    decomposed = unicodedata.normalize("NFD", "Größe.csv")
    assert studio.put(decomposed, b"2", "?replace=1").json["name"] == "Größe.csv"


def test_a_file_beyond_the_limit(studio):
    most = studio.limits["upload"]
    # The answer comes before the body, which a server that refuses it does not wait for.
    with studio.socket() as one:
        head = f"PUT /{studio.token}/api/files/large.csv HTTP/1.1\r\nX-Strapdown: 1\r\n"
        host = f"Host: 127.0.0.1:{studio.port}\r\nContent-Length: {most + 1}\r\n\r\n"
        one.sendall((head + host).encode())
        assert b" 413 " in one.recv(4096).partition(b"\r\n")[0]
    chunked = {"Transfer-Encoding": "chunked", "Content-Length": ""}
    with suppress(OSError):
        body = b"".join(b"10000\r\n" + b"x" * 0x10000 + b"\r\n" for _ in range(40)) + b"0\r\n\r\n"
        found = studio.ask("PUT", "api/files/large.csv", raw=body, headers=chunked)
        assert (found.status, found.code) == (413, "studio.upload-too-large")
    assert not (studio.folder / "large.csv").exists()
    assert not left_over(studio)


def test_a_file_of_the_limit_itself_is_taken(studio):
    assert studio.put("most.csv", b"x" * studio.limits["upload"]).status == 201


def test_an_upload_that_stalls_leaves_nothing(studio):
    with studio.socket() as one:
        head = f"PUT /{studio.token}/api/files/stalled.csv HTTP/1.1\r\nX-Strapdown: 1\r\n"
        host = f"Host: 127.0.0.1:{studio.port}\r\nContent-Length: 1000\r\n\r\n"
        one.sendall((head + host).encode() + b"only so much")
        time.sleep(0.5)
        assert len(left_over(studio)) == 1
        answer = one.recv(4096)
        while b"studio.upload-stalled" not in answer and (more := one.recv(4096)):
            answer += more  # the body may be a packet of its own
        assert b" 422 " in answer.partition(b"\r\n")[0] and b"studio.upload-stalled" in answer
    assert not (studio.folder / "stalled.csv").exists()
    assert not left_over(studio)


def test_an_upload_that_breaks_off_leaves_nothing(studio):
    with studio.socket() as one:
        head = f"PUT /{studio.token}/api/files/broken.csv HTTP/1.1\r\nX-Strapdown: 1\r\n"
        host = f"Host: 127.0.0.1:{studio.port}\r\nContent-Length: 1000\r\n\r\n"
        one.sendall((head + host).encode() + b"only so much")
        time.sleep(0.3)
    time.sleep(0.7)
    assert not (studio.folder / "broken.csv").exists()
    assert not left_over(studio)


def test_what_a_killed_server_left_of_an_upload_is_removed(fresh):
    with fresh.socket() as one:
        head = f"PUT /{fresh.token}/api/files/half.csv HTTP/1.1\r\nX-Strapdown: 1\r\n"
        host = f"Host: 127.0.0.1:{fresh.port}\r\nContent-Length: 1000\r\n\r\n"
        one.sendall((head + host).encode() + b"half")
        time.sleep(0.5)
        fresh.kill()
    assert len(left_over(fresh)) == 1
    fresh.start()
    assert not left_over(fresh)


def test_a_disk_without_room(tmp_path, monkeypatch):
    from strapdown.errors import DataError
    from strapdown.studio.folder import Folder

    folder = Folder.open(tmp_path)
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=folder.limits.disk + 9))
    folder._check_room("a.csv", 9)
    with pytest.raises(DataError) as caught:
        folder._check_room("a.csv", 10)
    assert caught.value.finding.code == "studio.disk-full"
