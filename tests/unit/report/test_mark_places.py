"""Names of marks above a chart lie neither on each other nor beyond the axes."""

from __future__ import annotations

import pytest

from strapdown.report.chart_svg import label_rows, label_side

LETTER = 0.01


def test_names_that_have_room_stand_in_one_row():
    assert label_rows([0.2, 0.6], ["time zero", "event end"], LETTER) == (0, 0)


def test_a_name_that_would_lie_on_another_stands_above_it():
    # Nine letters are 0.09 wide: two centred names touch below 0.09 and a gap of 1.5 letters.
    assert label_rows([0.50, 0.58], ["time zero", "event end"], LETTER) == (0, 1)
    assert label_rows([0.50, 0.61], ["time zero", "event end"], LETTER) == (0, 0)


def test_a_third_name_goes_down_again_as_soon_as_it_can():
    assert label_rows([0.50, 0.58, 0.70], ["time zero", "event end", "end"], LETTER) == (0, 1, 0)


def test_marks_may_come_in_any_order():
    assert label_rows([0.58, 0.50], ["event end", "time zero"], LETTER) == (1, 0)


@pytest.mark.parametrize(("share", "side"), [(0.01, "left"), (0.5, "center"), (0.99, "right")])
def test_a_name_does_not_leave_the_axes(share, side):
    assert label_side(share, "time zero", LETTER) == side
