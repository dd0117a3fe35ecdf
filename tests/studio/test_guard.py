"""Who may reach a studio: token, host, origin, headers; and that nobody can hold it up."""

from __future__ import annotations

import secrets
import socket
import time
from contextlib import ExitStack, suppress

import pytest
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from strapdown.studio.guard import allowed_hosts

FOREIGN = ("http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1")


def test_the_page_is_below_the_token_alone(studio):
    assert studio.ask("GET", "").status == 200
    assert b"<title>" in studio.ask("GET", "").body
    for whole in (
        *("/", "/index.html", "/api/state", f"/{studio.token}", "//", "/..", "*"),
        f"/{studio.token[:-1]}/api/state",
        f"/{studio.token}x/api/state",
        f"/{studio.token[::-1]}/api/state",
        f"/x/{studio.token}/api/state",
    ):
        found = studio.ask("GET", "", whole=whole)
        assert found.status in (400, 404), whole
        assert studio.token.encode() not in found.body


def test_a_token_guessed_a_thousand_times_is_not_found(studio):
    for _ in range(1000):
        found = studio.ask("GET", "", whole=f"/{secrets.token_urlsafe(24)}/api/state")
        assert found.status == 404
    assert studio.ask("GET", "api/state").status == 200


def test_a_token_has_192_bits_of_the_system(studio, fresh):
    assert len(studio.token) == 32
    assert studio.token != fresh.token


@pytest.mark.parametrize("origin", FOREIGN)
def test_a_foreign_origin_is_refused_in_every_method(studio, origin):
    for method, path in (("GET", "api/state"), ("POST", "api/look"), ("PUT", "api/files/a.csv")):
        found = studio.ask(method, path, {}, headers={"Origin": origin})
        assert (found.status, found.code) == (403, "studio.origin-refused")
    assert not list(studio.folder.glob("*.csv"))


def test_its_own_origin_is_accepted(studio):
    own = {"Origin": f"http://127.0.0.1:{studio.port}", "Sec-Fetch-Site": "same-origin"}
    assert studio.ask("GET", "api/state", headers=own).status == 200
    assert studio.ask("GET", "api/state", headers={"Sec-Fetch-Site": "cross-site"}).status == 403


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1:80", "127.0.0.1.nip.io"]
)
def test_a_name_that_was_made_to_point_here_is_refused(studio, host):
    found = studio.ask("GET", "api/state", headers={"Host": host.format(port=studio.port)})
    assert (found.status, found.code) == (403, "studio.host-refused")


def test_without_one_host_nothing_is_answered(studio):
    with studio.socket() as one:
        text = f"GET /{studio.token}/api/state HTTP/1.1\r\n"
        one.sendall(f"{text}Host: 127.0.0.1:{studio.port}\r\nHost: evil\r\n\r\n".encode())
        assert one.recv(99).split()[1] in (b"400", b"403")


def test_hosts_of_a_server_that_others_reach():
    own, open_ = allowed_hosts("127.0.0.1", 80, False), allowed_hosts("0.0.0.0", 80, True)
    assert own("127.0.0.1:80") and own("localhost:80") and own("LOCALHOST:80")
    assert not own("192.168.0.7:80") and not own("0.0.0.0:80") and not own("localhost:81")
    assert open_("192.168.0.7:80") and open_(f"{socket.gethostname()}:80") and open_("[fe80::1]:80")
    assert not open_("evil.example:80") and not open_("0x7f.1.evil:80")


def test_what_changes_something_needs_the_header(studio):
    for method, path in (
        ("POST", "api/look"),
        ("PUT", "api/files/a.csv"),
        ("DELETE", "api/jobs/x"),
    ):
        found = studio.ask(method, path, {}, headers={"X-Strapdown": ""})
        assert (found.status, found.code) == (403, "studio.header-missing")


def test_every_answer_has_the_headers(studio):
    for whole in (f"/{studio.token}/", f"/{studio.token}/api/state", "/", f"/{studio.token}/api/x"):
        found = studio.ask("GET", "", whole=whole).headers
        assert "default-src 'none'" in found["content-security-policy"]
        assert "unsafe-eval" not in found["content-security-policy"]
        assert found["referrer-policy"] == "no-referrer"
        assert found["x-content-type-options"] == "nosniff"
        assert not {"set-cookie", "access-control-allow-origin", "server"} & set(found)


def test_methods_that_a_path_does_not_have(studio):
    for method in ("DELETE", "PATCH", "OPTIONS", "TRACE"):
        assert studio.ask(method, "api/state").status in (404, 405)


def test_a_body_that_is_too_large_is_not_read(studio):
    found = studio.ask("POST", "api/look", raw=b"", headers={"Content-Length": str(10**9)})
    assert (found.status, found.code) == (413, "studio.request-too-large")


