"""The runs of the record, in neutral terms; an adapter puts them into the words of a version.

A run is a list of steps in a folder of its own. Each covers some entries of the tables of choices;
together all of them. They are short: parts of recordings, small simulations, no figures.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Command:
    """A command line. `{data}` is the folder of recordings; paths begin in the run's folder."""

    command: str
    arguments: tuple[str, ...] = ()
    options: dict[str, Any] = field(default_factory=dict)
    out: str | None = None
    stdin: str | None = None
    stdout: str | None = None  # "json" or "lines"
    label: str | None = None
    words: tuple[str, ...] = ()  # more keys whose strings are compared
    keep: bool = True
    exit: int = 0


@dataclass(frozen=True)
class Call:
    """A function of the package, by the neutral name that the adapters give it."""

    function: str
    arguments: tuple[str, ...] = ()
    label: str | None = None


@dataclass(frozen=True)
class Tamper:
    """One digit of a file of a result is changed."""

    folder: str
    file: str


@dataclass(frozen=True)
class Toml:
    kind: str
    document: dict[str, Any]


@dataclass(frozen=True)
class Text:
    text: str


@dataclass(frozen=True)
class Run:
    name: str
    steps: tuple[Command | Call | Tamper, ...]
    files: dict[str, Toml | Text | bytes] = field(default_factory=dict)
    recordings: tuple[str, ...] = ()  # needed below the folder of recordings


RUNS: dict[str, Run] = {}


def add(name, *steps, files=None, recordings=()):
    RUNS[name] = Run(name, steps, files or {}, recordings)


Q = {"quiet": True}

# --- attitude ------------------------------------------------------------------------------------

ALGORITHMS = (
    "naive euler euler:step=rk4 dcm dcm:order=3 dcm:orthogonalise_every=10 quaternion "
    "quaternion:order=2 quaternion:normalise=false rk4 rotvec rotvec:samples=1 rotvec:samples=3 "
    "rotvec:samples=4"
)

add(
    "attitude-algorithms",
    # Today the bias of a rest is removed by default; without it all algorithms are the same.
    Command(
        "attitude",
        ("alexiev-fig2f",),
        {"algorithms": ALGORITHMS, "rate": 100, "gyro-bias": "none", **Q},
        "att",
    ),
    Command("verify", ("att",), {"json": True}, stdout="json", label="verified"),
    Tamper("att", "attitude"),
    Command("verify", ("att",), {"json": True}, stdout="json", label="tampered", exit=6),
)
add(
    "attitude-coning-cubic",
    Command(
        "attitude",
        ("coning-slow",),
        {"duration": 10, "rate": 50, "sampling": "mean", "interpolation": "cubic"}
        | {"sensor": "mpu-6050", "seed": 3, "rates": "25 10", **Q},
        "att",
    ),
)
add(
    "attitude-trials",
    Command("attitude", ("alexiev-fig2d",), {"trials": 3, "tolerance-deg": 2, **Q}, "att"),
    Command("attitude", ("alexiev-fig4",), {"rate": 20, "json": True}, stdout="json", out="json"),
    Command(
        "attitude",
        ("alexiev-fig2b",),
        {"algorithms": "rotvec:samples=2", "export": "a.c", **Q},
        "c",
    ),
)
add(
    "attitude-broad",
    Command(
        "attitude",
        ("{data}/broad/02_undisturbed_slow_rotation_B.hdf5",),
        {"duration": 30, "gyro-bias": "rest", "algorithms": "naive quaternion rotvec", **Q},
        "att",
    ),
    recordings=("broad/02_undisturbed_slow_rotation_B.hdf5",),
)
TURNS = "{data}/mpu6050_turns/rotate-360ccw-around-z-pointing-up"
add(
    "attitude-references",
    Command(
        "attitude",
        (TURNS,),
        {"gyro-bias": "none", "reference": "end 2 turns about z since start"}
        | {"algorithms": "euler dcm rk4", **Q},
        "att",
    ),
    recordings=("mpu6050_turns",),
)

