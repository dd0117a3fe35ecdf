"""The copy of a case in a sealed folder finds the copies of its records."""

from __future__ import annotations

import json

import pytest

from strapdown.config.reading import beside_sealed_case

KEY = ("units", 0, "accelerometers", 0, "path")


@pytest.fixture
def sealed(tmp_path):
    """A folder that keeps ``left/log.csv`` and ``right/log.csv``, as a bundle does."""

    def make(*kept):
        units = [{"accelerometers": [{"path": p}]} for p in kept]
        for folder in ("case", "record", "record-2"):
            (tmp_path / "inputs" / folder).mkdir(parents=True, exist_ok=True)
        for name in ("record/log.csv", "record-2/log.csv"):
            (tmp_path / "inputs" / name).write_text("t,ax\n")
        (tmp_path / "manifest.json").write_text(
            json.dumps({"configuration": {"case": {"units": units}}})
        )
        return tmp_path / "inputs" / "case" / "case.toml"

    return make


def test_the_copy_is_found_by_its_key(sealed, tmp_path):
    case = sealed("inputs/record/log.csv", "inputs/record-2/log.csv")
    second = ("units", 1, *KEY[2:])
    assert beside_sealed_case(case, KEY, "../left/log.csv") == tmp_path / "inputs/record/log.csv"
    assert beside_sealed_case(case, second, "right/log.csv") == tmp_path / "inputs/record-2/log.csv"


def test_a_changed_case_does_not_get_another_record(sealed):
    assert beside_sealed_case(sealed("inputs/record/log.csv"), KEY, "other.csv") is None
    third = ("units", 2, *KEY[2:])
    assert beside_sealed_case(sealed("inputs/record/log.csv"), third, "log.csv") is None


@pytest.mark.parametrize("kept", ["../../etc/log.csv", "manifest.json", "inputs/record/none", 3])
def test_a_manifest_does_not_lead_out_of_its_folder(sealed, kept):
    assert beside_sealed_case(sealed(kept), KEY, "log.csv") is None


def test_a_case_that_is_in_no_sealed_folder(tmp_path):
    assert beside_sealed_case(tmp_path / "case.toml", KEY, "log.csv") is None
