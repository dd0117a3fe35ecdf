"""Records to begin with, copied into a folder that has none where a person asks for them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

from strapdown.bundle.atomic_folder import replace_file
from strapdown.errors import ConfigError, check_choice
from strapdown.studio.folder import Folder

__all__ = ["SAMPLES", "listed_samples", "sample"]


@dataclass(frozen=True)
class Sample:
    """Records to begin with.

    Attributes
    ----------
    title, text : str
        For people.
    make : callable
        Returns the content of each file by its name.
    """

    title: str
    text: str
    make: Callable[[], dict[str, bytes]]


def _drive() -> dict[str, bytes]:
    recording = files("strapdown").joinpath("demo_data", "comma2k19")
    return {
        f"drive-{name}": recording.joinpath(name).read_bytes()
        for name in ("imu.csv", "gnss.csv", "reference.csv")
    }


def _crash() -> dict[str, bytes]:
    from strapdown.api.simulation import simulate

    with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
        made = Path(name) / "crash"
        simulate("frontal").save(made)
        return {f"crash-{p.name}": p.read_bytes() for p in sorted(made.glob("imu1_*.csv"))}


SAMPLES = {
    "drive": Sample(
        "A phone in a car",
        "One minute of a recorded drive: inertial sensors, satellite fixes and a reference "
        "(comma2k19, MIT license).",
        _drive,
    ),
    "crash": Sample(
        "A simulated crash",
        "The recorder of a car that meets an obstacle with its front, in three files.",
        _crash,
    ),
}


def listed_samples() -> list[dict[str, str]]:
    """List the samples: name, title and text."""
    return [{"name": k, "title": one.title, "text": one.text} for k, one in SAMPLES.items()]


def sample(folder: Path, name: str) -> dict[str, Any]:
    """Copy a sample into the folder of the studio; return the names of its files.

    ConfigError: there is no such sample, or another file has the name of one of its own.
    """
    check_choice("studio.no-such-sample", SAMPLES, quantity="name", word=name)
    place = Folder(folder)
    made = SAMPLES[name].make()
    for file, data in made.items():
        target = place.path / file
        if target.is_symlink() or (target.exists() and target.read_bytes() != data):
            raise ConfigError("studio.name-taken", file=file)
    for file, data in made.items():
        replace_file(place.path / file, data)
    return {"files": list(made)}
