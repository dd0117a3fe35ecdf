"""Fine alignment: a filter over the errors of a mechanization of a stationary body."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from strapdown import rotation
from strapdown.alignment import stationary
from strapdown.alignment.alignment import Alignment, Site
from strapdown.alignment.record_checks import seems_in_deg_per_s
from strapdown.constants import DEG_PER_HOUR, STANDARD_GRAVITY
from strapdown.errors import ConfigError, DataError, DivergenceError, Finding
from strapdown.estimation.covariance import (
    COVARIANCES,
    CovarianceForm,
    Innovations,
    Observation,
    UpdateRule,
)
from strapdown.estimation.error_filter import ErrorFilter, FilterState
from strapdown.estimation.error_model import PHYSICAL, ErrorModel, RotationVectorModel, Segment
from strapdown.estimation.sensor_blocks import resting_states
from strapdown.increments import motion_increments
from strapdown.mechanization import NorthEastDown, run_mechanization
from strapdown.mechanization.mechanization import Mechanization
from strapdown.nav_state import NavState
from strapdown.sensors.uncertainty import ImuUncertainty
from strapdown.tables import ACCEL, EULER, GYRO, MOTION
from strapdown.tables.checks import Array, is_number, source_of, values_of

# Motion of a body on a floor in a town; a smaller one is not assumed.
LEAST = stationary.Standing(
    position=np.full(3, 1e-3),  # m
    velocity=np.full(3, 3e-4),  # m/s
    turn=np.zeros(3),  # rad
)
# Fewer epochs do not determine the motion of the body.
LEAST_EPOCHS = 10

Progress = Callable[[float], None]


@dataclass(frozen=True)
class FineAlignment:
    """Attitude, drifts and biases of a stationary body, by a filter.

    Chernodarov (2009), Eqs. (16)-(18): the measured rate is that of the Earth, the position is
    constant, the velocity is zero. Errors that a rest cannot separate stay correlated in the
    covariance: a tilt and a horizontal accelerometer bias, the heading and an east drift.

    Attributes
    ----------
    mechanization : Mechanization
        Its height free, so that the vertical bias is seen.
    model : type of ErrorModel
    form : CovarianceForm
    rule : UpdateRule, optional
        Weighting of observations; full weight if not given.
    interval : float, s
        From epoch to epoch.
    observe : tuple of str
        Of ``rate``, ``position``, ``velocity``.
    standing : Standing, optional
        Residual motion of the body; estimated from the record, if not given.

    Raises
    ------
    ConfigError
        An option is invalid.
    """

    mechanization: Mechanization = field(default_factory=NorthEastDown)
    model: type[ErrorModel] = RotationVectorModel
    form: CovarianceForm = field(default_factory=COVARIANCES["ud"])
    rule: UpdateRule | None = None
    interval: float = 1.0
    observe: tuple[str, ...] = stationary.OBSERVATIONS
    standing: stationary.Standing | None = None

    def __post_init__(self) -> None:
        if not is_number(self.interval) or not 0.0 < self.interval <= 60.0:
            raise ConfigError(
                "alignment.interval-out-of-range", quantity="interval", interval=self.interval
            )
        unknown = [name for name in self.observe if name not in stationary.OBSERVATIONS]
        if unknown or "velocity" not in self.observe:
            raise ConfigError(
                "alignment.unknown-rest-observation",
                quantity="observe",
                observe=", ".join(self.observe) or "nothing",
                observations=stationary.OBSERVATIONS,
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
            Called with the completed fraction.
        increments : DataFrame, optional
            A MotionIncrements table that covers the record, as a pre-filter makes it; formed of
            `imu`, if not given.

        Raises
        ------
        DataError
            The record is too short or has gaps, the coarse alignment belongs to another instant or
            does not know the heading, or the sensors' errors are beyond a linear filter.
        DivergenceError
            The mechanization has left its range of validity.
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
        steady = stationary.without_steady_turn(rows, earth)
        whole = _free_run(filter_, state, time, steady, source_of(imu))
        home = replace(stationary.home_of(site, begin), q_nb=stationary.attitude_of_rest(whole))
        standing = self.standing
        if standing is None:
            standing = stationary.measured_standing(
                whole, home, int(ends[0]), LEAST, filter_.model.gyro_noise
            )
        state = filter_.begin(start, initial_covariance(filter_, coarse, standing))
        epochs = AlignmentEpochs(filter_)
        epochs.add(state, {})
        at = 0
        for end in ends.tolist():
            state, seen = settled_epoch(
                filter_, state, time[at:end], rows[at:end], home, standing, self.observe
            )
            at = end
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
        """The state at the first sample; an attitude at the last one is propagated back."""
        end = float(increments.index[-1])
        slack = float(increments["dt"].max())
        home = replace(stationary.home_of(site, coarse.time), q_nb=coarse.q_nb)
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
        # The gyro drifts turn the body by as much as the attitude error misplaces the Earth rate: a
        # rest cannot separate them. The backward propagation adds the noise of the gyros.
        C = rotation.dcm_from_quaternion(back.q_nb)
        noise = C * np.square(filter_.model.gyro_noise) @ C.T * abs(last.time - back.time)
        covariance = np.asarray(last.covariance + noise)
        return replace(last, time=back.time, q_nb=back.q_nb, covariance=covariance)

    def _backward(self, end: NavState, increments: pd.DataFrame) -> NavState:
        """The state before the first increment, of a body that is stationary after the last."""
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


# Epochs of a fine alignment: start, and propagation from one to the next.

# Tilt and heading before the filter: much more than a coarse alignment leaves, which comes from the
# same rests and biases and so adds no information to the filter's own.
WIDER = 10.0
LEAST_TILT, LEAST_HEADING = math.radians(0.1), math.radians(1.0)
MOST_TILT, MOST_HEADING = math.radians(5.0), math.radians(20.0)
Seen = dict[str, tuple[Observation, Innovations]]


def settled_epoch(
    filter_: ErrorFilter,
    state: FilterState,
    time: Array,
    rows: Array,
    home: NavState,
    standing: stationary.Standing,
    observe: tuple[str, ...],
) -> tuple[FilterState, Seen]:
    """Propagate over one epoch of a rest and update with its observations at the end."""
    seen: Seen = {}
    if "rate" in observe:
        made: list[Observation] = []

        def turn(segment: Segment) -> Observation:
            made.append(stationary.rate_observation(filter_, segment, home, standing))
            return made[0]

        state, _, innovations = filter_.predict_observing(state, time, rows, turn)
        seen["rate"] = (made[0], innovations)
    else:
        state, _ = filter_.predict(state, time, rows)
    others = stationary.still_observations(filter_, state, home, standing, observe)
    state, _, several = filter_.observe(state, others)
    seen |= {one.name: (one, of) for one, of in zip(others, several, strict=True)}
    return state, seen


def epoch_ends(begin: float, time: Array, interval: float) -> NDArray[np.int64]:
    """Number of steps before the end of each whole interval, (m,)."""
    count = math.floor((float(time[-1]) - begin) / interval + 1e-6)
    wanted = begin + interval * np.arange(1, count + 1)
    half = 0.5 * float(np.median(np.diff(time))) if time.size > 1 else 0.0
    return np.unique(np.searchsorted(time, wanted - half) + 1).clip(max=time.size)


def prior_heading_sd(coarse: Alignment) -> float:
    """Standard deviation of the heading before the first epoch, rad."""
    heading = float(np.sqrt(coarse.covariance[2, 2]))
    if coarse.heading_given:
        return heading
    return min(max(WIDER * heading, LEAST_HEADING), MOST_HEADING)


def initial_covariance(
    filter_: ErrorFilter, coarse: Alignment, standing: stationary.Standing
) -> Array:
    """Covariance of the physical errors before the first epoch, in north-east-down."""
    P = np.zeros((filter_.model.physical_size,) * 2)
    P[0:3, 0:3] = np.diag(standing.position**2)
    P[3:6, 3:6] = np.diag(standing.velocity**2)
    tilt = float(np.sqrt(np.diagonal(coarse.covariance)[:2].max()))
    P[6, 6] = P[7, 7] = min(max(WIDER * tilt, LEAST_TILT), MOST_TILT) ** 2
    P[8, 8] = prior_heading_sd(coarse) ** 2
    at = PHYSICAL
    for block in filter_.model.sensors:
        end = at + len(block.block)
        P[at:end, at:end] = np.diag(block.sd**2)
        at = end
    return P


# Lower bounds of the heading uncertainty of a stationary body, where errors are too large for it.

#: Fraction of the least standard deviation below which a heading is a false claim. Rocking, which
#: points the drifts in other directions, gains less.
CLAIMED = 0.7
#: A body that turns by more than this changes its attitude, and its drifts become observable.
TURNED_DEG = 30.0
#: A heading that moved by more prior standard deviations was wrong before.
BEYOND = 4.0
CLAIMS_DEG_PER_HOUR = math.degrees(3600.0)


def heading_floor_deg(result: FineResult, site: Site) -> float:
    """Least standard deviation of the heading of a stationary body, however long the rest.

    A heading and an east drift look alike, ``b_E = omega cos(lat) psi``, and so the information on
    the heading is the prior information plus that on the drift:
    ``1/s^2 = 1/s_0^2 + (omega cos(lat) / s_E)^2``.

    In deg.
    """
    gyro = np.asarray(result.filter.model.sensors[0].sd[:3], dtype=np.float64)
    east = float(np.linalg.norm(rotation.dcm_from_quaternion(result.alignment.q_nb)[1] * gyro))
    across = float(np.linalg.norm(site.earth_rate[:2]))
    before = 1.0 / math.radians(result.prior_heading_sd_deg) ** 2
    found = (across / east) ** 2 if east > 0.0 else math.inf
    return math.degrees(1.0 / math.sqrt(before + found))


def refuse_false_claims(result: FineResult, site: Site) -> None:
    """Refuse a heading that is stated to be more accurate than the sensors allow.

    A filter is linear: with biases so large that the second order of tilt, heading and bias exceeds
    the noise, it takes that for information.

    Raises DataError.
    """
    heading = result.history["heading"].to_numpy()
    moved = float(heading[-1] - heading[0])
    if result.heading_given and abs(moved) > BEYOND * result.prior_heading_sd_deg:
        raise DataError(
            "alignment.heading-contradicted-by-gyros",
            file=result.source,
            quantity="heading",
            moved=moved,
            prior_heading_sd_deg=result.prior_heading_sd_deg,
        )
    if float(np.ptp(heading[len(heading) // 10 :])) > TURNED_DEG:
        return
    floor = heading_floor_deg(result, site)
    sd = float(result.alignment.sd_deg[2])
    if not sd < CLAIMED * floor:
        return
    gyro = CLAIMS_DEG_PER_HOUR * float(np.max(result.filter.model.sensors[0].sd[:3]))
    raise DataError(
        "alignment.heading-claimed-beyond-gyros",
        file=result.source,
        quantity="heading",
        sd=sd,
        gyro=gyro,
        floor=floor,
    )


# Error messages on the record of a fine alignment that fails.

GAPS = ("mechanization.gap-before-body-did-not", "mechanization.gap-body-did-not-known")


@contextmanager
def telling_record(imu: pd.DataFrame) -> Iterator[None]:
    """Add the remedy at a command to a gap error, and the gyro readings to a divergence.

    `imu`: Imu table that is aligned inside.
    """
    try:
        yield
    except DataError as error:
        f = error.finding
        # The remedy of the mechanization is an argument that an alignment lacks.
        if f.code not in GAPS:
            raise
        raise DataError(f.explains("alignment.gap-in-fine-record", quantity="time")) from None
    except DivergenceError as error:
        f = error.finding
        rate = float(np.linalg.norm(values_of(imu, GYRO).mean(axis=0)))
        raise DivergenceError(
            f.explains(
                "alignment.fine-alignment-diverged",
                file=imu.attrs.get("source"),
                rate_deg=math.degrees(3600.0 * rate),
            )
        ) from None


# Findings of a fine alignment.

#: Code of the finding of a rocking body: harmless, if the coarse alignment allows it.
ROCKS = "alignment.body-rocks"
#: Code of the finding of a bias beyond the data sheet; data `sensor`.
BIASED = "alignment.bias-beyond-data-sheet"
# A heading with a larger standard deviation does not find north.
NO_NORTH = 5.0  # deg
# Ratio to the prior standard deviation above which a quantity is not observable.
UNCHANGED = 0.5
# Upper bounds of the motion of a parked vehicle by people, wind and engine.
MOST_VELOCITY = 0.05  # m/s
MOST_TURN = 0.5  # deg from epoch to epoch
# Ratio to the motion that sensor noise shows for a stationary body.
OVER_NOISE = 3.0
# Mean square of the normalized innovations; the epochs are not all independent.
INCONSISTENT = 3.0


def fine_findings(result: FineResult, site: Site) -> tuple[Finding, ...]:
    """Report assumptions that do not hold, and quantities that the sensors could not determine."""
    return (*_north(result, site), *_stands(result), *_fits(result), *_biases(result))


def _north(result: FineResult, site: Site) -> Iterator[Finding]:
    sd = float(result.alignment.sd_deg[2])
    if sd > min(NO_NORTH, UNCHANGED * result.prior_heading_sd_deg) and not result.heading_given:
        east = float(np.linalg.norm(site.earth_rate[:2])) * DEG_PER_HOUR
        yield Finding(
            "alignment.heading-hardly-observable",
            file=result.source,
            quantity="heading",
            sd=sd,
            lat_deg=site.lat_deg,
            east=east,
        )


def _stands(result: FineResult) -> Iterator[Finding]:
    velocity = float(result.standing.velocity.max())
    turn = float(np.degrees(result.standing.turn.max()))
    model = result.filter.model
    noise = stationary.velocity_of_noise(
        model.gyro_noise, model.accel_noise, result.interval, len(result.history) - 1
    )
    moves = velocity > max(MOST_VELOCITY, OVER_NOISE * noise)
    if not moves and turn > MOST_TURN:
        yield Finding(
            ROCKS,
            file=result.source,
            quantity="rocking",
            turn=turn,
            velocity=velocity,
            in_bound=True,
        )
    elif moves:
        yield Finding(
            "alignment.body-moves-between-epochs",
            file=result.source,
            quantity="time",
            velocity=velocity,
            turn=turn,
        )


def _fits(result: FineResult) -> Iterator[Finding]:
    for name, table in result.innovations.items():
        # The filter settles in the first tenth.
        late = table.iloc[len(table) // 10 :]
        parts = len(table.columns) // 3
        nu, s = late.iloc[:, :parts].to_numpy(), late.iloc[:, parts : 2 * parts].to_numpy()
        share = np.square(nu) / s
        worst = int(share.mean(axis=0).argmax())
        mean = float(share[:, worst].mean())
        if mean > INCONSISTENT:
            at = float(late.index[int(share[:, worst].argmax())])
            yield Finding(
                "alignment.innovations-inconsistent",
                file=result.source,
                quantity=str(table.columns[worst]).removeprefix("nu "),
                name=name,
                mean=mean,
                at=at,
            )


def _biases(result: FineResult) -> Iterator[Finding]:
    gyro, accel = result.filter.model.sensors[:2]
    for block, found, unit, scale in (
        (gyro, result.alignment.gyro_bias, "deg/h", DEG_PER_HOUR),
        (accel, result.alignment.accel_bias, "mg", 1e3 / STANDARD_GRAVITY),
    ):
        assert found is not None
        for axis, value, sd in zip("xyz", found.tolist(), block.sd.tolist(), strict=True):
            if abs(value) > BEYOND * sd:
                sensor = block.block.name.split("_")[0]
                yield Finding(
                    BIASED,
                    file=result.source,
                    quantity=f"{sensor}_{axis}",
                    sensor=sensor,
                    axis=axis,
                    scale=value * scale,
                    unit=unit,
                    sd=sd * scale,
                )


# Result of a fine alignment, epoch by epoch.

BIASES = tuple(f"{sensor}_bias_{axis}" for sensor in ("gyro", "accel") for axis in "xyz")
#: Columns of the history: degrees, rad/s and m/s², and the standard deviation of each.
FINE_COLUMNS = (*EULER, *BIASES, *(f"{name}_sd" for name in (*EULER, *BIASES)))


@dataclass(frozen=True, eq=False)
class FineResult:
    """Result of a fine alignment.

    Attributes
    ----------
    alignment : Alignment
        At the last epoch, with the biases.
    at_start : Alignment
        The same carried back to the first sample by the gyros.
    history : DataFrame
        By time in s, of each epoch: roll, pitch and heading in degrees, biases in rad/s and m/s²,
        and the standard deviation of each (``_sd``).
    innovations : dict of DataFrame
        By name of the observation, by time: ``nu``, ``s`` and ``weight`` of each component, as
        ``nu x, m/s``.
    standing : Standing
        Residual motion of the body.
    interval : float, s
        From epoch to epoch.
    heading_given : bool
        Whether the heading before it is independent of the gyros.
    prior_heading_sd_deg : float, deg
        Assumed standard deviation of the heading before the first epoch.
    filter : ErrorFilter
    state : FilterState
        At the last epoch, for navigation to continue from.
    findings : tuple of Finding
    source : str, optional
    """

    alignment: Alignment
    at_start: Alignment
    history: pd.DataFrame
    innovations: Mapping[str, pd.DataFrame]
    standing: stationary.Standing
    interval: float
    heading_given: bool
    prior_heading_sd_deg: float
    filter: ErrorFilter = field(repr=False)
    state: FilterState = field(repr=False)
    findings: tuple[Finding, ...] = ()
    source: str | None = None


def alignment_of(filter_: ErrorFilter, state: FilterState) -> Alignment:
    """Convert a filter state to an alignment.

    The rotation of the local level with position, 1.6e-7 rad per meter, is negligible beside
    the attitude's own uncertainty and left out.
    """
    here = filter_.mechanization.nav_state(state.mechanization, state.time)
    P = filter_.physical_covariance(state)
    level = filter_.mechanization.level_from_ned(state.row)
    sd = np.sqrt(np.diagonal(P))
    return Alignment(
        method="fine",
        time=state.time,
        q_nb=here.q_nb,
        covariance=level.T @ P[6:9, 6:9] @ level,
        gyro_bias=state.sensors[:3].copy(),
        accel_bias=state.sensors[3:6].copy(),
        gyro_bias_sd=sd[PHYSICAL : PHYSICAL + 3],
        accel_bias_sd=sd[PHYSICAL + 3 : PHYSICAL + 6],
    )


class AlignmentEpochs:
    """Epochs of a run."""

    def __init__(self, filter_: ErrorFilter) -> None:
        self._filter = filter_
        self._time: list[float] = []
        self._rows: list[Array] = []
        self._seen: dict[str, list[tuple[float, Observation, Innovations]]] = {}

    def add(self, state: FilterState, seen: Mapping[str, tuple[Observation, Innovations]]) -> None:
        """Append an epoch."""
        alignment = alignment_of(self._filter, state)
        assert alignment.gyro_bias is not None and alignment.accel_bias is not None
        assert alignment.gyro_bias_sd is not None and alignment.accel_bias_sd is not None
        self._time.append(state.time)
        self._rows.append(
            np.concatenate(
                [
                    alignment.roll_pitch_heading,
                    alignment.gyro_bias,
                    alignment.accel_bias,
                    alignment.sd_deg,
                    alignment.gyro_bias_sd,
                    alignment.accel_bias_sd,
                ]
            )
        )
        for name, (observation, innovations) in seen.items():
            self._seen.setdefault(name, []).append((state.time, observation, innovations))

    def history(self) -> pd.DataFrame:
        """Estimates and their standard deviations, by time."""
        rows = np.array(self._rows)
        # Heading is unwrapped through north: a plot has no jump.
        rows[:, 2] = np.degrees(np.unwrap(np.radians(rows[:, 2])))
        return pd.DataFrame(
            rows, index=pd.Index(self._time, name="time"), columns=list(FINE_COLUMNS)
        )

    def innovations(self) -> dict[str, pd.DataFrame]:
        """Innovations of each observation, by time."""
        tables = {}
        for name, epochs in self._seen.items():
            labels = epochs[0][1].labels
            values = [np.concatenate([i.nu, i.s, i.weight]) for _, _, i in epochs]
            columns = [f"{what} {label}" for what in ("nu", "s", "weight") for label in labels]
            time = pd.Index([at for at, _, _ in epochs], name="time")
            tables[name] = pd.DataFrame(np.array(values), index=time, columns=columns)
        return tables
