"""Fine alignment: a filter over the errors of a mechanization of a body that stands still."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment.alignment import Alignment
from strapdown.alignment.claims import refuse_false_claims
from strapdown.alignment.fine_epochs import (
    MOST_HEADING,
    epoch_ends,
    initial_covariance,
    prior_heading_sd,
    settled,
)
from strapdown.alignment.fine_findings import fine_findings
from strapdown.alignment.fine_record import telling_record
from strapdown.alignment.fine_result import Epochs, FineResult, alignment_of
from strapdown.alignment.north import seems_in_deg_per_s
from strapdown.alignment.site import Site
from strapdown.alignment.stationary import (
    OBSERVATIONS,
    Standing,
    attitude_of_rest,
    home_of,
    measured_standing,
    without_steady_turn,
)
from strapdown.constants import DEG_PER_HOUR
from strapdown.errors import ConfigError, DataError, DivergenceError
from strapdown.estimation.covariance import CovarianceForm
from strapdown.estimation.covariances import COVARIANCES
from strapdown.estimation.error_filter import ErrorFilter
from strapdown.estimation.error_model import ErrorModel, Segment
from strapdown.estimation.filter_state import FilterState
from strapdown.estimation.resting_sensors import resting_states
from strapdown.estimation.rotation_vector_model import RotationVectorModel
from strapdown.estimation.update_rule import UpdateRule
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, run_mechanization
from strapdown.mechanization.mechanization import Mechanization
from strapdown.nav_state import NavState
from strapdown.sensors.imu_uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, GYRO, MOTION
from strapdown.tables.checks import is_number, source_of, values_of

__all__ = ["FineAlignment"]

Array = NDArray[np.float64]

# A body on a floor in a town moves by so much; less is not claimed.
LEAST = Standing(
    position=np.full(3, 1e-3),  # m
    velocity=np.full(3, 3e-4),  # m/s
    turn=np.zeros(3),  # rad
)
# Fewer epochs tell nothing of how still a body stands.
LEAST_EPOCHS = 10

Progress = Callable[[float], None]


@dataclass(frozen=True)
class FineAlignment:
    """Attitude, drifts and biases of a body at rest, with what cannot be known of them.

    Chernodarov (2009), Eqs. (16)-(18): the turn that is measured is that of the Earth, the place
    stays, the velocity is zero. What no rest can tell apart stays apart in the covariance: a tilt
    from a horizontal accelerometer bias, the heading from an east drift.

    Attributes
    ----------
    mechanization : Mechanization
        Its height free, so that the vertical bias is seen.
    model : type of ErrorModel
    form : CovarianceForm
    rule : UpdateRule, optional
        How far an observation is believed; without one, all of it.
    interval : float, s
        From epoch to epoch.
    observe : tuple of str
        Of ``rate``, ``position``, ``velocity``.
    standing : Standing, optional
        How still the body stands; found from the record, if not given.

    Raises
    ------
    ConfigError
        An option means nothing.
    """

    mechanization: Mechanization = field(default_factory=NorthEastDown)
    model: type[ErrorModel] = RotationVectorModel
    form: CovarianceForm = field(default_factory=COVARIANCES["ud"])
    rule: UpdateRule | None = None
    interval: float = 1.0
    observe: tuple[str, ...] = OBSERVATIONS
    standing: Standing | None = None

    def __post_init__(self) -> None:
        if not is_number(self.interval) or not 0.0 < self.interval <= 60.0:
            raise ConfigError(
                "alignment.interval-out-of-range", quantity="interval", interval=self.interval
            )
        unknown = [name for name in self.observe if name not in OBSERVATIONS]
        if unknown or "velocity" not in self.observe:
            raise ConfigError(
                "alignment.unknown-rest-observation",
                quantity="observe",
                observe=", ".join(self.observe) or "nothing",
                observations=OBSERVATIONS,
            )
        if self.mechanization.height == "damped":
            raise ConfigError("alignment.height-damped", quantity="height")

    def align(
        self,
        imu: pd.DataFrame,
        site: Site,
        sensors: ImuUncertainty,
        coarse: Alignment,
        progress: Progress | None = None,
        increments: pd.DataFrame | None = None,
    ) -> FineResult:
        """Align.

        Parameters
        ----------
        imu : DataFrame
            Imu table of the rest; it begins or ends where the coarse alignment holds.
        site : Site
        sensors : ImuUncertainty
        coarse : Alignment
            The attitude at the first or at the last sample, within 20 deg of the truth.
        progress : callable, optional
            Told the share that is done.
        increments : DataFrame, optional
            A MotionIncrements table that covers the record, as a pre-filter makes it; formed of
            `imu`, if not given.

        Returns
        -------
        FineResult

        Raises
        ------
        DataError
            The record is too short or has gaps, the coarse alignment belongs to another instant or
            does not know the heading, or the sensors' errors are beyond a linear filter.
        DivergenceError
            The mechanization has left the range in which it means anything.
        """
        _check_coarse(coarse, imu, site)
        increments = motion_increments(imu) if increments is None else _within(increments, imu)
        begin = float(increments.index[0] - increments["dt"].iloc[0])
        with telling_record(imu):
            return self._run(imu, increments, begin, site, sensors, coarse, progress)

    def _run(
        self,
        imu: pd.DataFrame,
        increments: pd.DataFrame,
        begin: float,
        site: Site,
        sensors: ImuUncertainty,
        coarse: Alignment,
        progress: Progress | None,
    ) -> FineResult:
        start = self._start(increments, site, coarse, begin)
        force = imu[ACCEL].to_numpy(dtype=np.float64).mean(axis=0)
        rate = imu[GYRO].to_numpy(dtype=np.float64).mean(axis=0)
        filter_ = ErrorFilter(
            self.mechanization,
            self.model(
                gyro_noise=sensors.gyro.axis("noise_density"),
                accel_noise=sensors.accel.axis("noise_density"),
                sensors=resting_states(sensors, rate, force),
            ),
            self.form,
            self.rule,
            rests=True,
        )
        rows = values_of(increments, MOTION)
        time = increments.index.to_numpy(dtype=np.float64)
        ends = epoch_ends(begin, time, self.interval)
        if ends.size < LEAST_EPOCHS:
            raise DataError(
                "alignment.too-few-epochs",
                file=source_of(imu),
                quantity="time",
                time=time[-1] - begin,
                size=ends.size,
                interval=self.interval,
                least_epochs=LEAST_EPOCHS * self.interval,
            )
        state = filter_.begin(start, np.zeros((filter_.model.physical_size,) * 2))
        earth = rotation.rotate(rotation.conjugate(start.q_nb), site.earth_rate)
        steady = without_steady_turn(rows, earth)
        whole = _free_run(filter_, state, time, steady, source_of(imu))
        home = replace(home_of(site, begin), q_nb=attitude_of_rest(whole))
        standing = self.standing
        if standing is None:
            standing = measured_standing(whole, home, int(ends[0]), LEAST, filter_.model.gyro_noise)
        state = filter_.begin(start, initial_covariance(filter_, coarse, standing))
        epochs = Epochs(filter_)
        epochs.add(state, {})
        run = settled(filter_, state, time, rows, ends, home, standing, self.observe)
        for after, seen in run:
            state = after
            epochs.add(state, seen)
            if progress is not None:
                progress((state.time - begin) / (float(time[-1]) - begin))
        used = slice(0, int(ends[-1]))
        result = FineResult(
            alignment=alignment_of(filter_, state),
            at_start=self._carried_back(filter_, state, increments.iloc[used]),
            history=epochs.history(),
            innovations=epochs.innovations(),
            standing=standing,
            interval=self.interval,
            heading_given=coarse.heading_given,
            prior_heading_sd_deg=math.degrees(prior_heading_sd(coarse)),
            filter=filter_,
            state=state,
            source=source_of(imu),
        )
        refuse_false_claims(result, site)
        return replace(result, findings=fine_findings(result, site))

    def _start(
        self, increments: pd.DataFrame, site: Site, coarse: Alignment, begin: float
    ) -> NavState:
        """The state at the first sample; an attitude at the last one is carried back."""
        end = float(increments.index[-1])
        slack = float(increments["dt"].max())
        home = replace(home_of(site, coarse.time), q_nb=coarse.q_nb)
        if abs(coarse.time - begin) <= slack:
            return replace(home, time=begin)
        if abs(coarse.time - end) <= slack:
            back = self._backward(replace(home, time=end), increments)
            return replace(home, time=begin, q_nb=back.q_nb)
        raise DataError(
            "alignment.coarse-alignment-at-other-instant",
            file=source_of(increments),
            quantity="time",
            time=coarse.time,
            begin=begin,
            end=end,
        )

    def _carried_back(
        self, filter_: ErrorFilter, state: FilterState, increments: pd.DataFrame
    ) -> Alignment:
        """The attitude at the first sample, by the gyros without their drifts."""
        clean = increments.copy()
        clean[list(MOTION)] = filter_.compensated(state, values_of(increments, MOTION))
        clean.attrs = dict(increments.attrs)
        last = alignment_of(filter_, state)
        end = filter_.mechanization.nav_state(state.mechanization, state.time)
        back = self._backward(replace(end, v_n=np.zeros(3)), clean)
        # Drifts that no rest can tell turn the body by as much as the attitude misplaces the rate
        # of the Earth; what the carrying adds is the noise of the gyros.
        C = rotation.dcm_from_quaternion(back.q_nb)
        noise = C * np.square(filter_.model.gyro_noise) @ C.T * abs(last.time - back.time)
        covariance = np.asarray(last.covariance + noise)
        return replace(last, time=back.time, q_nb=back.q_nb, covariance=covariance)

    def _backward(self, end: NavState, increments: pd.DataFrame) -> NavState:
        """The state before the first increment, of a body that stands after the last."""
        held = replace(self.mechanization, height="held")
        return run_mechanization(held, end, increments, backward=True).end


def _free_run(
    filter_: ErrorFilter, state: FilterState, time: Array, rows: Array, source: str | None
) -> Segment:
    """The whole record without observations."""
    try:
        return filter_.predict(state, time, rows)[1]
    except DivergenceError as error:
        rate = rows[:, 1:4] / rows[:, :1]
        away = np.abs(rate - np.median(rate, axis=0))
        row, axis = (int(k) for k in np.unravel_index(int(away.argmax()), away.shape))
        raise DataError(
            "alignment.record-not-stationary",
            file=source,
            row=row + 1,
            quantity=GYRO[axis],
            rate_deg=np.degrees(rate[row, axis]),
            time=time[row],
            deg_per_hour=DEG_PER_HOUR * float(np.linalg.norm(rate.mean(axis=0))),
        ) from error


def _check_coarse(coarse: Alignment, imu: pd.DataFrame, site: Site) -> None:
    sd = math.degrees(math.sqrt(coarse.covariance[2, 2]))
    if not sd <= math.degrees(MOST_HEADING):
        raise DataError(
            "alignment.coarse-heading-too-uncertain-gyros-in-deg-per-s"
            if seems_in_deg_per_s(values_of(imu, GYRO).mean(axis=0), site)
            else "alignment.coarse-heading-too-uncertain",
            file=source_of(imu),
            quantity="heading",
            method=coarse.method,
            sd_deg=sd,
            most_deg=math.degrees(MOST_HEADING),
        )


def _within(increments: pd.DataFrame, imu: pd.DataFrame) -> pd.DataFrame:
    """The steps that end after the first sample and no later than the last one."""
    half = 0.5 * float(increments["dt"].median())
    ends = increments.index.to_numpy(dtype=np.float64)
    first, last = float(imu.index[0]), float(imu.index[-1])
    part: pd.DataFrame = increments[(ends > first + half) & (ends < last + half)]
    part.attrs = dict(imu.attrs)
    if part.empty:
        raise DataError(
            "alignment.increments-outside-record",
            file=source_of(imu),
            quantity="increments",
            first=first,
            last=last,
        )
    return part
