"""Tables and messages of the terminal: nothing is cut, whatever its width."""

from __future__ import annotations

import pytest

from strapdown.cli import console
from strapdown.errors import Finding

COLUMNS = ("recorder", "event", "from, to, s", "forward, km/h", "largest in 30 ms, km/h")
ROWS = [
    ("left rear floorpan", "1, front", "−0.0011 to 0.1277", "−50.7 ± 2.2", "23.8 ± 6.4"),
    ("mean of the recorders", "1, front", "−0.0047 to 0.1475", "at least 50.69 ± 0.87", ""),
]
# Rows one below the other, a table with texts that are wrapped, a table.
WIDTHS = (40, 64, 80, 160)


@pytest.mark.parametrize("width", WIDTHS)
def test_no_number_of_a_table_is_cut_at_any_width(width, capsys, monkeypatch):
    monkeypatch.setattr(console, "PIPE_WIDTH", width)
    console.print_table(COLUMNS, ROWS, text=(0, 1, 2))
    out = capsys.readouterr().out
    for row in ROWS:
        for cell in row[3:]:
            assert cell in out
        for word in " ".join(row[:3]).split():
            assert word in out
    assert "…" not in out


def test_a_narrow_terminal_has_a_line_for_each_cell(capsys, monkeypatch):
    monkeypatch.setattr(console, "PIPE_WIDTH", 40)
    console.print_table(COLUMNS, ROWS, text=(0, 1, 2))
    lines = [line.strip() for line in capsys.readouterr().out.splitlines() if line.strip()]
    # An empty cell has none.
    assert len(lines) == len(COLUMNS) + len(COLUMNS) - 1
    assert next(x for x in lines if x.startswith("forward")).endswith("−50.7 ± 2.2")


def test_what_is_said_of_several_recorders_alike_is_one_message(capsys):
    def low_pass(file, end, row=None):
        return Finding(
            "sensors.low-pass-at-ends", file=file, row=row, quantity="time", begin=-0.045, end=end,
            noise_factor=8.4,
        )  # fmt: skip

    told = [low_pass("left", 0.245), low_pass("right", 0.245), low_pass("top", 0.2)]
    console.print_findings(told)
    err = capsys.readouterr().err.splitlines()
    heads = [line for line in err if line.startswith("warning: ")]
    assert len(heads) == 2
    assert "left; right" in heads[0] and "top" in heads[1]
    # A row belongs to one file.
    console.print_findings([low_pass("a.csv", 0.2, 3), low_pass("b.csv", 0.2, 3)])
    assert sum(x.startswith("warning: ") for x in capsys.readouterr().err.splitlines()) == 2
