"""The built front end in the package is the build of its sources, and fits what it promises."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
STUDIO = ROOT / "studio"
STATIC = ROOT / "src" / "strapdown" / "studio" / "static"
#: Bytes: what a page loads that shows no map.
LARGEST = 226_000


def test_the_sources_are_those_that_were_built() -> None:
    build = json.loads((STATIC / "build.json").read_text(encoding="utf-8"))
    names = sorted(
        [f"src/{path.name}" for path in (STUDIO / "src").iterdir()]
        + ["build.mjs", "package.json", "package-lock.json", "tsconfig.json"]
    )
    digest = hashlib.sha256()
    for name in names:
        digest.update(f"{name}\n".encode() + (STUDIO / name).read_bytes() + b"\n")
    assert build["files"] == names
    assert build["sources"] == digest.hexdigest(), "make studio, and commit what it builds"


@pytest.mark.slow
def test_a_build_gives_the_same_bytes(tmp_path: Path) -> None:
    node = shutil.which("node")
    if node is None or not (STUDIO / "node_modules").is_dir():
        pytest.skip("no node, or nothing installed: cd studio && npm ci")
    out = tmp_path / "static"
    subprocess.run([node, "build.mjs", "--out", str(out)], cwd=STUDIO, check=True, timeout=120)
    built = {path.name: path.read_bytes() for path in out.iterdir()}
    assert built == {path.name: path.read_bytes() for path in STATIC.iterdir()}


def test_a_page_without_a_map_is_small() -> None:
    assert (STATIC / "app.js").stat().st_size + (STATIC / "app.css").stat().st_size < LARGEST


def test_nothing_is_inline_and_nothing_is_from_elsewhere() -> None:
    page = (STATIC / "index.html").read_text(encoding="utf-8")
    assert not re.search(r"<style|\sstyle=|\son[a-z]+=|javascript:", page)
    assert re.findall(r"<script[^>]*>(.*?)</script>", page, re.DOTALL) == [""]
    addresses = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert addresses and all(one.startswith("static/") for one in addresses)
    for one in addresses:
        assert (STATIC / one.removeprefix("static/")).is_file()
    code = (STATIC / "app.js").read_text(encoding="utf-8")
    # Names of XML name spaces are no addresses that anything asks.
    found = set(re.findall(r"https?://[a-zA-Z0-9./_-]+", code))
    assert all(one.startswith("http://www.w3.org/") for one in found), found
    assert not re.search(r"\beval\(|new Function\(|document\.write", code)


def test_no_text_becomes_markup() -> None:
    for path in (STUDIO / "src").glob("*.ts*"):
        source = path.read_text(encoding="utf-8")
        assert not re.search(r"innerHTML|insertAdjacentHTML|outerHTML|DOMParser", source, re.I), (
            path
        )


def test_every_bundled_package_has_its_license() -> None:
    text = (STATIC / "LICENSES.txt").read_text(encoding="utf-8")
    lock = json.loads((STUDIO / "package-lock.json").read_text(encoding="utf-8"))
    shipped = {
        path.removeprefix("node_modules/"): about["version"]
        for path, about in lock["packages"].items()
        if path.startswith("node_modules/") and not about.get("dev")
    }
    # Of types alone nothing is bundled.
    for name, version in shipped.items():
        if not name.startswith("@types/"):
            assert re.search(rf"^{re.escape(name)} {re.escape(version)} \(", text, re.MULTILINE), (
                name
            )
    assert not re.search(r"\bA?GPL", text)


def test_the_lock_names_no_registry_and_pins_every_version() -> None:
    lock = (STUDIO / "package-lock.json").read_text(encoding="utf-8")
    assert '"resolved"' not in lock
    about = json.loads((STUDIO / "package.json").read_text(encoding="utf-8"))
    for version in {**about["dependencies"], **about["devDependencies"]}.values():
        assert re.fullmatch(r"\d+\.\d+\.\d+", version)
