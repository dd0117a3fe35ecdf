"""The gate of `make bench`: its verdicts, its exit code and the table that it writes."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

import benchmarks.__main__ as bench
import pytest
from benchmarks.measure import Row, by_turns, command

REACHED = Row("sum", (1.0, 1.1, 9.0), "C", (1.0, 1.0, 1.0), "ns", 1.2)
OPEN = Row("sine", (3.0, 3.1, 9.0), "C", (1.0, 1.0, 1.0), "ns", 2.0, 3.5)
OVER = Row("cosine", (5.0, 3.4, 9.0), "C", (1.0, 1.0, 1.0), "ns", 2.0, 3.5)
MISSING = Row("tangent", against="vqf", goal=1.0, missing="vqf is not installed")


@pytest.mark.parametrize(
    "name", sorted(p.stem for p in Path(bench.__file__).parent.glob("[a-z]*.py"))
)
def test_module_fits_the_library(name: str) -> None:
    importlib.import_module(f"benchmarks.{name}")


def test_verdicts() -> None:
    assert [row.verdict for row in (REACHED, OPEN, OVER, MISSING)] == [
        "reached",
        "not yet",
        "OVER",
        "",
    ]
    # Ratios 3.4, 5 and 9: half way from the least to the middle one is 4.2, beyond the limit.
    assert OVER.ratios == pytest.approx((4.2, 5.0, 7.0))


def test_a_side_that_is_missing_is_said() -> None:
    assert "not measured: vqf is not installed" in MISSING.cells()


def measured(monkeypatch: pytest.MonkeyPatch, page: Path, *words: str) -> int:
    def good() -> Iterator[Row]:
        yield from (REACHED, OPEN, MISSING)

    def bad() -> Iterator[Row]:
        yield OVER

    monkeypatch.setattr(bench, "GROUPS", {"good": good, "bad": bad})
    monkeypatch.setattr(bench, "PAGE", page)
    monkeypatch.setattr(sys, "argv", ["benchmarks", *words])
    return bench.main()


def test_exit_code_names_the_row(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "performance.md"
    page.write_text(f"before\n{bench.BEGIN}\nold\n{bench.END}\nafter\n")
    assert measured(monkeypatch, page, "--only", "good") == 0
    assert "old" in page.read_text()
    assert measured(monkeypatch, page) == 1
    assert "OVER its limit: cosine, against C: 5.00" in capsys.readouterr().out
    text = page.read_text()
    assert text.startswith(f"before\n{bench.BEGIN}\nMachine: ")
    assert text.endswith(f"{bench.END}\nafter\n")
    assert "| sine | 3.1 ns | C | 1 ns | 3.10 (3.05–6.05) | 2 | 3.5 | not yet |" in text
    assert "old" not in text


def test_rounds_are_by_turns() -> None:
    order: list[str] = []
    sides = by_turns(lambda: order.append("ours"), lambda: order.append("theirs"), rounds=2)
    assert order == ["ours", "theirs"] * 3
    assert [len(side) for side in sides] == [2, 2]


def test_memory_of_a_command_is_its_own() -> None:
    """A large parent is not counted: here one of 300 MiB, whose child needs less than 100."""
    block = bytearray(300 * 2**20)
    used = command([sys.executable, "-c", "pass"])
    assert len(block) > 2**20 * used.peak
    with pytest.raises(RuntimeError, match="NameError"):
        command([sys.executable, "-c", "unknown"])
