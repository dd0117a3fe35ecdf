"""What apps on phones send, as events of `formats.sensor_streams`.

Units and axes are those of the files that the apps export (`formats.sensor_logger`,
`formats.phyphox`, `formats.sensorstream`), so that a session and a file mean the same.

Sensor Logger
    HTTP push and MQTT: ``{"messageId", "sessionId", "deviceId", "payload": [{"name", "time",
    "values": {…}}, …]}``, ``time`` in ns since 1970 and names in small letters
    (https://github.com/tszheichoi/awesome-sensor-logger, PUSHING.md, UNITS.md, COORDINATES.md).
    Fields may be beside ``time`` instead of in ``values``. Accelerations of an iPhone without
    "Standardise Units & Frames" have the opposite sign, which no message states.
phyphox
    ``/get?NAME=THRESHOLD|TIME`` returns ``{"buffer": {NAME: {"size", "updateMode", "buffer":
    […]}}, "status": {"session", "measuring", …}}``, ``/config`` the buffers of the inputs
    (https://phyphox.org/wiki/index.php/Remote-interface_communication).
Sensorstream
    A stamp in s and blocks of a number and three values, in datagrams.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from strapdown.errors import Finding, check_choice
from strapdown.formats.columns import read_name
from strapdown.formats.sensor_streams import (
    ACCEL,
    FIX,
    GRAVITY,
    GYRO,
    LINEAR,
    MAG,
    PRESSURE,
    Event,
    is_event,
)
from strapdown.formats.sensorstream import blocks_of
from strapdown.live.lines import BadLineError, Measured, Sample, Word, parse_line
from strapdown.units import ACCEL_UNITS, GYRO_UNITS, MAG_UNITS, TIME_UNITS

#: Most values of a message, and characters of a name.
MOST_ENTRIES, LONGEST_NAME = 50_000, 40
PLATFORMS = ("auto", "android", "ios")


@dataclass(frozen=True)
class Message:
    """Message of Sensor Logger.

    Attributes
    ----------
    device, session : str
        Their identifiers.
    number : int or None
        Of the message, counted by the app.
    entries : sequence of mapping
    """

    device: str
    session: str
    number: int | None
    entries: Sequence[Any]


def plain_name(text: str) -> str:
    """Return a name that is safe for a folder and a terminal."""
    plain = re.sub(r"[^A-Za-z0-9]+", "-", text[: 4 * LONGEST_NAME]).strip("-")
    return plain[:LONGEST_NAME].strip("-") or "device"


def parse_sensor_logger(data: bytes | str) -> Message:
    """Parse a message of Sensor Logger.

    Raises
    ------
    BadLineError
        It is none.
    """
    try:
        said = json.loads(data)
    except (ValueError, RecursionError):
        raise BadLineError("message", "live.message-not-json") from None
    if not isinstance(said, dict) or not isinstance(said.get("payload"), list):
        raise BadLineError("message", "live.message-without-payload")
    if len(said["payload"]) > MOST_ENTRIES:
        raise BadLineError("message", "live.message-too-long", most=MOST_ENTRIES)
    names = [said.get(key, "") for key in ("deviceId", "sessionId")]
    if not all(isinstance(name, str | int) for name in names):
        raise BadLineError("message", "live.message-without-payload")
    number = said.get("messageId")
    plain = isinstance(number, int) and not isinstance(number, bool) and 0 <= number < 2**53
    return Message(
        str(names[0])[:200], str(names[1])[:200], number if plain else None, said["payload"]
    )


_NAMES = {
    "gyroscope": GYRO,
    "totalacceleration": ACCEL,
    "accelerometer": LINEAR,
    "gravity": GRAVITY,
    "magnetometer": MAG,
    "location": FIX,
    "barometer": PRESSURE,
}
_XYZ = ("x", "y", "z")
_FIELDS = {
    **dict.fromkeys((GYRO, ACCEL, LINEAR, GRAVITY, MAG), _XYZ),
    FIX: (
        *("latitude", "longitude", "altitude", "speed", "speedAccuracy", "bearing"),
        *("horizontalAccuracy", "verticalAccuracy"),
    ),
    PRESSURE: ("pressure",),
}
#: Fields of a fix that may be missing.
_OPTIONAL = frozenset(_FIELDS[FIX][3:])
_SIGNED = (LINEAR, GRAVITY)
#: Gravity along z, m/s², from which a phone at the start shows its screen to the sky.
UPRIGHT = 3.0


class SensorLoggerDevice:
    """Convert the values of one phone that Sensor Logger sends.

    Parameters
    ----------
    platform : {'auto', 'android', 'ios'}
        ``ios``: accelerations have the sign of iOS. ``auto``: that of Android if the phone sends
        ``totalacceleration``, which only Android has; otherwise so that its screen shows up at the
        first gravity.

    Attributes
    ----------
    findings : list of Finding
        That arose since it was last emptied.
    """

    def __init__(self, platform: str = "auto") -> None:
        check_choice("live.unknown-platform", PLATFORMS, quantity="--platform", platform=platform)
        self._sign = {"auto": None, "android": 1.0, "ios": -1.0}[platform]
        self.findings: list[Finding] = []

    def events(self, message: Message) -> tuple[list[Event], list[BadLineError]]:
        """Return the events of a message, each sensor's in order, and what cannot be used."""
        events: list[Event] = []
        bad: list[BadLineError] = []
        if self._sign is None:
            self._decide(message.entries)
        for entry in message.entries:
            try:
                event = self._event(entry)
            except BadLineError as error:
                bad.append(error)
                continue
            if event is not None:
                events.append(event)
        events.sort(key=lambda event: event.stamp)
        return events, bad

    def _decide(self, entries: Sequence[Any]) -> None:
        kinds = [_NAMES.get(str(e.get("name")).lower()) for e in entries if isinstance(e, Mapping)]
        if ACCEL in kinds:
            self._sign = 1.0
            return
        for entry in entries:
            if not isinstance(entry, Mapping) or str(entry.get("name")).lower() != "gravity":
                continue
            down = _number(_fields(entry).get("z"))
            if abs(down) >= UPRIGHT and math.isfinite(down):
                self._sign = math.copysign(1.0, down)
                system = "Android" if down > 0.0 else "iOS"
                code = "live.platform-not-stated"
                self.findings.append(Finding(code, system=system))
                return

    def _event(self, entry: Any) -> Event | None:
        """Return the event of a value; None of a sensor that is not used."""
        if not isinstance(entry, Mapping) or not isinstance(entry.get("name"), str):
            raise BadLineError("value", "live.value-not-understood")
        kind = _NAMES.get(entry["name"].lower())
        if kind is None:
            return None
        sign = 1.0
        if kind in _SIGNED:
            if self._sign is None:
                raise BadLineError("acceleration of unknown sign", "live.sign-not-known")
            sign = self._sign
        fields = _fields(entry)
        stamp = _stamp(entry.get("time"))
        needed = [name for name in _FIELDS[kind] if name not in _OPTIONAL and name not in fields]
        if stamp is None or needed:
            raise BadLineError(entry["name"][:20], "live.value-not-understood")
        values = tuple(sign * _number(fields.get(name)) for name in _FIELDS[kind])
        return checked(Event(kind, stamp, values))


