"""Files of trajectories that cannot be simulated: a message with its key, and nothing written."""

from __future__ import annotations

import pytest

REST = '[motion]\nkind = "stationary"\nlat_deg = 10\nlon_deg = 20\n'
SINE = '[motion]\nkind = "sine_velocity"\nlat_deg = 10\nlon_deg = 20\n'
BAD = {
    "a sensor without a name": ('sensor = ""\n' + REST + "duration_s = 2", "unknown sensor"),
    "no format": ("formats = []\n" + REST + "duration_s = 2", "formats: [] has 0 elements"),
    "for ever": (REST + "duration_s = 1e308", "gives inf samples"),
    "long": (REST + "duration_s = 1e300", "gives 1e+302 samples"),
    "deep": (
        REST + "duration_s = 2\nalt_m = -7e6",
        "alt_m: the motion reaches a height of -7e+06",
    ),
    "down": (
        SINE + "duration_s = 100\nmean_velocity_m_per_s = [5, 0, 20000]",
        "alt_m: the motion reaches a height of -1.0",
    ),
    "two components": (
        SINE + "duration_s = 2\nmean_velocity_m_per_s = [1, 2]",
        "mean_velocity_m_per_s 3: the value is missing",
    ),
    "nested": ("a = " + "[" * 5000 + "]" * 5000, "nested too deep"),
}


@pytest.mark.parametrize("name", sorted(BAD))
def test_what_cannot_be_is_said_and_leaves_nothing(name, tmp_path, monkeypatch, run_cli):
    monkeypatch.chdir(tmp_path)
    text, message = BAD[name]
    (tmp_path / "bad.toml").write_text(text)
    done = run_cli("simulate", "bad.toml")
    assert done.code == 4
    assert message in " ".join(done.err.split())
    assert "Remedy" in done.err
    assert [p.name for p in tmp_path.iterdir()] == ["bad.toml"]


def test_a_folder_is_no_file(tmp_path, monkeypatch, run_cli):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").mkdir()
    done = run_cli("simulate", "bad.toml")
    assert (done.code, "it is not a file" in done.err) == (4, True)


def test_the_mark_that_an_editor_begins_a_file_with_is_passed_over(tmp_path, monkeypatch, run_cli):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rest.toml").write_text(REST + "duration_s = 2", encoding="utf-8-sig")
    assert run_cli("simulate", "rest.toml").code == 0
