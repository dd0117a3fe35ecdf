"""Options of a comparison of attitude algorithms, and what they are resolved to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field, FiniteFloat

from strapdown.attitude_algorithms import ALGORITHMS
from strapdown.config.sources import LogSpec, ScenarioSpec, is_scenario_file
from strapdown.config.spec import Spec, specify
from strapdown.errors import ConfigError
from strapdown.systems.inputs import check_part

#: Algorithms that are compared by default: one of each.
COMPARED = tuple(ALGORITHMS)
#: Meaning of ``all``: the variants, too.
ALL_ALGORITHMS = tuple(text for name, cls in ALGORITHMS.items() for text in cls.variants or (name,))

AnySource = Annotated[ScenarioSpec | LogSpec, Field(discriminator="kind")]


class AttitudeSpec(Spec):
    """A comparison as it is sealed: `AttitudeOptions` with typed sources."""

    source: AnySource
    also: tuple[AnySource, ...] = ()
    algorithms: tuple[str, ...] = COMPARED
    interpolation: Literal["linear", "cubic"] = "linear"
    rates_hz: tuple[FiniteFloat, ...] = ()
    tolerance_deg: FiniteFloat = Field(default=1.0, gt=0.0)
    initial: str = "auto"
    gyro_bias: str = "auto"
    references: tuple[str, ...] = ()
    truth_path: str | None = None
    gyro_bias_path: str | None = None
    reference_log_path: str | None = None
    reference_clock: Literal["fitted", "stated"] = "fitted"
    magnetometer: Literal["auto", "raw", "log"] = "auto"
    magnetometer_path: str | None = None
    place: tuple[FiniteFloat, FiniteFloat, FiniteFloat] | None = None
    peers: tuple[str, ...] = ()
    from_s: FiniteFloat | None = None
    to_s: FiniteFloat | None = None
    duration_s: FiniteFloat | None = None


#: Options of how a log is read.
READING = (
    "format",
    "columns",
    "gyro_unit",
    "accel_unit",
    "time_unit",
    "axes",
    "repair",
    "calibration",
)


@dataclass(frozen=True)
class AttitudeOptions:
    """Options of a comparison of attitude algorithms.

    Attributes
    ----------
    algorithms : sequence of str
        Names with options, as in ``quaternion:order=3`` (`attitude_algorithms.make_algorithm`),
        plug-ins included; or ``all``: each of `attitude_algorithms.ALGORITHMS`, with its variants.
    rates_hz : sequence of float
        Lower rates to try; the full rate and its halves, if empty.
    tolerance_deg : float
        Required accuracy: limit of the largest known error.
    interpolation : {'linear', 'cubic'}
        Interpolation of the rates between stamps (`increments.increments_from_imu`).
    trials : int
        Number of seeds of a scenario, from `seed` on.
    reference : str or sequence of str
        Reference points in words (``end same as start``, `evaluation.reference_points`), or the
        path of a file with reference points or an attitude truth; ``rests``: gravity at every
        rest.
    reference_log : str or Path, optional
        Log of a second, better sensor on the same body: synchronized and aligned with this one,
        its attitude serves as the truth.
    reference_clock : {'fitted', 'stated'}
        Clock of an attitude truth: moved to that of the log where the rotations of both show an
        offset or a drift, or as its stamps state.
    initial : str or array_like, (3,), deg
        ``auto``, ``truth``, ``level``, ``zero``, or ``roll,pitch,heading`` in deg. ``auto`` is
        the truth where there is one, leveled where the log begins at rest, and zero otherwise.
    gyro_bias : str or array_like, (3,), rad/s
        ``auto``, as ``rest`` where there is a rest and its mean is significant; ``none``;
        ``rest``, the mean over the first stationary stretch; ``rests``, interpolated between all
        stretches; three numbers and a unit about forward, right, down; or the path of a
        log of the stationary sensor.
    magnetometer : str or Path
        For the filters: ``auto``, hard and soft iron are removed where the log shows them
        significantly; ``raw``, left; or the path of a log in which the sensor turned through all
        directions.
    lat, lon, alt : float, optional, deg, deg, m
        Place: headings of filters with a magnetometer become true ones, by the World Magnetic Model
        at the date of the log.
    peers : sequence of str
        Filters of other libraries to compare (`peers.PEERS`), or ``all``.
    from_s, to_s, duration_s : float, optional
        Part of the log: from an instant, to an instant, or of a duration.
    rate_hz : float, optional
        Sample rate of a scenario (100 if not given), or of a log without a time column.
    sampling : {'instantaneous', 'mean'}, optional
        Meaning of a row: the rate at its stamp, or its mean over the interval ending there.
    seed : int, optional
        Seed of a scenario's noise; 0 if not given.
    sensor : str or Path, optional
        For a scenario: a sensor of the catalogue, or a file like its entries.
    format, columns, gyro_unit, accel_unit, time_unit, axes, repair, calibration
        How to read a log, as in `formats.recording.ReadOptions`.
    """

    algorithms: Sequence[str] = COMPARED
    rates_hz: Sequence[float] = ()
    tolerance_deg: float = 1.0
    interpolation: str = "linear"
    trials: int = 1
    reference: str | Sequence[str] = ()
    reference_log: str | Path | None = None
    reference_clock: str = "fitted"
    initial: str | ArrayLike = "auto"
    gyro_bias: str | ArrayLike = "auto"
    magnetometer: str | Path = "auto"
    lat: float | None = None
    lon: float | None = None
    alt: float | None = None
    peers: Sequence[str] = ()
    from_s: float | None = None
    to_s: float | None = None
    duration_s: float | None = None
    rate_hz: float | None = None
    sampling: str | None = None
    seed: int | None = None
    sensor: str | Path | None = None
    format: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    gyro_unit: str | None = None
    accel_unit: str | None = None
    time_unit: str | None = None
    axes: str | None = None
    repair: bool = False
    calibration: str | Path | None = None

    def specify(self, source: str | Path | Sequence[str | Path]) -> AttitudeSpec:
        """Resolve the options for one source, or for several trials of one question.

        Parameters
        ----------
        source : str, Path, or a sequence of both
            Names of scenarios (`simulation.SCENARIOS`), or paths of logs.

        Raises
        ------
        DataError, ConfigError
            An option or a source is unknown, or the two do not go together.
        """
        sources = _texts(source)
        if not sources:
            raise ConfigError("attitude.nothing-named", quantity="source")
        for rate in self.rates_hz:
            refuse_no_rate(float(rate))
        check_part(self.from_s, self.to_s, self.duration_s)
        found: list[ScenarioSpec | LogSpec] = []
        for one in (one for text in sources for one in self._of_source(text)):
            # A source that is named twice would count as two trials.
            if one in found:
                name = one.name if isinstance(one, ScenarioSpec) else one.path
                raise ConfigError(
                    "attitude.named-twice-trial-does-not", file=name, quantity="source"
                )
            found.append(one)
        first, *others = found
        words, truth_path = _sort_references(_texts(self.reference))
        bias = _text(self.gyro_bias)
        bias_path = str(Path(bias)) if _exists(bias) else None
        stated = str(self.magnetometer).strip()
        if stated.lower() not in ("auto", "raw") and not _exists(stated):
            raise ConfigError(
                "attitude.no-such-calibration", file=stated, quantity="--magnetometer"
            )
        field_path = str(Path(self.magnetometer)) if _exists(str(self.magnetometer)) else None
        if (self.lat is None) != (self.lon is None) or (self.alt and self.lat is None):
            raise ConfigError("attitude.half-a-place", quantity="--lat, --lon")
        place = None
        if self.lat is not None and self.lon is not None:
            place = (self.lat, self.lon, self.alt or 0.0)
        algorithms = _texts(self.algorithms)
        return specify(
            AttitudeSpec,
            source=first,
            also=tuple(others),
            algorithms=ALL_ALGORITHMS if algorithms == ["all"] else tuple(algorithms),
            interpolation=self.interpolation.strip(),
            rates_hz=tuple(float(r) for r in self.rates_hz),
            tolerance_deg=self.tolerance_deg,
            initial=_text(self.initial),
            gyro_bias="log" if bias_path else bias,
            references=words,
            truth_path=truth_path,
            gyro_bias_path=bias_path,
            magnetometer="log" if field_path else str(self.magnetometer).strip().lower(),
            magnetometer_path=field_path,
            place=place,
            peers=tuple(_texts(self.peers)),
            reference_clock=self.reference_clock,
            reference_log_path=None if self.reference_log is None else str(self.reference_log),
            from_s=self.from_s,
            to_s=self.to_s,
            duration_s=self.duration_s,
        )

    def _of_source(self, text: str) -> Sequence[ScenarioSpec | LogSpec]:
        """Specify a scenario, once per trial, or a log."""
        if self.trials < 1:
            raise ConfigError("attitude.no-number-trials", quantity="--trials", trials=self.trials)
        name = text.strip().lower()
        if not name:
            raise ConfigError("attitude.nothing-named", quantity="source")
        reading = {
            key: value for key in READING if (value := getattr(self, key)) not in (None, False, {})
        }
        if "columns" in reading:
            reading["columns"] = dict(self.columns)
        if "calibration" in reading:
            reading["calibration"] = str(self.calibration)
        sensor = None if self.sensor is None else str(self.sensor)
        # The name of a scenario has neither a suffix nor a folder.
        plain = not Path(name).suffix and len(Path(name).parts) == 1
        if plain:
            from strapdown.simulation import SCENARIOS, find_scenario

            plain = name in SCENARIOS or not _exists(text)
        if plain and name in SCENARIOS:
            if reading:
                raise ConfigError(
                    "attitude.scenario-not-read-file", quantity=name, given=list(reading)
                )
            highest = max((float(r) for r in self.rates_hz), default=100.0)
            first = specify(
                ScenarioSpec,
                name=name,
                rate_hz=highest if self.rate_hz is None else self.rate_hz,
                sampling=(self.sampling or "instantaneous").lower(),
                seed=0 if self.seed is None else self.seed,
                sensor=sensor,
            )
        elif name.endswith(".toml") and is_scenario_file(Path(text)):
            sampling = self.sampling and self.sampling.lower()
            first = ScenarioSpec.of_file(Path(text), self.rate_hz, sampling, self.seed, sensor)
        else:
            if self.seed is not None:
                raise ConfigError("attitude.recorded-log-no-noise-drawn", quantity="seed")
            if self.sensor is not None:
                raise ConfigError("attitude.recorded-log-sensor", quantity="sensor")
            if self.trials > 1:
                raise ConfigError("attitude.recorded-log-not-drawn-again", quantity="--trials")
            if plain:
                find_scenario(name)  # lists the valid names
            path = str(Path(text))
            return [
                specify(LogSpec, path=path, sampling=self.sampling, rate_hz=self.rate_hz, **reading)
            ]
        return [first.model_copy(update={"seed": first.seed + k}) for k in range(self.trials)]


def refuse_no_rate(rate: float) -> None:
    """Raise ConfigError unless a rate in Hz is positive and finite."""
    if not (np.isfinite(rate) and rate > 0.0):
        raise ConfigError("attitude.hz-no-rate", quantity="--rates", rate=rate)


def _text(value: Any) -> str:
    """Return a text unchanged, three numbers as text."""
    if isinstance(value, str | Path):
        return str(value).strip()
    return ",".join(str(v) for v in np.asarray(value).ravel().tolist())


def _texts(values: object) -> list[str]:
    """Return one text, several or none as a list."""
    if values is None:
        return []
    if isinstance(values, str | Path) or not isinstance(values, Iterable):
        return [str(values)]
    return [str(v) for v in values]


def _exists(text: str) -> bool:
    """Whether a text is an existing path; False for sentences and invalid characters."""
    if text in ("", "auto", "none", "raw", "rest", "rests"):
        return False
    try:
        return Path(text).exists()
    except (OSError, ValueError):
        return False


def _sort_references(items: Sequence[str]) -> tuple[tuple[str, ...], str | None]:
    """Separate reference sentences from the path of a truth."""
    if not items:
        return (), None
    from strapdown.formats.references import read_reference_words

    words: list[str] = []
    truth: str | None = None
    for item in items:
        path = Path(item)
        if not _exists(item):
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
