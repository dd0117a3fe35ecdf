"""What all commands share: messages of the logger, completion, and the digest of the source."""

from __future__ import annotations

import json
import logging
import shutil

import numpy as np

from strapdown import bundle
from strapdown.formats.writers import WRITERS
from strapdown.tables import imu_table


def write_log(folder):
    t = np.arange(300) / 100.0
    gyro = np.column_stack([np.sin(t), np.cos(t), 0.1 * t])
    WRITERS["npz"].write(folder / "log.npz", {"imu": imu_table(t, gyro)})
    return folder / "log.npz"


def test_verbose_tells_stages_and_readers_and_quiet_nothing(run_cli, tmp_path):
    log = write_log(tmp_path)
    ask = ("attitude", log, "--algorithms", "quaternion", "--rates", "100")
    loud = run_cli(*ask, "--out", tmp_path / "a", "--verbose")
    usual = run_cli(*ask, "--out", tmp_path / "b")
    silent = run_cli(*ask, "--out", tmp_path / "c", "--quiet")
    assert (loud.code, usual.code, silent.code) == (0, 0, 0)
    assert "INFO: log.npz: read as npz" in loud.err
    assert "INFO: reading: 0." in loud.err
    assert "INFO" not in usual.err
    assert (silent.out, silent.err) == ("", "")
    # The library's own logger is as it was.
    assert logging.getLogger("strapdown").level == logging.NOTSET


def test_every_command_that_is_quiet_is_verbose_too(run_cli):
    for command in ("attitude", "align", "navigate", "outage", "crash", "simulate", "verify"):
        told = run_cli(command, "--help").out
        assert "--quiet" in told and "--verbose" in told, command


def test_a_shell_can_complete(run_cli):
    assert "--install-completion" in run_cli("--help").out


def test_the_manifest_has_the_digest_of_the_source(run_cli, tmp_path):
    done = run_cli("simulate", "alexiev-fig4", "--out", tmp_path / "a", "-q")
    assert done.code == 0, done.err
    manifest = json.loads((tmp_path / "a" / "manifest.json").read_text())
    assert manifest["versions"]["strapdown source"] == bundle.source_digest()
    assert len(bundle.source_digest()) == 64


def test_the_digest_follows_one_byte_of_one_source(tmp_path, monkeypatch):
    home = tmp_path / "bundle.py"
    shutil.copy(bundle.__file__, home)
    (tmp_path / "kernel.py").write_text("a = 1\n")
    monkeypatch.setattr(bundle, "__file__", str(home))
    plain = bundle.source_digest.__wrapped__
    before = plain()
    assert plain() == before
    (tmp_path / "kernel.py").write_text("a = 2\n")
    after = plain()
    (tmp_path / "kernel.py").rename(tmp_path / "colonel.py")
    assert len({before, after, plain()}) == 3
