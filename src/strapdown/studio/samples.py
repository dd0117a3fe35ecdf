"""Records to begin with, copied into a folder of their own where a person asks for them."""

from __future__ import annotations

import json
import math
import re
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

from strapdown.bundle.atomic_folder import replace_file
from strapdown.config.toml_text import string
from strapdown.crash.events import KMH
from strapdown.errors import ConfigError, check_choice
from strapdown.studio.folder import Folder

#: Head of the case of the simulated crash.
SIMULATED = "A simulated crash: what is marked as yours is the statement of the simulation."


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
        name: recording.joinpath(name).read_bytes()
        for name in ("imu.csv", "gnss.csv", "reference.csv")
    }


def _crash() -> dict[str, bytes]:
    from strapdown.api.simulation import simulate

    with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
        made = Path(name) / "crash"
        simulate("frontal").save(made)
        records = sorted(made.glob("imu1_*.csv"))
        case = (made / "case.toml").read_text(encoding="utf-8")
        truth = json.loads((made / "scenario.json").read_text(encoding="utf-8"))["impacts"][0]
        own = {p.name: p.read_bytes() for p in records}
        return {**own, "case.toml": _case_of_one(case, truth).encode()}


def _case_of_one(case: str, truth: Mapping[str, Any]) -> str:
    """Return a simulated case with its first recorder alone, whose files are in the folder.

    `truth`: of its impact, which the description states.
    """
    head, first, *others = case.split("\n[[units]]")
    # Without the comment above it, and what refers to files that are not copied.
    head = head[head.index("\ntitle = ") :]
    options = others[-1][others[-1].index("\n[options]") :]
    text = f"{head}\n[[units]]{first}{options}"
    change = math.hypot(*truth["delta_v_m_per_s"]) / KMH
    said = (
        f"Simulated, with the statements of an investigator. The truth is a delta-V of {change:.1f}"
        f" km/h and a direction of force of {truth['pdof_deg']:.1f}\N{DEGREE SIGN}."
    )
    text = re.sub("\ndescription = .*", f"\ndescription = {string(said)}", text)
    return f"# {SIMULATED}\n{text}"


SAMPLES = {
    "drive": Sample(
        "A phone in a car",
        "One minute of a recorded drive: inertial sensors, satellite fixes and a reference "
        "(comma2k19, MIT license).",
        _drive,
    ),
    "crash": Sample(
        "A simulated crash",
        "The recorder of a car that meets an obstacle with its front, in three files, and a case "
        "for them: the answers of the simulation, whose truth is known.",
        _crash,
    ),
}


def listed_samples() -> list[dict[str, str]]:
    """List the samples: name, title and text."""
    return [{"name": k, "title": one.title, "text": one.text} for k, one in SAMPLES.items()]


def sample(folder: Path, name: str) -> dict[str, Any]:
    """Copy a sample into a folder of its own, in that of the studio; return its records by name.

    A configuration for them is copied, too, and offered where one is proposed.

    ConfigError: there is no such sample, or another file has the name of one of its own.
    """
    check_choice("studio.no-such-sample", SAMPLES, quantity="name", word=name)
    own, made = f"sample-{name}", SAMPLES[name].make()
    place = Folder(folder).path / own
    if place.is_symlink() or (place.exists() and not place.is_dir()):
        raise ConfigError("studio.name-taken", file=own)
    for file, data in made.items():
        target = place / file
        if target.is_symlink() or (target.exists() and target.read_bytes() != data):
            raise ConfigError("studio.name-taken", file=f"{own}/{file}")
    place.mkdir(exist_ok=True)
    for file, data in made.items():
        replace_file(place / file, data)
    return {"files": [f"{own}/{file}" for file in made if not file.endswith(".toml")]}
