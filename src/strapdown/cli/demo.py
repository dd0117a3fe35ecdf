"""``strapdown demo``."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from strapdown.cli.console import console
from strapdown.cli.result_folder import claim
from strapdown.cli.shared_options import WriteFlags, folder_to_make, spread
from strapdown.errors import ConfigError

if TYPE_CHECKING:
    from strapdown.progress import Progress
    from strapdown.report.demo_page import Shown

EPILOG = "Example: strapdown demo --out demo"
_PAGE = "index.html"
_TURNS = "mpu6050_turns"
_TURN = "rotate-360ccw-around-z-pointing-up"
_OUTAGE = 30.0  # s
_RECORDING = "phone-recording"


@spread
def demo(
    *,
    out: Path = folder_to_make("demo", default=Path("demo")),
    write: WriteFlags,
) -> None:
    """Run all systems and show the results on one page: navigation, attitude, crash.

    Runs on one minute of a real drive and on simulations; further recordings are added if they are
    in the folder named by STRAPDOWN_DATA, by default ../shared/data.
    """
    from strapdown.bundle.atomic_folder import replace_file
    from strapdown.report.demo_page import demo_page, shown_answer, shown_truth

    data = Path(os.environ.get("STRAPDOWN_DATA", "../shared/data"))
    runs = demo_runs(out, data)
    there = [run for run in runs if run.needs is None or (data / run.needs).is_dir()]
    absent = [run for run in runs if run not in there]
    missing = (
        "Further public recordings are shown if STRAPDOWN_DATA names the folder that holds them: "
        f"{', '.join(str(run.needs) for run in absent)}. See docs/start.md."
        if absent
        else None
    )
    _check(out, [name for run in there for name in run.folders], write.force)
    # It describes the previous results.
    (out / _PAGE).unlink(missing_ok=True)
    page = console()
    for run in made(there, out, force=write.force, quiet=write.quiet):
        shown = run.shown
        if write.quiet:
            continue
        page.print(f"{shown.part}  {shown.title}", style="bold")
        page.print(f"   {shown_answer(out / shown.slug)}")
        truth = shown_truth(
            out / shown.slug, None if shown.records is None else out / shown.records
        )
        if truth:
            page.print(f"   {truth}", style="green")
    text = demo_page([run.shown for run in there], out, missing)
    replace_file(out / _PAGE, text.encode())
    if write.quiet:
        return
    if missing:
        console(err=True).print(f"note: {missing}")
    page.print(f"\nOpen  {out / _PAGE}")


def made(runs: Sequence[DemoRun], out: Path, *, force: bool, quiet: bool) -> Iterator[DemoRun]:
    """Make runs into a folder, with progress over all of them; yield each when it is there."""
    from strapdown.cli.console import progress

    whole, done = sum(run.takes for run in runs), 0.0
    for run in runs:
        with progress(quiet) as show:
            part = _part_of(show, run.shown.title, done / whole, run.takes / whole)
            run.make(out, force, part)
        done += run.takes
        yield run


def _part_of(show: Progress, title: str, begin: float, share: float) -> Progress:
    """Progress of one run as a part of the whole."""
    return lambda stage, done: show(f"{title}: {stage}", begin + share * done)


def _check(out: Path, names: list[str], force: bool) -> None:
    """Refuse before the first run what a later one would refuse."""
    for name in (*names, _PAGE):
        if "." not in name:
            claim(out / name, force)
        elif (out / name).exists() and not force:
            raise ConfigError("cli.folder-exists", file=str(out / name), quantity="--out")


@dataclass(frozen=True)
class DemoRun:
    """One run of the demonstration.

    Attributes
    ----------
    shown : Shown
    make : callable
        Called with the folder of the demonstration, whether to replace results, and progress.
    takes : float
        Approximate duration, relative to the others.
    folders : tuple of str
        Folders that it writes.
    needs : str, optional
        Folder of recordings.
    """

    shown: Shown
    make: Callable[[Path, bool, Progress], object]
    takes: float
    folders: tuple[str, ...]
    needs: str | None = None


def demo_runs(out: Path, data: Path) -> list[DemoRun]:
    """Return every run of the demonstration, in the order of its page.

    `out`: folder of the demonstration, as named in commands. `data`: folder of the recordings.
    """
    from strapdown.report.demo_page import Shown

    turns = data / _TURNS

    def scenario(folder: Path, force: bool, progress: Progress) -> None:
        _attitude(["alexiev-fig6"], folder / "hand", force, progress, rate_hz=200.0)

    def turn(folder: Path, force: bool, progress: Progress) -> None:
        _attitude(
            [str(turns / _TURN)],
            folder / "turn",
            force,
            progress,
            reference=["end 2 turns about up since start"],
            gyro_bias=str(turns / "unmoved-10min"),
        )

    def pole(folder: Path, force: bool, progress: Progress) -> None:
        from strapdown.api.crash import reconstruct
        from strapdown.api.simulation import simulate

        progress("simulating the records", 0.0)
        simulate("pole").save(folder / "pole-records", force=force)
        case = folder / "pole-records" / "case.toml"
        made = reconstruct(case, progress=progress)
        made.save(folder / "pole", force=force, progress=progress)

    def outages(folder: Path, force: bool, progress: Progress) -> None:
        from strapdown.api.alignment import outage

        made = outage(folder / "tunnel", _OUTAGE, progress=progress)
        made.save(folder / "cone", force=force, progress=progress)

    return [
        DemoRun(
            Shown(
                "A",
                "phone",
                "A real drive, one minute, by a phone",
                "A public recording (comma2k19, MIT license), part of the package: a phone, and a "
                "receiver that states no standard deviations; 5 m and 0.3 m/s are assumed. Errors "
                "of such fixes are correlated over minutes, which the filter does not model: its "
                "bound of the height is too small, as the comparison shows.",
                f"strapdown navigate {out / 'phone.toml'} \\\n  --out {out / 'phone'}",
                ("plan", "heading-integrity"),
            ),
            _navigation("phone", data),
            5.0,
            ("phone.toml", "phone"),
        ),
        DemoRun(
            Shown(
                "A",
                "tunnel",
                "A drive with half a minute in a tunnel",
                "A simulation: fixes with outliers, none in the tunnel; smoothed. Below the path: "
                "heading integrity.",
                f"strapdown navigate {out / 'tunnel.toml'} \\\n  --out {out / 'tunnel'}",
                ("plan", "heading-integrity"),
            ),
            _navigation("tunnel", data),
            6.0,
            ("tunnel.toml", "tunnel"),
        ),
        DemoRun(
            Shown(
                "A",
                "cone",
                "Drift during a GNSS outage",
                f"The same drive with a GNSS outage of {_OUTAGE:g} s at each of ten instants: the "
                "predicted drift, its sources, and the drift that occurred.",
                f"strapdown outage {out / 'tunnel'} --outage {_OUTAGE:g} "
                f"\\\n  --out {out / 'cone'}",
                ("cone",),
            ),
            outages,
            5.0,
            ("cone",),
        ),
        DemoRun(
            Shown(
                "A",
                "car",
                "A real car",
                "A recording: a small unit with vibration, and an RTK receiver, with GNSS outage "
                "tests.",
                f"strapdown navigate {out / 'car.toml'} \\\n  --out {out / 'car'}",
                ("plan", "heading-integrity"),
            ),
            _navigation("car", data),
            8.0,
            ("car.toml", "car"),
            "car_rtk",
        ),
        DemoRun(
            Shown(
                "A",
                "walk",
                "A real walk, without GNSS",
                "A recording: foot-mounted pedestrian dead reckoning with zero velocity updates "
                "(ZUPT).",
                f"strapdown navigate {out / 'walk.toml'} \\\n  --out {out / 'walk'}",
                ("plan",),
            ),
            _navigation("walk", data),
            4.0,
            ("walk.toml", "walk"),
            "foot",
        ),
        DemoRun(
            Shown(
                "B",
                "hand",
                "A phone, moved as fast as a hand can",
                "A scenario whose attitude is known exactly, as in Fig. 6 of Alexiev (2021).",
                f"strapdown attitude alexiev-fig6 --rate 200 \\\n  --out {out / 'hand'}",
                ("sweep",),
            ),
            scenario,
            3.0,
            ("hand",),
        ),
        DemoRun(
            Shown(
                "B",
                "turn",
                "A cheap sensor, turned twice by hand",
                "A recording. Reference: two full turns about the vertical end in the initial "
                "attitude.",
                f"strapdown attitude {turns / _TURN} \\\n"
                "  --reference 'end 2 turns about up since start' \\\n"
                f"  --gyro-bias {turns / 'unmoved-10min'} \\\n  --out {out / 'turn'}",
                ("sweep",),
            ),
            turn,
            2.0,
            ("turn",),
            _TURNS,
        ),
        DemoRun(
            Shown(
                "C",
                "pole",
                "A car against a pole",
                "A simulation: two low-cost recorders with sensor errors; the truth is known.",
                f"strapdown simulate pole --out {out / 'pole-records'}\n"
                f"strapdown crash {out / 'pole-records' / 'case.toml'} \\\n  --out {out / 'pole'}",
                ("path",),
                (("report.html", "Report"), ("report.pdf", "PDF")),
                "pole-records",
            ),
            pole,
            7.0,
            ("pole-records", "pole"),
        ),
    ]


def _attitude(
    sources: list[str], out: Path, force: bool, progress: Progress, **options: Any
) -> None:
    from strapdown.api.attitude import compare_attitude

    made = compare_attitude(sources, progress=progress, **options)
    progress("writing", 0.9)
    made.save(out, force=force)


def _navigation(name: str, data: Path) -> Callable[[Path, bool, Progress], None]:
    def make(folder: Path, force: bool, progress: Progress) -> None:
        from strapdown.api.navigation import navigate
        from strapdown.bundle.atomic_folder import replace_file

        packaged = files("strapdown").joinpath("demo_data")
        text = packaged.joinpath(f"{name}.toml").read_text("utf-8")
        text = text.replace("{data}", data.resolve().as_posix())
        folder.mkdir(parents=True, exist_ok=True)
        if _RECORDING in text:
            with as_file(packaged.joinpath("comma2k19")) as recording:
                shutil.copytree(recording, folder / _RECORDING, dirs_exist_ok=True)
        file = folder / f"{name}.toml"
        replace_file(file, text.encode())
        navigate(file, progress=progress).save(folder / name, force=force, progress=progress)

    return make
