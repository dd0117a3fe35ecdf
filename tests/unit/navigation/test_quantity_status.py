"""Position and velocity, horizontal and vertical, each by the measurements of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.unit.report.navigation_records import record, without_aids

from strapdown.config.navigation import NavigationSpec
from strapdown.navigation.heading_integrity import STATUSES
from strapdown.navigation.integrity import (
    QUANTITIES,
    QUANTITY_REASONS,
    IntegrityReport,
    quantity_status,
)
from strapdown.report.navigation_evaluation import NavigationEvaluation
from strapdown.report.verdict import STATUS_STYLES, terminal_lines, worst_words
from strapdown.systems.navigation_run import run_navigation


def with_innovations(made, label, since, nu=None, weight=None):
    """The record with other innovations of a component from an instant on."""
    table = made.innovations["rtk.position"].copy()
    late = table.index >= since
    if nu is not None:
        table.loc[late, f"nu {label}"] = nu
    if weight is not None:
        table.loc[late, f"weight {label}"] = weight
    return replace(made, innovations={"rtk.position": table})


def by_name(made):
    found = {one.name: one for one in quantity_status(made)}
    assert list(found) == list(QUANTITIES)
    for one in found.values():
        assert set(one.table["reason"]) <= set(QUANTITY_REASONS)
        assert sum(one.share(status) for status in STATUSES) == pytest.approx(1.0)
    return found


def test_what_is_measured_and_agrees_is_trusted():
    found = by_name(record(outage=None))
    for name in ("horizontal position", "height"):
        assert found[name].at_end == ("trusted", "")
        # Eight epochs at 1 Hz, the fewest for a scatter, come first.
        assert found[name].share("trusted") == pytest.approx(113.0 / 120.0)
        assert found[name].share("rejected") == 0.0
    for name in ("horizontal velocity", "vertical velocity"):
        assert found[name].at_end == ("unverified", "unmeasured")


def test_a_height_whose_fixes_are_rejected_is_rejected_alone():
    """Fixes of a height that is 176 m off, each rejected: the lone receiver is blamed."""
    made = record(outage=None, reject=())
    made = with_innovations(made, "down, m", 60.0, nu=176.0, weight=0.0)
    found = by_name(made)
    status = found["height"].table["status"].map(STATUSES.__getitem__)
    assert (status.loc[8.0:59.0] == "trusted").all()
    # Half of the last half minute.
    assert (status.loc[75.0:] == "rejected").all()
    assert found["height"].at_end == ("rejected", "apart")
    assert found["horizontal position"].share("rejected") == 0.0
    report = IntegrityReport(None, (), 0.0, (), {}, (), None, quantity_status(made))
    assert report.worst.name == "height"
    assert "Height" in worst_words(report)


@pytest.mark.parametrize(
    ("size", "status"), [(1.0, "trusted"), (2.5, "unverified"), (3.5, "rejected")]
)
def test_accepted_measurements_that_scatter_count_too(size, status):
    # The predicted variance is 4 m².
    made = with_innovations(record(outage=None, reject=()), "down, m", 60.0, nu=2.0 * size)
    assert by_name(made)["height"].at_end[0] == status


def test_single_outliers_reject_nothing():
    found = by_name(record(outage=None, reject=range(10, 110, 10)))
    for one in found.values():
        assert one.share("rejected") == 0.0
    assert found["height"].at_end[0] == "trusted"


def test_a_minute_after_the_last_measurement_nothing_confirms_it():
    table = by_name(record(seconds=240.0, outage=(50.0, 200.0)))["height"].table
    assert (table["reason"].loc[111.0:199.0] == "unmeasured").all()
    assert (table["reason"].loc[60.0:110.0] == "").all()
    assert (table["reason"].loc[201.0:] == "").all()


def test_what_is_not_estimated_is_never_trusted_but_can_be_refuted():
    made = record(outage=None, reject=())
    sd = made.sd.copy()
    sd["down"] = np.nan
    without = replace(made, sd=sd)
    height = by_name(without)["height"]
    assert height.share("trusted") == 0.0
    assert height.at_end == ("unverified", "not_estimated")
    off = with_innovations(without, "down, m", 60.0, nu=176.0, weight=0.0)
    assert by_name(off)["height"].at_end == ("rejected", "apart")


def test_without_measurements_nothing_is_trusted_or_rejected():
    for one in by_name(without_aids(record())).values():
        assert one.share("unverified") == 1.0
    report = IntegrityReport(None, (), 0.0, (), {}, (), None, quantity_status(record()))
    assert report.worst is None
    assert not worst_words(report)


def test_a_start_at_a_wrong_height_is_seen_where_the_heading_is_sound():
    """176 m off and stated to 0.1 m: a robust rule rejects every position of the receiver."""
    place = {"lat_deg": 55.75, "lon_deg": 37.62, "heading_deg": 30.0}
    rule = {"kind": "adaptive", "influence": "igg3", "scale": {"lowest": 1.0}}
    run = run_navigation(
        NavigationSpec.checked(
            {
                "simulation": {
                    "rate_hz": 50.0,
                    "seed": 3,
                    "motion": {
                        "kind": "car",
                        **place,
                        "alt_m": 150.0,
                        "manoeuvres": [
                            {"do": "straight", "duration_s": 10.0},
                            {"do": "accelerate", "to_km_per_h": 50.0, "duration_s": 10.0},
                            {"do": "turn_left", "angle_deg": 90.0, "radius_m": 60.0},
                            {"do": "straight", "duration_s": 20.0},
                        ],
                    },
                    "gnss": {"rtk": {"position_noise_m": 1.0, "velocity_noise_m_per_s": 0.03}},
                },
                "sensors": {"sensor": "fog-1000"},
                "start": {
                    **place,
                    "alt_m": 326.0,
                    "roll_deg": 0.0,
                    "pitch_deg": 0.0,
                    "position_sd_m": 0.1,
                    "tilt_sd_deg": 0.1,
                    "heading_sd_deg": 0.5,
                },
                "aiding": {"rtk": {"kind": "gnss", "update_rule": rule}},
                "trust": {"repeat": False},
            }
        )
    )
    assert run.trust.heading.spans[-1].status == "trusted"
    assert run.trust.worst.name == "height"
    assert run.trust.worst.at_end == ("rejected", "apart")
    assert run.trust.worst.share("trusted") == 0.0
    others = {one.name: one.at_end[0] for one in run.trust.quantities if one.name != "height"}
    assert set(others.values()) == {"trusted"}
    (first, style), *_ = terminal_lines(NavigationEvaluation(run), brief=True)
    assert first == worst_words(run.trust)
    assert style == STATUS_STYLES["rejected"]
