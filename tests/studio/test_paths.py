"""Names and paths from outside: nothing beyond the folder is read, written or told."""

from __future__ import annotations

import json
import unicodedata
from pathlib import Path
from urllib.parse import quote

import pytest

from strapdown.bundle import MANIFEST, sha256
from strapdown.errors import ConfigError
from strapdown.studio.folder import STATE, Folder, plain_name

SECRET = "the secret of another folder"
#: Ways out, as a client writes them into a path, unescaped.
WAYS = (
    *("..", "../secret.txt", "../../secret.txt", "..\\secret.txt", "x/../../secret.txt"),
    *("%2e%2e/secret.txt", "..%2fsecret.txt", "%2e%2e%2fsecret.txt", "..%5csecret.txt"),
    *("%252e%252e%252fsecret.txt", "..%c0%afsecret.txt", "secret.txt%00.csv", "%00"),
    *("/etc/passwd", "%2fetc%2fpasswd", "//etc/passwd", "file:///etc/passwd", "C:%5cwindows"),
    *("link.txt", "inside/link.txt", "linked/secret.txt", "linked", ".hidden", STATE),
    *(f"{STATE}/lock", f"{STATE}%2flock", "%2estrapdown-studio%2flock", "‮txt.exe", "~/secret"),
)
PATHS = (
    *("static/{}", "runs/result/{}", "runs/{}/report.html", "api/runs/{}", "api/runs/{}/track"),
    *("api/runs/{}/series", "api/runs/{}/export?as=zip", "api/jobs/{}", "tiles/{}/0/0"),
    *("api/series?file={}", "comparisons/{}/report.html", "comparisons/0123456789ab/{}", "{}"),
    *("api/runs/result/export?as={}",),
)


