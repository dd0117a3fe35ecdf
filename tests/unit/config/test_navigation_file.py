"""The file of a run of navigation: what it may say, and what is said of what it may not."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from tests.coded import coded

from strapdown.config import navigation as tables
from strapdown.config.alignment import sensors_of
from strapdown.config.choice import SLOTS, options_of
from strapdown.config.navigation import STAGES, NavigationSpec
from strapdown.config.spec import Spec
from strapdown.errors import ConfigError

ROOT = Path(__file__).parents[3]
START = """[start]
lat_deg = 55.0
lon_deg = 37.0
roll_deg = 0.0
pitch_deg = 0.0
heading_deg = 0.0
"""
FILE = f"""[log]
path = "log.csv"
{START}
[sensors]
sensor = "stim300"
"""


def read(folder, text):
    path = folder / "run.toml"
    path.write_text(text)
    return NavigationSpec.read(path, files=False)


def test_what_is_sealed_is_read_again_alike(tmp_path):
    spec = read(tmp_path, FILE + '\n[aiding.rtk]\nkind = "gnss"\npath = "fixes.csv"\n')
    sealed = spec.model_dump(mode="json", exclude_none=True, serialize_as_any=True)
    again = NavigationSpec.checked(sealed)
    assert again.model_dump(serialize_as_any=True) == spec.model_dump(serialize_as_any=True)


def test_a_known_start_leaves_alignment_out(tmp_path):
    spec = read(tmp_path, FILE)
    assert (spec.coarse.kind, spec.fine.kind) == ("none", "none")


@pytest.mark.parametrize("name", ["drive", "paper"])
def test_examples_of_the_manual_are_read(name):
    spec = NavigationSpec.read(ROOT / "docs" / "examples" / f"navigate_{name}.toml")
    assert spec.simulation is not None


def test_an_aid_is_of_the_kind_that_it_is_named_after(tmp_path):
    spec = read(tmp_path, FILE + "\n[aiding.no_slip]\nlever_arm_cm = [10.0, 0.0, 0.0]\n")
    wheels = spec.aiding["no_slip"]
    assert wheels.kind == "no_slip" and wheels.lever_arm_m == (0.1, 0.0, 0.0)


@pytest.mark.parametrize("name", ["_x", "a-b", "9a"])
def test_names_that_an_aid_cannot_have(tmp_path, name):
    with pytest.raises(ConfigError, match="line 13, aiding"):
        read(tmp_path, FILE + f'\n[aiding.{name}]\nkind = "no_slip"\n')


def test_the_second_of_a_rate_is_no_time(tmp_path):
    """``_per_s`` is not read as ``_s``, of which a thousandth were ``_per_ms``."""
    more = '\n[aiding.still]\nkind = "zero_velocity"\nrate_sd_deg_per_ms = 0.2\n'
    with pytest.raises(ConfigError, check=coded("config.unknown-unit")):
        read(tmp_path, FILE + more)


def test_all_that_does_not_fit_is_told_at_once(tmp_path):
    text = FILE.replace("lat_deg = 55.0", "lat_deg = 137.0").replace("stim300", "stim30")
    with pytest.raises(ConfigError) as caught:
        read(tmp_path, text + "\n[filter]\nstep_s = 0.0\n")
    said = str(caught.value)
    assert caught.value.finding.code == "config.several"
    faults = caught.value.finding.data["faults"]
    assert [f.line for f in faults] == [4, 11, 14]
    assert faults[0].code == "config.latitude-longitude-exchanged"
    assert [int(n) for n in re.findall(r"line (\d+)", said)] == [4, 11, 14]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "spans_s: the time is not stated"),
        ("spans_s = [[1.0, 2.0]]\nlengths_s = [3.0]\n", "lengths_s is given as well"),
        ("spans_s = [[2.0, 1.0]]\n", "the span from 2 to 1 s is empty"),
        ('aid = "rtc"\nlengths_s = [3.0]\n', "did you mean 'rtk'"),
    ],
)
def test_fixes_that_cannot_be_kept_back(tmp_path, text, said):
    aid = '\n[aiding.rtk]\nkind = "gnss"\npath = "fixes.csv"\n'
    with pytest.raises(ConfigError, match=re.escape(said)):
        read(tmp_path, FILE + aid + "\n[withhold]\n" + text)


def test_every_slot_is_a_table_or_a_key(tmp_path):
    """Of those that a chain has, none is left out."""
    spec = read(tmp_path, FILE)
    keys = {*STAGES, "aiding"}
    for kind in (spec.filter, spec.coarse, spec.fine):
        keys |= set(type(kind).model_fields)
    assert {"error_model", "covariance", "update_rule", *STAGES, "aiding"} <= keys
    assert set(SLOTS) - keys == {"influence"}


def test_the_manual_has_every_key():
    page = (ROOT / "docs" / "navigate.md").read_text()
    forms = {f for f in vars(tables).values() if isinstance(f, type) and issubclass(f, Spec)}
    for form in forms - {tables.ExtrinsicsSpec}:  # which the flags of another command write
        if form.__module__ != tables.__name__ and form.__name__ not in ("LogTable", "AxesTable"):
            continue
        for name in form.model_fields:
            if name in form.unwritten or name in ("kind", "options"):
                continue
            assert f"`{name}`" in page or f"[{name}" in page or f".{name}" in page, (form, name)


def test_options_have_the_units_of_their_fields():
    """An option of an aid that is a length, a time or a speed says so."""
    plain = {
        "use_position",
        "use_velocity",
        "qualities",
        "detector",
        "threshold_rule",
        "threshold",
        "gate",
    }
    plain |= {"position_sd_factor", "velocity_sd_factor", "mounting_of", "scale_sd", "update_rule"}
    plain |= {"position_correlated_share", "axes"}
    endings = (
        "_m",
        "_s",
        "_ut",
        "_deg",
        "_m_per_s",
        "_m_per_s2",
        "_per_s",
        "_per_sqrt_s",
        "_per_sqrt_h",
        "_per_g",
    )
    for kind, entry in SLOTS["aiding"].entries.items():
        for option in options_of(entry):
            assert option.key in plain or option.key.endswith(endings), (kind, option.key)


def test_units_differ_by_more_than_their_type_states(tmp_path):
    sheet = sensors_of(read(tmp_path, FILE))
    text = FILE.replace('sensor = "stim300"', 'sensor = "stim300"\nunit_factor = 1.5')
    wider = sensors_of(read(tmp_path, text))
    for name in ("bias", "scale", "misalignment"):
        assert wider.gyro.axis(name) == pytest.approx(1.5 * np.array(sheet.gyro.axis(name)))
    assert wider.gyro.noise_density == sheet.gyro.noise_density
