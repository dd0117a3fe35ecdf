"""Bad input to the reconstruction of a crash: what is called, and what is said about it."""

from __future__ import annotations

import inspect
import tempfile
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from strapdown import (
    Assumed,
    CrashOptions,
    Entry,
    Mounting,
    read_nhtsa,
    reconstruct_crash,
    sample_paths,
)
from strapdown.crash.path import compare_with_reference
from strapdown.crash.severity import find_severity_model, injury_risk
from strapdown.dsp.channel_class import cfc_filter
from strapdown.errors import StrapdownError
from strapdown.sensors.crash_unit import RecordedTriad
from strapdown.sensors.synchronise import synchronise
from strapdown.simulation.crash_motion import find_crash
from strapdown.simulation.crash_recording import paper_units, record_crash

LOW, HIGH, GYRO = 0, 1, 2
DESIGNS = {design.name: design for design in paper_units()}
ENTRY = Entry.from_speed(7.1, 0.1)
# A made-up test of one curve, in the form of the NHTSA database.
HEADER = """\
----- EV5 -----
----- TEST -----
V5|a title|an aim|03/OCT/2017|MGA|DTNH|BT17|NCA|VTB|CON|DRY|22|OTH|OTH|36|0|0|0|1|none
----- INSTRUMENTATION -----
1|93|AC|NA|FLLR|XG|SEC|G'S|2800|M|D|800|21|36|-2|3|100|AM|P|LEFT REAR CROSSMEMBER
----- END -----
"""
CHANNEL = "".join(f"{1e-4 * k:.6f}\t{-0.1 * k:.3f}\n" for k in range(-2, 4))


def record(name, recorder="IMU1", **options):
    """What a recorder of the paper writes of a simulated crash."""
    crash = find_crash(name)
    return record_crash(crash.motion, DESIGNS[recorder], impact=crash.start, seed=1, **options)[0]


@cache
def first_unit():
    """Unit 1 in the simulated pole crash, made when a test first asks for it."""
    return record("pole")


@cache
def second_unit():
    """Unit 2 in the same crash."""
    return record("pole", "IMU2")


def changed(unit, which, change):
    """The unit with the table of one of its parts, or of all, changed by a function."""
    parts = [*unit.accelerometers, unit.gyro]
    for k in range(3) if which is None else [which]:
        table = change(parts[k].table.copy())
        table.attrs = dict(parts[k].table.attrs)
        parts[k] = replace(parts[k], table=table)
    return replace(unit, accelerometers=tuple(parts[:2]), gyro=parts[2])


def after(instant):
    """Cuts a record before an instant from the trigger."""
    return lambda table: table.loc[first_unit().trigger + instant :]


def shaken(table):
    """An engine that never stops, in the unit of the table."""
    size = 1.5 if "accel_x" in table else 0.3
    return table + size * np.sin(60.0 * table.index.to_numpy())[:, None]


def no_rest():
    return reconstruct_crash([changed(first_unit(), None, shaken)], ENTRY)


def starts_in_the_crash():
    return reconstruct_crash([changed(first_unit(), None, after(0.02))], ENTRY)


def starts_in_the_crash_and_levelled():
    short = changed(first_unit(), None, after(0.0))
    level = {"levelling": (0.0, 0.0, 1.5)}
    return reconstruct_crash([short], ENTRY, CrashOptions(window=(0.0, 0.75), preparation=level))


def only_coasting():
    return reconstruct_crash([changed(first_unit(), None, after(-1.0))], ENTRY)


def no_entry():
    return reconstruct_crash([changed(first_unit(), None, after(-1.0))], None)


def high_range_saturated():
    return reconstruct_crash([changed(first_unit(), HIGH, lambda t: t.clip(-100.0, 100.0))], ENTRY)


def gyro_saturated():
    return reconstruct_crash([changed(first_unit(), GYRO, lambda t: t.clip(-1.0, 1.0))], ENTRY)


def laboratory_channel_saturated():
    laboratory = record("pole", "LAB1", start=6.5)
    (part,) = laboratory.accelerometers
    told = replace(part.uncertainty, full_scale=100.0)
    held = RecordedTriad(part.table.clip(-100.0, 100.0), told, part.name)
    return synchronise([first_unit(), replace(laboratory, accelerometers=(held,))])


def missing_axis():
    return reconstruct_crash(
        [changed(first_unit(), HIGH, lambda t: t.drop(columns="accel_y"))], ENTRY
    )


def without(unit, *columns):
    """The unit without some axes of its accelerometers, and without its gyro."""
    for which in (LOW, HIGH):
        unit = changed(unit, which, lambda t: t.drop(columns=list(columns)))
    return replace(unit, gyro=None)


def assumed_and_not_levelled():
    unit = replace(
        without(first_unit(), "accel_y"), assumed=Assumed(turn_sd_deg=5.0, delta_v_sd=1.0)
    )
    return reconstruct_crash([unit], ENTRY)


