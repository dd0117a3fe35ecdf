"""Results in the studio: what a sealed folder holds, as numbers, series, track and downloads.

A result may come from anyone: its manifest and its files are data, which are read in the process
for reading and checked before they are shown. Only files that the manifest lists, and those beside
the seal, are given away.
"""

from __future__ import annotations

import html
import json
import re
import shlex
import shutil
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np
import pandas as pd

from strapdown import rotation
from strapdown.bundle import (
    MANIFEST,
    SIGNATURE_FILE,
    UNSEALED,
    named_paths,
    read_manifest,
    resolved,
    sha256,
)
from strapdown.config.logs import FixesTable
from strapdown.config.spec import specify
from strapdown.constants import Array
from strapdown.errors import ConfigError, DataError, Finding, StrapdownError, check_choice
from strapdown.formats.trajectory_readers import read_trajectory
from strapdown.navigation.heading_integrity import STATUSES
from strapdown.studio.folder import Folder, repeating
from strapdown.studio.kinds import KINDS
from strapdown.studio.look import kept_stream
from strapdown.studio.pyramid import LIST
from strapdown.tables import EULER, QUATERNION
from strapdown.tables.checks import find_gaps, index_of

if TYPE_CHECKING:
    from strapdown.report.compare_folders import SealedRun

#: Tables of a result with its values over time, the first that it has; and that of the standard
#: deviations, whose stamps may be others.
TABLES, SD = ("trajectory.csv", "attitude.csv", "error_growth.csv", "allan.csv"), "sd.csv"
#: JSON of each command, with the answer.
ANSWERS = {"navigate": "navigation.json"}
#: Largest file that is read as JSON or as a table, bytes; findings and fixes that are listed.
LARGEST, MOST = 256 << 20, 500
#: Bytes of the JSON of which the list of results shows the verdict.
SMALL = 2 << 20
#: Units by the ending of a column, the longest first.
ENDINGS = {
    "_m_per_s2": "m/s²",
    "_deg_per_s": "deg/s",
    "_m_per_s": "m/s",
    "_m_s": "m/s",
    "_deg": "deg",
    "_m": "m",
    "_s": "s",
}
#: Configuration of a crash beside its simulated records.
CASE = "case.toml"
#: Downloads that are kept until the next ones.
KEPT = 4
EXPORTS = ("zip", "pdf", "gpx", "toml")


# --- what is read by the server -----------------------------------------------------------


def summary(folder: Path, name: str) -> dict[str, Any]:
    """Return what the list of results shows of one: command, title, digest, instant, verdict."""
    place = folder / name
    manifest = read_manifest(place)
    about = (place / MANIFEST).stat()
    return {
        "name": name,
        "command": str(manifest["command"])[:40],
        "title": _title(manifest, name),
        "made": about.st_mtime,
        "digest": sha256(place / MANIFEST),
        "verdict": _verdict(place, manifest),
        # A simulated crash comes with the case that reconstructs it.
        "case": manifest["command"] == "simulate" and (place / CASE).is_file(),
    }


def _title(manifest: Mapping[str, Any], name: str) -> str:
    """Title that the configuration states, or the name of the folder."""
    configuration = manifest.get("configuration")
    for table in configuration.values() if isinstance(configuration, dict) else ():
        title = table.get("title") if isinstance(table, dict) else None
        if isinstance(title, str) and title.strip():
            return title[:200]
    return name


def _verdict(place: Path, manifest: Mapping[str, Any]) -> str | None:
    """The verdict of a navigation or of an attitude, where its JSON is not large."""
    found = _answer(place, manifest, SMALL)
    said = [_word(found.get(key), "verdict") for key in ("trust", "answer")]
    return next((one[:40] for one in said if one is not None), None)


def file_of_run(folder: Path, name: str, path: str) -> Path:
    """Return a file of a result that its manifest lists, or that is beside the seal.

    ConfigError: there is none, or the path leads elsewhere.
    """
    place = Folder(folder).file(name)
    return file_in(place, path, read_manifest(place))


