"""Time offsets of made-up drives are found wherever the search begins."""

from __future__ import annotations

import pytest
from tests.drives.generator import draw, make
from tests.drives.judge import propose

import strapdown as sd

#: A walk with positions of centimeters once a second, whose steps are alike every half second.
WALK = 31026
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
