"""What was asked of the attitude bench, in whatever form it was said, as a specification."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strapdown.config import LogSpec, ScenarioSpec, specify
from strapdown.errors import ConfigError
from strapdown.formats.references import read_reference_words
from strapdown.simulation import SCENARIOS, find_scenario

Array = NDArray[np.float64]

#: What ``all`` stands for: Alexiev's four, Runge-Kutta, and 1 to 4 increments.
ALL_ALGORITHMS = (
    *("naive", "euler", "dcm", "quaternion", "rk4"),
    *(f"rotvec:samples={n}" for n in (1, 2, 3, 4)),
)


def as_text(value: object) -> str:
    """A text as it is; three numbers as the text that means them."""
    if isinstance(value, str | Path):
        return str(value).strip()
    return ",".join(str(v) for v in np.asarray(value).ravel().tolist())


def as_texts(values: object) -> list[str]:
    """One text or many, or none."""
    if values is None:
        return []
    if isinstance(values, str | Path):
        return [str(values)]
    return [str(v) for v in values] if isinstance(values, Iterable) else [str(values)]


def source_spec(
    text: str,
    rate: float | None,
    seed: int | None,
    reading: dict[str, Any],
    sampling: str | None,
    trials: int = 1,
    rates: Sequence[float] = (),
    sensor: str | Path | None = None,
) -> list[ScenarioSpec] | list[LogSpec]:
    """Specify a scenario, as often as there are trials, or a log.

    Parameters
    ----------
    text : str
        Name of a scenario, or path of a log.
    rate : float or None, Hz
    seed : int or None
    reading : dict
        What was said about reading a log; None where nothing was.
    sampling : str or None
    trials : int
        Seeds of a scenario.
    rates : sequence of float, Hz
        That will be tried; a scenario without a rate is sampled at the highest.
    sensor : str, Path or None
        Of a scenario.

    Returns
    -------
    list of ScenarioSpec or LogSpec

    Raises
    ------
    ConfigError
        There is no such thing, or something was said that the other kind needs.
    """
    if trials < 1:
        raise ConfigError("attitude.no-number-trials", quantity="--trials", trials=trials)
    name = text.strip().lower()
    if not name:
        raise ConfigError("attitude.nothing-named", quantity="source")
    if name in SCENARIOS:
        if given := [key for key, value in reading.items() if value is not None]:
            raise ConfigError("attitude.scenario-not-read-file", quantity=name, given=given)
        first = 0 if seed is None else seed
        highest = max((float(r) for r in rates), default=100.0)
        return [
            specify(
                ScenarioSpec,
                name=name,
                rate_hz=highest if rate is None else rate,
                sampling=(sampling or "instantaneous").lower(),
                seed=first + k,
                sensor=None if sensor is None else str(sensor),
            )
            for k in range(trials)
        ]
    if seed is not None:
        raise ConfigError("attitude.recorded-log-no-noise-drawn", quantity="seed")
    if sensor is not None:
        raise ConfigError("attitude.recorded-log-sensor", quantity="sensor")
    if trials > 1:
        raise ConfigError("attitude.recorded-log-not-drawn-again", quantity="--trials")
    if not exists(text) and not Path(text).suffix and len(Path(text).parts) == 1:
        find_scenario(name)  # says which names there are
    said = {key: value for key, value in reading.items() if value is not None}
    return [specify(LogSpec, path=str(Path(text)), sampling=sampling, rate_hz=rate, **said)]


def one_of_each(
    sources: Iterable[ScenarioSpec | LogSpec],
) -> list[ScenarioSpec | LogSpec]:
    """Refuse a source that is named twice: it would count as two trials.

    Raises
    ------
    ConfigError
    """
    found: list[ScenarioSpec | LogSpec] = []
    for source in sources:
        if source in found:
            name = source.name if isinstance(source, ScenarioSpec) else source.path
            raise ConfigError("attitude.named-twice-trial-does-not", file=name, quantity="source")
        found.append(source)
    return found


def exists(text: str) -> bool:
    """Tell whether a text is the path of something; sentences and odd characters are not."""
    if text in ("", "none", "rest", "rests"):
        return False
    try:
        return Path(text).exists()
    except (OSError, ValueError):
        return False


def sort_references(items: Sequence[str]) -> tuple[tuple[str, ...], str | None]:
    """Sort references into sentences and the path of a truth."""
    words: list[str] = []
    truth: str | None = None
    for item in items:
        path = Path(item)
        if not exists(item):
            if " " not in item.strip() and path.suffix:
                raise ConfigError("attitude.no-such-file", file=item, quantity="reference")
            words.append(item)
        elif path.is_dir():
            raise ConfigError("attitude.folder", file=item, quantity="reference")
        elif (listed := read_reference_words(path)) is not None:
            words += listed
        elif truth is None:
            truth = str(path)
        else:
            raise ConfigError(
                "attitude.two-attitude-truths-given", quantity="reference", truth=truth, item=item
            )
    return tuple(words), truth