def file_in(place: Path, path: str, manifest: Mapping[str, Any]) -> Path:
    """Return a file of a result: ConfigError if it is none."""
    listed = {str(one["name"]) for one in manifest["outputs"]}
    listed |= {str(one["name"]) for one in manifest["inputs"] if one.get("kept") == "copy"}
    own = path in UNSEALED or path == MANIFEST or SIGNATURE_FILE.fullmatch(path) is not None
    missing = ConfigError("studio.no-such-file", file=path[:80])
    if path not in listed and not own:
        raise missing
    # A manifest is data: what it lists must be in the folder, too.
    try:
        found = (place / path).resolve(strict=True)
    except (OSError, ValueError, RuntimeError):
        raise missing from None
    if not found.is_relative_to(place.resolve()) or not found.is_file():
        raise missing
    return found


# --- one result ---------------------------------------------------------------------------


def run(folder: Path, name: str) -> dict[str, Any]:
    """Return the numbers, options, inputs and findings of a result."""
    place, manifest = _opened(folder, name)
    from strapdown.report.compare_folders import open_run
    from strapdown.report.compare_numbers import is_over_ground

    answer, sealed = _answer(place, manifest), open_run(place, place.name)
    span: dict[str, Any] = {"from_s": None, "to_s": None}
    with suppress(StrapdownError):
        listed = json.loads((Path(run_stream(folder, name)) / LIST).read_text(encoding="utf-8"))
        span = {key: listed[key] for key in span}
    has = {str(one["name"]) for one in manifest["outputs"]}
    against = [_finding(one) for one in _list(answer.get("trust"), "against")[:MOST]]
    noticed = [_finding(one) for one in _list(answer, "findings")[:MOST]]
    if manifest["command"] == "attitude":
        # A finding without a file is of one of several algorithms, which the report names, too.
        for one in noticed:
            if one["quantity"] and not one["file"]:
                one["text"] = f"{one['quantity']}: {one['text']}"
    said = {(one["code"], one["text"]) for one in noticed}
    return {
        **summary(folder, name),
        **span,
        "answer": _word(answer, "answer") or _word(answer, "headline"),
        "numbers": _numbers(sealed),
        "options": options_table(sealed),
        "inputs": [
            {key: one.get(key) for key in ("role", "name", "kept", "sha256", "bytes")}
            for one in manifest["inputs"]
        ],
        # Without a heading the path of a crash is along the axes of the vehicle at its entry.
        "heading": _heading(sealed),
        "over_ground": manifest["command"] != "crash" or is_over_ground(answer),
        # Why the verdict is not the best one; a reason is noticed, too, and once.
        "against": against,
        "premises": _premises(answer) if manifest["command"] == "attitude" else [],
        "begins": _word(answer.get("initial"), "method"),
        "findings": [one for one in against if (one["code"], one["text"]) not in said] + noticed,
        "versions": manifest["versions"],
        "verifying": shlex.join(("strapdown", "verify", name)),
        "command_line": _repeating(folder, manifest, name),
        "figures": _figures(place, manifest, name),
        "report": f"runs/{name}/report.html" if "report.html" in has else None,
        "has": {
            "track": "trajectory.csv" in has and manifest["command"] == "navigate",
            "attitude": bool({"trajectory.csv", "attitude.csv"} & has),
            "series": bool(set(TABLES) & has),
            "pdf": "report.pdf" in has,
            "toml": _configuration(manifest) is not None,
        },
    }


#: Drawings of a crash that its report begins with, beside its numbers: file and title.
DRAWINGS = {
    "pdof": "Direction of force",
    "path": "Path from above",
    "measuring-points": "Change of velocity at the measuring points",
    "severity": "Severity",
}
#: Size of a drawing, at its beginning.
SIZE = re.compile(rb'<svg [^>]*?width="(\d{1,6}(?:\.\d{1,6})?)" height="(\d{1,6}(?:\.\d{1,6})?)"')
#: Title of a drawing, which says in words what it shows.
TITLE = re.compile(rb"<title>([^<]{1,2000})</title>")


