"""Reference points: instants with known attitude, tilt or rotation.

As text, on the command line or one per line in a file::

    end same as start
    9.0 same as 5.0 sd 0.5
    end 2 turns about z since start
    12.5 roll 0 pitch 0 heading 90
    12.5 roll 0 pitch 0

Instants are seconds of the log's own time, or ``start`` and ``end``. Angles are degrees. Axes
are the body's, x forward, y right, z down, or their names: ``about up`` is ``about -z``;
a turn is positive right-handed about the axis named.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from strapdown import rotation
from strapdown.attitude_algorithms.algorithm import AttitudeRun
from strapdown.constants import STANDARD_GRAVITY
from strapdown.errors import ConfigError, DataError
from strapdown.evaluation.differences import attitude_at
from strapdown.increments import increments_from_imu
from strapdown.rotation import level
from strapdown.sensors.rest import RestStretch
from strapdown.tables import EULER, THETA, references_table


@dataclass(frozen=True)
class Score:
    """Comparison of one algorithm with one reference.

    Attributes
    ----------
    algorithm : str
    against : str
        ``truth``, or the reference point in words.
    time : float, s
        End of the comparison.
    error_deg : float
        Rotation angle between the computed and the reference attitude at that instant.
    rms_deg, max_deg : float or None
        Over every scored instant; None for a reference point.
    turned_deg, expected_deg : float or None
        For a number of turns: integrated angle about the axis, and expected angle.
    sd_deg : float or None
        Standard deviation of the reference.
    reference : int or None
        Number of the reference point, from 1.
    """

    algorithm: str
    against: str
    time: float
    error_deg: float
    rms_deg: float | None = None
    max_deg: float | None = None
    turned_deg: float | None = None
    expected_deg: float | None = None
    sd_deg: float | None = None
    reference: int | None = None


@dataclass(frozen=True)
class SamePose:
    """Two stationary intervals at which gravity had the same direction in the body.

    Attributes
    ----------
    time, since : float, s
        Instants within the two intervals, the later one first.
    apart_deg, sd_deg : float
        Angle between the two directions, and its standard deviation from noise.
    words : str
        The corresponding reference point, in command-line syntax.
    caveat : str
        Condition for using it as a reference point.
    """

    time: float
    since: float
    apart_deg: float
    sd_deg: float
    words: str
    caveat: str


NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?"
INSTANT = rf"(?:{NUMBER}(?:\s*s)?|start|end)"
_AXIS_NAMES = {
    "x": ("x", 1.0),
    "y": ("y", 1.0),
    "z": ("z", 1.0),
    "forward": ("x", 1.0),
    "right": ("y", 1.0),
    "down": ("z", 1.0),
    "back": ("x", -1.0),
    "left": ("y", -1.0),
    "up": ("z", -1.0),
}
_SD = rf"(?:\s+sd\s+(?P<sd>{NUMBER}))?"
_FORMS = (
    rf"(?P<at>{INSTANT})\s+same\s+as\s+(?P<since>{INSTANT}){_SD}",
    rf"(?P<at>{INSTANT})\s+(?P<turns>{NUMBER})\s+turns?\s+about\s+(?P<axis>[+-]?\w+)\s+"
    rf"since\s+(?P<since>{INSTANT}){_SD}",
    rf"(?P<at>{INSTANT})\s+roll\s+(?P<roll>{NUMBER})\s+pitch\s+(?P<pitch>{NUMBER})"
    rf"(?:\s+heading\s+(?P<heading>{NUMBER}))?{_SD}",
)


def parse_reference(text: str, start: float, end: float) -> dict[str, object]:
    """Parse one reference point as a row of `references_table`; instants from start to end."""
    plain = re.sub(r"[:=]", " ", re.sub(r"same-as", "same as", text.partition("#")[0])).strip()
    match = next((m for form in _FORMS if (m := re.fullmatch(form, plain, re.I))), None)
    if match is None:
        raise ConfigError("evaluation.not-understood-2", quantity="reference", text=text)
    said = match.groupdict()
    row: dict[str, object] = {"time": instant(said["at"], start, end, text)}
    if said.get("sd"):
        row["sd"] = float(said["sd"])
        if not float(said["sd"]) > 0.0:
            raise ConfigError(
                "evaluation.standard-deviation-not-positive-2", quantity="reference", text=text
            )
    if "since" in said:
        row["since"] = instant(said["since"], start, end, text)
        since, at = row["since"], row["time"]
        assert isinstance(since, float) and isinstance(at, float)
        # An interval whose ends are words is as long as the log; its length is unknown here.
        if since >= at and np.isfinite([since, at]).all():
            raise ConfigError(
                "evaluation.compares-not-before",
                quantity="reference",
                text=text,
                at=at,
                since=since,
            )
    if "turns" in said:
        axis, sign = _axis(said["axis"], text)
        row |= {"kind": "turns", "axis": axis, "turns": sign * float(said["turns"])}
    elif "roll" in said:
        # Without a heading it is the direction of gravity in the body.
        known = [e for e in EULER if said[e] is not None]
        kind = "known" if len(known) == len(EULER) else "tilt"
        row |= {"kind": kind} | {e: float(said[e]) for e in known}
    else:
        row["kind"] = "same"
    return row


def instant(word: str, start: float, end: float, text: str) -> float:
    """Parse ``start``, ``end`` or seconds between these; `text` is the sentence, for messages."""
    if word.lower() in ("start", "end"):
        return start if word.lower() == "start" else end
    value = float(word.lower().rstrip("s "))
    # Stamps are printed to a millisecond; one that means the last sample counts as that sample.
    slack = 1e-3
    if not start - slack <= value <= end + slack:
        raise DataError(
            "evaluation.names-log-runs",
            quantity="reference",
            text=text,
            value=value,
            start=start,
            end=end,
        )
    return min(max(value, start), end)


def _axis(word: str, text: str) -> tuple[str, float]:
    name = word.lower().lstrip("+-")
    if name not in _AXIS_NAMES:
        raise ConfigError(
            "evaluation.names-axis",
            quantity="reference",
            text=text,
            word=word,
            axis_names=_AXIS_NAMES,
        )
    axis, sign = _AXIS_NAMES[name]
    return axis, -sign if word.startswith("-") else sign


def in_words(row: pd.Series) -> str:
    """Return a row of a References table as text."""
    at, since = (f"{float(row[key]):.3f}".rstrip("0").rstrip(".") for key in ("time", "since"))
    if row["kind"] == "same":
        return f"{at} s: same attitude as at {since} s"
    if row["kind"] == "turns":
        plural = "" if abs(row["turns"]) == 1 else "s"
        return f"{at} s: {row['turns']:g} turn{plural} about body {row['axis']} since {since} s"
    if row["kind"] == "tilt":
        return f"{at} s: roll {row['roll']:g}°, pitch {row['pitch']:g}°, whatever the heading"
    angles = ", ".join(f"{e} {row[e]:g}°" for e in EULER)
    return f"{at} s: {angles}"


def score_references(
    run: AttitudeRun, references: pd.DataFrame, imu: pd.DataFrame
) -> tuple[Score, ...]:
    """Compare a run with reference points.

    Parameters
    ----------
    run : AttitudeRun
    references : DataFrame
        A References table.
    imu : DataFrame
        The Imu table that the run used, for the rotation angle about an axis.

    Returns
    -------
    tuple of Score
        One per reference point: the rotation angle between computed and known attitude
        (``|log(C_est^T C_ref)|``); for a tilt the angle between computed and known direction
        of gravity.

    Raises
    ------
    DataError
        A reference lies before the run begins.
    """
    scores = []
    for number, (_, row) in enumerate(references.iterrows(), start=1):
        instants, error = _compare(run.attitude, row, number)
        turned = expected = None
        if row["kind"] == "turns":
            expected = 360.0 * float(row["turns"])
            turned = _turned(imu, "xyz".index(row["axis"]), instants[1], instants[0])
        sd = float(row["sd"])
        scores.append(
            Score(
                algorithm=run.algorithm,
                against=in_words(row),
                time=instants[0],
                error_deg=error,
                turned_deg=turned,
                expected_deg=expected,
                sd_deg=sd if np.isfinite(sd) else None,
                reference=number,
            )
        )
    return tuple(scores)


def reference_errors(attitude: pd.DataFrame, references: pd.DataFrame) -> list[float]:
    """Compare an attitude with reference points, as `score_references` does, in deg alone."""
    rows = enumerate(references.iterrows(), start=1)
    return [_compare(attitude, row, number)[1] for number, (_, row) in rows]


def _compare(attitude: pd.DataFrame, row: pd.Series, number: int) -> tuple[list[float], float]:
    """The instants of a reference point, and the error there in deg."""
    begin = float(attitude.index[0])
    alone = row["kind"] in ("known", "tilt")
    instants = [float(row["time"])] + ([] if alone else [float(row["since"])])
    if min(instants) < begin:
        raise DataError(
            "evaluation.computed-attitude-begins",
            row=number,
            quantity="reference",
            in_words=in_words(row),
            begin=begin,
        )
    q_at = attitude_at(attitude, instants)
    if row["kind"] == "known":
        known = rotation.quaternion_from_euler([float(row[e]) for e in EULER])
    elif row["kind"] == "tilt":
        known = with_tilt(q_at[0], float(row["roll"]), float(row["pitch"]))
    elif row["kind"] == "same":
        known = q_at[1]
    else:
        about = np.eye(3)["xyz".index(row["axis"])] * 2.0 * np.pi * float(row["turns"])
        known = rotation.compose(q_at[1], rotation.quaternion_from_rotation_vector(about))
    return instants, float(rotation.rotation_angle(q_at[0], known))


def with_tilt(q_nb: ArrayLike, roll: float, pitch: float) -> NDArray[np.float64]:
    """Rotate an attitude by the smallest angle to a roll and a pitch in deg.

    That angle is the one between the directions of gravity in the body: the least rotation from one
    direction to another is about an axis perpendicular to both.
    """
    down = np.array([0.0, 0.0, 1.0])
    known = rotation.quaternion_from_euler([roll, pitch, 0.0])
    here = rotation.rotate(rotation.conjugate(q_nb), down)
    there = rotation.rotate(rotation.conjugate(known), down)
    across, along = np.cross(there, here), float(there @ here)
    size = float(np.sqrt(across @ across))
    if size < 1e-12 and along < 0.0:
        # Upside down: every axis perpendicular to gravity is equivalent.
        across = np.cross(there, np.eye(3)[int(np.argmin(np.abs(there)))])
        axis, angle = across / np.sqrt(across @ across), np.pi
    else:
        axis, angle = across / max(size, 1e-300), float(np.arctan2(size, along))
    return rotation.compose(q_nb, rotation.quaternion_from_rotation_vector(axis * angle))


def _turned(imu: pd.DataFrame, axis: int, since: float, until: float) -> float:
    """Integral of one gyro between two instants, deg."""
    increments = increments_from_imu(imu)
    angle = np.concatenate([[0.0], np.cumsum(increments[THETA[axis]].to_numpy())])
    time = imu.index.to_numpy(dtype=np.float64)
    return float(np.degrees(np.interp(until, time, angle) - np.interp(since, time, angle)))


def references_from_words(words: list[str], start: float, end: float) -> pd.DataFrame:
    """Make a References table from text."""
    return references_table([parse_reference(text, start, end) for text in words])


# Rests as reference points: while a sensor is stationary, gravity gives roll and pitch.


Array = NDArray[np.float64]

#: Assumed standard deviation of the bias of each accelerometer, m/s², by class of sensor.
#: Consumer: the MPU-6050 bias may be 50 mg in x and y and 80 mg in z (data sheet 3.4, section 6.2),
#: taken as the limits of a uniform distribution, 29 to 46 mg. The others are the usual order of
#: magnitude, 5 mg, 1 mg and 50 µg: state your data sheet's value instead.
ACCEL_BIAS_SD = {"consumer": 0.3, "industrial": 0.05, "tactical": 0.01, "navigation": 0.0005}

# Two poses count as one if gravity agrees to so many standard deviations of the noise, or to the
# repeatability of placing a sensor by hand.
SAME_SIGMAS = 3.0
LEAST_APART = 0.1  # deg


def tilt_sd_deg(
    rest: RestStretch, *, bias_sd: float = ACCEL_BIAS_SD["consumer"], gravity: float | None = None
) -> float:
    """Standard deviation of the direction of gravity at a rest.

    Parameters
    ----------
    rest : RestStretch
        With acceleration.
    bias_sd : float, m/s²
        Assumed standard deviation of the bias of each accelerometer, at present in the log.
        One of `ACCEL_BIAS_SD`, or from a calibration.
    gravity : float, m/s², optional
        Local gravity; 9.80665 if not given, which is right to 0.03 m/s² everywhere on the
        surface.

    Returns
    -------
    float
        Root mean square of the angle between computed and true direction, in deg: two axes
        perpendicular to gravity, each in error by ``sqrt(bias² + noise²)/g`` rad. The bias is the
        larger of the assumed one and of the deviation of the specific force from gravity: the
        log may refute an assumption, but cannot confirm it, since an error perpendicular to
        gravity does not change the length.

    Raises
    ------
    DataError
        The rest has no acceleration, or its specific force differs from gravity by 20 %.
    """
    force, noise = _force(rest)
    g = STANDARD_GRAVITY if gravity is None else gravity
    size = float(np.sqrt(force @ force))
    bias = max(bias_sd, abs(size - g))
    return float(np.degrees(np.sqrt(2.0 * (bias / size) ** 2 + _across(force, noise))))


def tilt_references(
    rests: Sequence[RestStretch],
    *,
    bias_sd: float = ACCEL_BIAS_SD["consumer"],
    gravity: float | None = None,
    levelled_from: RestStretch | None = None,
) -> pd.DataFrame:
    """Make a reference point of roll and pitch from every rest; the heading stays open.

    Parameters
    ----------
    rests : sequence of RestStretch
        As returned by `sensors.rest.find_rests`; those without acceleration are left out.
    bias_sd, gravity
        As in `tilt_sd_deg`.
    levelled_from : RestStretch, optional
        The rest that the run was levelled at. It is left out: the run would be compared with
        its own start.

    Returns
    -------
    DataFrame
        A References table of kind ``tilt``, each at the middle of its rest;
        `evaluation.reference_points.score_references` compares a run with it. The biases of
        the accelerometers are the same in all rows, so that the errors of these references
        are not independent of each other, and cancel between rests of one pose where the run
        was levelled in that pose.

    Raises
    ------
    DataError
        As `tilt_sd_deg`.
    """
    rows: list[dict[str, object]] = []
    for rest in rests:
        if rest.accel_mean is None or (
            levelled_from is not None
            and rest.start <= levelled_from.end
            and levelled_from.start <= rest.end
        ):
            continue
        roll, pitch = level(rest.accel_mean)
        rows.append(
            {
                "time": _middle(rest),
                "kind": "tilt",
                "roll": roll,
                "pitch": pitch,
                "sd": tilt_sd_deg(rest, bias_sd=bias_sd, gravity=gravity),
            }
        )
    return references_table(rows, source="rests")


def same_pose_candidates(rests: Sequence[RestStretch]) -> tuple[SamePose, ...]:
    """Find rests at which the sensor may have the pose of an earlier one.

    Parameters
    ----------
    rests : sequence of RestStretch
        In order of time.

    Returns
    -------
    tuple of SamePose
        For each rest the earliest one whose direction of gravity agrees with it, within three
        standard deviations of the noise of both (the biases of the accelerometers are the same
        in both and cancel) or 0.1 deg, whichever is more. They are proposed, never used:
        gravity does not determine heading; only the operator knows whether the pose is the same.
    """
    found: list[SamePose] = []
    lying = [r for r in rests if r.accel_mean is not None]
    for number, rest in enumerate(lying):
        for earlier in lying[:number]:
            apart, sd = _apart(rest, earlier)
            if apart <= max(SAME_SIGMAS * sd, LEAST_APART):
                at, since = f"{_middle(rest):.2f}", f"{_middle(earlier):.2f}"
                found.append(
                    SamePose(
                        _middle(rest),
                        _middle(earlier),
                        apart,
                        sd,
                        f"{at} same as {since}",
                        f"gravity agrees to {apart:.2g}°; that the heading does, too, is "
                        "assumed: use it only where the sensor was put back",
                    )
                )
                break
    return tuple(found)


def _middle(rest: RestStretch) -> float:
    return 0.5 * (rest.start + rest.end)


def _force(rest: RestStretch) -> tuple[Array, Array]:
    if rest.accel_mean is None:
        raise DataError(
            "evaluation.rest-no-acceleration", quantity="accel", start=rest.start, end=rest.end
        )
    level(rest.accel_mean)
    noise = rest.accel_mean_sd or rest.accel_sd or (0.0, 0.0, 0.0)
    return np.array(rest.accel_mean), np.array(noise)


def _apart(a: RestStretch, b: RestStretch) -> tuple[float, float]:
    """Angle between the directions of gravity at two rests, and its standard deviation, deg."""
    (f_a, n_a), (f_b, n_b) = _force(a), _force(b)
    cross = np.cross(f_a, f_b)
    angle = float(np.arctan2(np.sqrt(cross @ cross), f_a @ f_b))
    variance = _across(f_a, n_a) + _across(f_b, n_b)
    return float(np.degrees(angle)), float(np.degrees(np.sqrt(variance)))


def _across(force: Array, noise: Array) -> float:
    """Variance of the direction of a force, sum of both axes perpendicular to it, rad²."""
    up = force / np.sqrt(force @ force)
    # Noise perpendicular to the force: |n|² minus the part along it.
    return float(((noise**2).sum() - ((up * noise) ** 2).sum()) / (force @ force))