# --- simulate ------------------------------------------------------------------------------------

add(
    "simulate-scenarios",
    Command("simulate", ("alexiev-fig2e",), {"rate": 50, "format": "all", "seed": 2, **Q}, "a"),
    Command("simulate", ("smooth-random",), {"rate": 20, "sensor": "bmi160", **Q}, "b"),
    Command("simulate", ("intensive",), {"rate": 100, "sampling": "mean", **Q}, "c"),
    Command("simulate", ("gestures",), {"rate": 20, "json": True}, "d", stdout="json"),
)

HOME = {"lat_deg": 55.75, "lon_deg": 37.62, "alt_m": 150.0}
WAVES = {
    "roll_waves": [{"amplitude_deg": 3.0, "period_s": 5.0}],
    "pitch_waves": [{"amplitude_deg": 2.0, "period_s": 4.0, "phase_deg": 30.0}],
}
DRIVE = [
    {"do": "straight", "duration_s": 4.0},
    {"do": "accelerate", "to_m_per_s": 14.0, "duration_s": 7.0},
    {"do": "lane_change", "offset_m": -3.5, "duration_s": 4.0},
    {"do": "turn_right", "angle_deg": 90.0, "radius_m": 25.0},
    {"do": "straight", "duration_s": 6.0},
    {"do": "stop", "braking_s": 4.0, "stay_s": 4.0},
]
CAR = {"kind": "car", **HOME, "heading_deg": 30.0, "manoeuvres": DRIVE}
MOTIONS = {
    "car": {"roll_deg_per_m_per_s2": 0.4, "pitch_deg_per_m_per_s2": 0.5, **CAR},
    "ship": {
        "kind": "ship",
        **HOME,
        "heading_deg": 250.0,
        "speed_m_per_s": 8.0,
        **WAVES,
        "heave_waves": [{"amplitude_m": 0.9, "period_s": 7.2}],
        "manoeuvres": [{"do": "turn_right", "angle_deg": 40.0, "radius_m": 200.0}],
    },
    "aircraft": {
        "kind": "aircraft",
        **HOME,
        "heading_deg": 66.0,
        "speed_m_per_s": 75.0,
        "manoeuvres": [
            {"do": "climb", "angle_deg": 8.0, "height_m": 60.0, "ramp_s": 1.0},
            {"do": "turn_left", "angle_deg": 30.0, "bank_deg": 25.0},
        ],
    },
    "rocking_stand": {"kind": "rocking_stand", "duration_s": 20.0, **HOME, **WAVES},
    "sine_velocity": {
        "kind": "sine_velocity",
        "duration_s": 20.0,
        **HOME,
        "mean_velocity_m_per_s": [8.0, -5.0, 0.2],
        "amplitude_m_per_s": [3.0, 3.0, 0.5],
    },
    "walking": {
        "kind": "walking",
        "gait": "walk",
        "strides": 4,
        "corner_each": 2,
        "stand_s": 3.0,
        **HOME,
    },
    "waypoints": {
        "kind": "waypoints",
        "speed_m_per_s": 12.0,
        "waypoints": [
            {"lat_deg": 43.585, "lon_deg": 39.7203, "alt_m": 80.0},
            {"lat_deg": 43.5861, "lon_deg": 39.7215, "alt_m": 95.0},
            {"lat_deg": 43.5868, "lon_deg": 39.7242, "alt_m": 110.0},
        ],
    },
}
add(
    "simulate-motions",
    *(Command("simulate", (f"{name}.toml",), Q, name) for name in MOTIONS),
    files={
        f"{name}.toml": Toml(
            "simulate",
            {
                "rate_hz": 20.0,
                "sensor": "hg1700",
                "seed": 1,
                "trajectory_formats": ["csv", "tum", "kml", "geojson", "nav", "parquet"]
                if name == "car"
                else ["csv"],
                "motion": motion,
            },
        )
        for name, motion in MOTIONS.items()
    },
)
add(
    "simulate-crashes",
    Command("simulate", ("side",), {"units": "IMU1", "format": "csv,mme", "seed": 4, **Q}, "side"),
    Command("simulate", ("pothole",), {"units": "IMU2", **Q}, "pothole"),
    Command("simulate", ("rollover",), {"units": "IMU1", **Q}, "rollover"),
)

