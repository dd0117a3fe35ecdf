"""Interface of every aid: its epochs, its observations, its additional states."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown._kernels.compensation import errors_of_states, true_inputs
from strapdown._kernels.level import Q_LB, V_L
from strapdown.ellipsoids import Ellipsoid, find_ellipsoid
from strapdown.errors import ConfigError
from strapdown.estimation.covariance import Observation, UpdateRule
from strapdown.estimation.error_model import PHYSICAL, ErrorModel
from strapdown.estimation.sensor_states import SensorStates
from strapdown.mechanization.mechanization import Mechanization
from strapdown.nav_state import NavState
from strapdown.tables.checks import MAG, Array, is_number


@dataclass(frozen=True, eq=False)
class Epochs:
    """Times and measured values of an aid.

    Attributes
    ----------
    time : ndarray, (n,), s
        On the clock of the inertial sensors, not decreasing.
    values : ndarray, (n, m)
        In the aid's own order.
    """

    time: Array
    values: Array


@dataclass(frozen=True)
class Measurement(ABC):
    """A source of observations; stateless.

    Attributes
    ----------
    name : str
        The user's: two receivers have two names. States and observations are named after it:
        ``rtk.lever_arm``, ``rtk.position``.
    rule : UpdateRule, optional
        Weighting of its observations; the filter's rule, if not given.
    """

    name: str = ""
    rule: UpdateRule | None = None

    kind: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]

    @property
    def wants_steady(self) -> bool:
        """Whether it uses rate and specific force without vibration: `View.steady`."""
        return False

    @property
    def lasts(self) -> bool:
        """Whether it states time-correlated errors and allows for them."""
        return False

    def states(self) -> tuple[SensorStates, ...]:
        """Its states in addition to those of the inertial sensors, named ``name.block``."""
        return ()

    def forgotten(self, since: float, until: float) -> Iterable[tuple[str, float]]:
        """Return states that changed after an instant, s, and by then, unseen.

        Each with the standard deviation of its change, of each element.
        """
        return ()

    @abstractmethod
    def observe(self, view: View, values: Array) -> list[Observation]:
        """Return the observations at one of its epochs; none where it observes nothing.

        Parameters
        ----------
        view : View
            Of the navigator at the instant of the epoch.
        values : ndarray, (m,)
            Row of `Epochs.values`.
        """


#: Units of columns by their names; those of standard deviations end in ``_sd``.
COLUMN_UNITS = {"speed": "m/s", "height": "m", "heading": "deg"}
COLUMN_UNITS |= dict.fromkeys(("vx", "vy", "vz"), "m/s") | dict.fromkeys(MAG, "uT")


@dataclass(frozen=True)
class TabulatedMeasurement(Measurement):
    """An aid with a table of measurements."""

    #: Columns that its table must have; a standard deviation may be an option of the same name.
    columns: ClassVar[tuple[str, ...]] = ()
    #: Units of its columns, where their names do not state them (`COLUMN_UNITS`).
    units: ClassVar[Mapping[str, str]] = MappingProxyType({})
    #: Column from which the first one follows (`converted`), with its unit.
    instead: ClassVar[tuple[str, str] | None] = None
    #: Whether its columns may be in the log of the samples: without a file.
    of_samples: ClassVar[bool] = False
    #: Stream of a recording that has its measurements, of `formats.STREAMS`.
    stream: ClassVar[str] = ""

    @classmethod
    def column_units(cls) -> dict[str, str]:
        """Unit of each column; empty for one that keeps its unit."""
        known = {c: COLUMN_UNITS.get(c.removesuffix("_sd"), "") for c in cls.columns}
        return {**known, **cls.units}

    def converted(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return a file's table with the columns of its kind: of a height, by the pressure.

        Standard deviations that the file lacks are those of the options.
        """
        sds = {c: getattr(self, option) for c, option in self.sd_options().items()}
        missing = {c: sd for c, sd in sds.items() if c not in table}
        return table.assign(**missing) if missing else table

    def sd_options(self) -> dict[str, str]:
        """Fields that state the standard deviations of a file without them, by column."""
        fields = {c: (c, f"{c}_deg") for c in self.columns if c.endswith("_sd")}
        found = {c: [f for f in names if hasattr(self, f)] for c, names in fields.items()}
        return {c: names[0] for c, names in found.items() if names}

    @abstractmethod
    def epochs(self, table: pd.DataFrame) -> Epochs:
        """Return the epochs of a table, without rows that have no values.

        Parameters
        ----------
        table : DataFrame
            By time in s of the clock of the inertial sensors, except for a known offset.

        Raises
        ------
        DataError
            The table is not valid; file, row, quantity and remedy are named.
        """


