"""Event data recorders by 49 CFR 563: tables in many layouts against the pulses in them."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from tests.coded import coded

from strapdown.crash.case import case_unit, run_case, whole_records
from strapdown.crash.event_data import BRAKED, TIRE, indicated_entry, recorder_parts
from strapdown.crash.template import draft_case, read_records
from strapdown.errors import DataError
from strapdown.formats.crash_edr import element_of
from strapdown.formats.crash_records import read_crash_record

from .edr_tables import FACTORS, KMH, LAYOUTS, MPH, Layout, Pulse, text_of
from .test_template import filled

LATERAL = {"x": 0, "y": 1}


def drafted(folder, text, name="edr.csv"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return draft_case(read_records([path]), folder=folder)


def codes(draft, record=None):
    return {f.code for f in (*draft.findings, *(record.findings if record else ()))}


def recorded(folder, draft):
    """Stamps, s, and the change of velocity, m/s, that a run takes from the record."""
    spec = filled(draft, folder)
    records, spec = whole_records(spec)
    table = case_unit(spec.units[0], records).accelerometers[0].table
    time = table.index.to_numpy()
    mean = np.nan_to_num(table.to_numpy())
    steps = np.diff(time, prepend=time[0])
    return table, time, np.cumsum(mean * steps[:, None], axis=0)


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_layout_is_read_right(tmp_path, name):
    layout = LAYOUTS[name]
    draft = drafted(tmp_path, text_of(layout))
    toml = tomllib.loads(draft.text)
    (unit,) = toml["units"]
    (triad,) = unit["accelerometers"]
    assert set(triad["channels"]) == ({"x", "y"} if layout.lateral else {"x"})
    strong = max(range(len(layout.pulses)), key=lambda k: abs(layout.pulses[k].forward))
    pulse = layout.pulses[strong]
    table, time, change = recorded(tmp_path, draft)
    true = pulse.change(time)
    unit_size = (
        0.1 * KMH if layout.both_in_cell else FACTORS[layout.units[-1]] * (0.1**layout.decimals)
    )
    for k, column in enumerate(table.columns):
        axis = LATERAL[column[-1]]
        if layout.acceleration_only:
            # Instantaneous: 0.01 g of rounding.
            own = pulse.acceleration(time)[:, axis]
            assert np.abs(table[column] - own).max() <= 0.005 * 9.80665 * (1.0 + 1e-6)
            continue
        off = np.abs(change[:, k] - true[:, axis])
        assert off.max() <= 0.5 * unit_size * (1.0 + 1e-6)
        assert time[0] == pytest.approx(0.0, abs=1e-12)
        assert time[-1] == pytest.approx(layout.end)
    if layout.before == "none":
        assert toml["entry"]["speed_km_per_h"] == "?"
    else:
        own = FACTORS[layout.units[-1]] / KMH
        assert toml["entry"]["speed_km_per_h"] == pytest.approx(
            round(layout.speeds[strong] / own) * own, abs=1e-4 * layout.speeds[strong]
        )
        assert toml["entry"]["time_s"] == 0.0
        # The speed at time zero of a car that brakes on at 4 m/s² is within two deviations.
        age = 1.0 / layout.rate
        assert 2.0 * toml["entry"]["speed_sd_km_per_h"] > 4.0 * age / KMH
    assert unit["trigger_s"] == 0.0
    said = codes(draft)
    assert ("io.edr-ends-in-event" in said) == (layout.end < 0.1)
    assert ("io.edr-not-complete" in said) == (not layout.complete)
    assert ("crash.several-events-of-recorder" in said) == (len(layout.pulses) > 1)
    assert "io.edr-units-disagree" not in said


def test_the_regulations_names_with_commas_are_one_column_each(tmp_path):
    rows = "\n".join(f"{10 * k},{min(k, 12)},{-2 * min(k, 12)}" for k in range(26))
    for names in (
        "Time (ms),Delta-V, Longitudinal (km/h),Delta-V, Lateral (km/h)",
        'Time (ms),"Delta-V, Longitudinal (km/h)","Delta-V, Lateral (km/h)"',
    ):
        (tmp_path / "edr.csv").write_text(f"Crash Pulse\n{names}\n{rows}\n", encoding="utf-8")
        _, forward, right = read_crash_record(tmp_path / "edr.csv").channels
        assert (forward.axis, right.axis) == ("x", "y")
        for channel, last in ((forward, 12.0 * KMH), (right, -24.0 * KMH)):
            assert channel.load()[1][-1] == pytest.approx(last)
    # Where no blank tells the commas apart, which column is which is not known.
    pairs = "\n".join(f"{10 * k},{min(k, 12)}" for k in range(26))
    text = f"Time (ms),Delta-V,Longitudinal (km/h)\n{pairs}\n"
    (tmp_path / "edr.csv").write_text(text, encoding="utf-8")
    with pytest.raises(DataError, check=coded("io.edr-header-longer")):
        read_crash_record(tmp_path / "edr.csv")


@pytest.mark.parametrize("length", [0.03, 0.06, 0.1])
@pytest.mark.parametrize("first", [0.0, 0.01])
def test_the_reconstructed_change_is_the_recorded_one(tmp_path, length, first):
    layout = Layout(pulses=(Pulse(length=length),), first=first, decimals=3, lateral=False)
    draft = drafted(tmp_path, text_of(layout))
    result = run_case(filled(draft, tmp_path))
    (event,) = result.reconstruction.main.body
    assert event.event.delta_v.vector[0] == pytest.approx(-44.3 * KMH, abs=1e-3 * KMH)


def test_a_table_begins_at_time_zero_by_definition(tmp_path):
    draft = drafted(tmp_path, text_of(Layout()))
    result = run_case(filled(draft, tmp_path))
    assert result.reconstruction.main.events.events[0].starts_before_record
    found = {f.code: f.severity for f in result.findings}
    assert found["crash.table-levelled"] == "note"
    late = {"crash.record-begins-event-km-h", "crash.record-starts-in-crash-levelled"}
    assert not late & {*found}
    # A record of accelerations that begins there has missed what it does not have.
    other = drafted(tmp_path, text_of(Layout(acceleration_only=True, step=0.001)), "g.csv")
    found = {f.code for f in run_case(filled(other, tmp_path)).findings}
    assert late <= found


@pytest.mark.parametrize("end", [0.05, 0.06])
def test_a_table_of_six_or_seven_rows_is_at_least(tmp_path, end):
    draft = drafted(tmp_path, text_of(Layout(end=end, decimals=3)))
    spec = filled(draft, tmp_path)
    whole = run_case(spec).reconstruction.main.delta_v
    assert whole.at_least and whole.missing == ("after",)
    known = np.linalg.norm(Pulse().change([end]))
    assert whole.resultant == pytest.approx(known, rel=1e-3)
    # Its own length is the reason, not an overlap with itself.
    few = spec.options.model_copy(update={"rate_hz": 30.0})
    with pytest.raises(DataError, check=coded("sensors.record-too-short")):
        run_case(spec.model_copy(update={"options": few}))


def test_axes_are_of_the_vehicle_and_begin_together(tmp_path):
    # In mph with a decimal the lateral change is 0.0 after its first step of 10 ms.
    draft = drafted(tmp_path, text_of(Layout(units=("mph",), first=0.01, decimals=1)))
    (unit,) = tomllib.loads(draft.text)["units"]
    assert unit["angles_deg"] == [0.0, 0.0, 0.0]
    result = run_case(filled(draft, tmp_path))
    (event,) = result.reconstruction.main.body
    change = event.event.delta_v.vector / KMH
    assert np.abs(change[:2] - [-44.3, 7.4]).max() <= 0.05 * MPH / KMH + 1e-6


def test_pedal_and_indicated_speed_are_no_sensors(tmp_path):
    rows = "".join(f"{10 * k},{-min(k, 10) * 3},{20 + k},{60 - k}\n" for k in range(31))
    head = "Time (msec),Delta-V longitudinal (km/h),Accelerator Pedal (% full),Vehicle Speed (km/h)"
    draft = drafted(tmp_path, f"{head}\n{rows}")
    (unit,) = tomllib.loads(draft.text)["units"]
    assert [t["channels"] for t in unit["accelerometers"]] == [{"x": "Delta-V longitudinal (km/h)"}]
    assert "gyro" not in unit


@pytest.mark.parametrize(
    ("heading", "element"),
    [
        ("Accelerator Pedal, % full", "pedal"),
        ("Engine Throttle (%)", "pedal"),
        ("Engine Speed (RPM)", "rpm"),
        ("Speed, Vehicle Indicated (MPH)", "speed"),
        ("Service Brake", "brake"),
        ("ABS Activity", "abs"),
        ("Steering Input (deg)", "steering"),
        ("Vehicle Roll Angle (deg)", "roll angle"),
        ("Delta-V, longitudinal (MPH)", ""),
        ("Acceleration, lateral (g)", ""),
    ],
)
def test_elements_of_the_regulation(heading, element):
    assert element_of(heading) == element


def test_two_units_that_disagree_are_found_and_refused(tmp_path):
    layout = Layout(units=("mph", "km/h"), decimals=1, before="none", events="none")
    right = text_of(layout)
    assert "io.edr-two-units" in codes(drafted(tmp_path, right))
    # Of one column the factor is that of knots.
    lines = right.splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith("Time (msec)"))
    for k in range(at + 1, len(lines)):
        cells = lines[k].split(",")
        cells[2] = f"{float(cells[1]) * 1.852:.1f}"
        lines[k] = ",".join(cells)
    path = tmp_path / "edr.csv"
    path.write_text("\n".join(lines) + "\n")
    record = read_crash_record(path)
    assert "io.edr-units-disagree" in {f.code for f in record.findings}
    with pytest.raises(DataError, check=coded("crash.axis-recorded-twice")):
        draft_case([record], folder=tmp_path)


def test_a_table_that_begins_late_keeps_its_sum(tmp_path):
    layout = Layout(first=0.03, decimals=2, before="none")
    draft = drafted(tmp_path, text_of(layout))
    table, time, change = recorded(tmp_path, draft)
    assert change[-1, 0] == pytest.approx(-44.3 * KMH, abs=0.005 * KMH)
    assert time[0] == 0.0
    np.testing.assert_allclose(np.diff(time), 0.01, rtol=1e-9)
    # What the first value is made of is not known: it is spread evenly.
    np.testing.assert_allclose(np.diff(change[:4, 0]), change[3, 0] / 3.0, rtol=1e-9)
    assert "io.delta-v-begins-late" in {f.code for f in table.attrs["findings"]}


def test_a_table_that_is_not_zero_at_zero_widens_or_is_refused(tmp_path):
    time = np.arange(0.0, 0.251, 0.01)
    change = -40.0 * np.clip((time + 0.01) / 0.1, 0.0, 1.0)

    def text(values):
        rows = "".join(f"{1e3 * t:.0f},{v:.1f}\n" for t, v in zip(time, values, strict=True))
        return f"Time (msec),Delta-V longitudinal (km/h)\n{rows}"

    draft = drafted(tmp_path, text(change))
    table, _, summed = recorded(tmp_path, draft)
    assert summed[-1, 0] == pytest.approx(-40.0 * KMH, abs=1e-9)
    assert "io.delta-v-offset-at-start" in {f.code for f in table.attrs["findings"]}
    (at_zero,) = (tomllib.loads(drafted(tmp_path, text(v)).text) for v in (change - change[0],))
    wide, plain = (
        c["units"][0]["accelerometers"][0]["uncertainty"]["bias_sd_mg"]
        for c in (tomllib.loads(draft.text), at_zero)
    )
    assert wide > 3.0 * plain
    with pytest.raises(DataError, check=coded("io.delta-v-not-zero-at-start")):
        drafted(tmp_path, text(change - 20.0))


def test_the_end_of_the_range_is_found(tmp_path):
    layout = Layout(pulses=(Pulse(forward=-118.0 * KMH),))
    text = text_of(layout)
    assert "io.edr-at-range-end" not in codes(
        drafted(tmp_path, text_of(replace(layout, pulses=(Pulse(forward=-92.0 * KMH),))))
    )
    cut = []
    for line in text.splitlines():
        cells = line.split(",")
        if cells[0].isdigit() and float(cells[1]) < -100.0:
            cells[1] = "-100"
        cut.append(",".join(cells))
    draft = drafted(tmp_path, "\n".join(cut) + "\n")
    (found,) = (f for f in draft.findings if f.code == "io.edr-at-range-end")
    assert found.data["axis"] == "x"


def test_a_stated_maximum_that_the_table_does_not_reach(tmp_path):
    text = "Maximum Delta-V, Longitudinal (MPH),-27.5\n\n" + text_of(
        Layout(end=0.06, preamble=False, events="none")
    )
    assert "io.edr-maximum-beyond-table" in codes(drafted(tmp_path, text))
    whole = text_of(Layout(preamble=False, events="none"))
    whole = "Maximum Delta-V, Longitudinal (MPH),-27.5\n\n" + whole
    assert "io.edr-maximum-beyond-table" not in codes(drafted(tmp_path, whole))


def test_one_recorder_exported_twice_is_one(tmp_path):
    paths = []
    for unit in ("mph", "km/h"):
        path = tmp_path / f"{unit.replace('/', '')}.csv"
        path.write_text(text_of(Layout(units=(unit,), decimals=1)))
        paths.append(path)
    draft = draft_case(read_records(paths), folder=tmp_path)
    assert len(tomllib.loads(draft.text)["units"]) == 1
    assert "crash.recorder-exported-twice" in codes(draft)
    paths[1].write_text(text_of(Layout(decimals=1, pulses=(Pulse(forward=-41.0 * KMH),))))
    draft = draft_case(read_records(paths), folder=tmp_path)
    assert len(tomllib.loads(draft.text)["units"]) == 2
    assert "crash.recorder-exported-twice" not in codes(draft)


def before(brake, abs_, speeds, rate=2.0, last=0.0):
    time = last - np.arange(len(speeds))[::-1] / rate
    rows = "".join(
        f"{t},{v},{b},{a}\n" for t, v, b, a in zip(time, speeds, brake, abs_, strict=True)
    )
    return f"Time (sec),Vehicle Speed (km/h),Service Brake,ABS Activity\n{rows}\n"


def entry_of(folder, *args, **keys):
    path = folder / "entry.csv"
    path.write_text(
        before(*args, **keys) + text_of(Layout(before="none", preamble=False, events="none"))
    )
    return indicated_entry(read_crash_record(path), 1, 1)


def test_the_entry_speed_and_its_parts(tmp_path):
    steady = entry_of(tmp_path, ["Off"] * 3, ["Off"] * 3, [70, 71, 70])
    assert steady.speed == pytest.approx(70 * KMH)
    # ±1 km/h, uniform, with rounding to 1 km/h; 0.5 g or less over half a second; tires.
    assert steady.indicated_sd == pytest.approx(KMH * np.sqrt(1 / 3 + 1 / 12))
    assert steady.age_sd == pytest.approx(0.5 * 9.80665 * 0.5 / np.sqrt(3))
    assert (steady.slip_sd, steady.tire_sd) == (0.0, pytest.approx(TIRE * 70 * KMH))
    braked = entry_of(tmp_path, ["Off", "On", "On"], ["Off"] * 3, [70, 62, 54])
    assert braked.age_sd == pytest.approx(BRAKED * 0.5 / np.sqrt(3))
    assert braked.slip_sd == pytest.approx(0.1 * 54 * KMH / np.sqrt(3))
    regulated = entry_of(tmp_path, ["Off", "On", "On"], ["Off", "Off", "Engaged"], [70, 62, 54])
    assert regulated.slip_sd == pytest.approx(0.3 * 54 * KMH / np.sqrt(3))
    assert regulated.sd > braked.sd > steady.sd
    old = entry_of(tmp_path, ["Off"] * 3, ["Off"] * 3, [70, 71, 70], last=-0.5)
    assert old.age_sd == pytest.approx(2.0 * steady.age_sd)


def test_locked_wheels_widen_the_entry_to_the_speed_before(tmp_path):
    # 70 to 10 km/h in half a second is 33 m/s².
    locked = entry_of(tmp_path, ["Off", "On", "On"], ["Off"] * 3, [72, 70, 10])
    assert locked.locked
    assert locked.slip_sd == pytest.approx(60 * KMH / np.sqrt(3))
    assert not entry_of(tmp_path, ["Off", "On", "On"], ["Off"] * 3, [72, 70, 58]).locked


def test_invalid_and_old_speeds(tmp_path):
    held = entry_of(tmp_path, ["Off"] * 3, ["Off"] * 3, [70, 66, "Invalid"])
    assert (held.speed, held.stamp) == (pytest.approx(66 * KMH), -0.5)
    assert entry_of(tmp_path, ["Off"] * 3, ["Off"] * 3, ["SNA"] * 3) is None
    assert entry_of(tmp_path, ["Off"] * 3, ["Off"] * 3, [70, 66, 60], last=-3.0) is None


def test_speeds_of_an_event_that_is_not_known_are_no_entry(tmp_path):
    # One table before two crashes without labels.
    layout = Layout(before="none", preamble=False, events="none", decimals=1)
    pulses = (Pulse(forward=-30 * KMH), Pulse())
    for severest, order in ((2, pulses), (1, pulses[::-1])):
        two = text_of(replace(layout, pulses=order, speeds=(70, 50)))
        draft = drafted(tmp_path, before(["Off"] * 3, ["Off"] * 3, [70, 70, 70]) + two)
        toml = tomllib.loads(draft.text)
        assert toml["entry"]["speed_km_per_h"] == "?"
        (triad,) = toml["units"][0]["accelerometers"]
        assert triad["channels"]["x"].endswith(f"(event {severest})")


def test_mph_is_the_unit_of_the_speed(tmp_path):
    draft = drafted(tmp_path, text_of(Layout(units=("mph",), speeds=(60.0 * MPH / KMH,))))
    assert tomllib.loads(draft.text)["entry"]["speed_km_per_h"] == pytest.approx(
        60.0 * MPH / KMH, rel=1e-5
    )
    assert filled(draft, tmp_path).entry.speed_m_per_s == pytest.approx(60.0 * MPH, rel=1e-5)


def test_a_log_of_a_drive_is_no_table_before_a_crash(tmp_path):
    rows = "".join(f"{k / 100},{60 - 0.1 * k:.1f},{k % 7},{k % 5},0.1,9.8\n" for k in range(200))
    path = tmp_path / "drive.csv"
    path.write_text(
        f"Time (s),Speed (km/h),Accelerator Pedal (%),ax (m/s2),ay (m/s2),az (m/s2)\n{rows}"
    )
    assert read_crash_record(path).format == "csv"


def test_axes_in_tables_of_their_own_are_one_recorder(tmp_path):
    change = np.round(Pulse().change(np.arange(26) * 0.01) / KMH, 1)
    text = "\n".join(
        f"Time (msec),Delta-V {axis} (km/h)\n"
        + "".join(f"{10 * k},{change[k, c]}\n" for k in range(26))
        for c, axis in enumerate(("longitudinal", "lateral"))
    )
    _, _, summed = recorded(tmp_path, drafted(tmp_path, text))
    np.testing.assert_allclose(summed[-1] / KMH, [-44.3, 7.4], rtol=1e-12)
    # With other stamps they are not.
    moved = text[: text.rindex("Time")] + "Time (msec),Delta-V lateral (km/h)\n"
    moved += "".join(f"{10 * k + 5},{change[k, 1]}\n" for k in range(26))
    with pytest.raises(DataError, check=coded("crash.axes-in-different-tables")):
        drafted(tmp_path, moved)


@pytest.mark.parametrize(
    ("heading", "sign"),
    [
        ("Delta-V, lateral (km/h)", 1.0),
        ("Delta-V, lateral, left to right (km/h)", 1.0),
        ("Delta-V, lateral, left positive (km/h)", -1.0),
        ("Delta-V, right to left (km/h)", -1.0),
    ],
)
def test_the_sign_of_the_lateral_axis(tmp_path, heading, sign):
    rows = "".join(f"{10 * k},{-3 * min(k, 10)},{min(k, 10)}\n" for k in range(26))
    text = f'Time (msec),"Delta-V, longitudinal (km/h)","{heading}"\n{rows}'
    _, _, summed = recorded(tmp_path, drafted(tmp_path, text))
    np.testing.assert_allclose(summed[-1] / KMH, [-30.0, sign * 10.0], rtol=1e-12)
    (part,) = recorder_parts("edr.csv", read_crash_record(tmp_path / "edr.csv")).parts
    np.testing.assert_array_equal(part.values[-1, :2], [-30.0, sign * 10.0])


@pytest.mark.parametrize("heading", ["Seconds before AE", "Time before crash (sec)"])
def test_seconds_before_the_crash_count_down(tmp_path, heading):
    rows = "".join(f"{5 - k},{60 - k},Off\n" for k in range(6))
    path = tmp_path / "edr.csv"
    crash = text_of(Layout(before="none", preamble=False, events="none"))
    path.write_text(f"{heading},Vehicle Speed (km/h),Brake Switch\n{rows}\n{crash}")
    found = indicated_entry(read_crash_record(path), 1, 1)
    assert (found.speed, found.stamp) == (pytest.approx(55 * KMH), 0.0)


def test_a_speed_after_time_zero_is_not_that_before(tmp_path):
    rows = "".join(f"{k},{60 - 9 * max(k, 0)},Off\n" for k in range(-5, 4))
    path = tmp_path / "edr.csv"
    crash = text_of(Layout(before="none", preamble=False, events="none"))
    path.write_text(f"Time (sec),Vehicle Speed (km/h),Brake Switch\n{rows}\n{crash}")
    assert indicated_entry(read_crash_record(path), 1, 1).speed == pytest.approx(60 * KMH)


@pytest.mark.parametrize(("brake", "regulated"), [("Off", "Off"), ("On", "Off"), ("On", "On")])
def test_the_bound_of_the_entry_speed_holds_the_truth(tmp_path, brake, regulated):
    # Each part anywhere in its bound, as the model has it: 95 % within twice the deviation or more.
    found = entry_of(tmp_path, [brake] * 3, [regulated] * 3, [70, 69, 68])
    rng = np.random.default_rng(4)
    n = 20_000
    speed = 68.0 * KMH * np.ones(n) + rng.uniform(-1.0, 1.0, n) * KMH
    speed *= 1.0 + TIRE * rng.standard_normal(n)
    slip = {"OffOff": 0.0, "OnOff": 0.1, "OnOn": 0.3}[brake + regulated]
    speed *= 1.0 + rng.uniform(0.0, slip, n)
    low, high = (-0.2, 0.5) if brake == "Off" else (-0.9, 0.0)
    speed += rng.uniform(low, high, n) * 9.80665 * rng.uniform(0.0, 0.5, n)
    assert np.mean(np.abs(speed - found.speed) < 1.96 * found.sd) > 0.95