# --- kernels and readers, from Python ---------------------------------------------------------

add(
    "mechanizations",
    Command("simulate", ("car.toml",), Q, "car", keep=False),
    Call("mechanize", ("car/log.csv", "car/trajectory.csv")),
    Call("health", ("car/log.csv",)),
    files={
        "car.toml": Toml(
            "simulate",
            {"rate_hz": 50.0, "sampling": "mean", "sensor": "stim300", "seed": 5, "motion": CAR},
        )
    },
)
LOGS = {
    "broad": "broad/27_disturbed_phone_vibration_B.hdf5",
    "mpu6050": "mpu6050_turns/unmoved-z-pointing-left",
    "rlg": "rlg_static/part1_first900s.imu",
    "comma2k19": "phone_comma2k19",
    "foot": "foot/SensorConnectData_32_LLIO.mat",
    "car": "car_rtk/part1_imu_frd_si.csv",
    "apdm": "zoo/apdm/imuData01.csv",
    "xsens_mtw": "zoo/xsens_mtw/MT_012005D6_009-001_00B421ED.txt",
    "xio": "zoo/xio/short_walk.csv",
    "bennyhui": "zoo/bennyhui",
    "sensorlogger": "zoo/sensorlogger_dr",
    "matlab_mobile": "zoo/matlab_mobile/imu_orientation.csv",
    "gsdc": "zoo/gsdc",
    "gtsam": "zoo/gtsam/imuAndGPSdata.csv",
}
for name, path in LOGS.items():
    add(f"log-{name}", Call("read_log", ("{data}/" + path,)), recordings=(path,))
add(
    "trajectories-read",
    Command("simulate", ("car.toml",), Q, "car", keep=False),
    *(
        Call("read_trajectory", (f"car/trajectory.{form}",), label=form)
        for form in ("csv", "tum", "nav", "parquet", "kml", "geojson")
    ),
    files={
        "car.toml": Toml(
            "simulate",
            {
                "rate_hz": 10.0,
                "trajectory_formats": ["csv", "tum", "kml", "geojson", "nav", "parquet"],
                "motion": CAR,
            },
        )
    },
)
add(
    "crash-records-read",
    Call("read_crash", ("{data}/crash_nhtsa_10146",)),
    recordings=("crash_nhtsa_10146",),
)

# --- align ---------------------------------------------------------------------------------------

STAND = {"duration_s": 120.0, "rate_hz": 20.0, "seed": 3, "heading_deg": 127.0, "pitch_deg": -2.0}
ALIGNMENTS = {
    "inertial-wd": {
        "simulation": {**STAND, **WAVES},
        "coarse": {"kind": "inertial_frame", "duration_s": 60.0},
        "fine": {
            "kind": "filter",
            "mechanization": "wander_azimuth",
            "error_model": "rotation_vector",
            "covariance": "wd",
        },
    },
    "two-vector-quaternions": {
        "simulation": STAND,
        "coarse": {"kind": "two_vector", "duration_s": 60.0},
        "fine": {
            "kind": "filter",
            "mechanization": "wander_azimuth",
            "error_model": "quaternions",
            "covariance": "joseph",
        },
    },
    "known-heading-ud": {
        "simulation": STAND,
        "coarse": {"kind": "known_heading", "heading_deg": 127.0, "sd_deg": 1.0, "duration_s": 9.0},
        "fine": {"kind": "filter", "mechanization": "ned", "covariance": "ud"},
    },
    "levelling": {
        "simulation": STAND,
        "coarse": {"kind": "levelling"},
        "fine": {"kind": "none"},
    },
}
for name, content in ALIGNMENTS.items():
    add(
        f"align-{name}",
        Command("align", ("align.toml",), Q, "align"),
        files={
            "align.toml": Toml(
                "align", {"site": HOME, "sensors": {"sensor": "fog-1000"}, **content}
            )
        },
    )
