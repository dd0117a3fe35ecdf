"""The file of an alignment: slots, options of their modules, and what is refused with its line."""

from __future__ import annotations

import re
from dataclasses import fields

import pytest
from tests.coded import coded

from strapdown.alignment.fine import FineAlignment
from strapdown.config.alignment import STAGES, AlignmentSpec
from strapdown.config.choice import GIVEN, SLOTS, UNITS, ChoiceSpec, form_of, options_of
from strapdown.errors import ConfigError
from strapdown.estimation.robust import RobustUpdate
from strapdown.mechanization import NorthEastDown

GOOD = """\
[simulation]
duration_s = 60.0
heading_deg = 40.0

[site]
lat_deg = 55.0
lon_deg = 37.0

[sensors]
sensor = "fog-1000"
"""


def read(folder, text=GOOD):
    path = folder / "align.toml"
    path.write_text(text)
    return AlignmentSpec.read(path)


def test_what_is_left_out_is_resolved(tmp_path):
    spec = read(tmp_path)
    assert spec.name == "align"
    assert (spec.coarse.kind, spec.fine.kind, spec.prefilter.kind) == (
        "inertial_frame",
        "filter",
        "none",
    )
    # The options of the modules stand in it, whatever their defaults become.
    assert spec.fine.mechanization.kind == "ned"
    assert spec.fine.interval_s == FineAlignment().interval


def test_a_resolved_one_is_read_again_as_it_is(tmp_path):
    spec = read(tmp_path, GOOD + '\n[fine]\nupdate_rule = "robust"\ncovariance = "ud"\n')
    again = AlignmentSpec.checked(
        spec.model_dump(mode="json", exclude_none=True, serialize_as_any=True)
    )
    assert again.model_dump(serialize_as_any=True) == spec.model_dump(serialize_as_any=True)


def test_modules_are_made_of_what_is_written(tmp_path):
    text = GOOD + (
        '\n[fine]\ninterval_s = 2.0\n[fine.update_rule]\nkind = "robust"\n'
        'influence = { kind = "huber", k = 2.0 }\nscale = 1.5\n'
        "[fine.mechanization]\nheight_time_constant_ms = 20000\n"
    )
    spec = read(tmp_path, text)
    made = spec.fine.make(ellipsoid="grs80")
    assert isinstance(made, FineAlignment)
    assert made.interval == 2.0
    assert isinstance(made.rule, RobustUpdate)
    assert (made.rule.scale, made.rule.influence.k) == (1.5, 2.0)
    assert isinstance(made.mechanization, NorthEastDown)
    # The place says on which ellipsoid; other units are converted.
    assert made.mechanization.ellipsoid == "grs80"
    assert made.mechanization.height_time_constant == 20.0


@pytest.mark.parametrize("slot", SLOTS.values(), ids=lambda s: s.name)
def test_every_module_can_be_written_with_its_defaults(slot):
    for kind, entry in slot.entries.items():
        form = form_of(entry, kind, ChoiceSpec)
        needed = {o.key: o for o in options_of(entry) if o.key in form.model_fields}
        given = {k: 1.0 for k in needed if form.model_fields[k].is_required()}
        assert isinstance(form(**given).make(), entry)


@pytest.mark.parametrize("slot", SLOTS.values(), ids=lambda s: s.name)
def test_every_option_that_is_documented_with_a_unit_has_it_in_its_key(slot):
    """Units stand in the docstrings as ``name : float, s``; keys without them would mislead."""
    units = {"s", "ms", "m", "m/s", "m/s²", "Hz", "dB", "deg", "deg/s", "rad", "rad/s"}
    for entry in slot.entries.values():
        told: dict[str, str] = {}
        for cls in entry.__mro__:
            for line in (cls.__doc__ or "").splitlines():
                found = re.fullmatch(r"\s+([\w, ]+) : ([\w ]+), (\S+)(?:, optional)?", line)
                if found and found[3] in units:
                    told |= dict.fromkeys(found[1].split(", "), found[3])
        for option in options_of(entry):
            if option.field in told and option.slot is None:
                ending = told[option.field].lower().replace("/", "_per_").replace("²", "2")
                assert option.key.endswith(f"_{ending}"), (entry, option.field)


def test_what_the_tables_of_units_and_given_fields_name_is_there():
    entries = [e for s in SLOTS.values() for e in s.entries.values()]
    names = {f.name for e in entries for f in fields(e)}
    names |= {f"{e.__name__}.{f.name}" for e in entries for f in fields(e)}
    assert set(UNITS) <= names
    assert set(GIVEN) <= names
    assert set(STAGES) <= set(SLOTS)