@pytest.fixture(scope="module")
def places(studio):
    """A folder with links that lead out, beside a secret; and a result whose list lies."""
    (studio.folder.parent / "secret.txt").write_text(SECRET, encoding="utf-8")
    outside = studio.folder.parent / "outside"
    outside.mkdir()
    (outside / "secret.txt").write_text(SECRET, encoding="utf-8")
    (studio.folder / "link.txt").symlink_to(studio.folder.parent / "secret.txt")
    (studio.folder / "linked").symlink_to(outside)
    (studio.folder / "inside").mkdir()
    (studio.folder / "inside" / "link.txt").symlink_to(studio.folder.parent / "secret.txt")
    (studio.folder / ".hidden").write_text(SECRET, encoding="utf-8")
    (studio.folder / "log.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    result = studio.folder / "result"
    result.mkdir()
    (result / "report.html").write_text("<p>page</p>", encoding="utf-8")
    (result / "not-listed.txt").write_text(SECRET, encoding="utf-8")
    (result / "link.txt").symlink_to(studio.folder.parent / "secret.txt")
    names = ("report.html", "link.txt")
    outputs = [{"name": n, "sha256": sha256(result / n), "bytes": 1} for n in names]
    manifest = {
        "schema": "strapdown bundle 2",
        "command": "navigate",
        "configuration": {"name": "result"},
        "inputs": [],
        "outputs": outputs,
        "versions": {},
        "platform": {},
        "environment": [],
    }
    (result / MANIFEST).write_text(json.dumps(manifest), encoding="utf-8")
    return studio


def leaks(answer) -> bool:
    return SECRET.encode() in answer.body or b"root:" in answer.body


def test_no_path_leads_out_of_the_folder(places):
    for way in WAYS:
        # As it stands, where it is no text of a request, and escaped once.
        forms = {quote(way, safe=""), *([way] if way.isascii() else [])}
        for form in forms:
            for path in PATHS:
                found = places.ask("GET", path.format(form))
                assert not leaks(found), (path, form)
                fails = found.status in (400, 404, 422)
                # A path of dots may come back to the page, which is no file of the user's.
                assert fails or path == "{}" or b"<title>" in found.body, (path, form, found)
    assert places.ask("GET", "runs/result/report.html").status == 200


def test_a_file_of_a_result_that_is_not_listed_or_leads_out_is_not_given(places):
    for path in ("not-listed.txt", "link.txt", "../log.csv", f"../{STATE}/lock"):
        found = places.ask("GET", f"runs/result/{quote(path, safe='')}")
        assert (found.status, found.code) == (404, "studio.no-such-file")
    page = places.ask("GET", "runs/result/report.html")
    assert page.headers["content-security-policy"].startswith("sandbox allow-scripts;")
    assert "allow-same-origin" not in page.headers["content-security-policy"]
    assert "connect-src" not in page.headers["content-security-policy"]


@pytest.mark.parametrize("way", [way for way in WAYS if "%" not in way])
def test_no_name_in_a_request_leads_out(places, way):
    for path, body in (
        ("api/look", {"files": [way], "log": {}}),
        ("api/propose", {"kind": "navigate", "files": [way]}),
        ("api/compare", {"runs": [way, "result"]}),
        ("api/jobs", {"kind": "navigate", "name": way, "toml": "", "options": []}),
    ):
        found = places.ask("POST", path, body)
        assert found.status in (400, 404) and not leaks(found), (path, way, found)
    found = places.put(way, b"overwritten")
    assert found.status in (400, 404, 409)
    assert (places.folder.parent / "secret.txt").read_text(encoding="utf-8") == SECRET


@pytest.mark.parametrize("way", ["../secret.txt", "/etc/passwd", "linked/secret.txt", "link.txt"])
def test_no_configuration_reads_beyond_the_folder(places, way):
    texts = {
        "navigate": f'[log]\npath = "{way}"\n',
        "align": f'[log]\npath = "log.csv"\n[sensors]\nsensor = "{way}.toml"\n',
        "attitude": f'[log]\npath = "log.csv"\n[attitude]\nreference = ["{way}"]\n',
        "allan": f'[log]\npath = "log.csv"\nalso = ["{way}"]\n',
        "calibrate": f'[log]\npath = "log.csv"\n[calibrate]\nturns = "{way}"\n',
    }
    (places.folder.parent / "secret.txt.toml").write_text(SECRET, encoding="utf-8")
    for kind, text in texts.items():
        found = places.ask("POST", "api/check", {"kind": kind, "toml": text})
        if kind != "align" or (places.folder / f"{way}.toml").exists():
            assert [e["code"] for e in found.json["errors"]] == ["studio.path-outside"], (kind, way)
        asked = {"kind": kind, "name": "new", "toml": text, "options": []}
        job = places.ask("POST", "api/jobs", asked)
        assert job.status == 400 and not leaks(job), (kind, way)
    found = places.ask("POST", "api/crash/quick", {"toml": f'[entry]\npath = "{way}"\n', "set": {}})
    assert found.code == "studio.path-outside"


def test_the_list_has_no_hidden_names_and_nothing_outside(places):
    state = places.ask("GET", "api/state").json
    names = {one["name"] for one in state["files"]}
    assert "log.csv" in names
    assert not names & {"link.txt", "linked", ".hidden", STATE}
    assert str(places.folder.parent) not in json.dumps(state)
    assert [one["name"] for one in state["runs"]] == ["result"]


@pytest.mark.parametrize(
    "name",
    [
        *(
            "",
            ".",
            "..",
            "...",
            "a/b",
            "a\\b",
            "/a",
            ".a",
            "-a",
            " a",
            "a ",
            "a.",
            "a:b",
            "a*",
            "a?",
        ),
        *('a"', "a<", "a>", "a|", "a\0b", "a\nb", "a\x1b[2J", "a‮b", "a\udcffb", "con", "NUL.txt"),
        *("com1", "x" * 201, "é" * 101, None, 3),
    ],
)
def test_names_that_are_none(name):
    with pytest.raises(ConfigError) as caught:
        plain_name(name)
    assert caught.value.finding.code == "studio.name-not-plain"


@pytest.mark.parametrize(
    "name", ["a", "a b.csv", "Å.csv", "測定 1.csv", "a.b.c", "x" * 200, "$a;b&c'd"]
)
def test_names_that_are(name):
    assert plain_name(unicodedata.normalize("NFD", name)) == unicodedata.normalize("NFC", name)


def test_a_folder_that_is_no_folder_or_hides_a_link(tmp_path):
    with pytest.raises(ConfigError, match="it is a file"):
        Folder.open(__file__)
    (tmp_path / "elsewhere").mkdir()
    root = tmp_path / "folder"
    root.mkdir()
    (root / STATE).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(ConfigError) as caught:
        Folder.open(root)
    assert caught.value.finding.code == "studio.state-is-link"
    assert not list((tmp_path / "elsewhere").iterdir())


def test_a_link_within_the_folder_is_followed(tmp_path):
    (tmp_path / "log.csv").write_text("x", encoding="utf-8")
    (tmp_path / "other.csv").symlink_to(tmp_path / "log.csv")
    assert Folder.open(tmp_path).file("other.csv") == Path(tmp_path / "other.csv")
