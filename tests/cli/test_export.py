"""``strapdown export``: any module as a file for a device."""

from __future__ import annotations

import json

import pytest

from strapdown.export.steps import STEPS, step_in_c


def test_what_it_writes_and_says(tmp_path, run_cli):
    file = tmp_path / "update.c"
    done = run_cli("export", "ud:states=4,observations=1", str(file))
    assert done.code == 0, done.err
    made = step_in_c("ud:states=4,observations=1")
    assert file.read_text(encoding="utf-8") == made.text
    assert "At most 36 add, 52 multiply, 9 divide each time; 20 numbers" in done.out
    done = run_cli("export", "ud:states=4,observations=1", str(file), "--force", "--json")
    told = json.loads(done.out)
    assert told["operations"] == made.operations
    assert (told["memory_numbers"], told["language"]) == (20, "C99")


def test_an_algorithm_and_a_filter_in_both_languages(tmp_path, run_cli):
    for module, word in (("quaternion", "quaternion_step"), ("complementary", "complementary")):
        for suffix in ("c", "py"):
            file = tmp_path / f"{module}.{suffix}"
            assert run_cli("export", module, str(file), "--quiet").out == ""
            assert word in file.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("module", "file", "word"),
    [
        ("nedd", "a.c", "did you mean 'ned'"),
        ("ned", "a.py", "C alone"),
        ("ned", "a.h", "must end in"),
        ("ned", "no-folder/a.c", "folder"),
        ("ned:height=high", "a.c", "high"),
        ("low_pass:rate=300", "a.c", "no whole part"),
        ("wd:states=0", "a.c", "not within 1 to 64"),
    ],
)
def test_what_is_not_possible_is_said_and_nothing_written(tmp_path, run_cli, module, file, word):
    done = run_cli("export", module, str(tmp_path / file))
    assert done.code == 4
    assert word in done.err
    assert not list(tmp_path.iterdir())


def test_a_file_is_not_overwritten(tmp_path, run_cli):
    file = tmp_path / "a.c"
    file.write_text("mine")
    assert run_cli("export", "ned", str(file)).code == 4
    assert file.read_text() == "mine"


def test_neither_a_folder_nor_another_module_is_exported(tmp_path, run_cli):
    (tmp_path / "a.c").mkdir()
    assert "it is a folder" in run_cli("export", "ned", str(tmp_path / "a.c"), "--force").err
    for module, near in (("nde", "did you mean 'ned'"), ("joseph", "Known: ned")):
        done = run_cli("export", module, str(tmp_path / "b.c"))
        assert done.code == 4
        assert near in done.err


def test_the_modules_are_listed(run_cli):
    rows = json.loads(run_cli("modules", "--json").out)["exports"]
    assert [row["name"] for row in rows] == list(STEPS)
    assert rows[-1]["options"] == ["states", "observations"]
