"""A bundle is whole or absent, knows each of its bytes, and can be run again anywhere."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import time

import pytest
from tests.coded import coded

from strapdown import simulate, verify
from strapdown.api.attitude import compare_attitude
from strapdown.bundle import (
    LARGE,
    MANIFEST,
    SETTLED,
    InputFiles,
    atomic_folder,
    found_references,
    sha256,
    to_json,
    write_bundle,
)
from strapdown.errors import ConfigError, DataError
from strapdown.report import verify as module
from strapdown.report.attitude import write_attitude


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A simulated log, and a second one to take a bias from."""
    folder = tmp_path_factory.mktemp("logs")
    simulate("alexiev-fig2e", rate_hz=50, seed=3).save(folder / "log", formats=["csv"])
    return folder / "log" / "log.csv"


@pytest.fixture(scope="module")
def bench(log):
    """The log alone, compared once for what is only written."""
    return compare_attitude(log)


@pytest.fixture(scope="module")
def sealed(log, tmp_path_factory):
    bench = compare_attitude(
        log, reference=["end same as 4.5", str(log.with_name("truth.csv"))], gyro_bias=str(log)
    )
    return write_attitude(bench, tmp_path_factory.mktemp("sealed") / "bundle")


@pytest.fixture
def copy(sealed, tmp_path):
    return shutil.copytree(sealed.path, tmp_path / "copy")


@pytest.fixture
def run_again(sealed, monkeypatch):
    """The second run is stood in for by what was sealed, where the comparison is what is tested."""
    monkeypatch.setattr(
        module, "_rerun", lambda c, configuration, out, s: shutil.copytree(sealed.path, out)
    )


def test_the_seal_is_the_digest_of_the_manifest(sealed):
    assert sealed.digest == sha256(sealed.path / MANIFEST)


def test_what_a_run_writes(sealed):
    names = {p.relative_to(sealed.path).as_posix() for p in sealed.path.rglob("*") if p.is_file()}
    assert names == {
        "attitude.csv",
        "attitude.json",
        "report.html",
        "sweep.csv",
        "figures/cost.svg",
        "figures/sweep.svg",
        "figures/share.svg",
        "figures/gyro.svg",
        "figures/attitude.svg",
        "figures/error.svg",
        "figures/difference.svg",
        "figures/peers.svg",
        "figures/reference-error.svg",
        "inputs/log/log.csv",
        "inputs/truth/truth.csv",
        "inputs/gyro-bias/log.csv",
        "manifest.json",
    }


def test_it_verifies_where_it_stands_and_elsewhere_without_its_inputs(sealed, copy, log):
    assert verify(sealed.path).verdict == "identical"
    hidden = log.rename(log.with_suffix(".hidden"))
    try:
        assert verify(copy).verdict == "identical"
    finally:
        hidden.rename(log)


def test_the_same_run_gives_the_same_seal(log, bench, tmp_path):
    runs = {"a": bench, "b": compare_attitude(log)}
    seals = [write_attitude(run, tmp_path / name) for name, run in runs.items()]
    assert seals[0].digest == seals[1].digest


def test_one_changed_byte_in_any_file_is_found_and_named(copy):
    manifest = json.loads((copy / MANIFEST).read_text())
    for item in [*manifest["inputs"], *manifest["outputs"]]:
        path = copy / item["name"]
        good = path.read_bytes()
        middle = len(good) // 2
        path.write_bytes(good[:middle] + bytes([good[middle] ^ 1]) + good[middle + 1 :])
        found = verify(copy)
        path.write_bytes(good)
        assert found.verdict == "changed"
        assert found.details == (f"{item['name']}: changed after it was sealed",)


def test_a_missing_and_a_foreign_file_are_named(copy):
    (copy / "attitude.csv").unlink()
    (copy / "note.txt").write_text("hello")
    assert set(verify(copy).details) == {
        "attitude.csv: missing",
        "note.txt: not in the manifest",
    }


def test_timing_stands_outside_the_seal(copy, run_again):
    (copy / "timing.json").write_text("{}")
    assert verify(copy).verdict == "identical"


