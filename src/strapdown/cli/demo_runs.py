"""Runs of ``strapdown demo`` and their requirements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from strapdown.progress import Progress
    from strapdown.report.demo_page import Shown

__all__ = ["DemoRun", "demo_runs"]

_TURNS = "mpu6050_turns"
_TURN = "rotate-360ccw-around-z-pointing-up"
_VERDICT = (("report.html", "The report"), ("verdict.html", "The verdict"))
_OUTAGE = 30.0  # s


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

    Parameters
    ----------
    out : Path
        Folder of the demonstration, as named in commands.
    data : Path
        Folder of the recordings.
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
        from strapdown.report.simulation import simulate

        progress("simulating the records", 0.0)
        simulate("pole", folder / "pole-records", force=force)
        case = folder / "pole-records" / "case.toml"
        made = reconstruct(case, progress=progress)
        made.save(folder / "pole", force=force, progress=progress)

    def coasting(folder: Path, force: bool, progress: Progress) -> None:
        from strapdown.api.alignment import coast

        made = coast(folder / "tunnel", _OUTAGE, progress=progress)
        made.save(folder / "cone", force=force, progress=progress)

    return [
        DemoRun(
            Shown(
                "A",
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
                "A",
                "turn",
                "A cheap sensor, turned twice by hand",
                "A recording. What is known: two full turns about the vertical end as they began.",
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
                "B",
                "pole",
                "A car against a pole",
                "Two cheap recorders, simulated with the errors of their sensors; the truth is "
                "known.",
                f"strapdown simulate pole --out {out / 'pole-records'}\n"
                f"strapdown crash {out / 'pole-records' / 'case.toml'} \\\n  --out {out / 'pole'}",
                ("path",),
                (("report.html", "The report"), ("report.pdf", "as PDF")),
                "pole-records",
            ),
            pole,
            7.0,
            ("pole-records", "pole"),
        ),
        DemoRun(
            Shown(
                "C",
                "tunnel",
                "A drive, half a minute of it in a tunnel",
                "Fixes with outliers, and none in the tunnel; smoothed when it has ended. Below "
                "the path: when the heading can be trusted.",
                f"strapdown navigate {out / 'tunnel.toml'} \\\n  --out {out / 'tunnel'}",
                ("plan", "heading-light"),
                _VERDICT,
            ),
            _navigation("tunnel", data),
            6.0,
            ("tunnel.toml", "tunnel"),
        ),
        DemoRun(
            Shown(
                "C",
                "cone",
                "How far would it have drifted?",
                f"The same drive, its receiver taken away for {_OUTAGE:g} s at each of ten places: "
                "what is foretold, what it is made of, and what came.",
                f"strapdown coast {out / 'tunnel'} --outage {_OUTAGE:g} \\\n  --out {out / 'cone'}",
                ("cone",),
            ),
            coasting,
            5.0,
            ("cone",),
        ),
        DemoRun(
            Shown(
                "C",
                "car",
                "A real car",
                "A recording: a small unit that shakes, and a receiver that is good to "
                "centimetres; its fixes are kept back at times, to score the run by them.",
                f"strapdown navigate {out / 'car.toml'} \\\n  --out {out / 'car'}",
                ("plan", "heading-light"),
                _VERDICT,
            ),
            _navigation("car", data),
            8.0,
            ("car.toml", "car"),
            "car_rtk",
        ),
        DemoRun(
            Shown(
                "C",
                "walk",
                "A real walk, without satellites",
                "A recording: a unit on a shoe, which stands still at each step.",
                f"strapdown navigate {out / 'walk.toml'} \\\n  --out {out / 'walk'}",
                ("plan",),
                _VERDICT,
            ),
            _navigation("walk", data),
            4.0,
            ("walk.toml", "walk"),
            "foot",
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

        packaged = files("strapdown.cli").joinpath("demo_files", f"{name}.toml")
        text = packaged.read_text("utf-8").replace("{data}", data.resolve().as_posix())
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{name}.toml"
        file.write_text(text, encoding="utf-8", newline="\n")
        navigate(file, progress=progress).save(folder / name, force=force, progress=progress)

    return make