def assumed():
    stated = Assumed(turn_sd_deg=(2.0, 2.0, 5.0), delta_v_sd=1.0, because="the marks are straight")
    unit = replace(without(first_unit(), "accel_y"), assumed=stated)
    return reconstruct_crash(
        [unit], ENTRY, CrashOptions(preparation={"levelling": (0.0, 0.0, 1.0)})
    )


def assumed_where_the_impact_is():
    unit = replace(without(record("side"), "accel_y"), assumed=Assumed(5.0, 1.0))
    return reconstruct_crash(
        [unit], ENTRY, CrashOptions(preparation={"levelling": (0.0, 0.0, 1.0)})
    )


def assumed_in_one_range():
    unit = changed(first_unit(), HIGH, lambda t: t.drop(columns="accel_y"))
    return reconstruct_crash([replace(unit, assumed=Assumed(delta_v_sd=1.0))], ENTRY)


def nothing_assumed():
    Assumed(because="the marks are straight")


def gyro_for_accelerometer():
    return reconstruct_crash([replace(first_unit(), accelerometers=(first_unit().gyro,))], ENTRY)


def other_rates_and_starts():
    unit = changed(first_unit(), GYRO, lambda t: t.iloc[::4])
    return reconstruct_crash([changed(unit, HIGH, after(-2.0))], ENTRY)


def axes_not_together():
    def apart(table):
        table.iloc[1::2, 2] = np.nan
        return table

    return reconstruct_crash([changed(first_unit(), LOW, apart)], ENTRY)


def in_g():
    return reconstruct_crash([changed(first_unit(), LOW, lambda t: t / 9.80665)], ENTRY)


def high_range_in_g():
    return reconstruct_crash([changed(first_unit(), HIGH, lambda t: t / 9.80665)], ENTRY)


def in_degrees():
    return reconstruct_crash([changed(first_unit(), GYRO, np.degrees)], ENTRY)


def in_milliseconds():
    unit = changed(first_unit(), None, lambda t: t.set_axis(1000.0 * t.index))
    return reconstruct_crash([unit], ENTRY)


def millimetres():
    Mounting((600.0, -500.0, 200.0))


def upside_down():
    return reconstruct_crash([changed(first_unit(), LOW, lambda t: -t)], ENTRY)


def hard_braking():
    return reconstruct_crash([record("hard-braking")], Entry.from_speed(20.0, 0.3))


def pothole():
    return reconstruct_crash([record("pothole")], Entry.from_speed(13.9, 0.3))


def swapped_axes():
    def swap(table):
        return table.rename(columns={"accel_x": "accel_y", "accel_y": "accel_x"})

    second = changed(changed(second_unit(), LOW, swap), HIGH, swap)
    return reconstruct_crash([first_unit(), second], ENTRY)


def wrong_lever_arm():
    wrong = replace(second_unit().mounting, position=(0.6, 1.5, 0.2))
    return reconstruct_crash([first_unit(), replace(second_unit(), mounting=wrong)], ENTRY)


def no_trigger():
    return reconstruct_crash([replace(first_unit(), trigger=None)], ENTRY)


def trigger_of_another_clock():
    return reconstruct_crash([replace(first_unit(), trigger=7.05e3)], ENTRY)


def late_trigger():
    late = replace(first_unit(), trigger=first_unit().trigger + 0.05)
    return reconstruct_crash([late], ENTRY, CrashOptions(window=(-0.2, 0.5)))


def unknown_lender():
    laboratory = replace(record("pole", "LAB1", start=6.5), gyro_from="IMU3")
    return reconstruct_crash([first_unit(), laboratory], ENTRY)


def no_gyro():
    return reconstruct_crash([replace(first_unit(), gyro=None)], ENTRY)


def nan():
    def one(table):
        table.iloc[776, 1] = np.nan
        return table

    return reconstruct_crash([changed(first_unit(), LOW, one)], ENTRY)


def text():
    def one(table):
        table = table.astype(object)
        table.iloc[776, 1] = "n/a"
        return table

    return reconstruct_crash([changed(first_unit(), LOW, one)], ENTRY)


def time_back():
    def back(table):
        stamps = table.index.to_numpy().copy()
        stamps[900:] -= 1.0
        return table.set_axis(stamps)

    return reconstruct_crash([changed(first_unit(), GYRO, back)], ENTRY)


def gap():
    def hole(table):
        time = table.index - first_unit().trigger
        return table[(time < 0.02) | (time > 0.06)]

    return reconstruct_crash([changed(first_unit(), GYRO, hole)], ENTRY)


def impossible_speed():
    Entry.from_speed(200.0, 1.0)


def speed_in_km_h():
    return reconstruct_crash([first_unit()], Entry.from_speed(25.6, 0.3))


def window():
    return reconstruct_crash([first_unit()], ENTRY, CrashOptions(window=(-0.1, 5.0)))


def misspelt_option():
    return reconstruct_crash(
        [first_unit()], ENTRY, CrashOptions(preparation={"leveling": (0.0, 0.0, 1.0)})
    )


