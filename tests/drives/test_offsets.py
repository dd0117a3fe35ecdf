"""Time offsets and lost headings of made-up drives are found wherever the search begins."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from tests.drives.generator import draw, make
from tests.drives.judge import propose

import strapdown as sd
from strapdown.systems.navigation_run import _swings

#: A walk with positions of centimeters once a second, whose steps are alike every half second.
WALK = 31026
#: A boat with a phone whose gyros are off by 1 deg/s and more, and which shows its heading late.
BOAT = 31088
#: A walk with velocities that are late by 0.1 s, less than the search about one start takes up.
SWINGING = 62035
#: Of its log, and how well its offset is known at the end, s.
STEP, KNOWN = 0.01, 0.03


@pytest.mark.slow
@pytest.mark.parametrize("late", [-0.381, 0.15])
def test_an_offset_is_found_from_wherever_the_search_begins(late, tmp_path):
    made = make(draw(WALK) | {"duration_s": 100.0, "late_s": late}, tmp_path)
    config, _, _ = propose(made)
    text = config.read_text() + "\n[trust]\nrepeat = false\n"
    found = []
    for start in (-0.2, 0.0, 0.1):
        config.write_text(text.replace("# time_offset_s = 0.0", f"time_offset_s = {start}"))
        run = sd.navigate(config)
        offsets = [f for f in run.findings if f.code == "navigation.run-again-with-offset"]
        assumed = offsets[-1].data["offset"] if offsets else start
        found.append(assumed - run.filtered.sensors["gnss.time_offset_t"].iloc[-1])
    assert found == pytest.approx([late] * 3, abs=KNOWN + STEP)


@pytest.mark.slow
def test_a_heading_that_was_lost_is_found_or_called_ambiguous(tmp_path):
    """To a single run it is off by up to half a circle, with a bound of 20 degrees."""
    for duration, told in ((60.0, None), (90.0, "ambiguous"), (266.4, "found")):
        made = make(draw(BOAT) | {"duration_s": duration}, tmp_path)
        config, _, _ = propose(made)
        config.write_text(config.read_text() + "\n[trust]\nrepeat = false\n")
        run = sd.navigate(config)
        codes = {f.code for f in run.findings}
        assert ("navigation.run-again-with-drift" in codes) == (told == "found")
        assert ("navigation.heading-ambiguous" in codes) == (told == "ambiguous")
        time = run.sd.index.to_numpy()
        heading = np.interp(
            time, run.trajectory.index, np.unwrap(run.trajectory["heading"], period=360.0)
        )
        truth = made.motion.state(made.time(time + made.stamps[0]))["heading"]
        off = np.abs((heading - truth + 180.0) % 360.0 - 180.0)
        assert (off < 3.0 * run.sd["heading"]).all()


@pytest.mark.slow
def test_steps_show_by_how_much_velocities_are_late(tmp_path):
    """Else a pitch that is wrong by 5 degrees explains them, with a bound of one."""
    made = make(draw(SWINGING), tmp_path)
    config, _, _ = propose(made)
    config.write_text(config.read_text() + "\n[trust]\nrepeat = false\n")
    run = sd.navigate(config)
    time = run.sd.index.to_numpy()
    truth = made.motion.state(made.time(time + made.stamps[0]))
    for name in ("roll", "pitch"):
        angle = np.interp(time, run.trajectory.index, run.trajectory[name])
        assert (np.abs(angle - truth[name]) < 3.0 * run.sd[name]).all()


@pytest.mark.parametrize(
    ("rate", "period", "size", "swings"),
    [
        (10.0, 0.5, 2.0, True),
        (10.0, 0.5, 0.5, False),
        (10.0, 5.0, 2.0, False),
        (4.0, 0.5, 2.0, False),
    ],
)
def test_a_body_swings_by_accelerations_within_a_second(rate, period, size, swings):
    time = np.arange(0.0, 60.0, 1.0 / rate)
    speed = size * period / (2 * np.pi) * np.sin(2 * np.pi / period * time + 0.3) * math.sqrt(2.0)
    columns = {"VN": 0.2 * time, "VE": np.zeros_like(time), "VD": speed}
    record = SimpleNamespace(trajectory=pd.DataFrame(columns, index=time))
    assert _swings(record) == swings
