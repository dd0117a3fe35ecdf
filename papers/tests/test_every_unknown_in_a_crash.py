"""The errors that were drawn, times the effects that the bound has for each, are the errors made.

Far sharper than any coverage: sign and size of every unknown through the whole chain. What is left
is noise, what is known of biases after a rest, the samples' rate, and products of two errors.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from papers.crash_trials.cases import TrialPriors, draw_case
from papers.crash_trials.outcomes import END, reconstruct_case
from strapdown import rotation
from strapdown.simulation import ExactAnswers
from strapdown.tables import NED

AXES = "xyz"
# Nothing but the sensors, their mounting and their trigger.
SENSORS = {"speed_sd": 0.0, "slip_sd_deg": 0.0, "heading_sd_deg": 0.0}


def quiet_design():
    """IMU1 without noise: then nothing is left but rate, filters and products."""
    design = TrialPriors().design

    def still(triad):
        u = triad.uncertainty
        low = tuple(1e-3 * x for x in u.axis("noise_density"))
        return replace(triad, uncertainty=replace(u, noise_density=low, quantization=0.0))

    return replace(
        design,
        accelerometers=tuple(still(t) for t in design.accelerometers),
        gyro=still(design.gyro),
    )


def drawn(case):
    """Standard normal numbers by the name of the unknown; of the computed less the true."""
    unit, truth = case.unit, case.recorder
    out = {}

    def triad(prefix, errors, told):
        for i, a in enumerate(AXES):
            bias = errors.axis("bias")[i] + errors.axis("warm_up")[i]
            out[f"{prefix} bias {a}"] = bias / told.axis("bias")[i]
            out[f"{prefix} scale {a}"] = errors.axis("scale")[i] / told.axis("scale")[i]
            bend = errors.axis("nonlinearity_2")[i] / told.axis("nonlinearity_2")[i]
            out[f"{prefix} nonlinearity {a}"] = bend
            for j, b in enumerate(AXES):
                if i != j:
                    skew = np.asarray(errors.misalignment)[i, j] / told.axis("misalignment")[i]
                    out[f"{prefix} misalignment {b}→{a}"] = skew

    for recorded, errors in zip(unit.accelerometers, truth.accelerometers, strict=True):
        triad(f"{unit.name} {recorded.name}", errors, recorded.uncertainty)
    triad(f"{unit.name} gyro", truth.gyro, unit.gyro.uncertainty)
    pull = np.asarray(truth.gyro.g_sensitivity) / unit.gyro.uncertainty.axis("g_sensitivity")[0]
    for i, a in enumerate(AXES):
        for j, b in enumerate(AXES):
            out[f"{unit.name} g-sensitivity {a} of {b}"] = pull[i, j]
    # The other way round: these are where the truth is, seen from what was told.
    told, real = unit.mounting, truth.mounting
    turn = rotation.rotation_vector_from_dcm(real.C_vs @ told.C_vs.T)
    for name, angle in zip(("roll", "pitch", "heading"), np.degrees(turn), strict=True):
        out[f"{unit.name} mounting {name}"] = -angle / told.angles_sd_deg
    for i, a in enumerate(AXES):
        off = real.position[i] - told.position[i]
        out[f"{unit.name} lever arm {a}"] = -off / told.position_sd
    out[f"{unit.name} timing"] = truth.trigger_error / unit.trigger_sd
    # What was found at rest is known but for noise: not these.
    for a in AXES:
        out.pop(f"{unit.name} gyro bias {a}")
    return out


@pytest.fixture(scope="module")
def made_and_predicted():
    priors = TrialPriors(design=quiet_design(), **SENSORS)
    rows = []
    for number in range(12):
        case = draw_case(number, 8, priors)
        found = reconstruct_case(case)
        truth = ExactAnswers(case.scenario.motion, case.scenario.start)
        d, effects, path = drawn(case), found.at_point.effects, found.path
        known = set(d) & set(effects.names)
        assert len(known) > 50
        d = np.array([d.get(name, 0.0) for name in path.names])
        k = found.events.events.index(found.events.strongest)
        dv = found.body[k].event.delta_v
        each = np.einsum("n,pni->pi", dv.weights, effects.force)
        each = each - dv.weights.sum() * effects.rest_force
        row = int(np.argmin(np.abs(path.time - END)))
        place = path.table[NED].to_numpy()[row] - truth.course([END])[0][0]
        rows.append(
            (
                dv.vector - truth.along_body(dv.start, dv.end),
                d[: len(each)] @ each,
                place,
                d @ path.errors[:, row, 6:],
            )
        )
    return [np.array(column) for column in zip(*rows, strict=True)]


def rms(values):
    return float(np.sqrt((values**2).mean()))


def test_changes_of_velocity(made_and_predicted):
    made, predicted, _, _ = made_and_predicted
    # 0.2 m/s, predicted to a twentieth: products of two errors (3 % of 3 %), and the samples.
    assert rms(made) > 0.15
    assert rms(made - predicted) < 0.06 * rms(made)


def test_places(made_and_predicted):
    _, _, made, predicted = made_and_predicted
    assert rms(made) > 0.1
    assert rms(made - predicted) < 0.06 * rms(made)