def stretch_in_the_crash():
    return reconstruct_crash([first_unit()], ENTRY, CrashOptions(preparation={"rest": (0.0, 0.1)}))


def class_beyond_the_rate():
    cfc_filter(first_unit().accelerometers[1].table["accel_x"], 1.0 / 200.0, 60)


def reference_without_a_column():
    path = reconstruct_crash([first_unit()], ENTRY).main.path
    compare_with_reference(path, path.table[["north", "east"]])


def runs_of_the_whole():
    sample_paths(reconstruct_crash([first_unit()], ENTRY), runs=100)


def beyond_a_model():
    model = find_severity_model("wang_2022_front_mais3")
    injury_risk(model, {"delta_v": 30.0, "crash_type": "front"})


def nhtsa(header=HEADER, channel=CHANNEL):
    """A test in a folder, read with its channel."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "v00001.EV5").write_text(header)
        (Path(folder) / "v00001.093").write_text(channel)
        read_nhtsa(Path(folder) / "v00001.EV5").channel(93).table  # noqa: B018


def cut_header():
    nhtsa(header=HEADER[:200])


def cut_channel():
    nhtsa(channel=CHANNEL[:40])


def not_a_header():
    nhtsa(header="time,accel_x\n0.0,1.0\n")


@dataclass(frozen=True)
class CrashCall:
    title: str
    call: Callable[[], object]

    @property
    def source(self) -> str:
        text = textwrap.dedent(inspect.getsource(self.call).split("\n", 1)[1]).rstrip()
        text = "\n".join(line.removeprefix("return ") for line in text.splitlines())
        return text.replace("\n\n", "\n\n\n") if text.startswith("def ") else text

    @property
    def said(self) -> str:
        """The error, or what was found."""
        try:
            found = self.call()
        except StrapdownError as error:
            return f"{type(error).__name__}: {error}"
        return "\n".join(f"note: {finding}" for finding in found.findings)


CRASH_CALLS = (
    CrashCall("No stationary stretch", no_rest),
    CrashCall("A record that starts in the crash", starts_in_the_crash),
    CrashCall("The same, with the attitude stated", starts_in_the_crash_and_levelled),
    CrashCall("A record that starts at speed", only_coasting),
    CrashCall("A record that starts at speed, and no entry speed", no_entry),
    CrashCall("The high range saturated too", high_range_saturated),
    CrashCall("The gyro saturated", gyro_saturated),
    CrashCall("A laboratory channel saturated", laboratory_channel_saturated),
    CrashCall("A missing axis", missing_axis),
    CrashCall("A missing axis that another range has", assumed_in_one_range),
    CrashCall("A missing axis that is assumed, and no attitude", assumed_and_not_levelled),
    CrashCall("The same, with the attitude stated", assumed),
    CrashCall("An impact along an axis that is assumed", assumed_where_the_impact_is),
    CrashCall("Nothing assumed", nothing_assumed),
    CrashCall("A gyro in place of an accelerometer", gyro_for_accelerometer),
    CrashCall("Parts of different rates and starts", other_rates_and_starts),
    CrashCall("Axes that were not sampled together", axes_not_together),
    CrashCall("Accelerations in g", in_g),
    CrashCall("The high range alone in g", high_range_in_g),
    CrashCall("Rates in degrees per second", in_degrees),
    CrashCall("Stamps in milliseconds", in_milliseconds),
    CrashCall("A position in millimetres", millimetres),
    CrashCall("A unit with the other signs", upside_down),
    CrashCall("Hard braking", hard_braking),
    CrashCall("A pothole", pothole),
    CrashCall("Swapped axes of a second unit", swapped_axes),
    CrashCall("A wrong position of a second unit", wrong_lever_arm),
    CrashCall("No trigger", no_trigger),
    CrashCall("A trigger of another clock", trigger_of_another_clock),
    CrashCall("A late trigger", late_trigger),
    CrashCall("A gyro borrowed from nobody", unknown_lender),
    CrashCall("No gyro", no_gyro),
    CrashCall("NaN in an axis", nan),
    CrashCall("Text in an axis", text),
    CrashCall("Time that goes back", time_back),
    CrashCall("A gap in the gyro", gap),
    CrashCall("An entry speed that no car has", impossible_speed),
    CrashCall("An entry speed in km/h", speed_in_km_h),
    CrashCall("A window outside of the record", window),
    CrashCall("A rest in the crash", stretch_in_the_crash),
    CrashCall("A misspelt option of the preparation", misspelt_option),
    CrashCall("A class that the rate cannot carry", class_beyond_the_rate),
    CrashCall("A reference path without a column", reference_without_a_column),
    CrashCall("Monte Carlo of the whole reconstruction", runs_of_the_whole),
    CrashCall("A change of velocity beyond a model of injury", beyond_a_model),
    CrashCall("A crash test's header that was cut", cut_header),
    CrashCall("A crash test's channel that was cut", cut_channel),
    CrashCall("Another file in place of a crash test's header", not_a_header),
)
