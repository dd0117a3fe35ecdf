"""Attitude from Python: one algorithm over a record or sample by sample, and comparisons."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from strapdown import rotation
from strapdown.api.reading import FoundTable, ImuFile, imu_input, imu_of, imu_of_arrays
from strapdown.attitude_algorithms import AttitudeTracker, attitude_history, make_algorithm
from strapdown.attitude_algorithms.algorithm import history_of_samples
from strapdown.attitude_comparison.comparison import (
    AttitudeComparison as AttitudeComparison,
)
from strapdown.attitude_comparison.comparison import (
    initial_attitude,
    run_comparison,
)
from strapdown.attitude_comparison.options import AttitudeOptions as AttitudeOptions
from strapdown.attitude_comparison.references import motion_finding
from strapdown.attitude_comparison.source import magnetic_north
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, DataError, Finding, add_note, add_warning, check_choice
from strapdown.increments import BETWEEN_STAMPS, increments_from_imu
from strapdown.orientation_filters import (
    FILTERS,
    OrientationEstimator,
    OrientationTracker,
    is_filter,
    make_filter,
    run_for_motion,
)
from strapdown.progress import Progress, silent
from strapdown.sensors.magnetometer import (
    MagnetometerCalibration as MagnetometerCalibration,
)
from strapdown.sensors.magnetometer import (
    calibrate_magnetometer as calibrate_magnetometer,
)
from strapdown.sensors.magnetometer import (
    without_iron,
)
from strapdown.sensors.rest import find_rests
from strapdown.systems.inputs import NOWHERE, Memory, moved
from strapdown.tables import ACCEL, EULER, GYRO, MAG, QUATERNION, attitude_table
from strapdown.tables.checks import Array, as_array, check_same_length, view_of
from strapdown.tables.imu import imu_of_columns

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


ANGLES_SD = ["roll_sd", "pitch_sd", "heading_sd"]

#: Median specific force of a body on Earth, m/s²: half and twice gravity.
WEAKEST, STRONGEST = 4.9, 19.6
#: A disturbed field is reported from this share of the time on.
REPORTED = 0.01


class Attitude(FoundTable):
    """Attitude by time: a DataFrame with `rotation` and `findings`.

    Index ``time`` in s; columns ``q_w q_x q_y q_z`` (body to north-east-down, Hamilton, scalar
    first) and ``roll pitch heading`` in deg, which are computed when the table is first used; of a
    filter that states them, standard deviations ``roll_sd pitch_sd heading_sd`` in deg.
    """

    @classmethod
    def _of(cls, time: pd.Index, q_nb: Array) -> Attitude:
        """A table of checked stamps and unit quaternions, with its angles to be computed."""
        table = pd.DataFrame(q_nb, index=time, columns=QUATERNION, copy=False)
        out = cls(table)
        out.__dict__["_quaternions"] = q_nb
        return out

    # A table of pandas is what its manager holds. Angles cost several times what the attitude does,
    # and of many runs nobody looks at them: they join the manager when it is first asked for.
    @property
    def _mgr(self) -> Any:
        # Another thread may ask at the same time: both make the same.
        q_nb = self.__dict__.get("_quaternions")
        if q_nb is not None:
            held = self.__dict__["_held"]
            whole = pd.DataFrame(
                np.hstack([q_nb, rotation.euler_from_quaternion(q_nb)]),
                index=held.axes[1],
                columns=QUATERNION + EULER,
                copy=False,
            )
            self.__dict__["_held"] = whole._mgr
            self.__dict__.pop("_quaternions", None)
        return self.__dict__["_held"]

    @_mgr.setter
    def _mgr(self, manager: Any) -> None:
        self.__dict__["_held"] = manager

    @property
    def _constructor(self) -> type[Attitude]:
        return Attitude

    @property
    def rotation(self) -> Rotation:
        """The attitudes as a scipy Rotation: ``rotation.apply(v_b)`` is ``v_n``."""
        from scipy.spatial.transform import Rotation

        q_nb = self.__dict__.get("_quaternions")
        if q_nb is None:
            q_nb = self[QUATERNION].to_numpy()
        return Rotation.from_quat(np.roll(q_nb, -1, axis=1))


def attitude(
    t: Any,
    gyro: ArrayLike | None = None,
    accel: ArrayLike | None = None,
    mag: ArrayLike | None = None,
    *,
    algorithm: str = "quaternion",
    initial: str | ArrayLike = "auto",
    gyro_bias: str | ArrayLike | None = None,
    sampling: str = "instantaneous",
    interpolation: str = "linear",
    magnetometer: str | MagnetometerCalibration = "auto",
    place: Sequence[float] | None = None,
) -> Attitude:
    """Attitude from gyro samples with one algorithm, or with an orientation filter.

    An algorithm integrates the gyros; the accelerometer is used only for the initial attitude. A
    filter, ``error-state`` or ``complementary``, uses accelerometer and magnetometer throughout.
    Earth rotation (15 deg/h) is neglected.

    Parameters
    ----------
    t : array_like, (n,), s; or Imu, DataFrame, str or Path
        Increasing stamps; or samples of all sensors, and then the next two are omitted.
    gyro : array_like, (n, 3), rad/s
        Body rates, forward-right-down.
    accel : array_like, (n, 3), m/s², optional
        Specific force, forward-right-down. A filter takes rows with NaN as missing samples.
    mag : array_like, (n, 3), optional
        Magnetic field, forward-right-down, in any unit; NaN as in `accel`. For filters only.
    algorithm : str
        A name with its options, such as ``rotvec:samples=3`` or ``error-state:velocity=10``
        (`strapdown modules`), or the name of an installed plug-in (entry points
        ``strapdown.attitude``).
    initial : str or array_like
        ``auto``: leveled if the samples begin stationary with an accelerometer, else zero;
        ``level``; ``zero``; roll, pitch, heading in deg; or a quaternion ``q_nb``. A filter levels
        itself with ``auto`` and ``level``, moving or not.
    gyro_bias : array_like, (3,), rad/s, or str, optional
        Subtracted from the rates; ``rest``: the mean over the first stationary interval.
    sampling : {'instantaneous', 'mean'}
        For arrays: the rate at the stamp, or its mean over the interval that ends there.
    interpolation : {'linear', 'cubic'}
        Interpolation of rates between their stamps.
    magnetometer : {'auto', 'raw'} or MagnetometerCalibration
        Hard and soft iron: removed where the samples themselves show them significantly; left; or
        as `calibrate_magnetometer` found them in another log.
    place : sequence of float, optional
        Latitude and longitude in deg, and height in m if it matters: magnetic headings become true
        ones, by the World Magnetic Model at the date of the log (2025 if its clock has none).

    Returns
    -------
    Attitude
        One row per sample; with `roll_sd`, `pitch_sd`, `heading_sd` in deg if the filter states
        them. Headings of a filter are magnetic with a magnetometer, or true with `place` or the
        filter's option ``declination``; without one they are relative to the start.

    Raises
    ------
    DataError
        The samples cannot be used, or have no stationary interval for leveling or bias.
    ConfigError
        The algorithm or an option is unknown.
    DivergenceError
        The algorithm left the floating-point range.
    """
    if is_filter(algorithm):
        chosen_filter = make_filter(algorithm)
        chosen_filter.check_interpolation(interpolation)
        samples = _filter_samples(t, gyro, accel, mag, sampling)
        chosen_filter, samples, said = _of_field(chosen_filter, samples, magnetometer, place)
        return _filtered(chosen_filter, samples, initial, gyro_bias, said)
    chosen = make_algorithm(algorithm, tuple(FILTERS))
    if mag is not None:
        raise ConfigError("api.magnetometer-needs-filter", quantity="mag", known=FILTERS)
    if gyro is None:
        if isinstance(t, np.ndarray):
            raise ConfigError("api.no-samples", quantity="gyro")
        imu = imu_of(t)
    elif accel is None and not isinstance(gyro_bias, str):
        imu = _gyro_alone(t, gyro, sampling)
    else:
        imu = imu_of_arrays(t, gyro, accel, sampling)
    # Without an accelerometer a rest is not a start, and it takes longer to find than the attitude.
    leveled = set(ACCEL) <= set(imu.columns) or isinstance(gyro_bias, str)
    rests = find_rests(imu) if leveled else ()
    findings = _doubts(imu)
    name = str(imu.attrs.get("source") or "imu")
    if isinstance(initial, str):
        q_nb, start, _ = initial_attitude(initial, imu, rests, findings)
        how = str(start["from"])
    else:
        q_nb, how = _given(initial), "given"
    if gyro_bias is not None:
        bias = _bias(gyro_bias, rests)
        imu = imu.copy()
        imu[GYRO] = imu[GYRO].to_numpy() - bias
    time = np.ascontiguousarray(imu.index.to_numpy(dtype=np.float64))
    check_choice(
        "mechanization.no-interpolation",
        BETWEEN_STAMPS,
        quantity="interpolation",
        interpolation=interpolation,
    )
    mean = imu.attrs["sampling"] == "mean"
    if interpolation == "linear" or mean:
        history = history_of_samples(chosen, time, view_of(imu, GYRO), mean, q_nb)
    else:
        history = attitude_history(chosen, increments_from_imu(imu, interpolation), q_nb)
    out = Attitude._of(imu.index, history)
    out.attrs = {
        "source": name,
        "algorithm": chosen.label,
        "initial": how,
        "findings": (*imu.attrs.get("findings", ()), *findings),
    }
    return out


#: Rates that no person and no vehicle reaches, and those that few reach for a part of a log, rad/s;
#: turn between samples, in the median, that no algorithm follows, rad.
IMPOSSIBLE, FAST, FAST_SHARE, TURN = 100.0, 20.0, 0.05, 1.0
#: Half of the magnitudes of a specific force are this near to gravity, as a share of it, at least
#: of a body that does not move violently.
NEAR_GRAVITY = 0.2
_LOOKED_AT = 2000


def _doubts(imu: pd.DataFrame) -> list[Finding]:
    """Warn of rates and stamps that another unit or order would explain, by some of the samples."""
    rows = slice(None, None, max(1, len(imu) // _LOOKED_AT))
    rates = np.linalg.norm(view_of(imu, GYRO)[rows], axis=1)
    if len(imu) < 2 or not rates.size:
        return []
    if set(ACCEL) <= set(imu.columns):
        force = np.linalg.norm(imu[ACCEL].to_numpy(dtype=np.float64)[rows], axis=1)
        felt = float(np.median(force[np.isfinite(force)])) if np.isfinite(force).any() else math.inf
        lower, middle, upper = np.percentile(rates, [25.0, 50.0, 75.0])
        near = abs(np.array([lower, upper]) / STANDARD_GRAVITY - 1.0) < NEAR_GRAVITY
        if near.all() and felt < WEAKEST:
            data = {"rate": float(middle), "force": felt}
            code = "attitude.gyro-and-accel-exchanged"
            return [Finding(code, quantity="gyro, accel", data=data)]
    time = imu.index.to_numpy(dtype=np.float64)
    step = float(time[-1] - time[0]) / (len(imu) - 1)
    if (turn := float(np.median(rates)) * step) > TURN:
        data = {"turn": math.degrees(turn), "step": step}
        return [Finding("attitude.turn-between-samples", data=data)]
    largest, share = float(rates.max()), float(np.mean(rates > FAST))
    if largest <= IMPOSSIBLE and share <= FAST_SHARE:
        return []
    data = {"largest": largest, "share": 100.0 * share, "fast": FAST}
    return [Finding("attitude.rate-implausible", quantity="gyro", data=data)]


def _gyro_alone(t: Any, gyro: ArrayLike, sampling: str) -> pd.DataFrame:
    """An Imu table of arrays, for this computation alone: it keeps the rates without a copy."""
    stamps, rates = as_array(t, None, "time"), as_array(gyro, 3, "gyro")
    check_same_length(None, time=stamps, gyro=rates)
    return imu_of_columns(np.array(stamps), rates, GYRO, sampling=sampling)


def _filter_samples(
    t: Any, gyro: ArrayLike | None, accel: ArrayLike | None, mag: ArrayLike | None, sampling: str
) -> pd.DataFrame:
    """An Imu table, in which accelerometer and magnetometer may miss samples (NaN)."""
    if gyro is None:
        if isinstance(t, np.ndarray):
            raise ConfigError("api.no-samples", quantity="gyro")
        imu = imu_of(t)
        if isinstance(t, pd.DataFrame) and set(MAG) <= set(t.columns) and mag is None:
            mag = t[MAG].to_numpy(dtype=np.float64)
    else:
        imu = imu_of_arrays(t, gyro, None, sampling)
    for columns, values in ((ACCEL, accel if gyro is not None else None), (MAG, mag)):
        if values is not None:
            sensor = columns[0].partition("_")[0]
            block = as_array(values, 3, sensor)
            check_same_length(None, time=imu.index.to_numpy(), **{sensor: block})
            imu[columns] = block
    return imu


def _of_field(
    chosen: OrientationEstimator,
    imu: pd.DataFrame,
    magnetometer: str | MagnetometerCalibration,
    place: Sequence[float] | None,
) -> tuple[OrientationEstimator, pd.DataFrame, tuple[Finding, ...]]:
    """Prepare filter and samples for the field: iron, declination."""
    given = magnetometer if isinstance(magnetometer, MagnetometerCalibration) else None
    if given is None:
        check_choice(
            "api.unknown-magnetometer",
            ("auto", "raw"),
            quantity="magnetometer",
            magnetometer=str(magnetometer),
        )
    declination, sd, said = 0.0, 0.0, tuple[Finding, ...]()
    if place is not None:
        declination, sd, said = magnetic_north(place, imu)
    if magnetometer != "raw":
        imu, _, of_iron, found = without_iron(imu, given)
        sd, said = math.hypot(sd, of_iron), (*said, *found)
    return chosen.with_heading(declination, sd), imu, said


def _filtered(
    chosen: OrientationEstimator,
    imu: pd.DataFrame,
    initial: str | ArrayLike,
    gyro_bias: str | ArrayLike | None,
    said: Sequence[Finding],
) -> Attitude:
    """Attitude of a filter; `said`: findings so far."""
    name = str(imu.attrs.get("source") or "imu")
    q_nb: ArrayLike | None = None
    how = "leveled by the filter"
    if not isinstance(initial, str):
        q_nb, how = _given(initial), "given"
    elif initial.strip().lower() == "zero":
        q_nb, how = (1.0, 0.0, 0.0, 0.0), "zero"
    else:
        check_choice(
            "api.filter-levels-itself",
            ("auto", "level", "zero"),
            quantity="initial",
            initial=initial.strip().lower(),
        )
    findings = [*said, *_doubts(imu)]
    felt = imu.reindex(columns=ACCEL).dropna()  # a filter refuses a log without them
    force = np.linalg.norm(felt.to_numpy(dtype=np.float64), axis=1)
    if force.size and not WEAKEST < (median := float(np.median(force))) < STRONGEST:
        add_warning(findings, "attitude.no-gravity-in-force", quantity="accel", force=median)
    if gyro_bias is not None:
        bias = _bias(gyro_bias, find_rests(imu) if isinstance(gyro_bias, str) else ())
        imu = imu.copy()
        imu[GYRO] = imu[GYRO].to_numpy() - bias
    asked, (chosen, run) = chosen, run_for_motion(chosen, imu, q_nb)
    if chosen != asked:
        findings.append(motion_finding(chosen, imu))
    if run.disturbed >= REPORTED:
        add_note(findings, "attitude.field-disturbed", quantity=chosen.label, share=run.disturbed)
    out = Attitude(attitude_table(imu.index.to_numpy(), run.q_nb, source=name))
    sd = run.euler_sd()
    if sd is not None:
        out[ANGLES_SD] = sd
    out.attrs = {
        "source": name,
        "algorithm": chosen.label,
        "initial": how,
        "findings": (*imu.attrs.get("findings", ()), *findings),
    }
    return out


def _given(initial: ArrayLike) -> Array:
    """A stated initial attitude: three angles in deg, or a quaternion."""
    values = np.asarray(initial, dtype=np.float64).ravel()
    if values.size == 3 and np.isfinite(values).all():
        return rotation.quaternion_from_euler(values)
    if values.size == 4:
        return rotation.normalise(values)
    raise ConfigError("api.not-an-attitude", quantity="initial", values=values.tolist())


def _bias(gyro_bias: str | ArrayLike, rests: Sequence[Any]) -> Array:
    if isinstance(gyro_bias, str):
        if gyro_bias.lower() != "rest":
            raise ConfigError("api.unknown-gyro-bias", quantity="gyro_bias", gyro_bias=gyro_bias)
        if not rests:
            raise DataError("api.no-rest-for-gyro-bias", quantity="gyro_bias")
        return np.asarray(rests[0].gyro_mean, dtype=np.float64)
    return _three(gyro_bias, "gyro_bias")


def _three(values: ArrayLike, quantity: str) -> Array:
    try:
        found = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (3,) or not all(map(math.isfinite, found.tolist())):
        raise DataError(
            "api.not-three-numbers", quantity=quantity, asarray=np.asarray(values).tolist()
        )
    return found


class OrientationFilter:
    """Attitude sample by sample, as on a device.

    With a filter, ``error-state`` or ``complementary``, accelerometer and magnetometer are used
    throughout, and the body may move from the start. `attitude` with the same algorithm gives
    bitwise the same result: it names the one that it took (``attrs["algorithm"]``), as it finds the
    velocity of the body from the whole record, which here is 0.3 m/s unless it is stated.

    With an algorithm that integrates gyros, roll and pitch are leveled once, from the mean
    specific force of the first `level_samples` samples, over which the body must be stationary;
    heading starts at zero. From then on the gyros are integrated alone: their errors accumulate (a
    bias of 1 deg/min is 1 deg after a minute), and accelerations of the body have no effect.

    Parameters
    ----------
    rate_hz : float
        Sample rate; sample k belongs to the instant ``k / rate_hz``.
    algorithm : str
        As in `attitude`.
    initial : array_like, optional
        Roll, pitch, heading in deg, or a quaternion ``q_nb``; replaces the leveling.
    gyro_bias : array_like, (3,), rad/s
        Subtracted from every sample.
    level_samples : int
        Number of accelerometer samples averaged at the start; a filter does not need them.
    sampling : {'instantaneous', 'mean'}
        Meaning of a gyro sample.
    magnetometer : MagnetometerCalibration, optional
        Applied to every sample of the field; by default they are taken as they are, like `attitude`
        does with ``magnetometer="raw"``.

    Raises
    ------
    ConfigError
        The rate, the algorithm or an option is not valid.
    """

    def __init__(
        self,
        rate_hz: float,
        algorithm: str = "quaternion",
        *,
        initial: ArrayLike | None = None,
        gyro_bias: ArrayLike = (0.0, 0.0, 0.0),
        level_samples: int = 1,
        sampling: str = "instantaneous",
        magnetometer: MagnetometerCalibration | None = None,
    ) -> None:
        if not (np.isfinite(rate_hz) and rate_hz > 0.0):
            raise ConfigError("api.rate-out-of-range", quantity="rate_hz", rate_hz=rate_hz)
        if level_samples < 1:
            raise ConfigError(
                "api.too-few-level-samples", quantity="level_samples", level_samples=level_samples
            )
        self.rate_hz = float(rate_hz)
        self._bias = _three(gyro_bias, "gyro_bias")
        self._sampling = sampling
        self._magnetometer = magnetometer
        self._force = np.zeros(3)
        self._samples = 0
        start = None if initial is None else _given(initial)
        self._tracker: AttitudeTracker | OrientationTracker
        if is_filter(algorithm):
            chosen = make_filter(algorithm)
            self.label, self._level_samples = chosen.label, 0
            self._tracker = OrientationTracker(chosen, start, sampling)
        else:
            self._algorithm = make_algorithm(algorithm, tuple(FILTERS))
            self.label = self._algorithm.label
            self._level_samples = 0 if initial is not None else level_samples
            self._tracker = AttitudeTracker(
                self._algorithm, (1.0, 0.0, 0.0, 0.0) if start is None else start, sampling
            )

    def update(
        self, gyro: ArrayLike, accel: ArrayLike | None = None, mag: ArrayLike | None = None
    ) -> Array:
        """Process one sample.

        Parameters
        ----------
        gyro : array_like, (3,), rad/s
            Body rate, forward-right-down.
        accel : array_like, (3,), m/s², optional
            Specific force. A filter uses every sample, and takes None or NaN as a missing one; an
            algorithm requires it during the leveling, and does not use it afterwards.
        mag : array_like, (3,), optional
            Magnetic field in any unit, for a filter; None or NaN without a new sample.

        Returns
        -------
        ndarray, (4,)
            ``q_nb`` after the sample, body to north-east-down, scalar first.

        Raises
        ------
        DataError
            The sample is not three finite numbers, or its specific force is not that of a
            stationary body during the leveling. The sample is then not processed.
        ConfigError
            `mag` is given, and the algorithm is not a filter.
        """
        rate = _three(gyro, "gyro") - self._bias
        time = self._samples / self.rate_hz
        if isinstance(self._tracker, OrientationTracker):
            if mag is not None and self._magnetometer is not None:
                mag = self._magnetometer.apply(mag)
            self._tracker.update(time, rate, accel, mag)
        elif mag is not None:
            raise ConfigError("api.magnetometer-needs-filter", quantity="mag", known=FILTERS)
        elif self._samples < self._level_samples:
            if accel is None:
                raise DataError(
                    "api.no-specific-force-to-level", row=self._samples + 1, quantity="accel"
                )
            force = self._force + _three(accel, "accel")
            roll, pitch = rotation.level(force / (self._samples + 1))
            tracker = AttitudeTracker(
                self._algorithm, rotation.quaternion_from_euler([roll, pitch, 0.0]), self._sampling
            )
            tracker.update(time, rate)
            self._force, self._tracker = force, tracker
        else:
            self._tracker.update(time, rate)
        self._samples += 1
        return self.quaternion

    @property
    def quaternion(self) -> Array:
        """``q_nb``, (4,), of unit norm."""
        return self._tracker.quaternion

    @property
    def roll_pitch_heading(self) -> Array:
        """3-2-1 Euler angles, (3,), deg."""
        return self._tracker.roll_pitch_heading

    @property
    def roll_pitch_heading_sd(self) -> Array | None:
        """Their standard deviations, (3,), deg; None of an algorithm that states none."""
        tracker = self._tracker
        return tracker.roll_pitch_heading_sd if isinstance(tracker, OrientationTracker) else None

    @property
    def rotation(self) -> Rotation:
        """The attitude as a scipy Rotation: ``rotation.apply(v_b)`` is ``v_n``."""
        from scipy.spatial.transform import Rotation

        return Rotation.from_quat(np.roll(self.quaternion, -1))

    def __repr__(self) -> str:
        roll, pitch, heading = self.roll_pitch_heading
        return (
            f"<OrientationFilter {self.label}, {self.rate_hz:g} Hz: {self._samples} "
            f"samples; roll {roll:.3f}°, pitch {pitch:.3f}°, heading {heading:.3f}°>"
        )


def compare_attitude(
    source: Any,
    algorithms: str | Sequence[str] | None = None,
    *,
    options: AttitudeOptions | None = None,
    progress: Progress = silent,
    **changes: Any,
) -> AttitudeComparison:
    """Compare attitude algorithms at several rates with a reference attitude.

    Parameters
    ----------
    source : Imu, DataFrame, (t, gyro, accel), str or Path, or a sequence of paths and names
        Samples (s, rad/s, m/s², forward-right-down), a log, or the name of a scenario
        (`strapdown modules`). Several paths or names are trials of one question: the first is
        shown, and the answer holds for all.
    algorithms : sequence of str
        Names with their options, such as ``quaternion:order=3``, plug-ins included; or ``all``.
    options : AttitudeOptions, optional
        How to compare and to read.
    progress : callable, optional
        Called with a stage and the completed fraction.
    **changes
        Fields of `AttitudeOptions` that replace those of `options`: ``rates_hz=[100, 50]``,
        ``tolerance_deg=0.5``, ``reference="end same as start"``.

    Raises
    ------
    DataError
        The samples or a reference cannot be used; the message names file, row and remedy.
    ConfigError
        A requested item is unknown, or not available from these samples.

    Notes
    -----
    Alexiev (2021). Earth rotation is neglected, as in the paper: 15 deg/h.
    """
    known = [f.name for f in fields(AttitudeOptions)]
    for name in changes:
        check_choice("api.unknown-option", known, quantity="options", name=name)
    if algorithms is not None:
        changes["algorithms"] = algorithms
    named = source if isinstance(source, list | tuple) else [source]
    if all(isinstance(one, str | Path) for one in named):
        return run_comparison(
            replace(options or AttitudeOptions(), **changes).specify(source), progress
        )
    given = imu_input(source)
    if isinstance(given, ImuFile):
        read = given.log.model_dump(exclude_none=True, exclude={"path"})
        asked = replace(AttitudeOptions(**read, axes=given.axes), **changes)
        if options is not None:
            asked = replace(options, **{**read, "axes": given.axes, **changes})
        return run_comparison(asked.specify(given.log.path), progress)
    memory = Memory({"imu.npz": given})
    with memory.as_files() as folder:
        asked = replace(options or AttitudeOptions(), **changes)
        made = run_comparison(asked.specify(folder / "imu.npz"), progress)
        return replace(
            moved(made, "specification", folder, NOWHERE), on_disk=partial(_on_disk, memory)
        )


@contextmanager
def _on_disk(memory: Memory, result: AttitudeComparison) -> Iterator[AttitudeComparison]:
    with memory.as_files() as folder:
        yield moved(result, "specification", NOWHERE, folder)