def test_a_manifest_whose_configuration_was_changed_does_not_reproduce(copy):
    manifest = json.loads((copy / MANIFEST).read_text())
    manifest["configuration"]["gyro_bias_path"] = None
    manifest["configuration"]["gyro_bias"] = "none"
    (copy / MANIFEST).write_text(to_json(manifest))
    found = verify(copy)
    assert found.verdict == "changed"
    assert any(line.startswith("attitude.json") for line in found.details)


@pytest.mark.parametrize(("shift", "verdict"), [(1e-9, "numerically equal"), (1e-3, "changed")])
def test_numbers_that_differ_are_told_by_how_much(copy, run_again, shift, verdict):
    """As another processor would have sealed it: the outputs shifted, and sealed like that."""
    path = copy / "attitude.json"
    content = json.loads(path.read_text())
    final = content["algorithms"][0]["final"]
    # Of an angle beyond one degree the difference itself.
    relative = shift / min(1.0, abs(final["roll_deg"] + shift))
    final["roll_deg"] += shift
    path.write_text(json.dumps(content))
    manifest = json.loads((copy / MANIFEST).read_text())
    item = next(o for o in manifest["outputs"] if o["name"] == path.name)
    item |= {"sha256": sha256(path), "bytes": path.stat().st_size}
    manifest["platform"]["cpu"] = "another"
    (copy / MANIFEST).write_text(to_json(manifest))
    found = verify(copy)
    assert found.verdict == verdict
    assert any(
        line.startswith("platform cpu: another as the bundle states") for line in found.details
    )
    assert found.within == pytest.approx(relative, rel=1e-4)