def test_a_body_that_grows_without_end_is_ended(studio):
    with studio.socket() as one:
        head = f"POST /{studio.token}/api/look HTTP/1.1\r\nHost: 127.0.0.1:{studio.port}\r\n"
        one.sendall(f"{head}X-Strapdown: 1\r\nTransfer-Encoding: chunked\r\n\r\n".encode())
        chunk = b"100000\r\n" + b" " * 0x100000 + b"\r\n"
        before, sent = studio.memory(), 0
        with suppress(OSError):
            for _ in range(100):
                one.sendall(chunk)
                sent += 1
        assert studio.memory() - before < 60 << 20
        assert sent < 100 or b" 4" in one.recv(99)
    assert studio.ask("GET", "api/state").status == 200


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "[]",
        "1",
        '{"files": 1}',
        '{"files": [1]}',
        '{"kind": {}}',
        "{" * 3000,
        '{"x": 1}',
        "\xff",
    ],
)
def test_what_is_no_request_is_refused_with_a_code(studio, text):
    found = studio.ask("POST", "api/look", raw=text.encode("latin-1"))
    assert found.status == 400 and found.code.startswith("studio.")


# --- who holds a connection ---------------------------------------------------------------


def events(studio, **options):
    own = options.pop("origin", f"http://127.0.0.1:{studio.port}")
    url = f"ws://127.0.0.1:{studio.port}/{options.pop('token', studio.token)}/api/events"
    return connect(url, origin=own, open_timeout=10, close_timeout=1, **options)


def test_a_page_hears_of_jobs_and_files_for_as_long_as_it_listens(studio):
    with events(studio) as socket_:
        assert socket_.recv(timeout=10).startswith('{"jobs"')
        time.sleep(2.0 * studio.limits["patience"])
        studio.put("heard.csv", b"1")
        assert socket_.recv(timeout=10) == '{"files": true}'


@pytest.mark.parametrize("origin", FOREIGN)
def test_a_socket_of_a_foreign_page_is_refused(studio, origin):
    with pytest.raises(WebSocketException):
        events(studio, origin=origin)


def test_a_socket_with_another_token_is_refused(studio):
    with pytest.raises(WebSocketException):
        events(studio, token="x" * 32)


def test_a_thousand_sockets_are_a_few(studio):
    before, opened = studio.memory(), 0
    with ExitStack() as kept:
        for _ in range(1000):
            with suppress(WebSocketException, OSError, TimeoutError):
                kept.enter_context(events(studio))
                opened += 1
        assert opened == studio.limits["sockets"]
        assert studio.ask("GET", "api/state").status == 200
    assert studio.memory() - before < 50 << 20
    time.sleep(0.5)
    with events(studio) as again:
        assert again.recv(timeout=10)


def test_connections_that_say_nothing_are_ended(studio):
    held = [studio.socket() for _ in range(3 * studio.limits["connections"])]
    time.sleep(studio.limits["patience"] + 1.0)
    assert studio.ask("GET", "api/state").status == 200
    gone = 0
    for one in held:
        one.settimeout(1.0)
        with suppress(OSError):
            gone += one.recv(1) == b""
            one.close()
            continue
        gone += 1
    assert gone == len(held)


def test_a_second_request_that_is_begun_and_not_ended_is_ended(studio):
    with studio.socket() as one:
        text = f"GET /{studio.token}/api/jobs/x HTTP/1.1\r\nHost: 127.0.0.1:{studio.port}\r\n"
        # As long as it asks in time, it may go on for longer than one wait.
        for _ in range(round(2.0 * studio.limits["patience"] / 0.5)):
            one.sendall(f"{text}\r\n".encode())
            answer = b""
            while not answer.endswith(b"}}"):
                part = one.recv(4096)
                assert part, answer
                answer += part
            assert answer.startswith(b"HTTP/1.1 404")
            time.sleep(0.5)
        begun, ended = time.monotonic(), None
        while ended is None and time.monotonic() < begun + 10.0:
            try:
                one.sendall(text[:1].encode() if text else b"x")
                text = text[1:]
                time.sleep(0.2)
                one.settimeout(0.05)
                if one.recv(1) == b"":
                    ended = time.monotonic()
            except TimeoutError:
                continue
            except OSError:
                ended = time.monotonic()
        assert ended is not None and ended - begun < studio.limits["patience"] + 2.0


def test_a_client_that_takes_nothing_is_ended(studio):
    (studio.folder / "large.bin").write_bytes(b"")
    page = studio.folder.parent / "page" / "large.js"
    page.write_bytes(b"x" * (30 << 20))
    with socket.socket() as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        one.connect(("127.0.0.1", studio.port))
        text = f"GET /{studio.token}/static/large.js HTTP/1.1\r\nHost: 127.0.0.1:{studio.port}"
        before = studio.memory()
        one.sendall(f"{text}\r\n\r\n".encode())
        time.sleep(studio.limits["patience"] + 1.0)
        assert studio.memory() - before < 20 << 20
        got = 0
        with suppress(OSError):
            while part := one.recv(1 << 20):
                got += len(part)
        assert got < 30 << 20
