"""More ignorance narrows no bound: each stated standard deviation grows, and what is published."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from tests.unit.crash.folding_crash import Crash, Fault, prepared

from strapdown import reconstruct, reconstruct_crash
from strapdown.crash import combine_units
from strapdown.crash.case_indices import vehicle_indices
from strapdown.crash.consistency import compare_units
from strapdown.crash.deformation import dynamic_crush
from strapdown.crash.measuring_point import TURNED_AXIS
from strapdown.crash.reconstruction import summary_table
from strapdown.crash.template import draft_case, read_records

#: Seed, kind, whether the points have gyros, and the axis that they lack.
CASES = {
    "front": (900, "front", False, ""),
    "offset": (901, "offset", False, ""),
    "oblique": (902, "oblique", True, ""),
    "no axis": (904, "front", False, "y"),
}
OF_MOUNTING = {"position": "position_sd", "angles": "angles_sd_deg"}
OF_SENSOR = {"scale": "scale", "bias": "bias", "noise": "noise_density"}
OF_VEHICLE = {"turn": "turn_sd_deg", "axis": "delta_v_sd"}
#: Indices are differences over finite steps, and the onset is between samples.
NUMERICAL = 1e-3


def stated(unit, what, factor):
    """The unit with one of its standard deviations larger by a factor."""
    if what == "clock":
        return replace(unit, trigger_sd=factor * unit.trigger_sd)
    if what in OF_MOUNTING:
        name = OF_MOUNTING[what]
        larger = factor * getattr(unit.mounting, name)
        return replace(unit, mounting=replace(unit.mounting, **{name: larger}))
    if what in OF_VEHICLE:
        name = OF_VEHICLE[what]
        larger = tuple(factor * x for x in getattr(unit.assumed, name))
        return replace(unit, assumed=replace(unit.assumed, **{name: larger}))
    (triad,) = unit.accelerometers
    name = OF_SENSOR[what]
    sd = replace(triad.uncertainty, **{name: factor * triad.uncertainty.axis(name)[0]})
    return replace(unit, accelerometers=(replace(triad, uncertainty=sd),))


def widths(crash, units):
    """Widths of all bounds of every answer, by name."""
    found = reconstruct_crash(units, *crash.stated(units))
    out = {}
    for (unit, part, figure), row in summary_table(found.answers).iterrows():
        # The type of a crash is no bound.
        out[unit, part.split()[0], figure] = row["high"] - row["low"]
    for answer in found.answers:
        for one in vehicle_indices(answer, 0):
            if one.high is not None:
                out[answer.name, one.name, one.detail] = one.high - one.low
        crush = dynamic_crush(answer.name, answer.path, answer.events.events[0])
        if crush is not None:
            out[answer.name, "crush", ""] = 2.0 * crush.depth.half_width
    turned = found.comparison.turned
    if turned is not None:
        out["turned", "rate", ""] = turned.rate_sd[-1, 2]
        out["turned", "angle", ""] = turned.angle_sd[-1, 2]
    return out


@cache
def case(name):
    """A crash whose car comes to a stop, its points, and the widths of their bounds."""
    seed, kind, gyro, missing = CASES[name]
    crash = Crash(seed, kind)
    crash.speed = crash.size / 1.15
    units = [crash.unit(k, gyro=gyro, fault=Fault(missing=missing)) for k in range(2)]
    units = [replace(u, trigger_sd=1e-3) for u in units]
    return crash, units, widths(crash, units)


def steps(name):
    """The standard deviations that a case states."""
    _, _, gyro, missing = CASES[name]
    return [
        "clock",
        *OF_MOUNTING,
        *OF_SENSOR,
        *([] if gyro else ["turn"]),
        *(["axis"] if missing else []),
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "what"), [(n, w) for n in CASES for w in steps(n)])
def test_a_larger_standard_deviation_of_one_recorder_narrows_no_bound(name, what, monkeypatch):
    # With its weights as they were: a recorder that is stated worse counts for less in the mean,
    # and the bound of another mean is another bound.
    monkeypatch.setattr(
        combine_units, "force_weights", lambda units: np.full((2, 3, 3), 0.5) * np.eye(3)
    )
    crash, units, before = case(name)
    after = widths(crash, [stated(units[0], what, 1.7), units[1]])
    common = [key for key in before if key in after]
    # Agreement does not end, so that the mean is among them.
    assert len({key[0] for key in common} - {"turned"}) == 3
    for key in common:
        assert after[key] >= before[key] * (1.0 - NUMERICAL), (key, before[key], after[key])
    # An assumed turning has no rate by which a position matters.
    wider = any(after[key] > before[key] * (1.0 + 1e-6) for key in common)
    assert wider == (what != "position" or CASES[name][2])


@pytest.mark.parametrize("what", ["turn", "scale", "angles", "clock"])
def test_the_structure_of_bounds_is_learnt_without_any_stated_uncertainty(what):
    crash = Crash(901, "offset")
    units = [crash.unit(k, gyro=False) for k in range(2)]
    seen = [
        compare_units(prepared(those, crash.stated(those)[1])).structure
        for those in (units, [stated(units[0], what, 1.7), units[1]])
    ]
    assert seen[0].expected[0] > 0.0
    assert seen[1].squares == pytest.approx(seen[0].squares, rel=1e-9)


def test_what_recorders_assume_of_the_vehicle_is_the_largest_of_it():
    crash = Crash(900, "front")
    units = [crash.unit(k, gyro=False) for k in range(2)]
    there = prepared([stated(units[0], "turn", 3.0), units[1]], crash.stated(units)[1])
    first, second = (u.prepared.unit.assumed.turn_sd_deg for u in there)
    assert second == first == tuple(3.0 * x for x in units[0].assumed.turn_sd_deg)
    said = [f.code for f in there[1].prepared.findings]
    assert "crash.assumed-more-elsewhere" in said
    assert "crash.assumed-more-elsewhere" not in [f.code for f in there[0].prepared.findings]


def test_a_turn_widens_a_missing_axis_by_what_the_measured_ones_leak():
    """Against drawn turns of a car whose velocity over ground does not change aside."""
    crash = Crash(904, "front")
    unit = crash.unit(0, gyro=False, fault=Fault(missing="y"))
    unit = replace(unit, assumed=replace(unit.assumed, turn_sd_deg=(0.0, 0.0, 8.0)))
    (there,) = prepared([unit], crash.stated([unit])[1])
    time = there.time
    step = np.gradient(time)
    names, of = there.effects.names, np.array(there.effects.contributors)
    leaks = there.effects.force[of == TURNED_AXIS]
    assert len(leaks) == 2
    assert np.abs(leaks[:, :, [0, 2]]).max() == 0.0
    aside = leaks[:, :, 1] @ step
    force, _ = crash.motion(time)
    rng = np.random.default_rng(3)
    turns = [k for k, name in enumerate(names) if name.startswith("vehicle assumed heading")]
    rates = there.effects.rate[turns][:, :, 2]
    drawn = []
    for _ in range(4000):
        yaw = np.cumsum(rng.normal(size=len(rates)) @ rates * step)
        # Over ground aside: sin(yaw) fx + cos(yaw) fy = 0.
        drawn.append(np.sum(-np.tan(yaw) * force[:, 0] * step))
    assert np.linalg.norm(aside) == pytest.approx(np.std(drawn), rel=0.05)


def test_a_larger_turn_of_one_recorder_of_a_real_car_narrows_nothing(recordings, tmp_path):
    header = recordings("crash_nhtsa_10146") / "v10146.EV5"
    text = draft_case(read_records([header]), folder=tmp_path).text
    found = []
    for turn in (2.0, 15.0):
        lines, side, first = [], "-", True
        for line in text.splitlines():
            side = "" if 'name = "RIGHT' in line else side
            line = line.replace('["?", "?", "?"]', f"[-1.3, {side}0.6, 0.1]")
            if 'turn_sd_deg = "?"' in line:
                line = f"turn_sd_deg = {turn if first else 2.0}"
                first = False
            line = line.replace('delta_v_sd_m_per_s = "?"', "delta_v_sd_m_per_s = 1.0")
            lines.append(line.replace('because = "?"', 'because = "centric impact"'))
        case = tmp_path / "case.toml"
        case.write_text("\n".join(lines), encoding="utf-8")
        answers = reconstruct(case).reconstruction.answers
        rows = [
            [
                *answer.body[0].event.bound.half_width,
                answer.body[0].event.resultant_bound,
                answer.body[0].peak.resultant_bound,
                dynamic_crush(answer.name, answer.path, answer.events.events[0]).depth.half_width,
            ]
            for answer in answers
        ]
        found.append(np.array(rows))
    assert found[0].shape == (3, 6)
    assert (found[1] >= found[0]).all()
    # Aside, where nothing is measured, by the leak of 15 deg.
    assert (found[1][:, 1] > 1.2 * found[0][:, 1]).all()