def _figures(place: Path, manifest: Mapping[str, Any], name: str) -> list[dict[str, Any]]:
    """List the drawings of the report of a crash that are shown beside its numbers.

    Each has its ``title``, its ``address``, ``alt``: what it shows, in words, and ``width`` and
    ``height``, which a page keeps free for it.
    """
    found = []
    for slug, title in DRAWINGS.items() if manifest["command"] == "crash" else ():
        with suppress(ConfigError, OSError):
            file = f"figures/{slug}.svg"
            with file_in(place, file, manifest).open("rb") as drawn:
                head = drawn.read(8192)
            said, size = TITLE.search(head), SIZE.search(head)
            width, height = (400.0, 300.0) if size is None else map(float, size.groups())
            alt = title if said is None else html.unescape(said[1].decode(errors="replace"))
            one = {"title": title, "address": f"runs/{quote(name)}/{file}", "alt": alt}
            found.append({**one, "width": width, "height": height})
    return found


def _opened(folder: Path, name: str) -> tuple[Path, dict[str, Any]]:
    place = Folder(folder).file(name)
    return place, read_manifest(place)


def _answer(place: Path, manifest: Mapping[str, Any], most: int | None = None) -> dict[str, Any]:
    """Return the JSON of a result; empty if it has none, or of more bytes than so many."""
    command = str(manifest["command"])
    with suppress(ConfigError, OSError, ValueError, RecursionError):
        path = file_in(place, ANSWERS.get(command, f"{command}.json"), manifest)
        if path.stat().st_size <= (most or LARGEST):
            found = json.loads(path.read_text(encoding="utf-8"))
            return found if isinstance(found, dict) else {}
    return {}


def _numbers(sealed: SealedRun) -> list[dict[str, Any]]:
    """Return the numbers of a result with their 95 % bounds: those that `compare` compares."""
    from strapdown.report.compare import NumberRow, units_of
    from strapdown.report.compare_document import shown_row
    from strapdown.report.compare_numbers import values_of

    found, system = [], units_of(sealed)
    for part in sealed.parts:
        for one in values_of(part):
            said = shown_row(NumberRow(one.key, (one,), (None,), (None,)), system)
            found.append(
                {
                    "group": one.group,
                    "label": one.label,
                    "value": said["values"][0],
                    "bound": said["bounds"][0],
                    "unit": said["unit"],
                    # A bound of a latitude or a longitude is along the ground.
                    "bound_unit": said["bound_unit"],
                    "note": one.note,
                }
            )
    return found[:MOST]


def _premises(answer: Mapping[str, Any]) -> list[str]:
    """Return what an attitude begins with, and why the answer is what it is."""
    from strapdown.report.attitude_words import premises

    found = [one for one in _list(answer.get("answer"), "why") if isinstance(one, str)]
    # What another program wrote may have another form: it is then omitted.
    with suppress(KeyError, TypeError, ValueError):
        said = premises(answer["initial"], answer["gyro_bias"])
        found = [*(f"{name}: {text}" for name, text in said), *found]
    return [one[:500] for one in found[:20]]


def _heading(sealed: SealedRun) -> str | None:
    """Return what the heading integrity says, of a navigation whose heading was not all trusted."""
    from strapdown.report.verdict import heading_sentence

    if sealed.command != "navigate":
        return None
    # What another program wrote may have another form: it is then omitted.
    with suppress(StrapdownError, KeyError, IndexError, TypeError, ValueError, AttributeError):
        told = sealed.parts[0].json("verdict.json")["heading"]
        shares = {status: float(told["share"][status]) for status in STATUSES}
        if shares["trusted"] < 1.0:
            last, check = told["spans"][-1], told["confirmed_by"] or ""
            why_not = "; ".join(_finding(one)["text"] for one in told["why_not"])
            return heading_sentence(shares, last["status"], last["reason"], check, why_not)
    return None