def test_a_run_that_fails_leaves_nothing(tmp_path):
    with (
        pytest.raises(RuntimeError),
        write_bundle(tmp_path / "out", command="x", configuration={}, seals=[]) as folder,
    ):
        (folder / "half").write_text("half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_a_bundle_is_replaced_only_when_asked(bench, tmp_path):
    first = write_attitude(bench, tmp_path / "out", report=False)
    with pytest.raises(ConfigError, check=coded("bundle.folder-exists")) as refused:
        write_attitude(bench, tmp_path / "out", report=False)
    assert "--force" in refused.value.finding.text("cli")
    again = write_attitude(bench, tmp_path / "out", force=True, report=False)
    assert again.digest == first.digest
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("force", [False, True])
def test_a_folder_that_is_no_bundle_is_never_touched(bench, tmp_path, force):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("years of work")
    with pytest.raises(ConfigError):
        write_attitude(bench, tmp_path / "out", force=force)
    assert (tmp_path / "out" / "thesis.tex").read_text() == "years of work"


def test_a_large_input_is_referred_to_and_still_watched(log, tmp_path, monkeypatch):
    monkeypatch.setattr("strapdown.bundle.COPY_LIMIT", 10)
    source = shutil.copy(log, tmp_path / "mine.csv")
    seal = write_attitude(compare_attitude(source), tmp_path / "out", report=False)
    assert not (seal.path / "inputs").exists()
    assert json.loads((seal.path / MANIFEST).read_text())["inputs"][0]["kept"] == "reference"
    # A manifest may name any file of this machine: only those that the user names are read.
    with pytest.raises(ConfigError, check=coded("bundle.inputs-outside")) as refused:
        verify(seal.path)
    assert refused.value.finding.data["names"] == (str(source),)
    with pytest.raises(ConfigError, check=coded("bundle.inputs-outside")):
        verify(seal.path, inputs=[tmp_path / "out"])
    assert verify(seal.path, inputs=[source]).verdict == "identical"
    moved = tmp_path / "disk"
    moved.mkdir()
    source.rename(moved / "of another name.csv")
    # The recorded name stands in the result.
    for given in (moved, moved / "of another name.csv"):
        assert verify(seal.path, inputs=[given]).verdict == "identical"
    with (moved / "of another name.csv").open("a") as stream:
        stream.write("\n")
    changed = verify(seal.path, inputs=[moved / "of another name.csv"])
    assert changed.details == (f"{source}: changed after it was sealed",)


def test_a_folder_that_is_referred_to_may_have_moved(tmp_path):
    folder = tmp_path / "drive"
    (folder / "a").mkdir(parents=True)
    for name in ("a/imu.npy", "fixes.npy"):
        (folder / name).write_text(name)
    files = [folder / "a" / "imu.npy", folder / "fixes.npy"]
    manifest = {
        "configuration": {"log": {"path": str(folder)}},
        "inputs": [
            {"name": str(f), "kept": "reference", "sha256": sha256(f), "role": "log", "bytes": 1}
            for f in files
        ],
    }
    assert found_references(manifest, [tmp_path])[str(folder)] == folder
    for given in (tmp_path / "disk", tmp_path / "disk" / "drive"):
        if not (tmp_path / "disk").exists():
            (tmp_path / "disk").mkdir()
            folder.rename(tmp_path / "disk" / "drive")
        found = found_references(manifest, [given])
        assert found[str(folder)] == tmp_path / "disk" / "drive"
        assert found[str(files[0])] == tmp_path / "disk" / "drive" / "a" / "imu.npy"


def test_what_is_no_bundle_is_said_to_be_none(tmp_path):
    with pytest.raises(DataError, check=coded("bundle.no-manifest")):
        verify(tmp_path)
    (tmp_path / "log.csv").write_text("t,x\n")
    with pytest.raises(DataError, check=coded("bundle.no-folder")):
        verify(tmp_path / "log.csv")
    (tmp_path / MANIFEST).write_text("{")
    with pytest.raises(DataError, check=coded("bundle.not-json")):
        verify(tmp_path)
    (tmp_path / MANIFEST).write_text("[" * 100_000)
    with pytest.raises(DataError, check=coded("bundle.not-json")):
        verify(tmp_path)
    (tmp_path / MANIFEST).write_text('{"schema": "other"}')
    with pytest.raises(DataError, check=coded("bundle.unknown-form")):
        verify(tmp_path)


def test_a_simulation_verifies_too(tmp_path):
    seal = simulate("alexiev-fig2f", rate_hz=20, seed=9).save(tmp_path / "s", formats=["all"])
    assert verify(seal.path).verdict == "identical"
    other = simulate("alexiev-fig2f", rate_hz=20, seed=10).save(tmp_path / "t", formats=["all"])
    assert other.digest != seal.digest


@pytest.mark.parametrize(
    "name", ["../secret", "/etc/hostname", 7, "x" * 256, "a\0b", "\ud800", ".", ""]
)
def test_a_manifest_that_names_files_outside_is_refused(copy, name):
    manifest = json.loads((copy / MANIFEST).read_text())
    manifest["outputs"][0]["name"] = name
    (copy / MANIFEST).write_text(to_json(manifest))
    with pytest.raises(DataError, check=coded("bundle.malformed")):
        verify(copy)


def reseal(folder, name, data, *, elsewhere=False):
    """Change a file and its digest in the manifest, as a forger would."""
    (folder / name).write_bytes(data)
    manifest = json.loads((folder / MANIFEST).read_text())
    item = next(o for o in manifest["outputs"] if o["name"] == name)
    item |= {"sha256": sha256(folder / name), "bytes": (folder / name).stat().st_size}
    if elsewhere:
        manifest["platform"]["cpu"] = "another"
    (folder / MANIFEST).write_text(to_json(manifest))


FORGERIES = [
    ("report.html", lambda data: data.replace(b"</h1>", b"!</h1>")),
    ("figures/gyro.svg", lambda data: b"<svg/>"),
    ("attitude.json", lambda data: data.replace(b'"headline": "', b'"headline": "Not so: ')),
    ("attitude.json", lambda data: data.replace(b'"error_deg": ', b'"error_deg": 1', 1)),
    ("attitude.csv", lambda data: data[:-2] + b"7\n"),
]


@pytest.mark.parametrize(("name", "change"), FORGERIES)
def test_what_was_changed_and_sealed_again_does_not_reproduce(copy, run_again, name, change):
    before = (copy / name).read_bytes()
    reseal(copy, name, change(before))
    assert (copy / name).read_bytes() != before
    found = verify(copy)
    assert found.verdict == "changed"
    assert any(line.startswith(name) for line in found.details)


@pytest.mark.parametrize(("name", "change"), FORGERIES[:4])
def test_nor_elsewhere_where_it_is_no_rounding(copy, run_again, name, change):
    reseal(copy, name, change((copy / name).read_bytes()), elsewhere=True)
    assert verify(copy).verdict == "changed"


def test_no_number_is_no_number_elsewhere_either(copy, run_again):
    text = (copy / "attitude.json").read_text()
    at = text.index('"error_deg": ') + len('"error_deg": ')
    text = text[:at] + "NaN" + text[text.index(",", at) :]
    reseal(copy, "attitude.json", text.encode(), elsewhere=True)
    assert verify(copy).verdict == "changed"


def test_a_file_taken_out_of_folder_and_manifest_is_missed(copy, run_again):
    manifest = json.loads((copy / MANIFEST).read_text())
    manifest["outputs"] = [o for o in manifest["outputs"] if o["name"] != "report.html"]
    (copy / MANIFEST).write_text(to_json(manifest))
    (copy / "report.html").unlink()
    found = verify(copy)
    assert found.verdict == "changed"
    assert "report.html: written now, and not sealed" in found.details


def test_a_bundle_of_a_reproduced_paper_is_refused(copy):
    manifest = json.loads((copy / MANIFEST).read_text())
    manifest["command"] = "reproduce"
    (copy / MANIFEST).write_text(to_json(manifest))
    with pytest.raises(DataError, check=coded("report.reproduced-paper")) as refused:
        verify(copy)
    assert "papers." in str(refused.value)


def test_a_configuration_that_reads_what_is_not_sealed_is_refused(copy):
    manifest = json.loads((copy / MANIFEST).read_text())
    manifest["configuration"]["source"]["path"] = "../log.csv"
    (copy / MANIFEST).write_text(to_json(manifest))
    with pytest.raises(DataError, check=coded("bundle.malformed")):
        verify(copy)


@pytest.mark.parametrize("name", ["log.npz", "log.h5", "log.mat"])
def test_a_forged_simulation_is_found_elsewhere(tmp_path, name):
    seal = simulate("alexiev-fig2c", rate_hz=20).save(tmp_path / "s", formats=["all"])
    other = simulate("alexiev-fig2c", rate_hz=20.1).save(tmp_path / "t", formats=["all"])
    reseal(seal.path, name, (other.path / name).read_bytes(), elsewhere=True)
    assert verify(seal.path).verdict == "changed"


@pytest.mark.slow
def test_every_way_of_naming_a_log_gives_one_seal(tmp_path, monkeypatch):
    simulate("alexiev-fig2e", rate_hz=20).save(tmp_path / "logs")
    monkeypatch.chdir(tmp_path)
    names = ["logs/log.csv", "./logs/log.csv", "logs//log.csv", "logs/../logs/log.csv"]
    names.append(str(tmp_path / "logs" / "log.csv"))
    seals = [
        write_attitude(compare_attitude(name, gyro_bias=name), f"out{k}", report=False)
        for k, name in enumerate(names)
    ]
    assert len({s.digest for s in seals}) == 1
    assert all(verify(s.path).verdict == "identical" for s in seals)


def test_a_link_keeps_its_own_name(tmp_path, log):
    (tmp_path / "blob1234").write_bytes(log.read_bytes())
    (tmp_path / "mine.csv").symlink_to(tmp_path / "blob1234")
    seal = write_attitude(compare_attitude(tmp_path / "mine.csv"), tmp_path / "out", report=False)
    assert verify(seal.path).verdict == "identical"


def test_a_log_that_changed_since_it_was_read_is_not_sealed(tmp_path, log):
    mine = tmp_path / "mine.csv"
    mine.write_bytes(log.read_bytes())
    bench = compare_attitude(mine)
    mine.write_bytes(log.read_bytes() + b"\n")
    with pytest.raises(DataError, check=coded("bundle.input-changed")):
        write_attitude(bench, tmp_path / "out", report=False)
    mine.unlink()
    with pytest.raises(DataError, check=coded("bundle.input-changed")):
        write_attitude(bench, tmp_path / "out", report=False)
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(os.name != "posix", reason="whose stamps of changes no program can set")
def test_a_large_log_is_read_for_its_digest_once(tmp_path, monkeypatch):
    log, read = tmp_path / "log.csv", []
    log.write_bytes(bytes(LARGE))
    digest = hashlib.file_digest
    monkeypatch.setattr(hashlib, "file_digest", lambda *of: read.append(1) or digest(*of))
    before = sha256(log)
    assert sha256(log) == before
    assert len(read) == 2  # it was just written, so that a change may have the same stamp
    now = time.time_ns()
    monkeypatch.setattr(time, "time_ns", lambda: now + 2 * SETTLED)
    assert [sha256(log), sha256(log)] == [before, before]
    assert len(read) == 3
    # A byte within it, with the stamp of before.
    about = log.stat()
    with log.open("r+b") as stream:
        stream.seek(LARGE // 2)
        stream.write(b"x")
    os.utime(log, ns=(about.st_atime_ns, about.st_mtime_ns))
    assert sha256(log) != before


def test_the_old_bundle_stays_where_the_new_one_cannot_be_put(tmp_path, bench, monkeypatch):
    seal = write_attitude(bench, tmp_path / "out", report=False)

    def refuse(self, target):
        raise OSError("no")

    # A system that cannot exchange two names, and a disk that fails.
    monkeypatch.setattr(atomic_folder, "_exchange", lambda: None)
    monkeypatch.setattr("pathlib.Path.rename", refuse)
    with pytest.raises(OSError, match="no"):
        write_attitude(bench, tmp_path / "out", force=True, report=False)
    monkeypatch.undo()
    assert verify(seal.path).verdict == "identical"


def test_one_folder_in_two_roles_is_kept_whole_in_one_place(tmp_path):
    """A log and the fixes of one recording: each role has files of its own, and one of both."""
    folder = tmp_path / "drive"
    folder.mkdir()
    for name in ("imu.npy", "fixes.npy", "clock.npy"):
        (folder / name).write_bytes(name.encode())

    def of(role, *names):
        files = tuple(folder / name for name in names)
        return InputFiles(role, folder, files, tuple(sha256(file) for file in files))

    seals = []
    inputs = (of("log", "imu.npy", "clock.npy"), of("aid-gnss", "fixes.npy", "clock.npy"))
    configuration = {"log": {"path": str(folder)}, "gnss": {"path": str(folder)}}
    with write_bundle(
        tmp_path / "out",
        command="navigate",
        configuration=configuration,
        inputs=inputs,
        seals=seals,
    ):
        pass
    manifest = json.loads((seals[0].path / MANIFEST).read_text())
    paths = {part["path"] for part in manifest["configuration"].values()}
    assert paths == {"inputs/log/drive"}
    kept = {item["name"]: item["role"] for item in manifest["inputs"]}
    assert kept == {
        "inputs/log/drive/imu.npy": "log",
        "inputs/log/drive/clock.npy": "log",
        "inputs/log/drive/fixes.npy": "aid-gnss",
    }
    assert all((seals[0].path / name).is_file() for name in kept)


def test_a_bundle_of_version_0_1_is_refused_by_a_finding_that_names_the_version(tmp_path):
    manifest = {"schema": "strapdown bundle 1", "command": "attitude", "configuration": {}}
    manifest |= {"inputs": [], "outputs": [], "platform": {}, "versions": {"strapdown": "0.1.0"}}
    (tmp_path / MANIFEST).write_text(json.dumps(manifest))
    with pytest.raises(DataError) as refused:
        verify(tmp_path)
    assert refused.value.finding.code == "bundle.other-schema"
    assert refused.value.finding.data["version"] == "0.1.0"
