"""A trajectory to simulate, as a file in TOML."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field, FiniteFloat, ValidationError, field_validator

from strapdown.config.motions import KINDS, MANOEUVRES, MotionSpec
from strapdown.config.spec import TableSpec
from strapdown.exceptions import ConfigError, nearest

__all__ = ["TrajectorySpec", "read_trajectory_spec"]


class TrajectorySpec(TableSpec):
    """One run of the simulator over a motion on the Earth."""

    unwritten: ClassVar[tuple[str, ...]] = ("name",)

    name: str = "trajectory"
    title: str = ""
    ellipsoid: str = "wgs84"
    rate_hz: FiniteFloat = Field(default=100.0, gt=0.0)
    sampling: str = "instantaneous"
    seed: int = Field(default=0, ge=0)
    sensor: str | None = None
    formats: tuple[str, ...] = Field(default=("csv",), min_length=1)
    trajectory_formats: tuple[str, ...] = ()
    motion: MotionSpec

    @field_validator("formats", "trajectory_formats", mode="before")
    @classmethod
    def _several(cls, value: Any) -> Any:
        return [value] if isinstance(value, str) else value


def read_trajectory_spec(path: Path, **instead: Any) -> TrajectorySpec:
    """Read a trajectory's file.

    Parameters
    ----------
    path : Path
    **instead
        Values that take the place of the file's own; None leaves them.

    Returns
    -------
    TrajectorySpec
        Named after the file. A sensor's file is looked for beside it.

    Raises
    ------
    ConfigError
        There is no such file, it is no TOML, or a value does not fit; the message names the key.
    """
    if not path.is_file():
        what = "it is no file" if path.exists() else "there is no such file"
        raise ConfigError(what, file=str(path), remedy="check the path")
    try:
        # With the mark that some editors on Windows begin a file with, or without.
        table = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except RecursionError:
        raise ConfigError(
            "it is nested too deep", file=path.name, remedy="a trajectory has three levels"
        ) from None
    except OSError as error:
        raise ConfigError(
            f"it cannot be read: {error.strerror}", file=str(path), remedy="check its permissions"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(
            f"it is no TOML: {error}", file=path.name, remedy="mend it where it says"
        ) from None
    if "name" in table:
        raise ConfigError(
            "there is no such key",
            file=path.name,
            quantity="name",
            remedy="a trajectory is named after its file; write title = …",
        )
    table["name"] = path.stem
    sensor = table.get("sensor")
    if isinstance(sensor, str) and sensor.lower().endswith(".toml"):
        table["sensor"] = str(path.parent / sensor)
    table |= {key: value for key, value in instead.items() if value is not None}
    try:
        return TrajectorySpec(**table)
    except ValidationError as error:
        raise _explained(error.errors()[0], path.name) from None


def _explained(error: Any, file: str) -> ConfigError:
    """An error of pydantic in the words of ours."""
    place, given, context = list(error["loc"]), error["input"], error.get("ctx", {})
    if error["type"] == "refused":
        what, remedy = context["what"], context["remedy"]
        place.append(context["key"])
    elif error["type"] == "missing":
        what, remedy = "it is missing", f"write {place[-1]} = …; its name tells its unit"
        if isinstance(place[-1], int):
            remedy = "give a number for each component"
    elif error["type"] == "union_tag_not_found":
        key = context["discriminator"].strip("'")
        place.append(key)
        known = KINDS if key == "kind" else MANOEUVRES
        what, remedy = "it is missing", f"write {key} = …; known: {', '.join(known)}"
    elif error["type"] == "union_tag_invalid":
        place.append(context["discriminator"].strip("'"))
        tags = re.findall(r"'(\w+)'", context["expected_tags"])
        what, remedy = f"there is no '{context['tag']}'", nearest(str(context["tag"]), tags)
    else:
        what = f"{given!r} does not fit: {error['msg'].lower()}"
        remedy = "give another value; the name of the key tells its unit"
    return ConfigError(what, file=file, quantity=_place(place), remedy=remedy)


def _place(parts: list[str | int]) -> str:
    """Where it stands, as a person counts: ``manoeuvre 3, turn_left, radius_m``."""
    words: list[str] = []
    for k, part in enumerate(parts):
        if isinstance(part, int):
            # Of lists one is named, of vectors a component.
            of = words[-1] if words[-1].endswith("_s") else words[-1].removesuffix("s")
            words[-1] = f"{of} {part + 1}"
        elif not (part == "motion" and k == 0 and len(parts) > 1) and not (
            part in KINDS and k == 1 and parts[0] == "motion" and len(parts) > 2
        ):
            words.append(part)
    return ", ".join(words)