def options_table(sealed: SealedRun) -> list[dict[str, Any]]:
    """Return the options of a result: key, name, value, unit, default, and what it is.

    ``usual``: whether the value is the default. A default is None where the form of the command
    states none.
    """
    from strapdown.report.compare_folders import options_of
    from strapdown.studio.forms import form_of, unit_of

    kind = KINDS.get(sealed.command)
    fields = [] if kind is None else [f for one in form_of(kind.form) for f in one["fields"]]
    known = {field["path"]: field for field in fields}
    named = [(re.compile(_any_name(path)), f) for path, f in known.items() if "*" in path]
    rows = []
    for key, value in list(options_of(sealed).items())[:MOST]:
        path = re.sub(r"\[[^\]]*\]", "[]", key)
        by_name = (field for form, field in named if form.fullmatch(path))
        field: dict[str, Any] = known.get(path) or next(by_name, {})
        plain = value if isinstance(value, bool | int | float | str | list) else str(value)
        rows.append(
            {
                "key": key[:200],
                "label": field.get("label"),
                "value": _finite(plain),
                "unit": unit_of(key.rpartition(".")[2]),
                "default": field.get("default"),
                "usual": bool(field) and plain == field["default"],
                "help": field.get("help") or "",
            }
        )
    return rows


def _any_name(path: str) -> str:
    return re.escape(path).replace(r"\*", r"[^.]+")


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _finding(one: Any) -> dict[str, Any]:
    """Return a finding of a result as the front end shows findings, in the words of the studio.

    One that this version does not know, or that has other data, is in those of the result.
    """
    said = {"text": _word(one, "sentence") or "", "remedy": _word(one, "remedy")}
    with suppress(KeyError, ValueError, TypeError, IndexError, AttributeError, OSError):
        again = _remade(one)
        said = {"text": again.sentence("studio"), "remedy": again.advice("studio")}
    return {
        "code": _word(one, "code"),
        "severity": _word(one, "severity") or "note",
        "file": _word(one, "file"),
        "quantity": _word(one, "quantity"),
        **said,
    }


#: Code of a finding: a room of the catalogue, and what is wrong.
CODE = re.compile(r"[a-z]+\.[a-z0-9-]+")


def _remade(one: dict[str, Any]) -> Finding:
    """Return a finding of the JSON of a result, with the findings among its data."""
    if CODE.fullmatch(one["code"]) is None:
        raise ValueError
    data = {key: _value(value) for key, value in one["data"].items()}
    return Finding(one["code"], severity="note", data=data)


def _value(node: Any) -> Any:
    if isinstance(node, dict):
        return _remade(node)
    return tuple(map(_value, node)) if isinstance(node, list) else node


def _list(node: Any, key: str) -> list[Any]:
    found = node.get(key) if isinstance(node, dict) else None
    return found if isinstance(found, list) else []


def _word(node: Any, key: str) -> str | None:
    found = node.get(key) if isinstance(node, dict) else None
    return found if isinstance(found, str) else None


def _configuration(manifest: Mapping[str, Any]) -> str | None:
    """Return the configuration file in a result; None if it was made with options."""
    for one in manifest["inputs"]:
        if one.get("role") in ("configuration", "case") and one.get("kept") == "copy":
            return str(one["name"])
    return None


def _repeating(folder: Path, manifest: Mapping[str, Any], name: str) -> str | None:
    """Return the command that makes a result again beside it; None: it was made with options."""
    file = _configuration(manifest)
    command = str(manifest["command"])
    if file is None or command not in ("navigate", "align", "crash"):
        return None
    made = shlex.join(("strapdown", command, f"{name}/{file}", "--out", name))
    return repeating(folder, name, made)


# --- series and track ---------------------------------------------------------------------


def run_stream(folder: Path, name: str) -> str:
    """Return the folder of the kept series of a result."""
    place, manifest = _opened(folder, name)
    key = sha256(place / MANIFEST)[:40]
    return kept_stream(folder, key, "run", lambda: _table(place, manifest), column_unit)


def column_unit(name: str) -> str:
    """Return the unit in the name of a column; empty if it names none."""
    return next((unit for ending, unit in ENDINGS.items() if name.endswith(ending)), "")