RLG = "rlg_static/part1_first900s.imu"
add(
    "align-rlg",
    Command(
        "align",
        ("{data}/" + RLG,),
        {"lat": 34.246048, "lon": 108.909664, "alt": 380, "sensor": "hg9900"}
        | {"duration": 120, "prefilter": "summed:rate_hz=20", "json": True},
        "align",
        stdout="json",
    ),
    recordings=(RLG,),
)
CAR_IMU = "car_rtk/part1_imu_frd_si.csv"
CAR_GNSS = "car_rtk/part1_gnss_rtk.csv"
add(
    "align-course",
    Command(
        "align",
        ("{data}/" + CAR_IMU,),
        {"method": "gnss_course", "gnss": "{data}/" + CAR_GNSS, "coarse-only": True}
        | {
            "sensor": "icm-42688-p",
            "from": 243260,
            "duration": 60,
            "lat": 40.1,
            "lon": -105.15,
            **Q,
        },
        "align",
    ),
    recordings=(CAR_IMU, CAR_GNSS),
)

# --- navigate ------------------------------------------------------------------------------------

PLAIN = {"output": {"figures": False}, "trust": {"repeat": False}}
START = {
    **HOME,
    "roll_deg": 0.0,
    "pitch_deg": 0.0,
    "heading_deg": 30.0,
    "position_sd_m": 2.0,
    "heading_sd_deg": 3.0,
}
FIXES = {"rate_hz": 2.0, "position_noise_m": 0.5, "outlier_share": 0.05}
BIASES = ["gyro_bias", "accel_bias"]
DRIFTS = ["gyro_drift", "accel_drift"]
MOVING = ["gyro_scale", "accel_scale", "gyro_misalignment", "accel_misalignment"]


def car(**more):
    """A car of half a minute with fixes and some of them wrong; `more` replaces tables."""
    base = {
        "simulation": {"rate_hz": 50.0, "seed": 3, "motion": CAR, "gnss": {"gnss": FIXES}},
        "sensors": {"sensor": "hg1700", "states": BIASES},
        "start": START,
        "aiding": {"gnss": {"kind": "gnss"}},
        **PLAIN,
    }
    return {**base, **more}


def rule(kind, influence):
    return {"gnss": {"kind": "gnss", "update_rule": {"kind": kind, "influence": influence}}}


NAVIGATIONS = {
    "joseph-huber-smoothed": car(
        filter={"covariance": "joseph"},
        aiding=rule("robust", "huber"),
        smoother={"kind": "rts"},
        recorder={"kind": "full"},
        damping={"kind": "closed_loop"},
    ),
    "ud-adaptive-igg3-fir": car(
        filter={"covariance": "ud"},
        aiding={
            **rule("adaptive", "igg3"),
            "wheels": {"kind": "nonholonomic"},
            "still": {"kind": "zupt"},
            "quiet": {"kind": "zaru"},
        },
        prefilter={"kind": "robust_fir", "rate_hz": 25.0},
        # The states that 0.1 took by default: today's have the g-sensitivity, too.
        sensors={"sensor": "adis16495-1", "states": [*BIASES, *DRIFTS, *MOVING]},
    ),
    "wd-paper-huber-open-loop": car(
        filter={"covariance": "wd"},
        aiding=rule("paper", "huber"),
        damping={"kind": "open_loop"},
        mechanization={"kind": "wander_azimuth"},
        recorder={"kind": "interval", "rate_hz": 5.0},
    ),
    "plain-robust-hampel-tadic": car(
        filter={"covariance": "plain"},
        aiding=rule("robust", "hampel"),
        mechanization={"kind": "tadic"},
        prefilter={"kind": "summed", "rate_hz": 10.0},
    ),
    # With an influence that descends again, the paper's step takes off more than there is.
    "paper-tukey-diverges": car(filter={"covariance": "wd"}, aiding=rule("paper", "tukey")),
    "quaternions-none-wd-filter": car(
        filter={"error_model": "quaternions", "covariance": "ud"},
        mechanization={"kind": "wander_azimuth"},
        aiding=rule("robust", "none"),
        prefilter={"kind": "w_d", "rate_hz": 10.0},
    ),
    "standstill-detectors": car(
        aiding={
            **rule("robust", "tukey"),
            "a": {"kind": "zupt", "detector": "rate_energy", "threshold_rule": "patience"},
            "b": {"kind": "zupt", "detector": "force_magnitude"},
            "c": {"kind": "zupt", "detector": "force_spread", "threshold_rule": "otsu"},
            "d": {"kind": "zupt", "detector": "force_variance", "threshold_rule": "stated"},
            "e": {"kind": "zaru", "detector": "variance"},
        },
    ),
    "withheld-outage": car(
        simulation={
            "rate_hz": 50.0,
            "seed": 4,
            "motion": CAR,
            "gnss": {"gnss": {"rate_hz": 2.0, "outages_s": [[14.0, 20.0]]}},
        },
        withhold={"aid": "gnss", "spans_s": [[21.0, 25.0]]},
        trust={"repeat": True},
    ),
}
EXITS = {"paper-tukey-diverges": 5}
for name, content in NAVIGATIONS.items():
    add(
        f"navigate-{name}",
        Command("navigate", ("run.toml",), Q, "nav", exit=EXITS.get(name, 0)),
        files={"run.toml": Toml("navigate", content)},
    )

