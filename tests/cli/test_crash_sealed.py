"""A sealed crash report: what is changed in it is found and named."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys

import pytest
from tests.coded import coded

import strapdown.report.verify as module
from strapdown.bundle import sha256
from strapdown.errors import DataError
from strapdown.report.verify import verify


class RunAgainError(Exception):
    """Verify found nothing to name, and would run the case again."""


@pytest.fixture
def no_run(monkeypatch):
    def refuse(command, configuration, out, sealed):
        raise RunAgainError

    monkeypatch.setattr(module, "_rerun", refuse)


@pytest.fixture
def copy(copied_crash):
    return copied_crash


def sealed_files(folder):
    outside = {"manifest.json", "timing.json"}
    names = (p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())
    return sorted(set(names) - outside)


def found(folder):
    result = verify(folder)
    assert result.verdict == "changed"
    return result.details


def test_a_byte_flipped_anywhere_in_any_file_is_found_and_the_file_named(copy, no_run):
    names = sealed_files(copy)
    # Case, six records, a reference; page, PDF, JSON, a path, three signals, and the figures.
    assert len(names) >= 8 + 7 + 20
    for name in names:
        path = copy / name
        whole = path.read_bytes()
        for place in (0, len(whole) // 2, len(whole) - 1):
            path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x01]) + whole[place + 1 :])
            assert found(copy)[0] == f"{name}: changed after it was sealed", place
        path.write_bytes(whole)
    with pytest.raises(RunAgainError):
        verify(copy)


def test_any_byte_of_the_case_file_may_be_harmed(copy, no_run):
    path = copy / "inputs" / "case" / "case.toml"
    whole = path.read_bytes()
    for place in range(0, len(whole), 101):
        for bits in (0x80, 0xFF, 0x20):
            path.write_bytes(whole[:place] + bytes([whole[place] ^ bits]) + whole[place + 1 :])
            assert found(copy)[0] == "inputs/case/case.toml: changed after it was sealed"
    for other in (b"", b"\x00", b"[" * 5000, whole[: len(whole) // 2]):
        path.write_bytes(other)
        details = found(copy)
        assert len(details) == 2
        assert details[1].startswith("inputs/case/case.toml: not a valid case: ")
    path.write_bytes(whole)


def test_files_that_are_added_removed_or_renamed_are_named(copy, no_run, tmp_path):
    (copy / "figures" / "more.svg").write_text("<svg/>")
    (copy / "inputs" / "link.csv").symlink_to(tmp_path / "nowhere.csv")
    (copy / "inputs" / "linked").symlink_to(tmp_path)
    assert set(found(copy)) == {
        "figures/more.svg: not in the manifest",
        "inputs/link.csv: not in the manifest",
        "inputs/linked: not in the manifest",
    }
    for name in ("figures/more.svg", "inputs/link.csv", "inputs/linked"):
        (copy / name).unlink()
    gyro = copy / "inputs" / "record" / "imu1_gyro.csv"
    gyro.rename(tmp_path / "kept.csv")
    assert found(copy) == ("inputs/record/imu1_gyro.csv: missing",)
    (tmp_path / "kept.csv").rename(gyro.with_name("imu3_gyro.csv"))
    assert found(copy) == (
        "inputs/record/imu1_gyro.csv: missing",
        "inputs/record/imu3_gyro.csv: not in the manifest",
    )
    gyro.with_name("imu3_gyro.csv").rename(gyro)


OPTIONS = [
    (
        "monte_carlo_runs = 2000",
        "monte_carlo_runs = 2001",
        "options, monte_carlo_runs",
        "2000",
        "2001",
    ),
    (
        'source = "simulated light gate"',
        'source = "a guess"',
        "entry, source",
        "'simulated light gate'",
        "'a guess'",
    ),
    ("speed_m_per_s = 7.08", "speed_km_per_h = 36", "entry, speed_m_per_s", "7.08", "10.0"),
    (
        "position_m = [0.6, 0.5, 0.2]",
        "position_m = [0.6, 0.5, 0.3]",
        "unit 'IMU2', position_m",
        "[0.6, 0.5, 0.2]",
        "[0.6, 0.5, 0.3]",
    ),
]


@pytest.mark.parametrize(("old", "new", "where", "before", "now"), OPTIONS)
def test_an_option_that_is_changed_in_the_case_file_is_named(
    copy, no_run, old, new, where, before, now
):
    path = copy / "inputs" / "case" / "case.toml"
    whole = path.read_text(encoding="utf-8")
    assert old in whole
    path.write_text(whole.replace(old, new, 1), encoding="utf-8")
    details = found(copy)
    path.write_text(whole, encoding="utf-8")
    assert details == (
        "inputs/case/case.toml: changed after it was sealed",
        f"inputs/case/case.toml: {where}: {before} before, {now} now",
    )


def change_manifest(folder, change):
    path = folder / "manifest.json"
    whole = path.read_bytes()
    manifest = json.loads(whole)
    change(manifest)
    path.write_text(json.dumps(manifest, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    return whole


def test_an_option_that_is_changed_in_the_manifest_alone_is_named(copy, no_run):
    def change(manifest):
        manifest["configuration"]["case"]["options"]["monte_carlo_runs"] = 9

    whole = change_manifest(copy, change)
    details = found(copy)
    (copy / "manifest.json").write_bytes(whole)
    assert details == ("inputs/case/case.toml: options, monte_carlo_runs: 9 before, 2000 now",)


def leaves(value, place=()):
    if isinstance(value, dict):
        for key, item in value.items():
            yield from leaves(item, (*place, key))
    elif isinstance(value, list):
        for number, item in enumerate(value):
            yield from leaves(item, (*place, number))
    else:
        yield place, value


def put(manifest, place, value):
    *way, last = place
    for key in way:
        manifest = manifest[key]
    manifest[last] = value


def other(value):
    if isinstance(value, bool):
        return not value
    return f"{value}x" if isinstance(value, str) else value + 1


@pytest.mark.slow
def test_what_is_changed_in_the_manifest_is_refused_named_or_run_again(copy, no_run):
    whole = (copy / "manifest.json").read_bytes()
    silent = set()
    for place, value in leaves(json.loads(whole)):
        (copy / "manifest.json").write_bytes(whole)
        change_manifest(copy, lambda m, p=place, v=value: put(m, p, other(v)))
        try:
            assert verify(copy).verdict == "changed"
        except DataError as error:
            assert error.finding.file == "manifest.json"
        except RunAgainError:
            silent.add(" ".join(str(k) for k in place if not isinstance(k, int)))
    (copy / "manifest.json").write_bytes(whole)
    assert {re.sub(r"^(versions|platform) .*", r"\1", name) for name in silent} == {
        # These change what is written, so that the second run differs.
        "configuration name",
        "configuration case name",
        "inputs role",
        # These are what was then, which nobody can check; the printed seal holds them.
        "versions",
        "environment",
        "platform",
    }


@pytest.mark.parametrize("place", [("units", 0, "gyro", "path"), ("references", 0, "path")])
@pytest.mark.parametrize("path", ["/etc/hostname", "../outside.csv", "trajectory.csv"])
def test_a_case_that_reads_what_is_not_sealed_is_refused(copy, no_run, place, path):
    change_manifest(copy, lambda m: put(m, ("configuration", "case", *place), path))
    with pytest.raises(DataError, check=coded("bundle.malformed")):
        verify(copy)


def test_a_sensor_outside_of_the_seal_is_refused(copy, no_run):
    place = ("configuration", "case", "units", 0, "gyro", "sensor")
    change_manifest(copy, lambda m: put(m, place, "/tmp/mine.toml"))
    with pytest.raises(DataError, check=coded("bundle.malformed")):
        verify(copy)


def test_whatever_is_changed_in_the_manifest_changes_the_printed_seal(copy, no_run, sealed_crash):
    printed = sealed_crash.out.split()[-1]
    assert sha256(copy / "manifest.json") == printed
    path = copy / "manifest.json"
    whole = path.read_bytes()
    digest = whole.index(b'"sha256": "') + len(b'"sha256": "')
    for place in (0, digest, len(whole) - 1):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x01]) + whole[place + 1 :])
        try:
            assert verify(copy).digest != printed
        except DataError as error:
            assert error.finding.file == "manifest.json"
    path.write_bytes(whole)


@pytest.mark.parametrize(
    ("place", "value", "named"),
    [
        (("configuration", "name"), "another", "report.html: differs"),
        (("configuration", "case", "name"), "another", "crash.json: differs"),
        (("inputs", 0, "role"), "record", "manifest.json: "),
    ],
)
def test_what_the_second_run_finds_is_named(copy, sealed_crash, monkeypatch, place, value, named):
    """The second run is stood in for by what was sealed, as the configuration says it now."""

    def again(command, configuration, out, sealed):
        shutil.copytree(sealed_crash.folder, out)
        if configuration["name"] == "another":
            (out / "report.html").write_text("strapdown verify another")
        if configuration["case"]["name"] == "another":
            (out / "crash.json").write_text('{"name": "another"}')

    monkeypatch.setattr(module, "_rerun", again)
    assert verify(copy).verdict == "identical"
    whole = change_manifest(copy, lambda m: put(m, place, value))
    details = found(copy)
    (copy / "manifest.json").write_bytes(whole)
    assert any(d.startswith(named) for d in details), details


CASES = {
    "time zone, locale, umask, hashes": (
        {"TZ": "Pacific/Kiritimati", "LC_ALL": "C", "PYTHONHASHSEED": "7"},
        0o077,
        None,
    ),
    "one core and one thread": (
        {"NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        0o022,
        {min(os.sched_getaffinity(0))} if hasattr(os, "sched_getaffinity") else None,
    ),
    "more threads than cores": (
        {"NUMBA_NUM_THREADS": "7", "OPENBLAS_NUM_THREADS": "5"},
        0o002,
        None,
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_the_seal_depends_on_nothing_around(sealed_crash, tmp_path, name):
    environment, mask, cores = CASES[name]
    shutil.copytree(sealed_crash.records, tmp_path / "elsewhere" / "records of the case")

    def prepare():
        os.umask(mask)
        if cores is not None:
            os.sched_setaffinity(0, cores)

    done = subprocess.run(
        [sys.executable, "-m", "strapdown", "crash", "records of the case/case.toml",
         "--out", "deep/er/pole-crash"],
        cwd=tmp_path / "elsewhere",
        env=os.environ | environment,
        preexec_fn=prepare,
        capture_output=True,
        text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout.split()[-1] == sealed_crash.out.split()[-1]


def test_without_typst_the_pdf_is_left_out_and_both_output_and_seal_say_so(
    light_case, tmp_path, run_cli, monkeypatch
):
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "typst", None)
        done = run_cli("crash", light_case, "--out", tmp_path / "out")
        assert done.code == 0
        assert "pip install 'strapdown[pdf]'" in done.err
        names = {path.name for path in (tmp_path / "out").iterdir()}
        assert "report.html" in names and "report.pdf" not in names
        manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
        assert manifest["configuration"]["pdf"] is False
    # Repeated where typst is installed, as it was sealed.
    again = run_cli("verify", tmp_path / "out", "--json")
    assert json.loads(again.out)["verdict"] == "identical"


def test_a_sealed_pdf_is_not_repeated_without_typst(sealed_crash, run_cli, monkeypatch):
    monkeypatch.setitem(sys.modules, "typst", None)
    done = run_cli("verify", sealed_crash.folder)
    assert done.code == 4 and "pip install 'strapdown[pdf]'" in done.err


@pytest.mark.slow
def test_without_a_report_a_case_has_its_data_and_its_seal(light_case, tmp_path, run_cli):
    done = run_cli("crash", light_case, "--no-report", "--out", tmp_path / "out")
    assert done.code == 0, done.err
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"crash.json", "trajectory.csv", "manifest.json"} <= names
    assert not names & {"report.html", "report.pdf", "figures"}
    again = run_cli("verify", tmp_path / "out", "--json")
    assert json.loads(again.out)["verdict"] == "identical"