def _table(place: Path, manifest: Mapping[str, Any]) -> pd.DataFrame:
    """Return the values of a result over time, with their standard deviations."""
    for name in TABLES:
        with suppress(ConfigError):
            table = _read(file_in(place, name, manifest))
            break
    else:
        raise ConfigError("studio.no-series")
    with suppress(ConfigError):
        sd = _read(file_in(place, SD, manifest))
        # At the nearest stamp: the filter has them at its own steps.
        at = np.searchsorted(index_of(sd), index_of(table)).clip(1, len(sd) - 1)
        time, stamps = index_of(sd), index_of(table)
        at = np.where(stamps - time[at - 1] < time[at] - stamps, at - 1, at)
        for column in sd.columns:
            table[column] = sd[column].to_numpy()[at]
    if manifest["command"] == "attitude":
        for angle, values in _known_attitude(place, manifest, index_of(table)).items():
            table[f"reference {angle}_deg"] = values
    return table


def _known_attitude(place: Path, manifest: Mapping[str, Any], time: Array) -> dict[str, Array]:
    """Return the attitude that a run was compared with at instants, (n,), s, by angle, deg.

    NaN where it is not known; empty without one, or if it is not in the folder of the result.
    """
    answer = _answer(place, manifest)
    scores = [s for one in _list(answer, "algorithms") for s in _list(one, "scores")]
    if all(_word(one, "against") != "truth" for one in scores):
        return {}
    from strapdown.attitude_comparison.options import AttitudeSpec
    from strapdown.attitude_comparison.source import read_source, with_truth
    from strapdown.evaluation.differences import attitude_at

    stated = {k: v for k, v in manifest["configuration"].items() if k != "report"}
    # A file that a manifest names elsewhere is not read.
    if any(not (place / p).resolve().is_relative_to(place.resolve()) for p in named_paths(stated)):
        return {}
    with suppress(StrapdownError, OSError, ValueError):
        spec = AttitudeSpec.model_validate(resolved(stated, place))
        source = with_truth(read_source(spec), spec)
        if source.truth is None or source.scored is None:
            return {}
        known = source.truth[np.asarray(source.scored, dtype=bool)][QUATERNION]
        stamps = index_of(known)
        angles = rotation.euler_from_quaternion(attitude_at(known, time))
        angles[(time < stamps[0]) | (time > stamps[-1])] = np.nan
        for gap in find_gaps(stamps):
            angles[(time > gap.start) & (time < gap.end)] = np.nan
        return dict(zip(EULER, angles.T, strict=True))
    return {}


def _read(path: Path) -> pd.DataFrame:
    """Read a table of a result: numbers by time. DataError: it is none."""
    if path.stat().st_size > LARGEST:
        raise DataError("studio.table-too-large", file=path.name, most=LARGEST / 2**20)
    try:
        table = pd.read_csv(path, comment="#")
        time = table.pop(next(c for c in table.columns if str(c).startswith("time")))
        stamps = pd.to_numeric(time, errors="coerce").to_numpy(dtype=np.float64)
        numbers = table.apply(pd.to_numeric, errors="coerce")
    except (ValueError, StopIteration, TypeError) as error:
        reason = type(error).__name__
        raise DataError("studio.table-not-read", file=path.name, reason=reason) from None
    kept = np.flatnonzero(np.isfinite(stamps))
    if kept.size < 2:
        raise DataError("studio.table-not-read", file=path.name, reason="no rows")
    kept = kept[np.argsort(stamps[kept], kind="stable")]
    values = numbers.to_numpy(dtype=np.float64)[kept]
    return pd.DataFrame(values, pd.Index(stamps[kept], name="time"), list(numbers.columns))


def track(folder: Path, name: str, points: int) -> dict[str, Any]:
    """Return positions and attitudes along a navigation, at most so many, the ends among them."""
    place, manifest = _opened(folder, name)
    table = _read(file_in(place, "trajectory.csv", manifest))
    if not {"lat_deg", "lon_deg", "alt_m"} <= set(table.columns):
        raise ConfigError("studio.no-track", file=name)
    some = _thinned(table, ["lat_deg", "lon_deg", "alt_m"], points)
    euler = ["roll_deg", "pitch_deg", "heading_deg"]
    quaternions = None
    if set(euler) <= set(table.columns):
        angles = some[euler].to_numpy(dtype=np.float64)
        if np.isfinite(angles).all():
            quaternions = rotation.quaternion_from_euler(angles).tolist()
    return {
        "t": index_of(some).tolist(),
        "lat": some["lat_deg"].tolist(),
        "lon": some["lon_deg"].tolist(),
        "alt": some["alt_m"].tolist(),
        "q": quaternions,
        "fixes": _fixes(place, manifest, points),
        "reference": _reference(place, manifest, points),
    }