SECONDS = [float(t) for t in range(1, 15)]


def rows(head, cells):
    """Return a table of an aid, one row a second of a straight drive at 10 m/s to 30 deg."""
    return Text(head + "\n" + "\n".join(f"{t},{cells}" for t in SECONDS) + "\n")


add(
    "navigate-tables-of-aids",
    Command("navigate", ("run.toml",), Q, "nav"),
    files={
        "run.toml": Toml(
            "navigate",
            car(
                simulation={
                    "rate_hz": 50.0,
                    "seed": 6,
                    "motion": {
                        "kind": "car",
                        **HOME,
                        "heading_deg": 30.0,
                        "speed_m_per_s": 10.0,
                        "manoeuvres": [{"do": "straight", "duration_s": 15.0}],
                    },
                },
                start={**START, "v_ned_m_per_s": [8.660254037844387, 5.0, 0.0]},
                aiding={
                    "wheel": {"kind": "odometer", "path": "odometer.csv"},
                    "doppler": {"kind": "body_velocity", "path": "doppler.csv"},
                    "baro": {"kind": "barometer", "path": "barometer.csv"},
                    "compass": {"kind": "heading", "path": "heading.csv"},
                },
            ),
        ),
        "odometer.csv": rows("time_s,speed,speed_sd", "10.02,0.1"),
        "doppler.csv": rows("time_s,vx,vy,vz,vx_sd,vy_sd,vz_sd", "9.98,0.01,-0.02,0.1,0.1,0.1"),
        "barometer.csv": rows("time_s,height,height_sd", "151.0,1.0"),
        "heading.csv": rows("time_s,heading,heading_sd", "30.5,1.0"),
    },
)
add(
    "navigate-stages",
    Command("navigate", ("run.toml",), Q, "nav"),
    files={
        "run.toml": Toml(
            "navigate",
            {
                "simulation": {
                    "rate_hz": 20.0,
                    "seed": 3,
                    "motion": {
                        "kind": "stationary",
                        **HOME,
                        "heading_deg": 127.0,
                        "duration_s": 200.0,
                    },
                },
                "site": {**HOME, "position_sd_m": 1.0},
                "sensors": {"sensor": "fog-1000"},
                "coarse": {"kind": "inertial_frame", "duration_s": 60.0},
                "fine": {
                    "kind": "filter",
                    "duration_s": 80.0,
                    "mechanization": "wander_azimuth",
                    "covariance": "wd",
                },
                "mechanization": {"kind": "wander_azimuth", "height": "held"},
                "filter": {"covariance": "wd"},
                "recorder": {"kind": "interval", "rate_hz": 1.0},
                **PLAIN,
            },
        )
    },
)
add(
    "navigate-walk",
    Command("navigate", ("run.toml",), {"smoothed": True, **Q}, "nav"),
    files={
        "run.toml": Toml(
            "navigate",
            {
                "simulation": {
                    "rate_hz": 100.0,
                    "seed": 2,
                    "motion": {
                        "kind": "walking",
                        "gait": "walk",
                        "strides": 6,
                        "corner_each": 3,
                        "stand_s": 5.0,
                        **HOME,
                    },
                },
                "site": {**HOME, "position_sd_m": 0.01, "velocity_sd_m_per_s": 0.01},
                "sensors": {"sensor": "xsens-mti-1", "states": BIASES},
                "coarse": {
                    "kind": "known_heading",
                    "heading_deg": 0.0,
                    "sd_deg": 0.1,
                    "duration_s": 3.0,
                },
                "fine": {"kind": "none"},
                "aiding": {
                    "stance": {
                        "kind": "zupt",
                        "detector": "shoe",
                        "window_s": 0.05,
                        "threshold": 10.0,
                        "threshold_rule": "otsu",
                        "rate_sd_deg_per_s": 1.0,
                        "force_sd_m_per_s2": 0.1,
                        "interval_s": 0.02,
                        "pivot_m": 0.1,
                    }
                },
                **PLAIN,
            },
        )
    },
)
add(
    "navigate-recorded-car",
    Command(
        "init navigate",
        ("{data}/" + CAR_IMU,),
        {"gnss": "{data}/" + CAR_GNSS, "sensor": "icm-42688-p"}
        | {"from": 243290, "duration": 40, **Q},
        "run.toml",
    ),
    Command(
        "navigate",
        ("{data}/" + CAR_IMU,),
        {"gnss": "{data}/" + CAR_GNSS, "sensor": "icm-42688-p", "lever-arm": "0,-0.05,0"}
        | {"from": 243290, "duration": 60, "smoothed": True, "json": True},
        "nav",
        stdout="json",
    ),
    recordings=(CAR_IMU, CAR_GNSS),
)
LIVE = {
    "live": {"sampling": "instantaneous", "hold_s": 0.1},
    "start": {**START, "v_ned_m_per_s": [8.660254037844387, 5.0, 0.0]},
    "sensors": {"sensor": "adis16470", "states": BIASES},
    "aiding": {"gnss": {"kind": "gnss"}},
    **PLAIN,
}