@dataclass(frozen=True)
class ImuDerivedMeasurement(Measurement):
    """An aid that derives its observations from the inertial sensors."""

    @abstractmethod
    def begin(self) -> Any:
        """Return the state before the first sample; never changed in place."""

    @abstractmethod
    def watch(self, memory: Any, time: Array, rows: Array) -> tuple[Any, Epochs]:
        """Process samples: chunks of any length give the same as the whole.

        Parameters
        ----------
        time : ndarray, (k,), s
            Ends of the steps.
        rows : ndarray, (k, 10)
            Motion increments as the sensors gave them: ``dt``, angle, velocity, distance.

        Returns
        -------
        memory : object
        epochs : Epochs
            Times of observation, at the ends of some of these steps, with their values.
        """


def lasting(aids: Iterable[Measurement]) -> tuple[str, ...]:
    """Return the names of the aids with stated time-correlated errors."""
    return tuple(one.name for one in aids if one.lasts)


# Checks of the options of aids.


def check_number(
    aid: Measurement,
    name: str,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    above: bool = False,
) -> None:
    """Refuse an option that is not a number within limits.

    Parameters
    ----------
    name : str
        Of the option.
    above : bool
        Whether it must be more than `low`.
    """
    value = getattr(aid, name)
    good = is_number(value) and math.isfinite(value) and low <= value <= high
    if not good or (above and value == low):
        if high < math.inf:
            code = "navigation.option-not-between"
        elif low == -math.inf:
            code = "navigation.option-not-finite"
        else:
            code = "navigation.option-not-above" if above else "navigation.option-below"
        raise ConfigError(
            code, file=aid.name or None, quantity=name, value=value, least=low, most=high
        )


def check_numbers(aid: Measurement, name: str, count: int, *, low: float = -math.inf) -> None:
    """Refuse an option that is not a given count of finite numbers; return a tuple of float."""
    value = getattr(aid, name)
    try:
        given = list(value)
    except TypeError:
        given = []
    if len(given) != count or not all(
        is_number(x) and math.isfinite(x) and x >= low for x in given
    ):
        raise ConfigError(
            "navigation.no-numbers" if low == -math.inf else "navigation.no-numbers-from",
            file=aid.name or None,
            quantity=name,
            value=value,
            count=count,
            least=low,
        )
    object.__setattr__(aid, name, tuple(float(x) for x in given))


def check_block(view: View, name: str) -> None:
    """Refuse a block of states that the filter lacks."""
    view.model.layout[name]


def check_other_name(aid: Measurement, name: str) -> None:
    """Refuse an option that is not the name of another aid; empty is allowed.

    Parameters
    ----------
    name : str
        Of the option.
    """
    value = getattr(aid, name)
    if not isinstance(value, str) or (value and value == aid.name):
        raise ConfigError(
            "navigation.other-aid-name-invalid", file=aid.name or None, quantity=name, value=value
        )


# State of a navigator as an aid sees it at an epoch.


#: Columns of the physical errors: displacement, velocity, rotation.
DISPLACEMENT, VELOCITY, ROTATION = slice(0, 3), slice(3, 6), slice(6, 9)


