"""Lines from a pipe, and from datagrams over this machine's own network."""

from __future__ import annotations

import os
import socket
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from tests.coded import coded

from strapdown.errors import ConfigError
from strapdown.live.lines import BadLineError, parse_line
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


def test_a_line_without_end_is_one_line_that_no_parser_accepts():
    """Whatever its length, little of it is kept, and the line after it is whole."""
    long = b"imu,1,2,3,4,5,6,7" + b" " * 200_000
    parts = [long[k : k + 65_536] for k in range(0, len(long), 65_536)]
    data = iter([b"a\n", *parts, b" 8\nb\n", b"#" * 5000 + b"\nc", b""])
    source = LineSource("test", lambda: next(data), MachineClock(), lambda: None, whole=False)
    found = texts(source)
    assert [text for _, text in found if len(text) < 5] == ["a", "b", "c"]
    others = [text for _, text in found if len(text) > 5]
    assert len(others) == 2
    for text in others:
        assert len(text) < 100
        with pytest.raises(BadLineError):
            parse_line(text, ())
    whole = LineSource("test", iter([long, b""]).__next__, MachineClock(), lambda: None)
    assert [len(text) < 100 for _, text in texts(whole)] == [True]


def test_only_others_need_a_token_and_it_is_drawn():
    sources = [open_source("udp://127.0.0.1:0", MachineClock(), None) for _ in range(2)]
    tokens = {source.token for source in sources}
    assert len(tokens) == 2
    assert min(map(len, tokens)) >= 16
    own = open_source("udp://127.0.0.1:0", MachineClock(), None, "word-of-mine")
    assert own.token == "word-of-mine"
    for source in (*sources, own):
        source.close()
    with Path(os.devnull).open("rb") as stdin:
        assert open_source("-", MachineClock(), stdin).token is None
        with pytest.raises(ConfigError, check=coded("live.only-with")):
            open_source("-", MachineClock(), stdin, "word-of-mine")
    for bad in ("", "short", "two words", "with,comma", "x" * 129, "näv-näv-näv"):
        with pytest.raises(ConfigError, check=coded("live.bad-token")):
            open_source("udp://127.0.0.1:0", MachineClock(), None, bad)
