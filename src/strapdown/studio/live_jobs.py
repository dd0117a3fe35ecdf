"""Live runs in the studio: who may send, and the command that receives it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from strapdown.config.navigation import NavigationSpec
from strapdown.config.toml_file import read_toml
from strapdown.constants import TWO_SIDED_95
from strapdown.errors import ConfigError, Finding, StrapdownError, check_choice, printable
from strapdown.report.values import GAP, bounded, on_ground
from strapdown.studio.configuration import LONGEST, refuse_outside
from strapdown.studio.folder import Folder


@dataclass(frozen=True)
class LiveField:
    """One option of a protocol: the flag that it becomes, and what a page shows of it."""

    flag: str
    label: str
    help: str
    default: str = ""
    kind: str = "text"
    choices: tuple[str, ...] = ()
    unit: str = ""
    #: Addresses to choose from, and who reaches them; another one may be written.
    places: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Protocol:
    """One way in which samples come."""

    title: str
    help: str
    fields: tuple[LiveField, ...]


#: Port of each address that is offered: an app of a phone keeps it.
PORT = 8437
#: Configurations that are offered.
MOST = 100

_AT = LiveField(
    "--listen",
    "Address",
    "HOST:PORT of this machine; 127.0.0.1 is for this machine alone, 0.0.0.0 for phones in your "
    "network",
    f"127.0.0.1:{PORT}",
    places=(
        (f"127.0.0.1:{PORT}", "Programs on this computer alone"),
        (f"0.0.0.0:{PORT}", "Phones in the same network, too"),
    ),
)
_EVERY = LiveField(
    "--every", "Interval of states", "least time between two", "0.1", "number", (), "s"
)
_END = LiveField(
    "--stop-after", "End after", "otherwise it ends when it is stopped", "", "number", (), "s"
)

#: Key of the configuration of a navigation, beside the fields of every protocol.
RUN = "run"
PROTOCOLS = {
    "sensor-logger": Protocol(
        "Sensor Logger",
        "The app of a phone sends by HTTP or WebSocket.",
        (
            _AT,
            LiveField(
                "--platform",
                "Phone",
                "sign of its accelerations",
                "auto",
                "choice",
                ("auto", "android", "ios"),
            ),
            _EVERY,
            _END,
        ),
    ),
    "phyphox": Protocol(
        "phyphox",
        "A phone with remote access is asked.",
        (LiveField("--phyphox", "Address", "HOST:PORT that the phone shows"), _EVERY, _END),
    ),
    "udp": Protocol(
        "Lines in datagrams",
        "Sensorstream, or lines of your own.",
        (
            LiveField("--udp", "Address", "HOST:PORT of this machine", "127.0.0.1:5555"),
            _EVERY,
            _END,
        ),
    ),
    "serial": Protocol(
        "Serial port",
        "Lines or rows of a board.",
        (LiveField("--serial", "Port", "PORT@BAUD, such as /dev/ttyUSB0@115200"), _EVERY, _END),
    ),
    "mqtt": Protocol(
        "MQTT",
        "Sensor Logger by a broker.",
        (LiveField("--mqtt", "Broker", "mqtt://HOST/TOPIC"), _EVERY, _END),
    ),
}


def live_info(folder: Path) -> dict[str, Any]:
    """Return the protocols with their fields, and the configurations to navigate by.

    ``configurations``: files right in the folder that are the configuration of a navigation,
    without open values.
    """
    return {
        "protocols": [
            {
                "name": name,
                "title": one.title,
                "help": one.help,
                "fields": [
                    {
                        "key": field.flag.removeprefix("--"),
                        "label": field.label,
                        "unit": field.unit,
                        "type": field.kind,
                        "choices": list(field.choices),
                        "default": field.default,
                        "help": field.help,
                        "places": [list(one) for one in field.places],
                    }
                    for field in one.fields
                ],
            }
            for name, one in PROTOCOLS.items()
        ],
        "configurations": list(_navigations(Folder(folder))),
        "warning": Finding("studio.live-open").sentence("studio"),
    }


def _navigations(folder: Folder) -> Iterator[str]:
    """Yield the names of files by which a live run can navigate."""
    names = sorted(p.name for p in folder.path.iterdir() if p.name.lower().endswith(".toml"))
    for name in names[:MOST]:
        with suppress(StrapdownError, OSError, ValueError):
            if (folder.path / name).stat().st_size <= LONGEST:
                yield _configuration(folder, name)


#: Quantities of a state line, as they are shown: name, unit, and the key of the standard deviation.
SHOWN = {
    "lat": ("Latitude", "m", "north_sd"),
    "lon": ("Longitude", "m", "east_sd"),
    "alt": ("Height", "m", "down_sd"),
    "VN": ("Velocity north", "m/s", "VN_sd"),
    "VE": ("Velocity east", "m/s", "VE_sd"),
    "VD": ("Velocity down", "m/s", "VD_sd"),
    "roll": ("Roll", "deg", "roll_sd"),
    "pitch": ("Pitch", "deg", "pitch_sd"),
    "heading": ("Heading", "deg", "heading_sd"),
}
#: Keys of a state line that are not quantities of the state.
STAMPS = ("time", "unix")


def shown_state(line: Mapping[str, Any]) -> list[dict[str, str]]:
    """Return the numbers of a state line as the reports show them: name, value, 95 % bound.

    The bound is empty where the line has no standard deviation.
    """
    found = []
    for key in line:
        value = _finite(line, key)
        if value is None or key in STAMPS or key.endswith("_sd"):
            continue
        name, unit, of_sd = SHOWN.get(key, (key.replace("_", " "), "", f"{key}_sd"))
        sd = _finite(line, of_sd)
        half = None if sd is None or sd <= 0.0 else TWO_SIDED_95 * sd
        if key in ("lat", "lon"):
            said, bound = on_ground(value, half)
        else:
            said, bound = bounded(value, math.inf if half is None else half)
            said = f"{said}{GAP}{unit}" if unit else said
        bound = f"{bound}{GAP}{unit}" if bound and unit else bound
        found.append({"name": name, "value": said, "bound": bound})
    return found


def _finite(line: Mapping[str, Any], key: str) -> float | None:
    """Return a number of a line; None: there is none. A line is data of another machine."""
    value = line.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if abs(value) < BEYOND else None


#: Numbers that no state has.
BEYOND = 1e30


def live_command(folder: Path, name: str, protocol: str, options: Mapping[str, Any]) -> list[str]:
    """Return the command of a live run, as words after ``strapdown``.

    Parameters
    ----------
    folder : Path
        Of the studio.
    name : str
        Of the folder of the sessions.
    protocol : str
        Of `PROTOCOLS`.
    options : mapping
        Values by the names of its fields, and ``run``: a file of the folder, the configuration of a
        navigation, without which an attitude is computed.

    Raises
    ------
    ConfigError
        The protocol or an option of it is not known, or its value is none; the configuration is
        wrong, or names a file outside of the folder.
    """
    check_choice("studio.unknown-protocol", PROTOCOLS, quantity="protocol", word=protocol)
    fields = {one.flag.removeprefix("--"): one for one in PROTOCOLS[protocol].fields}
    words = ["live"]
    for key in options:
        if key not in fields and key != RUN:
            raise ConfigError("studio.unknown-key", word=str(key)[:80], known=[*fields, RUN])
    if options.get(RUN) not in (None, ""):
        words.append(_configuration(Folder(folder), options[RUN]))
    for key, field in fields.items():
        value = options.get(key)
        if value in (None, ""):
            value = field.default
        if value in (None, ""):
            if field.kind == "number":
                continue
            raise ConfigError("studio.wrong-type", quantity=key, wanted=field.label)
        words.append(f"{field.flag}={_text(key, value, field)}")
    return [*words, "--lines=json", "--out", name]


def _configuration(folder: Folder, name: Any) -> str:
    """Return the configuration of a navigation as a word of a command, once it is checked."""
    if not isinstance(name, str) or not name.lower().endswith(".toml"):
        raise ConfigError("studio.wrong-type", quantity=RUN, wanted="name of a .toml file")
    file = read_toml(folder.file(name))
    refuse_outside(folder, file)
    NavigationSpec.of_file(file)
    return name


def _text(key: str, value: Any, field: LiveField) -> str:
    """Value of an option as a word; ConfigError: it is none."""
    if field.kind == "number":
        try:
            found = float(value)
        except (TypeError, ValueError):
            found = math.nan
        if not math.isfinite(found):
            raise ConfigError("studio.wrong-type", quantity=key, wanted="number")
        return f"{found:g}"
    text = value if isinstance(value, str) else ""
    if not text or len(text) > 300 or printable(text) != text:
        raise ConfigError("studio.wrong-type", quantity=key, wanted="text")
    if field.choices:
        check_choice("studio.unknown-choice", field.choices, quantity=key, word=text)
    return text