def checked(event: Event) -> Event:
    """Refuse numbers that no sensor gives."""
    if not is_event(*event):
        raise BadLineError("value beyond limits", "live.value-beyond-any-sensor")
    return event


def _fields(entry: Mapping[str, Any]) -> Mapping[str, Any]:
    fields = entry.get("values")
    return fields if isinstance(fields, Mapping) else entry


def _number(value: Any) -> float:
    """Return a number; NaN of anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return math.nan
    try:
        return float(value)
    except (ValueError, OverflowError):
        return math.nan


def _stamp(value: Any) -> int | None:
    """Return a whole stamp, which some languages write as text or with an exponent."""
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    if isinstance(value, str) and re.fullmatch(r"-?\d{1,19}", value, re.ASCII):
        return int(value)
    number = _number(value)
    return round(number) if math.isfinite(number) else None


# phyphox: buffers of an experiment.


#: Inputs by the names that the file format gives them; and of buffers in the app's own experiments.
_INPUTS = {"gyroscope": GYRO, "accelerometer": ACCEL, "magnetic_field": MAG}
_OWN = {
    GYRO: (("gyrX", "gyrY", "gyrZ", "gyr_time"), ("gyroX", "gyroY", "gyroZ", "gyro_time")),
    ACCEL: (("accX", "accY", "accZ", "acc_time"),),
    MAG: (("magX", "magY", "magZ", "mag_time"),),
}
Buffers = dict[int, tuple[str, str, str, str]]


def phyphox_buffers(config: Any) -> Buffers:
    """Return the buffers of x, y, z and time of each sensor that an experiment has.

    Parameters
    ----------
    config : object
        Answer of ``/config``; of none, or of one that names neither inputs nor buffers, those of
        the app's own experiments.
    """
    found: Buffers = {}
    config = config if isinstance(config, Mapping) else {}
    inputs = config.get("inputs")
    for one in inputs if isinstance(inputs, list) else []:
        if not isinstance(one, Mapping) or one.get("source") not in _INPUTS:
            continue
        outputs = one.get("outputs")
        whole: dict[str, Any] = {}
        for output in outputs if isinstance(outputs, list) else [outputs]:
            whole |= output if isinstance(output, Mapping) else {}
        names = tuple(whole.get(axis) for axis in ("x", "y", "z", "t"))
        if all(isinstance(name, str) for name in names):
            found[_INPUTS[one["source"]]] = names  # type: ignore[assignment]
    buffers = config.get("buffers")
    named = [b.get("name") for b in buffers if isinstance(b, Mapping)] if buffers else None
    for kind, forms in _OWN.items():
        if kind not in found:
            there = [f for f in forms if named is None or set(f) <= set(named)]
            found |= {kind: there[0]} if there else {}
    return found


def phyphox_events(answer: Any, buffers: Buffers, newest: dict[int, float]) -> list[Event]:
    """Return the events of an answer of ``/get``, and note the newest stamp of each sensor.

    Values are written with about eight digits; stamps are in s from the start of the experiment.

    Raises
    ------
    BadLineError
        It is no such answer.
    """
    held = answer.get("buffer") if isinstance(answer, Mapping) else None
    if not isinstance(held, Mapping):
        raise BadLineError("answer", "live.answer-not-understood")
    events: list[Event] = []
    for kind, names in buffers.items():
        columns = []
        for name in names:
            one = held.get(name)
            values = one.get("buffer") if isinstance(one, Mapping) else None
            columns.append(values if isinstance(values, list) else [])
        # Between two buffers of an answer a sample may have come: the newest ones belong together.
        count = min(map(len, columns))
        for x, y, z, t in zip(*(c[:count] for c in columns), strict=True):
            values, time = tuple(map(_number, (x, y, z))), _number(t)
            if not math.isfinite(time) or time <= newest.get(kind, -math.inf):
                continue
            if is_event(kind, stamp := round(time * 1e9), values):
                newest[kind] = time
                events.append(Event(kind, stamp, values))
    events.sort(key=lambda event: event.stamp)
    return events


# Lines: our own, those of Sensorstream, and tables with a header.


_STREAMED = {3: ACCEL, 4: GYRO, 5: MAG}
_TRIADS = {"gyro": GYRO, "accel": ACCEL, "mag": MAG}
_UNITS = {"gyro": GYRO_UNITS, "accel": ACCEL_UNITS, "mag": MAG_UNITS}


class LineDevice:
    """Read the lines of one sender: a serial port or an address.

    A line that names columns, as ``time_s,gyro_x_deg_s,…``, makes those after it rows of a table.

    Parameters
    ----------
    aids : sequence of str
        Names of the measurements that lines may hold.
    """

    def __init__(self, aids: Sequence[str] = ()) -> None:
        self._aids = aids
        self._columns: list[tuple[str, float]] | None = None

    def parse(self, text: str, now: float) -> list[Event | Measured | Word]:
        """Return what a line says.

        Parameters
        ----------
        now : float, s
            Stamp of a row of a table without a column of time.

        Raises
        ------
        BadLineError
            The line is not understood.
        """
        text = text.strip()
        if not text or text.startswith("#"):
            return []
        if (header := _header(text)) is not None:
            self._columns = header
            return []
        number = text[:1].isdigit() or text[:1] in "-+."
        if number and self._columns is not None:
            return list(self._row(text, now))
        if number and (streamed := blocks_of(text)) is not None:
            stamp, blocks = streamed
            if not {3, 4} & set(blocks):
                raise BadLineError(
                    "sensorstream without a sensor",
                    "live.sensorstream-without-sensor",
                    gyro=4,
                    accel=3,
                )
            return [
                checked(Event(kind, _ns(stamp), blocks[block]))
                for block, kind in _STREAMED.items()
                if block in blocks
            ]
        said = parse_line(text, self._aids)
        if isinstance(said, Sample):
            stamp = _ns(said.time)
            gyro, accel = said.values[:3], said.values[3:]
            return [checked(Event(GYRO, stamp, gyro)), checked(Event(ACCEL, stamp, accel))]
        return [] if said is None else [said]

    def _row(self, text: str, now: float) -> list[Event]:
        assert self._columns is not None
        fields = [part.strip() for part in re.split(r"[,;\t]", text)]
        if len(fields) != len(self._columns):
            raise BadLineError(
                "row", "live.row-of-other-width", count=len(fields), needed=len(self._columns)
            )
        values = {
            quantity: factor * _number(field)
            for (quantity, factor), field in zip(self._columns, fields, strict=True)
            if quantity
        }
        stamp = _ns(values.get("time", now))
        events = []
        for triad, kind in _TRIADS.items():
            names = [f"{triad}_{axis}" for axis in _XYZ]
            if all(name in values for name in names):
                events.append(checked(Event(kind, stamp, tuple(values[n] for n in names))))
        return events


def _ns(seconds: float) -> int:
    if not abs(seconds) < 9e9:
        raise BadLineError("value beyond limits", "live.value-beyond-any-sensor")
    return round(seconds * 1e9)


def _header(text: str) -> list[tuple[str, float]] | None:
    """Return quantity and factor to SI of each column that a line names; None if it names none.

    BadLineError: a name states no unit, or an unknown one.
    """
    names = [part.strip().strip('"') for part in re.split(r"[,;\t]", text)]
    if len(names) < 3 or any(re.fullmatch(r"[-+.\d].*", name) for name in names):
        return None
    columns, known = [], 0
    for name in names:
        said = read_name(name)
        quantity, triad = str(said.quantity or ""), str(said.quantity or "").partition("_")[0]
        factor = 0.0
        if quantity == "time":
            factor = TIME_UNITS.get(said.unit or "s", 0.0)
        elif triad in _TRIADS:
            factor = _UNITS[triad].get(said.unit or "", 0.0)
            known += 1
            if not factor:
                raise BadLineError("header", "live.column-without-unit", name=name[:40])
        columns.append((quantity if factor else "", factor))
    return columns if known >= 3 else None