def line_of(text, key):
    rows = list(enumerate(text.splitlines(), 1))
    return next(k for k, line in reversed(rows) if line.startswith(key))


@pytest.mark.parametrize(
    ("text", "key", "what", "remedy"),
    [
        (GOOD.replace("lat_deg", "lat"), "lat", "no unit", "lat_deg"),
        (GOOD.replace("lat_deg = 55.0", "lat_deg = 95.0"), "lat_deg", "beyond a pole", "-90 to 90"),
        (GOOD.replace("55.0", '"?"'), None, "value is missing", "question|by its value"),
        (GOOD.replace("fog-1000", "fog-100"), "sensor", "fog-100", "fog-1000"),
        (GOOD.replace('sensor = "fog-1000"', ""), None, "sensors are not stated", "catalogue"),
        (GOOD + '[coarse]\nkind = "inertial"\n', "kind", "no 'inertial'", "inertial_frame"),
        (GOOD + "[coarse]\nblocks = 3\n", "blocks", "unknown key", ""),
        (
            GOOD + '[coarse]\nkind = "two_vector"\nblocks = 1\n',
            "blocks",
            "1 blocks are out of range",
            "2 to",
        ),
        (GOOD + '[coarse]\nkind = "two_vector"\nblocks = 2.5\n', "blocks", "2.5", "whole number"),
        (GOOD + '[coarse]\nkind = "known_heading"\nsd_deg = 1.0\n', None, "missing", "heading_deg"),
        (GOOD + '[coarse]\nkind = "gnss_course"\n', "kind", "none are given", "gnss"),
        (GOOD + '[coarse]\nkind = "levelling"\n', "kind", "no heading", "none"),
        (GOOD + "[coarse]\nduration_s = 100.0\n", "duration_s", "longer than the record", "less"),
        (GOOD + "[fine]\ninterval_s = 0\n", "interval_s", "measurement interval of 0", "1 s"),
        (GOOD + '[fine]\nmechanization = "nde"\n', "mechanization", "no 'nde'", "ned"),
        (GOOD + '[fine]\nerror_model = "quaternions"\n', None, "wander azimuth", "wander_azimuth"),
        (GOOD + '[fine]\nobserve = ["rate"]\n', "observe", "not a measurement", "velocity"),
        (GOOD + '[fine.mechanization]\nheight = "up"\n', "height", "up", "free"),
        (
            GOOD + "[axes]\nmatrix = [[1,0,0],[0,1,0],[0,0,-1]]\n",
            "matrix",
            "reflection",
            "down is",
        ),
        (
            GOOD + "[axes]\nmatrix = [[1,0,0],[0,1,0],[0,0.1,1]]\n",
            "matrix",
            "are at|long",
            "cosines",
        ),
        (GOOD + '[axes]\ndesign = "chernodarov"\n', "design", "unknown axes", "chernodarov-2009"),
        (
            GOOD + '[axes]\naxes = "x,y,z"\ndesign = "chernodarov-2009"\n',
            "design",
            "states it already",
            "keep one",
        ),
        (
            GOOD + "[axes]\ngyro_matrix = [[1,0,0],[0,1,0],[0,0,1]]\n",
            "gyro_matrix",
            "accel_matrix is missing",
            "give both",
        ),
        (GOOD + "[sensors.gyro]\nbias_sd_deg = 1\n", None, "unknown key", "bias_sd_deg_per_h"),
        (GOOD + '[log]\npath = "x.csv"\n', None, "is given, too", "keep one"),
        (
            GOOD.replace("[simulation]", "[simulations]"),
            "[simulations]",
            "unknown key",
            "simulation",
        ),
        (GOOD.replace("60.0", "-1.0"), "duration_s", "-1.0 is out of range", "above 0"),
        ('name = "x"\n' + GOOD, "name", "unknown key", "title"),
    ],
)
def test_what_does_not_fit_names_its_line(tmp_path, text, key, what, remedy):
    with pytest.raises(ConfigError) as error:
        read(tmp_path, text)
    found = error.value.finding
    faults = found.data["faults"] if found.code == "config.several" else [found]
    said = next((one for one in faults if re.search(what, one.what)), faults[0])
    assert re.search(what, said.what), said
    assert re.search(remedy, said.remedy or ""), said
    assert said.file == "align.toml"
    if key is not None:
        assert said.line == line_of(text, key), said


def test_a_log_that_is_not_there_is_told_with_its_line(tmp_path):
    text = '[log]\npath = "gone.csv"\n' + GOOD[GOOD.index("[site]") :]
    with pytest.raises(ConfigError, check=coded("config.named-file-missing")) as error:
        read(tmp_path, text)
    assert error.value.finding.line == 2