def _input(place: Path, path: str, manifest: Mapping[str, Any]) -> Path:
    """Return a copied input of a result: a file, or a folder that holds listed ones.

    A log that is a folder has its fixes in it. ConfigError: there is none.
    """
    copied = {str(one["name"]) for one in manifest["inputs"] if one.get("kept") == "copy"}
    found, own = place / path, place.resolve() / "inputs"
    beneath = ".." not in Path(path).parts and found.resolve().is_relative_to(own)
    if path in copied or not beneath or not found.is_dir():
        return file_in(place, path, manifest)
    # A reader takes whatever lies in a folder: each file must be listed, and in the folder.
    inside = [one for one in found.rglob("*") if not one.is_dir() or one.is_symlink()]
    names = {one: one.relative_to(place).as_posix() for one in inside}
    if not inside or not copied.issuperset(names.values()):
        raise ConfigError("studio.no-such-file", file=path[:80])
    for name in names.values():
        file_in(place, name, manifest)
    return found.resolve()


def _fixes(place: Path, manifest: Mapping[str, Any], points: int) -> dict[str, Any] | None:
    """Return the fixes that the run used, if it has a copy."""
    from strapdown.formats.gnss_files import read_gnss

    aids = manifest["configuration"].get("navigation", {}).get("aiding", {})
    for aid in aids.values() if isinstance(aids, dict) else ():
        if not isinstance(aid, dict) or aid.get("kind") != "gnss" or not aid.get("path"):
            continue
        with suppress(StrapdownError, OSError):
            path = _input(place, str(aid["path"]), manifest)
            keys = {key: aid[key] for key in FixesTable.model_fields if key in aid}
            options = specify(FixesTable, **{**keys, "path": str(path)}).options()
            return _places(read_gnss(path, options), points)
    return None


def _reference(place: Path, manifest: Mapping[str, Any], points: int) -> dict[str, Any] | None:
    """Return the reference trajectory of the run, if it has a copy."""
    truth = manifest["configuration"].get("navigation", {}).get("truth")
    if not isinstance(truth, dict) or not truth.get("path"):
        return None
    with suppress(StrapdownError, OSError):
        path = _input(place, str(truth["path"]), manifest)
        return _places(read_trajectory(path), points)
    return None


def _thinned(table: pd.DataFrame, columns: list[str], points: int) -> pd.DataFrame:
    """Return at most so many rows whose columns are finite, the first and the last among them."""
    whole = np.flatnonzero(np.isfinite(table[columns].to_numpy(dtype=np.float64)).all(axis=1))
    if not whole.size:
        raise ConfigError("studio.no-track")
    at = np.linspace(0, whole.size - 1, min(points, whole.size)).round().astype(int)
    return table.take(whole[np.unique(at)])


def _places(table: pd.DataFrame, points: int) -> dict[str, Any]:
    some = _thinned(table, ["lat", "lon"], points)
    return {
        "t": index_of(some).tolist(),
        "lat": some["lat"].tolist(),
        "lon": some["lon"].tolist(),
    }


# --- downloads ----------------------------------------------------------------------------


