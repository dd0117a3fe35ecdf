"""What is fuzzed: our own parsers, each given one file; what else it needs lies beside that file.

A target reads a file and checks the result. A result holds finite numbers; anything else is a
`StrapdownError`. An exception of ours that a net caught at the boundary counts as a failure: the
reader fell over.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import strapdown as sd
from strapdown.errors import Finding, StrapdownError, printable

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
SEEDS, CORPUS = HERE / "seeds", HERE / "corpus"


class FellOverError(AssertionError):
    """A reader that raised what is not a `StrapdownError`, or returned what is not a number."""


@dataclass(frozen=True)
class Target:
    """One kind of file.

    Attributes
    ----------
    run : callable
        Reads a file and checks what it returns.
    seeds : callable
        Yields names and contents of files that are read.
    beside : mapping of str to bytes
        Further files of the folder, by their paths in it.
    """

    run: Callable[[Path], None]
    seeds: Callable[[], Iterator[tuple[str, bytes]]]
    beside: Callable[[], dict[str, bytes]] = dict


def refusal(error: StrapdownError) -> None:
    """Check an error: what was caught in our own code is none, and each has its sentence."""
    inner: list[Finding] = [error.finding]
    while inner:
        one = inner.pop()
        caught = one.code == "io.not-of-format"
        caught |= one.code == "io.crash-record-unreadable" and "Unicode" in str(one.data["name"])
        caught |= one.code == "io.crash-record-unreadable" and one.data["name"] == "ValueError"
        if caught:
            raise FellOverError(f"caught at the boundary: {one.what}") from error.__context__
        inner += [v for v in one.data.values() if isinstance(v, Finding)]
    text = error.finding.text("cli")
    _shown(text)


def _shown(text: str) -> None:
    if not text or printable(text, lines=True) != text:
        raise FellOverError(f"control characters in a message: {text!r}")


def finite(values: object, *, missing: bool = False) -> None:
    """Check numbers; `missing`: some may be unknown."""
    array = np.asarray(values, dtype=np.float64)
    good = ~np.isneginf(array) if missing else np.isfinite(array)
    if not good.all():
        raise FellOverError("not a finite number")


def _table(table: object, *, missing: bool = False) -> None:
    finite(table.index)
    finite(table.to_numpy(), missing=missing)
    for finding in table.attrs.get("findings", ()):
        _shown(finding.text("cli"))


def _log(path: Path) -> None:
    try:
        _table(sd.read_imu(path))
    except StrapdownError as error:
        refusal(error)
        _table(sd.read_imu(path, repair=True))


def _gnss(path: Path) -> None:
    try:
        _table(sd.read_gnss(path), missing=True)
    except StrapdownError as error:
        refusal(error)
        _table(sd.read_gnss(path, repair=True), missing=True)


def _trajectory(path: Path) -> None:
    _table(sd.read_trajectory(path))


def _aid(path: Path) -> None:
    from strapdown.formats.aid_table import read_aid_table, read_reference_path
    from strapdown.formats.references import read_reference_words

    for call in (
        lambda: _table(read_aid_table(path, {"speed": "m/s", "speed_sd": "m/s"}, repair=True)),
        lambda: _table(read_reference_path(path), missing=True),
        lambda: read_reference_words(path),
    ):
        try:
            call()
        except StrapdownError as error:
            refusal(error)
    _table(read_aid_table(path, {"pressure": "Pa"}, instead=("alt", "m")))


def _navigation(path: Path) -> None:
    from strapdown.config.navigation import NavigationSpec

    NavigationSpec.read(path, files=False)


def _alignment(path: Path) -> None:
    from strapdown.config.alignment import AlignmentSpec

    AlignmentSpec.read(path, files=False)


def _scenario(path: Path) -> None:
    from strapdown.config.motions import TrajectorySpec
    from strapdown.config.sources import ScenarioFile, is_scenario_file

    (ScenarioFile if is_scenario_file(path) else TrajectorySpec).read(path, files=False)


def _case(path: Path) -> None:
    from strapdown.config.crash_case import CaseSpec

    CaseSpec.read(path, files=False)


def _sensor(path: Path) -> None:
    from strapdown.sensors.catalogue import load_sensor

    sensor = load_sensor(path)
    sensor.draw(1)
    finite([figure.value for figure in sensor.sources])


def _severity(path: Path) -> None:
    from strapdown.crash.severity import load_severity_model

    load_severity_model(path)


def _manifest(path: Path) -> None:
    from strapdown.bundle import read_manifest

    read_manifest(path.parent)


def _line(path: Path) -> None:
    from strapdown.live.lines import BadLineError, Sample, parse_line

    for line in path.read_text(encoding="utf-8", errors="replace").split("\n"):
        try:
            parsed = parse_line(line, ["gnss", "speed"])
        except BadLineError as error:
            _shown(error.finding.text("cli"))
            continue
        if isinstance(parsed, Sample):
            finite([parsed.time, *parsed.values])


def _crash(path: Path) -> None:
    from strapdown.formats.crash_triad import triad_of_channels

    record = sd.read_crash_record(path if path.parent.name == "file" else path.parent)
    for channel in record.channels:
        if not channel.name.isprintable():
            raise FellOverError(f"control characters in a name: {channel.name!r}")
        try:
            time, _ = channel.load()
            finite(time)
            triad_of_channels(record, {"x": channel.name}, quantity="acceleration")
        except StrapdownError as error:
            refusal(error)


def _kept(kind: str) -> Callable[[], Iterator[tuple[str, bytes]]]:
    def seeds() -> Iterator[tuple[str, bytes]]:
        for path in sorted((SEEDS / kind).iterdir()):
            yield path.name, path.read_bytes()

    return seeds


def _of_tree(*patterns: str) -> Callable[[], Iterator[tuple[str, bytes]]]:
    def seeds() -> Iterator[tuple[str, bytes]]:
        for pattern in patterns:
            for path in sorted(ROOT.glob(pattern)):
                yield path.name, path.read_bytes()

    return seeds


def _any_table() -> Iterator[tuple[str, bytes]]:
    head = b"time_s,speed_m_s,speed_sd_m_s,pressure_hPa,lat_deg,lon_deg,alt_m\n"
    rows = (b"%d.5,%d,0.1,1013.2,50.1,30.%d,120\n" % (k, k, k) for k in range(9))
    yield "aid.csv", head + b"".join(rows)
    yield "references.csv", b"kind,time_s,turns,axis,since_s\nsame,5,,,1\nturns,9,2,z,1\n"
    yield "references.toml", b'references = ["5.0 same as 1.0", "9 2 turns about z since 1"]\n'
    yield "references.txt", b"5.0 same as 1.0\n9 2 turns about z since 1\n"


def _any_case() -> Iterator[tuple[str, bytes]]:
    from tests.unit.config.good_case import TEXT

    yield "case.toml", TEXT.encode()


def _any_model() -> Iterator[tuple[str, bytes]]:
    from tests.unit.crash.test_severity import FILE

    yield "own.toml", FILE.encode()


def _any_lines() -> Iterator[tuple[str, bytes]]:
    lines = [b"imu,0.01,0.1,0.2,-0.3,0,0,-9.81", b"# remark", b"command,fine", b"accel,1,0,0,9"]
    lines += [b"gnss,1.0,lat=50.1,lon=30.2,alt=120,north_sd=2", b"speed,2,speed=3.5,speed_sd=0.1"]
    lines += [b"20.5, 3, 0.1,0.2,9.8, 4, 0.01,0.02,0.03, 5, 22,1,-40"]
    yield "lines.txt", b"\n".join(lines)


def _any_manifest() -> Iterator[tuple[str, bytes]]:
    digest = "0" * 64
    manifest = {
        "schema": _schema(),
        "command": "attitude",
        "configuration": {"source": {"path": "inputs/log/imu.csv"}, "rates_hz": [100.0]},
        "inputs": [{"name": "inputs/log/imu.csv", "sha256": digest, "bytes": 3, "kept": "copy"}],
        "outputs": [{"name": "report.html", "sha256": digest, "bytes": 5}],
        "versions": {"strapdown": "0.2.0"},
        "environment": ["numpy==2.0"],
        "platform": {"system": "Linux"},
    }
    yield "manifest.json", json.dumps(manifest, indent=1).encode()


def _schema() -> str:
    from strapdown.bundle import SCHEMA

    return SCHEMA


def _crash_files() -> dict[str, bytes]:
    from tests.property import test_crash_record_fuzz as crash

    return {n if "/" in n else f"file/{n}": data for n, data in crash.SEEDS.items()}


#: By name; the folder of its reproducers has the same.
TARGETS: dict[str, Target] = {
    "log": Target(_log, _kept("log")),
    "gnss": Target(_gnss, _kept("gnss")),
    "trajectory": Target(_trajectory, _kept("trajectory")),
    "aid": Target(_aid, _any_table),
    "navigation": Target(_navigation, _of_tree("docs/examples/navigate_*.toml")),
    "alignment": Target(_alignment, _of_tree("docs/examples/*_stand.toml")),
    "scenario": Target(
        _scenario, _of_tree(*(f"docs/examples/{n}.toml" for n in ("pulses", "car", "ship")))
    ),
    "case": Target(_case, _any_case),
    "sensor": Target(_sensor, _of_tree("src/strapdown/sensors/catalogue/*.toml")),
    "severity": Target(_severity, _any_model),
    "manifest": Target(_manifest, _any_manifest),
    "line": Target(_line, _any_lines),
    "crash": Target(_crash, lambda: iter(_crash_files().items()), _crash_files),
}


def give(target: Target, folder: Path, name: str, data: bytes) -> bool:
    """Write an input into an empty folder and run the target; whether it was read.

    What is neither read nor refused is raised.
    """
    if "/" in name and not name.startswith("file/"):
        for other, content in target.beside().items():
            if other.split("/")[0] == name.split("/")[0]:
                (folder / other).parent.mkdir(parents=True, exist_ok=True)
                (folder / other).write_bytes(content)
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    try:
        target.run(path)
    except StrapdownError as error:
        refusal(error)
        return False
    finally:
        with suppress(OSError):
            path.unlink()
    return True
