"""Records of navigation that are made up, so that what a report must say is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from strapdown.config.alignment import sensors_of
from strapdown.config.navigation import NavigationSpec
from strapdown.ellipsoids import WGS84
from strapdown.errors import Finding
from strapdown.frames import geodetic_from_ned
from strapdown.navigation.consistency import consistency_of_all, inconsistencies
from strapdown.navigation.heading_integrity import heading_status
from strapdown.navigation.integrity import IntegrityReport
from strapdown.navigation.record import Event, NavigationRecord, Span
from strapdown.navigation.truth_comparison import smoother_consistency
from strapdown.report.navigation_evaluation import NavigationEvaluation
from strapdown.rotation import euler_sd
from strapdown.systems.navigation_run import NavigationRun
from strapdown.systems.navigation_source import NavigationSource
from strapdown.tables import gnss_table, trajectory_error_table, trajectory_table

#: Of an ellipse turned by 30 deg from north toward east, 3 m along and 1 m across.
AXES, TURN = (3.0, 1.0), np.radians(30.0)
UNITS = {"gyro_bias_x": "rad/s", "gyro_bias_y": "rad/s", "rtk.time_offset_t": "s"}


def plane_covariance(scale=1.0):
    c, s = np.cos(TURN), np.sin(TURN)
    turn = np.array([[c, -s], [s, c]])
    return turn @ np.diag(np.square(np.array(AXES) * scale)) @ turn.T


def record(
    seconds=120.0,
    rate=10.0,
    place=(55.0, 37.0, 150.0),
    speed=8.0,
    course=60.0,
    outage=(50.0, 80.0),
    reject=(20,),
    seed=1,
):
    """Straight on from a place; the bound grows tenfold over the outage."""
    time = np.arange(1, round(seconds * rate) + 1) / rate
    heading = np.full(time.size, course % 360.0)
    v = speed * np.array([np.cos(np.radians(course)), np.sin(np.radians(course)), 0.0])
    geodetic = geodetic_from_ned(v * time[:, None], place)
    euler = np.column_stack([np.zeros_like(time), np.zeros_like(time), heading])
    trajectory = trajectory_table(
        time, geodetic, np.tile(v, (time.size, 1)), euler, source="made.csv"
    )
    marks = np.arange(1.0, seconds + 0.5)
    covariance = np.zeros((marks.size, 9, 9))
    for k, at in enumerate(marks):
        grown = 1.0
        if outage is not None and outage[0] <= at < outage[1]:
            grown = 1.0 + 9.0 * (at - outage[0]) / (outage[1] - 1.0 - outage[0])
        covariance[k, :2, :2] = plane_covariance(grown)
        covariance[k, 2:, 2:] = np.diag([4.0, 0.01, 0.01, 0.01, *np.radians([0.1, 0.1, 0.5]) ** 2])
    sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    rng = np.random.default_rng(seed)
    gone = np.zeros(marks.size, dtype=bool)
    if outage is not None:
        gone = (marks > outage[0]) & (marks < outage[1])
    epochs = marks[~gone]
    labels = ("north, m", "east, m", "down, m")
    nu = rng.normal(size=(epochs.size, 3)) * 2.0
    weight = np.ones((epochs.size, 3))
    for k in reject:
        if k < epochs.size:
            nu[k], weight[k] = 100.0, 0.0
    innovations = pd.DataFrame(
        np.hstack([nu, np.full_like(nu, 4.0), weight]),
        index=pd.Index(epochs, name="time"),
        columns=[f"{part} {label}" for part in ("nu", "s", "weight") for label in labels],
    )
    index = pd.Index(marks, name="time")
    unknown = np.array([1e-5, 1e-5, 0.1])
    fell = np.exp(-marks[:, None] / 30.0) * np.array([1.0, 0.0, 1.0]) + np.array([0.0, 1.0, 0.0])
    spans = () if outage is None else (Span("outage", *outage),)
    return NavigationRecord(
        trajectory=trajectory,
        sd=trajectory_error_table(
            marks,
            sd[:, :3],
            sd[:, 3:6],
            euler_sd(np.tile([0.0, 0.0, course % 360.0], (marks.size, 1)), covariance[:, 6:, 6:]),
        ),
        covariance=covariance,
        sensors=pd.DataFrame(
            np.tile([2e-6, 0.0, 0.125], (marks.size, 1)), index=index, columns=list(UNITS)
        ),
        sensors_sd=pd.DataFrame(unknown * fell, index=index, columns=list(UNITS)),
        units=UNITS,
        innovations={"rtk.position": innovations},
        events=tuple(
            Event.of(s.begin, "outage", "outage", name="rtk", since=s.begin) for s in spans
        ),
        modes=(Span("navigation", float(time[0]), float(time[-1])),),
        outages={"rtk": spans},
    )


def without_aids(made):
    """The same without anything observed."""
    return replace(made, innovations={}, outages={}, events=(), modes=())


def one_epoch(made):
    """Its first mark and the samples to it."""
    return replace(
        made,
        trajectory=made.trajectory.iloc[:1],
        sd=made.sd.iloc[:1],
        covariance=made.covariance[:1],
        sensors=made.sensors.iloc[:1],
        sensors_sd=made.sensors_sd.iloc[:1],
        innovations={n: t.iloc[:1] for n, t in made.innovations.items()},
        events=(),
        modes=(),
        outages={},
    )


SPEC = NavigationSpec.checked(
    {
        "log": {"path": "made.csv"},
        "sensors": {"sensor": "mpu-6050"},
        "start": {
            "lat_deg": 55.0,
            "lon_deg": 37.0,
            "alt_m": 150.0,
            "roll_deg": 0.0,
            "pitch_deg": 0.0,
            "heading_deg": 60.0,
        },
        "aiding": {"rtk": {"kind": "gnss", "path": "rtk.csv"}},
        "withhold": {"lengths_s": [30.0]},
    }
)


def told(made, *, name="made.csv", truth=None, forward=None, findings=(), withheld=(), fixes=None):
    """A run with this record, and with fixes where it was."""
    rows = made.trajectory.iloc[9::10]
    given = gnss_table(
        rows.index,
        rows[["lat", "lon", "alt"]].to_numpy(),
        np.zeros((len(rows), 3)),
        (1.0, 1.0, 1.0),
        (np.inf,) * 3,
    )
    tables = {"rtk": given if fixes is None else fixes}
    source = NavigationSource(
        name, "made up", made.trajectory, tables, truth, "", None, None, (), (), ()
    )
    consistency = consistency_of_all(made.innovations)
    trust = IntegrityReport(
        heading_status(made, ()),
        (Finding("navigation.no-receiver-fixes"),),
        90.0,
        (),
        consistency,
        inconsistencies(consistency, made.innovations),
        None,
    )
    differences = dict.fromkeys(("differences", "errors", "forward_differences", "points"))
    run = NavigationRun(
        spec=SPEC,
        source=source,
        ellipsoid=WGS84,
        sensors=sensors_of(SPEC),
        coarse=None,
        fine=None,
        record=made,
        forward=forward,
        agreement=None if forward is None else smoother_consistency(forward, made),
        beside=None,
        withheld=withheld,
        trust=trust,
        inputs=(),
        findings=findings,
        **differences,
    )
    return NavigationEvaluation(run)


def shifted(trajectory, north=0.0, east=0.0, down=0.0, heading=0.0):
    """A truth that is off by so many metres and degrees: what is navigated less these."""
    place = trajectory[["lat", "lon", "alt"]].to_numpy()
    moved = np.array([geodetic_from_ned([[-north, -east, -down]], p)[0] for p in place])
    euler = trajectory[["roll", "pitch", "heading"]].to_numpy().copy()
    euler[:, 2] = (euler[:, 2] - heading) % 360.0
    return trajectory_table(
        trajectory.index,
        moved,
        trajectory[["VN", "VE", "VD"]].to_numpy(),
        euler,
        source="truth.csv",
    )