def export(
    folder: Path, name: str, kind: str, epoch: str | None = None, geoid: float | None = None
) -> dict[str, str]:
    """Return a file to download: path and name.

    Parameters
    ----------
    kind : {'zip', 'pdf', 'gpx', 'toml'}
    epoch : str, optional
        Instant of stamp zero, for a clock that is not related to UTC; of a GPX.
    geoid : float, optional, m
        Height of the geoid over the ellipsoid, of a GPX.
    """
    check_choice("studio.no-such-export", EXPORTS, quantity="as", word=kind)
    place, manifest = _opened(folder, name)
    if kind == "pdf":
        try:
            return {"path": str(file_in(place, "report.pdf", manifest)), "name": f"{name}.pdf"}
        except ConfigError:
            raise ConfigError("studio.no-pdf", name=name) from None
    if kind == "toml":
        own = _configuration(manifest)
        written = Folder(folder).state / "configurations" / f"{name}.toml"
        path = written if own is None else file_in(place, own, manifest)
        if not path.is_file():
            raise ConfigError("studio.no-configuration", name=name)
        return {"path": str(path), "name": f"{name}.toml"}
    exports = Folder(folder).state / "exports"
    exports.mkdir(exist_ok=True)
    for old in sorted(exports.iterdir(), key=lambda one: one.stat().st_mtime)[:-KEPT]:
        shutil.rmtree(old, ignore_errors=True)
    made = Path(tempfile.mkdtemp(dir=exports)) / f"{name}.{kind}"
    if kind == "zip":
        _zip(place, name, manifest, made)
    else:
        _gpx(place, made, epoch, geoid)
    return {"path": str(made), "name": made.name}


def _zip(place: Path, name: str, manifest: Mapping[str, Any], out: Path) -> None:
    """Write the files of a result, and no other that lies in its folder."""
    names = [MANIFEST, *UNSEALED]
    names += [p.name for p in place.iterdir() if SIGNATURE_FILE.fullmatch(p.name)]
    names += [str(one["name"]) for one in manifest["outputs"]]
    names += [str(one["name"]) for one in manifest["inputs"] if one.get("kept") == "copy"]
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for one in dict.fromkeys(names):
            with suppress(ConfigError):
                archive.write(file_in(place, one, manifest), f"{name}/{one}")


def _gpx(place: Path, out: Path, epoch: str | None, geoid: float | None) -> None:
    """Write the track of a result as ``strapdown convert`` does."""
    from strapdown.api.writing import read_streams, write

    instant = None
    if epoch:
        try:
            instant = datetime.fromisoformat(epoch)
        except ValueError:
            raise ConfigError("studio.wrong-type", quantity="epoch", wanted="date") from None
    found, _ = read_streams([place], {}, None, {}, ["reference"])
    write(found, out, epoch=instant, geoid_undulation_m=geoid)


# --- several results ----------------------------------------------------------------------


def compare(folder: Path, runs: Sequence[str]) -> dict[str, Any]:
    """Compare results: the JSON of ``strapdown compare``, and the address of its page."""
    from strapdown.api.compare import compare_runs
    from strapdown.report.compare import comparison_json
    from strapdown.report.compare_document import is_finer, shown_row

    place = Folder(folder)
    digests = [sha256(place.file(name) / MANIFEST) for name in runs]
    found = compare_runs(*(place.file(name).name for name in runs))
    key = re.sub(r"[^0-9a-f]", "", "".join(one[:12] for one in digests))[:120]
    kept = place.state / "comparisons" / key
    if not (kept / MANIFEST).is_file():
        kept.parent.mkdir(exist_ok=True)
        found.save(kept, force=True)
        for old in sorted(kept.parent.iterdir(), key=lambda p: p.stat().st_mtime)[: -10 * KEPT]:
            shutil.rmtree(old, ignore_errors=True)
    command = shlex.join(("strapdown", "compare", *runs))
    told = comparison_json(found)
    for row, one in zip(told["numbers"], found.numbers, strict=True):
        row |= {"shown": shown_row(one, found.units), "detail": one.any.detail}
        row["finer"] = is_finer(one, found.units)
    other = {row.key for row in found.options}
    return {
        **told,
        "same_options": [one for one in options_table(found.runs[0]) if one["key"] not in other],
        "page": f"comparisons/{key}/report.html",
        "command_line": command,
    }


def file_of_comparison(folder: Path, key: str, path: str) -> Path:
    """Return a file of a comparison that was made; ConfigError: there is none."""
    place = Folder(folder).state / "comparisons" / key
    if re.fullmatch(r"[0-9a-f]{12,120}", key) is None or not (place / MANIFEST).is_file():
        raise ConfigError("studio.no-such-file", file=path[:80])
    return file_in(place, path, read_manifest(place))