@dataclass(frozen=True, eq=False)
class View:
    """Computed state, and motion of the body, at an epoch.

    Attributes
    ----------
    time : float, s
    state : ndarray
        Of the mechanization.
    row : ndarray
        Of a history: the same instant.
    sensors : ndarray, (k,)
        Estimates of the errors of the sensors, in the order of the model's `sensors`.
    rate : ndarray, (3,), rad/s
        Of the body relative to inertial space, body axes: the mean over the step that ends here,
        with the estimated errors subtracted.
    force : ndarray, (3,), m/s²
        Specific force, the same.
    covariance_of : callable, optional
        Returns the covariance of the physical errors at this instant; computed on demand.
    steady : ndarray, (6,), optional
        Rate and force as fading means over some tenths of a second, as the sensors gave them, in
        the present body axes; for an aid that uses them (`Aid.wants_steady`).
    unobserved : float, s
        Time since the last observation.
    corrected : ndarray, (3,), m/s
        What the latest updates corrected the velocity by, north-east-down: a fading sum over some
        seconds, for an aid that wants `steady`.
    kept : dict of str to ndarray
        What aids keep from epoch to epoch, by names of theirs; arrays are replaced, never changed.
    """

    mechanization: Mechanization
    model: ErrorModel
    time: float
    state: Array
    row: Array
    sensors: Array
    rate: Array
    force: Array
    covariance_of: Callable[[], Array] | None = None
    steady: Array | None = None
    unobserved: float = 0.0
    corrected: Array = field(default_factory=lambda: np.zeros(3))
    kept: dict[str, Array] = field(default_factory=dict)

    @cached_property
    def covariance(self) -> Array:
        """Of the physical errors, level axes, (columns, columns); zero if unknown."""
        if self.covariance_of is None:
            return np.zeros((self.columns, self.columns))
        return self.covariance_of()

    @cached_property
    def level(self) -> Array:
        """Level row of this instant, (14,): `_kernels.level`."""
        level: Array = self.mechanization.levels(self.row[None, :])[0]
        return level

    @cached_property
    def here(self) -> NavState:
        """Position, velocity and attitude."""
        return self.mechanization.nav_state(self.state, self.time)

    @cached_property
    def ellipsoid(self) -> Ellipsoid:
        """Ellipsoid of the mechanization."""
        return find_ellipsoid(self.mechanization.ellipsoid)

    @cached_property
    def C_lb(self) -> Array:  # noqa: N802
        """Body to level axes, (3, 3)."""
        return rotation.dcm_from_quaternion(self.level[Q_LB : Q_LB + 4])

    @cached_property
    def C_ln(self) -> Array:  # noqa: N802
        """North-east-down to level axes, (3, 3)."""
        return self.mechanization.level_from_ned(self.row)

    @cached_property
    def velocity(self) -> Array:
        """Relative to the Earth, level axes, (3,), m/s."""
        return self.level[V_L : V_L + 3]

    @property
    def columns(self) -> int:
        """Number of the physical errors: columns of an observation's H."""
        return self.model.physical_size

    def has(self, name: str) -> bool:
        """Whether the filter has a block of states of this name."""
        return name in self.model.layout

    def place(self, name: str) -> slice:
        """Columns of a block of states of the sensors or of an aid."""
        return self.model.columns_of[name]

    def labels(self, name: str) -> tuple[str, ...]:
        """Labels of a block of states."""
        return next(s.block.labels for s in self.model.sensors if s.block.name == name)

    def without_errors(self, readings: Array) -> Array:
        """Measured rate and specific force, (6,), with the estimated errors subtracted."""
        stacked, errors, out = self.model.stacked, np.empty((2, 7, 3)), np.empty(6)
        errors_of_states(stacked.gyro_terms, self.sensors, errors[0])
        errors_of_states(stacked.accel_terms, self.sensors, errors[1])
        true_inputs(readings, errors[0], errors[1], out)
        return out

    def estimate(self, name: str) -> Array:
        """Estimate of a block: error of the assumed value, as its block is defined."""
        at = self.place(name)
        return self.sensors[at.start - PHYSICAL : at.stop - PHYSICAL]


# Time-correlated errors in a filter that takes observations as independent.


def longer_by(interval: float, correlation_time: float) -> float:
    """Return the variance of the mean of correlated errors relative to independent ones.

    Parameters
    ----------
    interval : float, s
        Between observations.
    correlation_time : float, s
        Zero: errors are new each time.

    Returns
    -------
    float
        ``(1 + rho) / (1 - rho)``, ``rho = exp(-interval / correlation_time)``: ratio of the
        variance of the mean of many to that of independent ones.
    """
    if correlation_time == 0.0:
        return 1.0
    rho = math.exp(-interval / correlation_time)
    return (1.0 + rho) / (1.0 - rho)
