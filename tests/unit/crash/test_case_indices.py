"""Indices of a case: occupants by the codes of their channels, the vehicle with its bound."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.unit.report.crash_results import crash_case

from strapdown.crash import indices
from strapdown.crash.case_indices import occupant_indices, vehicle_indices
from strapdown.formats.crash_record import CrashChannel, CrashRecord
from strapdown.formats.crash_records import read_crash_record
from strapdown.formats.crash_writers import write_mme
from strapdown.report.crash_tables import indices_table

G = 9.80665
STEP = 1e-4
TIME = np.arange(-500, 2500) * STEP
# A pulse of 100 ms: slow against all filter classes (CFC 180 is 3 dB down at 300 Hz).
PULSE = np.where((TIME > 0.0) & (TIME < 0.1), np.sin(np.pi * TIME / 0.1) ** 2, 0.0)
# A filter of 300 Hz takes (f/300 Hz)⁴/2 of a sine; of 20 Hz, 1e-5.
FILTERED = 1e-4

QUANTITIES = {"AC": ("acceleration", "m/s2"), "DS": ("displacement", "m"), "FO": ("force", "N")}


def channel(code, values, unit=None):
    quantity, si = QUANTITIES.get(code[12:14], ("other", "Nm"))
    axis, load = code[14].lower(), lambda: (TIME, values)
    # Without a body of its own, that of the code is read.
    return CrashChannel(code, quantity, axis, unit or si, load, body="", vehicle="1")


def record_of(channels, folder):
    """Record of these channels as a reader of ISO MME has them."""
    write_mme(folder, CrashRecord(Path("test"), "mme", "test", {}, tuple(channels), ()))
    return read_crash_record(folder)


def driver(dummy="H3"):
    def triad(part, size, letter):
        return [
            channel(f"11{part}0000{dummy}AC{axis}{letter}", size * share * G * PULSE)
            for axis, share in (("X", -0.6), ("Y", 0.0), ("Z", 0.8))
        ]

    return [
        *triad("HEAD", 50.0, "0"),
        *triad("CHST", 40.0, "0"),
        channel(f"11CHST0000{dummy}DSX0", -0.035 * PULSE),
        channel(f"11NECKUP00{dummy}FOX0", 500.0 * PULSE),
        channel(f"11NECKUP00{dummy}FOZ0", 1361.2 * PULSE),
        channel(f"11NECKUP00{dummy}MOY0", (-27.0 + 0.01778 * 500.0) * PULSE),
        channel(f"11FEMRLE00{dummy}FOZ0", -4000.0 * PULSE),
    ]


def found_in(tmp_path, channels, vehicles=("1",)):
    record = record_of(channels, tmp_path / "mme")
    return {i.name: i for i in occupant_indices([record], vehicles)}


def test_an_occupant_by_the_codes_of_its_channels(tmp_path):
    found = found_in(tmp_path, driver())
    assert {i.of for i in found.values()} == {"front left occupant"}
    values = {name: i.value for name, i in found.items()}
    # Compared with the functions on the pulse before the filters.
    head = 50.0 * PULSE
    exact = indices.hic(TIME, np.column_stack([head * G, 0 * head, 0 * head]))
    assert values["HIC15"] == pytest.approx(exact.value, rel=3.0 * FILTERED)
    level = indices.exceeded_level(TIME, head)
    assert values["head 3 ms"] == pytest.approx(level, rel=FILTERED)
    assert values["chest 3 ms"] == pytest.approx(0.8 * level, rel=FILTERED)
    assert values["chest deflection"] == pytest.approx(35.0, rel=FILTERED)
    # 1361.2/6806 + 27/135.
    assert values["Nij"] == pytest.approx(0.4, rel=FILTERED)
    assert values["neck tension"] == pytest.approx(1361.2, rel=FILTERED)
    assert values["left femur compression"] == pytest.approx(4000.0, rel=FILTERED)
    assert found["Nij"].limit == 1.0
    assert found["chest deflection"].limit == 63.0


def test_limits_and_critical_values_are_those_of_the_dummy(tmp_path):
    found = found_in(tmp_path, driver("HF"))
    assert found["Nij"].value == pytest.approx(1361.2 / 4287.0 + 27.0 / 67.0, rel=FILTERED)
    assert (found["chest deflection"].limit, found["left femur compression"].limit) == (52, 6805)


def test_without_a_dummy_there_is_no_nij(tmp_path):
    found = found_in(tmp_path, driver("00"))
    assert found["Nij"].value is None
    assert found["Nij"].because.code == "crash.index-dummy-unknown"
    assert found["chest deflection"].limit is None
    assert found["HIC15"].value > 0.0


def test_occupants_of_another_vehicle_are_not_of_this_one(tmp_path):
    assert not found_in(tmp_path, driver(), ("2",))


def test_a_unit_in_pounds_and_inches(tmp_path):
    channels = [c for c in driver() if "NECK" in c.name]
    # The moment alone is not converted by the reader: 1 lbf in is 0.112985 N m.
    moment = channels[-1]
    values = moment.load()[1] / 0.1129848290276167
    other = replace(moment, unit="in-lb", load=lambda: (TIME, values))
    found = found_in(tmp_path, [*channels[:-1], other])
    assert found["Nij"].value == pytest.approx(0.4, rel=FILTERED)


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda cs: [c for c in cs if "HEAD0000H3ACY" not in c.name], "index-axis-missing"),
        (
            lambda cs: [replace(c, name=c.name[:-1] + "D") if "HEAD" in c.name else c for c in cs],
            "index-class-too-low",
        ),
        (
            lambda cs: [replace(c, load=lambda c=c: tuple(x[::4] for x in c.load())) for c in cs],
            "index-rate-too-low",
        ),
    ],
)
def test_why_a_head_has_no_index(tmp_path, change, code):
    found = found_in(tmp_path, change(driver()))
    for name in ("HIC15", "HIC36", "head 3 ms"):
        assert found[name].value is None
        assert found[name].because.code == f"crash.{code}"
    assert found["chest deflection"].value is not None or code == "index-rate-too-low"


def test_a_class_that_was_applied_is_not_applied_again(tmp_path):
    # The chest in CFC 180, as its code says: the values are those of the record.
    channels = [
        replace(c, name=c.name[:-1] + "C") if c.name[2:6] == "CHST" and "AC" in c.name else c
        for c in driver()
    ]
    found = found_in(tmp_path, channels)
    assert found["chest 3 ms"].value == pytest.approx(
        indices.exceeded_level(TIME, 40.0 * PULSE), rel=1e-9
    )


class TestVehicle:
    def test_bound_is_that_of_the_change_where_the_index_is_one(self):
        unit = crash_case("pole").reconstruction.main
        found = {(i.name, i.standard): i for i in vehicle_indices(unit, 0)}
        oiv = found["OIV forward", "NCHRP Report 350; MASH"]
        change = unit.body[0].event
        # After the contact nothing changes: the occupant impact velocity is the change of velocity.
        assert oiv.value == pytest.approx(-change.delta_v.vector[0], rel=0.02)
        half = 0.5 * (oiv.high - oiv.low)
        assert half == pytest.approx(change.bound.half_width[0], rel=0.15)

    def test_occupant_load_criterion_of_a_frontal_impact_only(self):
        unit = crash_case("side").reconstruction.main
        found = {i.name: i for i in vehicle_indices(unit, 0)}
        assert found["OLC"].value is None
        assert found["OLC"].because.code == "crash.index-frontal-only"
        assert found["THIV"].value > 0.0

    def test_the_bound_of_a_part_is_open_away_from_zero(self):
        result = crash_case("pole")
        unit = result.reconstruction.main
        (body,) = unit.body
        cut = replace(body.event, missing=("after",), open_axes=(True, True, True))
        part = vehicle_indices(replace(unit, body=(replace(body, event=cut),)), 0)
        below = 0
        for whole, one in zip(vehicle_indices(unit, 0), part, strict=True):
            if whole.low is None:
                continue
            assert one.at_least
            if whole.value >= 0.0:
                assert (one.low, one.high) == (whole.low if whole.low >= 0.0 else None, None)
            else:
                assert (one.low, one.high) == (None, whole.high if whole.high < 0.0 else None)
                below += 1
        # The ride down of a front is backward: not "at least" a negative number.
        assert below
        table = indices_table(replace(result, indices=part))
        for cells, one in zip(table.rows, part, strict=True):
            if one.value is not None:
                assert cells[2].startswith("at least ") == (one.value >= 0.0)
