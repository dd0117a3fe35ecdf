"""``strapdown demo``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from strapdown.cli.shared_options import WriteFlags, folder_to_make, spread

if TYPE_CHECKING:
    from strapdown.progress import Progress

EPILOG = "Example: strapdown demo --out demo"
_PAGE = "index.html"


@spread
def demo(
    *,
    out: Annotated[Path, folder_to_make("demo")] = Path("demo"),
    write: WriteFlags,
) -> None:
    """Run all systems and show the results on one page: attitude, crash, navigation.

    Runs on built-in data; recordings are added if they are in the folder named by STRAPDOWN_DATA,
    by default ../shared/data.
    """
    from strapdown.cli.console import console, progress
    from strapdown.cli.demo_runs import demo_runs
    from strapdown.report.demo_page import demo_page, shown_answer, shown_truth

    data = Path(os.environ.get("STRAPDOWN_DATA", "../shared/data"))
    runs = demo_runs(out, data)
    there = [run for run in runs if run.needs is None or (data / run.needs).is_dir()]
    absent = [run for run in runs if run not in there]
    missing = (
        "All of this is simulated. Three public recordings stand here, too, where STRAPDOWN_DATA "
        f"names the folder that has them ({', '.join(str(run.needs) for run in absent)}); "
        "docs/start.md says what they are."
        if absent
        else None
    )
    _check(out, [name for run in there for name in run.folders], write.force)
    # It describes the previous results.
    (out / _PAGE).unlink(missing_ok=True)
    page = console()
    whole = sum(run.takes for run in there)
    done = 0.0
    for run in there:
        shown = run.shown
        with progress(write.quiet) as show:
            run.make(out, write.force, _part_of(show, shown.title, done / whole, run.takes / whole))
        done += run.takes
        if write.quiet:
            continue
        page.print(f"{shown.part}  {shown.title}", style="bold")
        page.print(f"   {shown_answer(out / shown.slug)}")
        truth = shown_truth(
            out / shown.slug, None if shown.records is None else out / shown.records
        )
        if truth:
            page.print(f"   {truth}", style="green")
    _write_whole(out / _PAGE, demo_page([run.shown for run in there], out, missing))
    if write.quiet:
        return
    if missing:
        console(err=True).print(f"note: {missing}")
    page.print(f"\nOpen  {out / _PAGE}")


def _part_of(show: Progress, title: str, begin: float, share: float) -> Progress:
    """Progress of one run as a part of the whole."""
    return lambda stage, done: show(f"{title}: {stage}", begin + share * done)


def _check(out: Path, names: list[str], force: bool) -> None:
    """Refuse before the first run what a later one would refuse."""
    from strapdown.bundle.seal import check_destination
    from strapdown.errors import ConfigError

    for name in (*names, _PAGE):
        if "." not in name:
            check_destination(out / name, force)
        elif (out / name).exists() and not force:
            raise ConfigError("cli.folder-exists", file=str(out / name), quantity="--out")


def _write_whole(path: Path, text: str) -> None:
    """Write a file atomically."""
    partial = path.with_name(f".{path.name}.partial")
    try:
        partial.write_text(text, encoding="utf-8", newline="\n")
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
