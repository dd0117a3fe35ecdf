"""File of a campaign: what a case runs, what varies, what is kept, and when it is enough."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from functools import cache
from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, StrictInt, model_validator

from strapdown.config.reading import FileSpec
from strapdown.config.spec import Fault, FileName, Number, Positive, Spec, Word, refuse
from strapdown.config.toml_file import KeyPath

#: Most cases of a campaign, and of the values of one parameter.
MOST_CASES, MOST_VALUES = 1_000_000_000, 10_000
#: Keys of each distribution of a drawn parameter.
DRAWS = {
    "uniform": ("low", "high"),
    "integer": ("low", "high"),
    "log-uniform": ("low", "high"),
    "normal": ("mean", "sd"),
    "log-normal": ("median", "factor"),
    "truncated-normal": ("mean", "sd", "low", "high"),
    "choice": ("values",),
}


@cache
def key_path(text: str) -> KeyPath:
    """Split a dotted key as TOML does; a part that is a whole number is the index in a list.

    ``observations."gnss.position".mean_nis`` has three parts. ValueError: it is not a key.
    """
    node: Any = tomllib.loads(f"{text} = 0")
    path: list[str | int] = []
    while isinstance(node, dict):
        if len(node) != 1:
            raise ValueError(text)
        ((name, node),) = node.items()
        path.append(int(name) if name.isdecimal() else name)
    return tuple(path)


def _is_key(text: str) -> bool:
    try:
        return bool(key_path(text)) and "\n" not in text
    except ValueError:
        return False


class BaseTable(Spec):
    """What a case runs."""

    kind: Literal["attitude", "align", "navigate", "outage", "crash", "calibrate", "doctor"]
    #: Configuration of this kind, from the folder of the campaign; or written here, as a table.
    file: FileName | None = None
    configuration: dict[str, Any] = Field(default_factory=dict)
    #: One case a log: a pattern of files, a folder, or a table with a column `log`.
    logs: FileName | None = None
    #: Of a crash: the name of a simulated one (``frontal``), instead of records.
    simulate: Word | None = None
    #: Many cases in one call: the errors of one record or motion, drawn without its reports.
    bulk: StrictBool = False

    @model_validator(mode="after")
    def _one(self) -> BaseTable:
        if self.file is not None and self.configuration:
            raise refuse("configuration", "campaign.base-twice")
        if self.simulate is not None and self.kind != "crash":
            raise refuse("simulate", "campaign.simulate-of-crash")
        if self.bulk and self.kind not in ("crash", "attitude", "outage"):
            raise refuse("bulk", "campaign.no-bulk", kind=self.kind)
        given = self.file is not None or self.configuration or self.simulate is not None
        if not given and self.kind not in ("doctor", "calibrate", "navigate", "attitude"):
            raise refuse("file", "campaign.no-base", kind=self.kind)
        if not given and self.logs is None:
            raise refuse("logs", "campaign.no-base-no-logs", kind=self.kind)
        return self


class CasesTable(Spec):
    """How many cases, and how their parameters are drawn."""

    #: In each cell of the grid; with "sensitivity" base samples.
    draws: Annotated[StrictInt, Field(ge=1, le=MOST_CASES)] = 1
    method: Literal["random", "latin", "sobol", "sensitivity"] = "random"
    seed: Annotated[StrictInt, Field(ge=0)] = 0
    #: Cases as they are: a table (CSV) with a column for each parameter.
    table: FileName | None = None


class ParameterTable(Spec):
    """What varies: over the values of a grid, or drawn from a distribution."""

    key: Annotated[Word, Field(description="key of the configuration, as sensors.sensor")]
    #: Column of the results; the last part of the key, if not given.
    name: Word | None = None
    values: Annotated[tuple[Any, ...], Field(max_length=MOST_VALUES)] = ()
    draw: (
        Literal[
            "uniform",
            "integer",
            "log-uniform",
            "normal",
            "log-normal",
            "truncated-normal",
            "choice",
        ]
        | None
    ) = None
    low: Number | None = None
    high: Number | None = None
    mean: Number | None = None
    sd: Positive | None = None
    #: Of a log-normal distribution: 68 % are between median / factor and median * factor.
    median: Positive | None = None
    factor: Annotated[Number, Field(gt=1.0)] | None = None

    @model_validator(mode="after")
    def _fits(self) -> ParameterTable:
        if not _is_key(self.key):
            raise refuse("key", "campaign.no-key", text=self.key)
        bounds = ("low", "high", "mean", "sd", "median", "factor")
        stated = [name for name in bounds if getattr(self, name) is not None]
        if self.draw is None:
            if stated:
                raise refuse(stated[0], "campaign.distribution-not-named", known=list(DRAWS))
            return self
        wanted = DRAWS[self.draw]
        have = [*stated, *(["values"] if self.values else [])]
        lacking = [n for n in wanted if n not in have]
        if lacking or any(n not in wanted for n in have):
            raise refuse("draw", "campaign.distribution-keys", draw=self.draw, wanted=wanted)
        low, high = self.low, self.high
        if low is not None and high is not None and not low < high:
            raise refuse("high", "campaign.range-empty", low=low, high=high)
        if self.draw == "log-uniform" and not (low or 0.0) > 0.0:
            raise refuse("low", "campaign.range-not-positive")
        if self.draw == "integer" and any(v != int(v) for v in (low or 0.0, high or 0.0)):
            raise refuse("low", "campaign.range-not-whole")
        return self

    @property
    def path(self) -> KeyPath:
        """The key, in parts."""
        return key_path(self.key)

    @property
    def column(self) -> str:
        """Name of its column in the results."""
        return self.name or str(self.path[-1])


class CurveAxis(Spec):
    """Common axis of the kept curves, from the start of a case."""

    from_s: Number = 0.0
    to_s: Number
    points: Annotated[StrictInt, Field(ge=2, le=2000)] = 50

    @model_validator(mode="after")
    def _span(self) -> CurveAxis:
        if not self.from_s < self.to_s:
            raise refuse("to_s", "config.end-before-begin", begin=self.from_s)
        return self


class KeepTable(Spec):
    """What is kept of each case."""

    #: Names, and where they are in the result; those of the kind, if none is given.
    scalars: dict[Word, Word] = Field(default_factory=dict)
    #: Names of curves of the kind.
    curves: tuple[Word, ...] = ()
    axis: CurveAxis | None = None

    @model_validator(mode="after")
    def _keys(self) -> KeepTable:
        for name, text in self.scalars.items():
            if not _is_key(text):
                raise refuse(f"scalars, {name}", "campaign.no-key", text=text)
        if self.curves and self.axis is None:
            raise refuse("axis", "campaign.no-axis")
        return self


class CoverageTable(Spec):
    """Share of cases whose error is within its bound."""

    name: Word
    error: Word
    bound: Word
    expected: Annotated[Number, Field(gt=0.0, lt=1.0)] = 0.95


class RateTable(Spec):
    """Share of cases in which a scalar is above or below a limit."""

    name: Word
    scalar: Word
    above: Number | None = None
    below: Number | None = None

    @model_validator(mode="after")
    def _one(self) -> RateTable:
        if (self.above is None) == (self.below is None):
            raise refuse("above", "campaign.above-or-below")
        return self


class ConsistencyTable(Spec):
    """A squared error in units of its covariance (NEES, NIS), over cases."""

    name: Word
    scalar: Word
    dof: Annotated[StrictInt, Field(ge=1, le=1000)]


class StopTable(Spec):
    """When a cell has enough cases: the half width of a 95 % interval."""

    coverage: Word | None = None
    rate: Word | None = None
    #: Of which the mean is to be known.
    scalar: Word | None = None
    half_width: Positive
    #: Draws between two looks.
    every: Annotated[StrictInt, Field(ge=10)] = 100

    @model_validator(mode="after")
    def _one(self) -> StopTable:
        if sum(v is not None for v in (self.coverage, self.rate, self.scalar)) != 1:
            raise refuse("half_width", "campaign.stop-by-one")
        return self


class LimitsTable(Spec):
    """What a case may use; one that needs more is recorded as such."""

    time_s: Positive = 3600.0
    memory_mb: Annotated[Number, Field(ge=256.0)] = 4096.0


class CampaignSpec(FileSpec):
    """A design of experiments, or a fleet of logs, and what is made of it."""

    called = "campaign"

    title: str = ""
    base: BaseTable
    cases: CasesTable = CasesTable()
    parameter: tuple[ParameterTable, ...] = ()
    keep: KeepTable = KeepTable()
    coverage: tuple[CoverageTable, ...] = ()
    rate: tuple[RateTable, ...] = ()
    consistency: tuple[ConsistencyTable, ...] = ()
    stop: StopTable | None = None
    limits: LimitsTable = LimitsTable()

    def with_scalars(self, scalars: dict[str, str]) -> CampaignSpec:
        """Return it with other kept scalars."""
        keep = self.keep.model_copy(update={"scalars": scalars})
        return self.model_copy(update={"keep": keep})

    def faults(self) -> Iterator[Fault]:
        """Yield what contradicts: names used twice, a stop rule without its statistic."""
        taken: set[str] = {"case", "cell", "draw", "seed", "status", "code", "findings", "log"}
        for k, one in enumerate(self.parameter):
            if one.column in taken:
                yield Fault(("parameter", k, "name"), "campaign.name-taken", {"name": one.column})
            taken.add(one.column)
            if one.draw is None and not one.values and self.cases.table is None:
                yield Fault(("parameter", k), "campaign.parameter-does-not-vary", {"key": one.key})
        for name in self.keep.scalars:
            if name in taken:
                yield Fault(("keep", "scalars", name), "campaign.name-taken", {"name": name})
        drawn = [one for one in self.parameter if one.draw is not None]
        grid = [one for one in self.parameter if one.draw is None and one.values]
        if self.cases.method == "sensitivity" and (not drawn or grid or self.base.logs):
            yield Fault(("cases", "method"), "campaign.sensitivity-of-draws")
        if self.cases.table is not None and (drawn or grid or self.base.logs):
            yield Fault(("cases", "table"), "campaign.table-alone")
        varied = drawn if self.base.kind != "outage" else [d for d in drawn if d.draw != "uniform"]
        if self.base.bulk and (varied or grid or self.base.logs or self.cases.table):
            yield Fault(("base", "bulk"), "campaign.bulk-alone")
        if self.base.bulk:
            for place, stated in (
                (("stop",), self.stop is not None),
                (("keep", "curves"), bool(self.keep.curves)),
            ):
                if stated:
                    yield Fault(place, "campaign.not-in-bulk")
        if self.stop is not None and self.cases.method == "sensitivity":
            yield Fault(("stop",), "campaign.sensitivity-whole")
        if self.stop is not None:
            known = {
                "coverage": [one.name for one in self.coverage],
                "rate": [one.name for one in self.rate],
            }
            for key, names in known.items():
                word = getattr(self.stop, key)
                if word is not None and word not in names:
                    data = {"word": word, "known": names}
                    yield Fault(("stop", key), "campaign.unknown-statistic", data)