def live_lines():
    """Return ten seconds straight on at 10 m/s to 30 deg, 50 samples and two fixes a second."""
    lines = []
    for k in range(501):
        t = k / 50
        # Six channels of no meaning that are not constant; the fixes go straight on.
        noise = [((k * step) % 101 - 50) / 5000.0 for step in (7919, 31, 57, 83, 23, 67)]
        rates = ",".join(repr(0.01 * value) for value in noise[:3])
        lines.append(f"imu,{t!r},{rates},{noise[3]!r},{noise[4]!r},{noise[5] - 9.8154!r}")
        if k % 25 == 0:
            north, east = 8.660254037844387 * t / 111_340.0, 5.0 * t / 62_790.0
            lines.append(
                f"gnss,{t!r},lat={55.75 + north!r},lon={37.62 + east!r},alt=150.1,"
                "north_sd=1.0,east_sd=1.0,down_sd=2.0"
            )
    return "\n".join([*lines, "nonsense", "command,end"]) + "\n"


add(
    "navigate-live",
    Command(
        "navigate",
        ("run.toml",),
        {"live": "-", "every": 0.5},
        "nav",
        stdin=live_lines(),
        stdout="lines",
    ),
    files={"run.toml": Toml("navigate", LIVE)},
)
add(
    "navigate-pace",
    Command("navigate", ("run.toml",), {"pace": "max", **Q}, "nav"),
    files={"run.toml": Toml("navigate", car())},
)

