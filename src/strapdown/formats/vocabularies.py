"""Vocabularies of column names, as data: of logs, fixes, trajectories and crash records.

`columns.read_name` reads a name by one vocabulary. Names that mean the same in every kind of file
(clocks, units, words of other languages) are in all.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from strapdown.units import (
    ANGLES,
    GYRO_UNITS,
    LENGTHS,
    OF_CRASHES,
    OF_LOGS,
    OF_TABLES,
    SPEEDS,
    TIME_UNITS,
)


def without_accents(text: str) -> str:
    """Return the letters of a text without their accents."""
    bare = "".join(c for c in unicodedata.normalize("NFD", text) if not unicodedata.combining(c))
    return unicodedata.normalize("NFC", bare)  # the syllables of Korean are whole again


@dataclass(frozen=True)
class Quantity:
    """A quantity that a file may hold.

    `words`: names without blanks, signs and units, in lower case. `units`: its units, each with its
    factor to that of the table; empty if dimensionless. `negative`: further words, for the opposite
    sign: ``velup`` for a velocity down.
    """

    words: tuple[str, ...]
    units: Mapping[str, float] = field(default_factory=dict)
    negative: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Vocabulary:
    """Names in one kind of file.

    `quantities`: names that mean a quantity as a whole. `kinds`: of units (`units.FACTORS`), in the
    order in which they decide. `before`: words that may stand before the name of a quantity.
    `sensors`: ``gyro``, ``accel``, ``mag`` and ``gravity`` to the names of their quantities here;
    empty if no names of sensors are read. `stems`: quantities to beginnings of words that are found
    anywhere in a name, in the order of search. `of`: object that the quantities describe, for
    messages.
    """

    quantities: Mapping[str, Quantity]
    kinds: Sequence[str]
    before: re.Pattern[str] | None = None
    sensors: Mapping[str, str] = field(default_factory=dict)
    stems: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    of: str = "this table"

    @cached_property
    def index(self) -> dict[str, tuple[str, float]]:
        """Words to their quantity and its sign; the first quantity that has a word counts."""
        out: dict[str, tuple[str, float]] = {}
        for name, quantity in self.quantities.items():
            for sign, words in ((1.0, quantity.words), (-1.0, quantity.negative)):
                for word in words:
                    out.setdefault(word, (name, sign))
        return out


def _words(text: str) -> tuple[str, ...]:
    return tuple(text.split())


# Words that mean the same everywhere.


#: Beginnings of German, French, Spanish, Italian and further words, without accents, by the English
#: word that they mean.
ABROAD = {
    english: _words(stems)
    for english, stems in {
        "time": "zeit uhrzeit temps horodat tiempo tempo vrijeme vreme czas tijd zaman "
        "время 时间 時間 시간",
        "acceleration": "beschl aceler accelerazion accelerometr przysp ubrz versnell zrychl ivme "
        "kiihtyv gyorsul "
        "ускорен акселером 加速度 가속도",
        "gyroscope": "drehrate drehgeschw winkelgeschw giroscop gyroskop kreisel hoeksnelh "
        "jiroskop vinkelhast kulmanop szogseb "
        "гироскоп 角速度 陀螺 ジャイロ 각속도 자이로",
        "magnetometer": "magnetfeld magnetometr магнит 磁 지자기 자기장",
        "velocity": "geschwindigkeit vitesse velocidad velocita predkosc скорость",
        "angular": "angulaire angolar katow угл",
        "linear": "linear lineaire lineal",
        "without": "ohne sans senza",
        "roll": "wank roulis alabeo rollio",
        "pitch": "nick tangage cabeceo beccheggio",
        "yaw": "gier lacet guinada imbardata",
    }.items()
}
#: Those in other letters, by which the code of a text is known.
FOREIGN = {w for stems in ABROAD.values() for w in stems if not w.isascii()}
#: Axis of the body that a turn is about.
TURNS = {"roll": "x", "pitch": "y", "yaw": "z"}
#: Words for the axes of a vehicle.
DIRECTIONS = {
    "x": (
        "longitudinal",
        "longit",
        "long",
        "lon",
        "lineal",
        "langs",
        "laengs",
        "longitudinale",
        "inline",
    ),
    "y": ("lateral", "lat", "quer", "laterale", "transversal"),
    "z": ("vertical", "vert", "vertikal", "hoch", "verticale"),
}
TIMES = _words(
    "time t ts timestamp timestamps timesec elapsed secondselapsed seconds sec tow sow gpssow "
    "gpstow gpstime unixtime epoch epoc stamp elapsedtime timeelapsed timesincestart sampletime "
    "sensortime systemtime unixtimestamp datetime localtime utc utctime timeutc "
    "gpssecondsofweek secondsofweek gpst timeintervalsince1970 zeit zeitstempel temps tiempo tempo "
    "rtctime chiptime utime offsettime heure hora ora tijd czas tid saat čas aika idő zaman час "
    "время 时间 時刻 時間 시간 "
    "datenum juliandate modifiedjuliandate jd mjd filetime gpsseconds ntptime ntptimestamp "
    "cfabsolutetime labviewtime secondsofday sod"
)
# Names of clocks that state their unit.
CLOCKS = {
    "seconds": "s",
    "timeintervalsince1970": "s",  # of Apple's NSDate
    "secs": "s",
    "sec": "s",
    "secondselapsed": "s",
    "elapsedseconds": "s",
    "millis": "ms",
    "milliseconds": "ms",
    "micros": "us",
    "microseconds": "us",
    "nanos": "ns",
    "nanoseconds": "ns",
    "ms": "ms",
    "itow": "ms",  # of u-blox, in every message
    "msec": "ms",
    "utime": "us",  # of LCM, and logs made from it
    "us": "us",
    "usec": "us",
    "ns": "ns",
    "nsec": "ns",
}
#: Axes of a camera in words, as GoPro names them.
CAMERA = {"up/down": "z", "right/left": "x", "forward/back": "y"}
#: Clocks by whose names an application runs on a system of Apple, whose accelerometer reads -1 g
#: upward (CMAccelerometerData).
APPLE = ("timeintervalsince1970",)
#: Words of the name of a clock, beside ``time``, and words behind it in brackets.
OF_TIME = {
    *_words("time timestamp timestamps stamp unix epoch utc gps system gmt sample logging elapsed"),
    *_words(
        "since since1970 start startup boot reboot local ros rosbag bag header rtc chip device lsl "
        "host esp mcu arduino unified session phone monotonic relative received recorded arrival"
    ),
}
TIME = Quantity((*TIMES, *CLOCKS), TIME_UNITS)
#: Of tables of measurements, where a date is a clock.
DATED = Quantity((*TIME.words, "date"), TIME_UNITS)


# Names of sensors. Blanks, underscores and capitals do not count.


_TRIAD_WORDS = {
    "gyro": "gyro gyros gyr gyroscope gyroscopes imugyr imugyro angularvelocity angularvel angvel "
    "velocityangular rotationvelocity velocityrotation anglerate "
    "angularrate angularrates angrate angularspeed turnrate rot rotationrate rotrate omega rate "
    "av w g ω avel pqr bodyrate bodyrates wb wib wibb omegab omegaib omegaibb",
    "accel": "accel acce acc accelerometer accelerometers accelerations acceleration accl "
    "linearacceleration linacc linaccel lina la gforce gf imuacc imuaccel specificforce "
    "specforce sf fb fib fibb xl a f",
    "mag": "mag magn magnet magnetic magnetometer magnetometers magneticfield magfield field "
    "imumag compass m b",
}
#: Names of a sensor without their axis.
TRIADS = {triad: words.split() for triad, words in _TRIAD_WORDS.items()}
# Names of columns that hold increments per sample.
SUMMED = {
    "gyro": ["dtheta", "deltatheta", "dangle", "deltaangle", "angleincrement", "dang"],
    "accel": ["dv", "deltav", "dvel", "deltavel", "deltavelocity", "velocityincrement"],
}
#: Gravity by itself, as phones write it beside acceleration without it.
GRAVITY = ("gravity", "grav", "gra", "gr", "gvec")
# A name that is a unit says the sensor: dps_x, uT_x. The letter g may be anything.
NAMED_BY_UNIT = {
    **dict.fromkeys(("dps", "mdps", "rads", "degs"), "gyro"),
    **dict.fromkeys(("mps2", "ms2", "mss"), "accel"),
    **dict.fromkeys(("ut",), "mag"),
}
#: Names, their triad, and whether they say increments.
SENSORS: tuple[tuple[Sequence[str], str, bool], ...] = (
    *((names, triad, False) for triad, names in TRIADS.items()),
    *((names, triad, True) for triad, names in SUMMED.items()),
    *(((unit,), triad, False) for unit, triad in NAMED_BY_UNIT.items()),
    (GRAVITY, "gravity", False),
)
# Words that may stand beside the name of a sensor, and say the same again or how it is meant.
BESIDE = {
    "gyro": {"angular", "rotation", "rotational", "rate", "rates", "velocity", "vel", "speed"},
    "accel": {"acceleration", "linear", "lin", "user", "including", "gravity", "with", "without"},
    "mag": {"magnetic", "field"},
}
WITHOUT_GRAVITY = {"linear", "lin", "user", "without", "linacc", "linaccel", "linearacceleration"}
WITHOUT_GRAVITY |= {"lina", "la", "lineara", "usera"}
#: Words that say a rate beside the name of a turn.
RATES = {"rate", "speed", "velocity", "vel", "dot", *TRIADS["gyro"]} - set("wgω")
# Names that are parts of words, unless their axis stands apart: MaX, but not max.
SHORT = {"gyro": "gy", "accel": "ac", "mag": "ma"}
#: Names that are a sensor with their axis alone: xav and xla of a message of ROS.
WITH_AXIS = ("av", "la")
# G is also gravity.
MAGNETIC = {"g": "gauss", "mg": "mG"}
# Arrays of PX4 (msg/SensorCombined.msg, SensorMag.msg), whose comments define their units.
PX4 = {
    "gyro_rad": ("gyro", "rad/s"),
    "accelerometer_m_s2": ("accel", "m/s2"),
    "magnetometer_ga": ("mag", "gauss"),
}
#: Fields of sensor_msgs/Imu and sensor_msgs/MagneticField, whose units ROS REP 103 defines.
ROS = {
    "angular_velocity": ("gyro", "rad/s"),
    "linear_acceleration": ("accel", "m/s2"),
    "magnetic_field": ("mag", "T"),
}
# Words of a sensor's name that do not distinguish quantities.
NOISE = {
    *("raw", "imu", "sensor", "sensors", "data", "body", "device", "phone", "watch", "motion"),
    *("cal", "calib", "calibrated", "corrected", "meas", "measured", "value", "values", "axis"),
    *("ins", "the", "of", "in", "de", "del", "di", "reading", "readings", "uncal", "uncalibrated"),
    *("unbiased",),
    # Of flight controllers: converted, smoothed (gyroADC, accSmooth).
    *("adc", "smooth", "filt", "filtered", "lpf", "lowpass", "out", "scaled", "total", "inertial"),
    *("un", "uncomp", "uncompensated", "comp", "compensated", "ch", "channel", "sens", "mpu"),
    "type",
    # Counts, and revolutions or radians per second: the values say which.
    *("lsb", "rps", "轴", "軸", "축", "ось", "оси"),
}
#: Where a sensor is worn or mounted, and its range: they distinguish sensors, not quantities.
PARTS = {
    *_words("head neck chest sternum trunk torso waist hip pelvis sacrum lumbar shoulder arm"),
    *_words("forearm elbow wrist hand thigh femur shank tibia knee calf leg ankle foot shoe"),
    *_words("belt pocket frame wheel cabin dash dashboard left right"),
}
PLACES = PARTS | {*_words("upper lower front rear back center top bottom l r ln wr base board")}
#: Beginnings of the names of sensor chips, which stand beside the name of the sensor.
CHIP = re.compile(
    r"(?:lsm|lis|ism|iis|asm|icm|iim|mpu|itg|bm[agimx]|bno|akm?|adxl|adis|fxos|fxas|kx|mxg|hmc|qmc|mmc"
    r"|scha?|sca|mti)\d\w*"
)
# Words of a quantity that is about another: its spread, its error, its demand.
ABOUT = {
    *("bias", "offset", "scale", "cov", "covariance", "std", "stddev", "stdev", "sd", "sigma"),
    *("var", "variance", "error", "err", "accuracy", "setpoint", "desired", "noise"),
}

#: Words of a quantity that is none of a sensor's axes in the body's frame, though one is named.
OTHER_QUANTITY = ABOUT | {
    *_words("temp temperature time angle angles integral count counts flag status valid clip"),
    *_words("clipping saturated jerk rms norm magnitude threshold psd fft range odr gain world"),
    *_words("earth global ned enu nav local ref reference true truth ideal pred predicted mean"),
    *_words("avg min max median energy entropy corr correlation diff delta residual innovation"),
    *_words("cmd command target limit free dynamic motor wheel sat saturation drift integrated"),
    *_words("gps gnss dot heading dec"),
}
#: Units that say the sensor of a column whose name is an axis. Those of a field in gauss are also
#: written for accelerations in g.
BY_UNIT = {
    "gyro": {*GYRO_UNITS} - {"rpm", "rev/s"},  # as well of an engine, and a frequency
    "accel": {"m/s2", "g", "mg", "ft/s2", "cm/s2", "mm/s2"},
    "mag": {"uT", "nT"},
}


# Logs of inertial sensors.


QUATERNIONS = {
    "q_w": ["qw", "quatw", "quaternionw", "q0"],
    "q_x": ["qx", "quatx", "quaternionx", "q1"],
    "q_y": ["qy", "quaty", "quaterniony", "q2"],
    "q_z": ["qz", "quatz", "quaternionz", "q3"],
}
EULERS = {
    "roll": ["roll", "phi"],
    "pitch": ["pitch", "theta"],
    "heading": ["heading", "yaw", "psi"],
}
#: Quantities that a user may name in a log.
QUANTITIES = [
    "time",
    *(f"{triad}_{axis}" for triad in TRIADS for axis in "xyz"),
    *QUATERNIONS,
    *EULERS,
]
#: Rates about forward, right and down in the notation of flight mechanics, if all three are there:
#: a letter alone may be anything.
BODY_RATES = {"rate_p": "gyro_x", "rate_q": "gyro_y", "rate_r": "gyro_z"}

#: Its quantities are `QUANTITIES`, a triad's name where the column holds three numbers or the name
#: ends in a number, ``gravity_x`` and `BODY_RATES`.
LOGS = Vocabulary(
    {
        **{rate: Quantity((rate[-1],)) for rate in BODY_RATES},
        "time": TIME,
        **{q: Quantity(tuple(words)) for q, words in {**QUATERNIONS, **EULERS}.items()},
    },
    OF_LOGS,
    sensors={triad: triad for triad in (*TRIADS, "gravity")},
    of="a log",
)


# Positions and velocities, in tables of fixes and of trajectories.


_HEADS = ("v", "vel", "velocity", "speed")


def _velocities(letter: str, *words: str) -> tuple[str, ...]:
    behind = tuple(h + e for h in _HEADS for e in (letter, *words))
    return behind + tuple(word + h for word in words for h in _HEADS)


#: Degrees, meters over the ellipsoid, meters per second; velocity up is negative velocity down.
_GEODETIC: dict[str, Quantity] = {
    "lat": Quantity(
        _words(
            "lat latitude latitudee7 breite breitengrad latitud latitudine широта 纬度 緯度 위도"
        ),
        ANGLES,
    ),
    "lon": Quantity(
        _words(
            "lon lng long longitude longitudee7 länge lange laenge längengrad langengrad longitud "
            "longitudine долгота 经度 經度 경도"
        ),
        ANGLES,
    ),
    "alt": Quantity(
        _words(
            "alt altitude h hgt height hell altell heightell ellipsoidalheight heightellipsoid "
            "ellipsoidheight ellheight heightwgs84 altitudewgs84 "
            "hae höhe hohe hoehe altitud altura altitudine quota hoogte высота "
            "高度 고도 wysokość wysokosc"
        ),
        LENGTHS,
    ),
    "VN": Quantity(
        (*_velocities("n", *_words("north nord norte noord север")), "北向速度", "北速"), SPEEDS
    ),
    "VE": Quantity(
        _velocities("e", *_words("east ost est este oost восток"))
        + _words("东向速度 東向速度 东速"),
        SPEEDS,
    ),
    "VD": Quantity(
        _velocities("d", "down"),
        SPEEDS,
        (*_velocities("u", "up"), *_words("vspd verticalspeed vspeed climbrate rateofclimb")),
    ),
}
TRAJECTORIES = Vocabulary(
    {
        "time": TIME,
        **_GEODETIC,
        **{angle: Quantity(tuple(words), ANGLES) for angle, words in EULERS.items()},
    },
    OF_TABLES,
    of="a trajectory",
)
#: Words for a standard deviation.
SD_WORDS = ("sd", "std", "stddev", "stdev", "sigma")


def spread_of(*words: str, letter: str = "") -> tuple[str, ...]:
    """List names of a standard deviation, with the word for it before or after the quantity.

    `letter`: another word for it, before the quantity alone.
    """
    heads = (*SD_WORDS, *letter)
    return tuple(h + w for h in heads for w in words) + tuple(
        w + h for h in SD_WORDS for w in words
    )


#: The names may stand behind others, as in ``gps_lat`` or ``location.latitude``.
FIXES = Vocabulary(
    {
        "time": DATED,
        "week": Quantity(_words("week gpsweek weeknumber wn")),
        **_GEODETIC,
        "alt_msl": Quantity(
            _words(
                "hmsl altmsl altitudemsl heightmsl mslaltitude mslheight orthometricheight 海拔 "
                "msl amsl altamsl altitudeamsl altitudeabovesealevel heightabovesealevel "
                "altitudeabovemeansealevel"
            ),
            LENGTHS,
        ),
        # It counts beside other heights.
        "alt_hae": Quantity(
            _words("althae altitudehae heighthae altellipsoid altitudeellipsoid"), LENGTHS
        ),
        "geoid": Quantity(
            _words("geoid undulation geoidsep geoidseparation geoidheight geoidundulation"), LENGTHS
        ),
        "alt_take_off": Quantity(
            _words(
                "relalt relativealt relativealtitude heightabovetakeoff altitudeabovetakeoff "
                "heighttakeoff"
            ),
            LENGTHS,
        ),
        # Of formats, and a word, that do not say whether it is over the ellipsoid or over the sea.
        "alt_unstated": Quantity(_words("elevation elev ele enhancedaltitude"), LENGTHS),
        "north": Quantity(
            _words("north posn positionnorth northposition northing northings utmn utmnorthing"),
            LENGTHS,
        ),
        "east": Quantity(
            _words("east pose positioneast eastposition easting eastings utme utmeasting"), LENGTHS
        ),
        "up": Quantity(_words("up posu positionup"), LENGTHS, _words("down posd positiondown")),
        **{
            f"ecef_{a}": Quantity((f"ecef{a}", f"{a}ecef", f"positionecef{a}"), LENGTHS)
            for a in "xyz"
        },
        "north_sd": Quantity(spread_of(*_words("n north lat latitude"), letter="s"), LENGTHS),
        "east_sd": Quantity(spread_of(*_words("e east lon longitude"), letter="s"), LENGTHS),
        "down_sd": Quantity(
            spread_of(*_words("d down u up h alt altitude height hgt"), letter="s"), LENGTHS
        ),
        "VN_sd": Quantity(
            spread_of(*_words("vn veln velocityn northvelocity velnorth"), letter="s"), SPEEDS
        ),
        "VE_sd": Quantity(
            spread_of(*_words("ve vele velocitye eastvelocity veleast"), letter="s"), SPEEDS
        ),
        "VD_sd": Quantity(
            spread_of(*_words("vd veld velocityd vu velu velocityu veldown velup"), letter="s"),
            SPEEDS,
        ),
        "horizontal_accuracy": Quantity(
            _words(
                "accuracy horizontalaccuracy locationhorizontalaccuracy accuracyhorizontal hacc "
                "haccuracy eph"
            ),
            LENGTHS,
        ),
        "vertical_accuracy": Quantity(
            _words(
                "verticalaccuracy locationverticalaccuracy altitudeaccuracy accuracyvertical vacc "
                "vaccuracy epv"
            ),
            LENGTHS,
        ),
        "speed": Quantity(
            _words(
                "speed 2dspeed speed2d sog gspeed groundspeed locationspeed speedoverground gndspd "
                "spd geschwindigkeit vitesse velocidad velocità velocita snelheid hastighet "
                "prędkość enhancedspeed predkosc rychlost brzina rapidez скорость 速度 车速 航速 "
                "속도"
            ),
            SPEEDS,
        ),
        "speed_sd": Quantity(_words("speedaccuracy speedsd sacc locationspeedaccuracy"), SPEEDS),
        "course": Quantity(
            _words(
                "course cog bearing courseoverground locationcourse track directionofmotion "
                "gpsheading gnssheading headmot trk gcrs groundcourse kurs rumbo rotta koers курс "
                "航向 航向角"
            ),
            ANGLES,
        ),
        "quality": Quantity(_words("quality fixquality gpsquality gnssquality")),
        "Q": Quantity(("q",)),
    },
    OF_TABLES,
    before=re.compile(r"(?:gps|gnss|navsat|location|loc|position|pos|coords|fix)(?=..)"),
)

#: Names that are those of a speed and a course beside the positions of a receiver, and elsewhere
#: may be others: of the velocity of a sensor, of the axis of a vehicle.
OVER_GROUND = Vocabulary(
    {
        "speed": Quantity(("velocity",), SPEEDS),
        "course": Quantity(
            _words("heading hdg azimuth azimut cap direction richtung direccion направление 方向"),
            ANGLES,
        ),
    },
    OF_TABLES,
    before=FIXES.before,
)


# Crash records: recorders in vehicles name their columns in words of several languages
# (``Longitudinal Delta-V (MPH)``, ``Gierrate``), loggers in letters (``ax [g]``).


#: Longitudinal is positive forward, lateral from left to right, vertical down (SAE J1698, SAE
#: J211); axes that point the other way have a minus.
AXIS_WORDS = {
    word: axis
    for axis, words in {
        "x": "x longitudinal long longi longit longitudinale langs laengs forward fwd",
        "y": "y lateral lat laterale quer transversal transverse transv right",
        "z": "z vertical vert verticale vertikal hoch down normal",
        "-x": "backward rearward",
        "-y": "left",
        "-z": "up",
    }.items()
    for word in words.split()
}
#: Beginnings of words for a turn, also in compounds: Gierrate, Nickwinkel.
TURN_STEMS = {word: axis for turn, axis in TURNS.items() for word in (turn, *ABROAD[turn])}
#: Short words that end in a letter without meaning an axis.
NO_AXIS = _words("hz khz mhz max idx mux aux fix box mix key day any by my")
#: A velocity that is a change since time zero.
CHANGE = re.compile(
    r"\b(delta ?v|dv|delta velocity|delta vel|velocity change|geschwindigkeits"
    r"|change (in|of) velocity|cumulative velocity)"
)
#: Last words of a column that counts samples.
COUNTERS = _words("n nr no num number index idx sample count counter row")
#: Quantities are those of `crash_record.QUANTITIES`; ``other`` is known not to be of a sensor, and
#: ``counter`` counts samples.
CRASHES = Vocabulary(
    {
        "acceleration": Quantity(
            _words("acceleration accel acc accelerations accelerometer ax ay az")
        ),
        "rate": Quantity(_words("rate gyro gyr gyroscope angular wx wy wz")),
        "velocity": Quantity(_words("velocity vel deltav dv deltavelocity")),
        "displacement": Quantity(_words("displacement crush")),
        "force": Quantity(_words("force load")),
    },
    OF_CRASHES,
    sensors={"accel": "acceleration", "gyro": "rate"},
    stems={
        "other": _words(
            "temp tmp batt volt spannung druck press humid feucht mag magn kompass compass latit "
            "longitud alt satell status flag valid quality speed geschw vitesse brems brake "
            "throttle engine rpm accelerator pedal gaspedal fahrpedal steer lenk belt abs stability"
        ),
        "rate": (
            *ABROAD["gyroscope"],
            *_words("winkelg gyro gyr rate omega angular rot"),
            *TURN_STEMS,
        ),
        "acceleration": (
            *ABROAD["acceleration"],
            *_words("acc accel specificforce lowg highg gforce nd hd"),
        ),
        "time": (*ABROAD["time"], *_words("stamp clock time")),
    },
    of="a crash record",
)
