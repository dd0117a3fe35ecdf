"""Noise of a sensor in the parameters and units of other programs' filters."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError
from strapdown.sensors.catalogue import ALLAN_OF_GAUSS_MARKOV
from strapdown.sensors.triad_errors import ImuErrors, Triad, TriadErrors, triad_of

DEG, G, MGAL = math.pi / 180.0, STANDARD_GRAVITY, 1e-5
HOUR, ROOT_HOUR = 3600.0, 60.0  # s, √s

#: Quantities of a triad in SI, u being rad/s or m/s²: of `TriadErrors`, and two that follow.
#: "drive" is the density of the white noise that drives the bias, u/√s: of a random walk K and a
#: Gauss-Markov process of standard deviation s and correlation time T together √(K² + 2 s²/T).
QUANTITIES = ("noise_density", "random_walk", "bias_instability", "correlation_time", "drive")


@dataclass(frozen=True)
class Entry:
    """One parameter of a program.

    Attributes
    ----------
    name : str
        As its manual or configuration file spells it.
    triad : {'gyro', 'accel'}
    quantity : str
        One of `QUANTITIES`.
    factor : float
        The parameter is ``factor · quantity^power · dt^step``, dt being the sample interval in s,
        of PX4 that of its filter.
    unit : str
    power : int
        1 for a density or standard deviation, 2 for a covariance.
    step : float
        0 in continuous time.
    """

    name: str
    triad: str
    quantity: str
    factor: float
    unit: str
    power: int = 1
    step: float = 0.0


@dataclass(frozen=True)
class Target:
    """A program, where its parameters are defined, and the parameters."""

    title: str
    source: str
    entries: tuple[Entry, ...]
    note: str = ""


def _both(
    names: tuple[str, str, str, str], units: tuple[str, str, str, str], power: int = 1
) -> tuple[Entry, ...]:
    """White noise and driving noise of gyros and accelerometers in SI and continuous time."""
    kinds = [(triad, q) for q in ("noise_density", "drive") for triad in ("gyro", "accel")]
    rows = zip(names, kinds, units, strict=True)
    return tuple(Entry(name, *kind, 1.0, unit, power) for name, kind, unit in rows)


_I2NAV = (
    Entry("arw", "gyro", "noise_density", ROOT_HOUR / DEG, "deg/sqrt(hr)"),
    Entry("vrw", "accel", "noise_density", ROOT_HOUR, "m/s/sqrt(hr)"),
    Entry("gbstd", "gyro", "bias_instability", HOUR / DEG, "deg/hr"),
    Entry("abstd", "accel", "bias_instability", 1.0 / MGAL, "mGal"),
    Entry("corrtime", "gyro", "correlation_time", 1.0 / HOUR, "hr"),
)
_ONE_TIME = (
    "corrtime is one number for both triads: that of the gyros, or of the accelerometers where the "
    "gyros have none; the standard deviation of the other triad keeps its driving noise"
)

TARGETS: dict[str, Target] = {
    "strapdown": Target(
        "this package",
        "docs/sensors.md",
        tuple(
            Entry(f"{triad}.{name}", triad, name, 1.0, unit if name != "correlation_time" else "s")
            for triad, u in (("gyro", "rad/s"), ("accel", "m/s²"))
            for name, unit in (
                ("noise_density", f"{u}/√Hz"),
                ("random_walk", f"{u}/√s"),
                ("bias_instability", u),
                ("correlation_time", "s"),
            )
        ),
        "bias_instability is the standard deviation of a Gauss-Markov process",
    ),
    "data-sheet": Target(
        "data-sheet units",
        "IEEE Std 952-1997, annex C; bias instability is the flat minimum of the Allan deviation",
        (
            Entry("angle random walk", "gyro", "noise_density", ROOT_HOUR / DEG, "deg/√h"),
            Entry("rate noise density", "gyro", "noise_density", 1.0 / DEG, "deg/s/√Hz"),
            Entry(
                "bias instability",
                *("gyro", "bias_instability"),
                ALLAN_OF_GAUSS_MARKOV * HOUR / DEG,
                "deg/h",
            ),
            Entry(
                "rate random walk",
                *("gyro", "random_walk"),
                HOUR * ROOT_HOUR / DEG,
                "deg/h/√h",
            ),
            Entry("velocity random walk", "accel", "noise_density", ROOT_HOUR, "m/s/√h"),
            Entry("noise density", "accel", "noise_density", 1e6 / G, "µg/√Hz"),
            Entry(
                "bias instability",
                "accel",
                "bias_instability",
                ALLAN_OF_GAUSS_MARKOV * 1e6 / G,
                "µg",
            ),
            Entry("acceleration random walk", "accel", "random_walk", 1e6 * ROOT_HOUR / G, "µg/√h"),
        ),
    ),
    "KF-GINS": Target(
        "KF-GINS",
        "i2Nav-WHU/KF-GINS, dataset/kf-gins.yaml: imunoise, with its units",
        _I2NAV,
        f"{_ONE_TIME}; gbstd and abstd are of a Gauss-Markov process",
    ),
    "OB_GINS": Target(
        "OB_GINS",
        "i2Nav-WHU/OB_GINS, config/ob_gins.yaml: imumodel, with its units",
        _I2NAV,
        f"{_ONE_TIME}; gbstd and abstd are of a Gauss-Markov process",
    ),
    "GTSAM": Target(
        "GTSAM, PreintegrationCombinedParams",
        "borglab/gtsam, gtsam/navigation/doc/PreintegrationParams.ipynb and "
        "PreintegrationCombinedParams.ipynb: covariances in continuous time",
        _both(
            (
                "gyroscopeCovariance",
                "accelerometerCovariance",
                "biasOmegaCovariance",
                "biasAccCovariance",
            ),
            ("(rad/s)²/Hz", "(m/s²)²/Hz", "(rad/s)²/s", "(m/s²)²/s"),
            power=2,
        ),
        "each is the diagonal of a 3x3 matrix",
    ),
    "kalibr": Target(
        "kalibr",
        "ethz-asl/kalibr, wiki, IMU Noise Model: densities in continuous time",
        _both(
            (
                "gyroscope_noise_density",
                "accelerometer_noise_density",
                "gyroscope_random_walk",
                "accelerometer_random_walk",
            ),
            ("rad/s/√Hz", "m/s²/√Hz", "rad/s²/√Hz", "m/s³/√Hz"),
        ),
        "one number for three axes: take the largest",
    ),
    "ORB-SLAM3": Target(
        "ORB-SLAM3",
        "UZ-SLAMLab/ORB_SLAM3, Examples_old/Monocular-Inertial/RealSense_D435i.yaml: "
        "rad/s^0.5, m/s^1.5, rad/s^1.5, m/s^2.5",
        _both(
            ("IMU.NoiseGyro", "IMU.NoiseAcc", "IMU.GyroWalk", "IMU.AccWalk"),
            ("rad/√s", "m/s^1.5", "rad/s^1.5", "m/s^2.5"),
        ),
        "one number for three axes: take the largest",
    ),
    "robot_localization": Target(
        "robot_localization, by sensor_msgs/Imu",
        "ROS, sensor_msgs/Imu.msg: covariances of each reading, rad/s and m/s²",
        (
            Entry(
                "angular_velocity_covariance",
                *("gyro", "noise_density", 1.0, "(rad/s)²"),
                power=2,
                step=-1.0,
            ),
            Entry(
                "linear_acceleration_covariance",
                *("accel", "noise_density", 1.0, "(m/s²)²"),
                power=2,
                step=-1.0,
            ),
        ),
        "each is the diagonal of a 3x3 matrix; the filter has no states of sensor biases",
    ),
    "PX4": Target(
        "PX4 EKF2",
        "PX4/PX4-Autopilot, src/modules/ekf2/params_gyro_bias.yaml and EKF/covariance.cpp: a "
        "standard deviation for each step of the filter, of the bias times the step",
        (
            Entry("EKF2_GYR_NOISE", "gyro", "noise_density", 1.0, "rad/s", step=-0.5),
            Entry("EKF2_ACC_NOISE", "accel", "noise_density", 1.0, "m/s²", step=-0.5),
            Entry("EKF2_GYR_B_NOISE", "gyro", "drive", 1.0, "rad/s²", step=-0.5),
            Entry("EKF2_ACC_B_NOISE", "accel", "drive", 1.0, "m/s³", step=-0.5),
        ),
        "the step is that of the filter, EKF2_PREDICT_US, 10 ms; its defaults are larger, as they "
        "stand for vibration, too",
    ),
    "NaveGo": Target(
        "NaveGo",
        "rodralez/NaveGo, conversions/imu_si_errors.m, its help: manufacturer units",
        (
            Entry("arw", "gyro", "noise_density", ROOT_HOUR / DEG, "deg/root(hour)"),
            Entry("vrw", "accel", "noise_density", ROOT_HOUR, "m/s/root(hour)"),
            Entry("arrw", "gyro", "random_walk", ROOT_HOUR / DEG, "deg/root(hour)/s"),
            Entry("vrrw", "accel", "random_walk", ROOT_HOUR, "m/s/root(hour)/s"),
            Entry("gb_dyn", "gyro", "bias_instability", 1.0 / DEG, "deg/s"),
            Entry("ab_dyn", "accel", "bias_instability", 1e3 / 9.80665, "mg"),
            Entry("gb_corr", "gyro", "correlation_time", 1.0, "s"),
            Entry("ab_corr", "accel", "correlation_time", 1.0, "s"),
        ),
    ),
    "PSINS": Target(
        "PSINS",
        "PSINS toolbox, imuerrset, its help",
        (
            Entry("web", "gyro", "noise_density", ROOT_HOUR / DEG, "deg/sqrt(h)"),
            Entry("wdb", "accel", "noise_density", 1e6 / G, "ug/sqrt(Hz)"),
            Entry("sqrtR0G", "gyro", "bias_instability", HOUR / DEG, "deg/h"),
            Entry("TauG", "gyro", "correlation_time", 1.0, "s"),
            Entry("sqrtR0A", "accel", "bias_instability", 1e6 / G, "ug"),
            Entry("TauA", "accel", "correlation_time", 1.0, "s"),
        ),
    ),
}

#: Step of PX4's filter, s.
PX4_STEP = 0.01


def target_of(name: str) -> tuple[str, Target]:
    """Return a target by its name in any case, with the name as it is spelled.

    ConfigError: it is unknown; the message lists the known.
    """
    for key, target in TARGETS.items():
        if key.lower() == name.lower():
            return key, target
    raise ConfigError("allan.unknown", quantity="target", word=name, known=tuple(TARGETS))


def for_program(errors: ImuErrors, name: str, dt: float, span: float) -> dict[Entry, Triad]:
    """Return the noise of a sensor as the parameters of a program, for x, y, z.

    Parameters
    ----------
    errors : ImuErrors
        Gyro in rad/s, accelerometer in m/s².
    name : str
        One of `TARGETS`.
    dt : float, s
        Sample interval of the log that the program is given.
    span : float, s
        For a program without random walks one is a Gauss-Markov process with this correlation time,
        unless the sensor has one, and the same driving noise: of standard deviation K √(T/2).

    Returns
    -------
    dict
        By entry, without those of a missing triad; a quantity that the sensor does not have is 0,
        an infinite correlation time inf.
    """
    name, target = target_of(name)
    dt = PX4_STEP if name == "PX4" else dt
    walks = any(entry.quantity in ("random_walk", "drive") for entry in target.entries)
    if any(entry.name == "corrtime" for entry in target.entries):
        errors = _at_one_time(errors, span)
    out: dict[Entry, Triad] = {}
    for entry in target.entries:
        triad = errors.gyro if entry.triad == "gyro" else errors.accel
        if triad is not None:
            triad = triad if walks else _without_walk(triad, span)
            values = _quantity(triad, entry.quantity)
            out[entry] = triad_of(
                [entry.factor * value**entry.power * dt**entry.step for value in values]
            )
    return out


def _without_walk(triad: TriadErrors, span: float) -> TriadErrors:
    if not any(triad.axis("random_walk")):
        return triad
    time = min(triad.correlation_time, span)
    return _at_time(triad, time, time)


def _at_one_time(errors: ImuErrors, span: float) -> ImuErrors:
    """Slow terms of both triads with one correlation time, each with its driving noise."""
    both = [t for t in (errors.gyro, errors.accel) if t is not None]
    slow = [t for t in both if any(t.axis("random_walk")) or any(t.axis("bias_instability"))]
    if not slow:
        return errors
    times = [t.correlation_time for t in slow if math.isfinite(t.correlation_time)]
    common = times[0] if times else span

    def at_common(triad: TriadErrors) -> TriadErrors:
        own = triad.correlation_time
        return _at_time(triad, common, own if math.isfinite(own) else span)

    accel = None if errors.accel is None else at_common(errors.accel)
    return ImuErrors(at_common(errors.gyro), accel)


def _at_time(triad: TriadErrors, time: float, own: float) -> TriadErrors:
    """Random walk and Gauss-Markov process as one process of another correlation time.

    `own`: correlation time of the process so far; the driving noise s √(2/T) is kept.
    """
    sizes = [
        math.hypot(s * math.sqrt(time / own), k * math.sqrt(0.5 * time))
        for k, s in zip(triad.axis("random_walk"), triad.axis("bias_instability"), strict=True)
    ]
    return replace(triad, random_walk=0.0, bias_instability=sizes, correlation_time=time)


def _quantity(triad: TriadErrors, name: str) -> Triad:
    if name == "correlation_time":
        return (triad.correlation_time,) * 3
    if name == "drive":
        walk, sd = triad.axis("random_walk"), triad.axis("bias_instability")
        time = triad.correlation_time
        return triad_of(
            [math.hypot(k, s * math.sqrt(2.0 / time)) for k, s in zip(walk, sd, strict=True)]
        )
    return triad.axis(name)
