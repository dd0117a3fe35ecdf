"""Lines from a pipe, and from datagrams over this machine's own network."""

from __future__ import annotations

import os
import socket
from urllib.parse import urlsplit

import pytest
from tests.coded import coded

from strapdown.errors import ConfigError
from strapdown.live.replay import MachineClock
from strapdown.live.sources import LineSource, open_source


def texts(source):
    """Lines to the end."""
    source.begin()
    out = []
    while True:
        try:
            line = source.next(5.0)
        except TimeoutError:
            pytest.fail("nothing came")
        if line is None:
            return out
        out.append((line.number, line.text))


def test_lines_of_a_stream_are_whole_however_they_come():
    parts = iter([b"imu,1", b",2\nimu,", b"3\n\nim", b"u,4", b""])
    source = LineSource("test", lambda: next(parts), MachineClock(), lambda: None, whole=False)
    assert texts(source) == [(1, "imu,1,2"), (2, "imu,3"), (3, "imu,4")]


def test_a_pipe():
    read, write = os.pipe()
    with os.fdopen(read, "rb") as end:
        os.write(write, b"a\nb\n\xff\n")
        os.close(write)
        assert texts(open_source("-", MachineClock(), end)) == [(1, "a"), (2, "b"), (3, "\ufffd")]


def test_datagrams():
    source = open_source("udp://127.0.0.1:0", MachineClock(), None)
    address = urlsplit(source.name)
    source.begin()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for data in (b"one", b"", b"two\nthree\n"):
            sender.sendto(data, (address.hostname, address.port))
    # Without a host and over this machine alone nothing is lost, and the order is kept.
    assert [source.next(5.0).text for _ in range(3)] == ["one", "two", "three"]
    source.close()


def test_nothing_comes_for_a_while():
    source = open_source("udp://127.0.0.1:0", MachineClock(), None)
    source.begin()
    with pytest.raises(TimeoutError):
        source.next(0.01)
    source.close()


def test_without_a_host_it_is_this_machine_alone():
    source = open_source("udp://:0", MachineClock(), None)
    assert source.name.startswith("udp://127.0.0.1:")
    source.close()


@pytest.mark.parametrize("where", ["", "tcp://127.0.0.1:1", "udp://", "udp://x:99999", "5555"])
def test_what_nothing_comes_from(where):
    with pytest.raises(ConfigError, match="--live"):
        open_source(where, MachineClock(), None)


def test_a_port_that_is_taken():
    one = open_source("udp://127.0.0.1:0", MachineClock(), None)
    with pytest.raises(ConfigError, check=coded("live.cannot-listen")):
        open_source(one.name, MachineClock(), None)
    one.close()