# --- drift without aids, verify of a run of navigation ------------------------------------------

add(
    "outage",
    Command(
        "outage",
        ("adis16470",),
        {"outage": 30, "speed": 15, "turn-rate": 2, "with": "nonholonomic", **Q},
        "sensor",
    ),
    Command("outage", ("hg1700",), {"aided": 0, "with": "zupt", "json": True}, "b", stdout="json"),
    Command("navigate", ("run.toml",), Q, "nav", keep=False),
    Command("outage", ("nav",), {"outage": 4, "places": 3, **Q}, "drive", exit=4),
    Command("verify", ("nav",), {"json": True}, stdout="json", label="verified"),
    Tamper("nav", "trajectory"),
    Command("verify", ("nav",), {"json": True}, stdout="json", label="tampered", exit=6),
    files={"run.toml": Toml("navigate", car())},
)

# --- crash ---------------------------------------------------------------------------------------

for name in ("tadic-pole", "side-disagree", "no-gyro"):
    add(
        f"crash-{name}",
        Command("simulate", (name,), {"seed": 1, **Q}, "case", keep=name == "tadic-pole"),
        Command("crash", ("case/case.toml",), Q, "crash"),
    )
add(
    "crash-paths",
    Command("simulate", ("tadic-pole",), {"seed": 3, "units": "IMU1", **Q}, "case", keep=False),
    Call("crash_paths", ("case",)),
)

# --- init, modules, demo, bad input --------------------------------------------------------------

add(
    "init",
    Command("simulate", ("car.toml",), Q, "car", keep=False),
    Command("init align", ("car/log.csv",), Q, "align.toml"),
    Command("init navigate", ("car/log.csv",), {"sensor": "hg1700", **Q}, "navigate.toml"),
    Command("simulate", ("door-slam",), {"units": "IMU1", **Q}, "case", keep=False),
    Command("init crash", ("case/imu1_low_g.csv", "case/imu1_gyro.csv"), Q, "case.toml"),
    Command("crash", ("case.toml",), Q, "refused", exit=4),
    files={"car.toml": Toml("simulate", {"rate_hz": 50.0, "sensor": "hg1700", "motion": CAR})},
)
add("modules", Command("modules", (), {"json": True}, stdout="json", words=("name",)))

LOG = "time_s,gx,gy,gz\n0,0,0,0\n0.01,0,0,0\n"
add(
    "bad-input",
    Command("attitude", ("nothing.csv",), exit=4),
    Command("attitude", ("alexiev-fig4",), {"algorithms": "quaternoin"}, "x", exit=4),
    Command("attitude", ("alexiev-fig4",), {"rate": "-1"}, "x", exit=4),
    Command("attitude", ("words.csv",), out="x", exit=3),
    Command("attitude", ("backward.csv",), {"gyro-unit": "rad/s"}, "x", exit=3),
    Command("align", ("words.csv",), {"sensor": "fog-1000"}, "x", exit=4),
    Command("navigate", ("run.toml",), out="x", exit=4),
    Command("navigate", ("broken.toml",), out="x", exit=4),
    Command("crash", ("run.toml",), out="x", exit=4),
    Command("simulate", ("no-such-motion",), out="x", exit=4),
    Command("outage", ("no-such-sensor",), out="x", exit=4),
    Command("verify", ("nothing",), exit=3),
    Command("no-such-command", exit=2),
    Command("modules", (), {"no-such-option": True}, exit=2),
    files={
        "words.csv": Text("time_s,gyro_x,gyro_y,gyro_z\n0,one,two,three\n"),
        "backward.csv": Text("time_s,gyro_x,gyro_y,gyro_z\n0,0,0,0\n2,0,0,0\n1,0,0,0\n3,0,0,0\n"),
        "run.toml": Toml("navigate", {"aiding": {"gnss": {"kind": "gnss"}}}),
        "broken.toml": Text("[start\nlat_deg = \n"),
    },
)
add("demo", Command("demo", (), Q, "demo"))
