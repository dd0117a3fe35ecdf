"""Sealed bundles: outputs and inputs of a run, with all that is needed to repeat it.

A bundle is a folder. ``manifest.json`` in it names the command, the resolved configuration,
the seed, the versions, the platform, and the SHA-256 of every input and output; its own
SHA-256 is the seal. A bundle is written to a temporary folder and renamed as a whole, so that
a failed run leaves no files. ``timing.json`` is outside the seal, because clocks differ.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import platform
import re
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any, BinaryIO

from strapdown.bundle import atomic_folder
from strapdown.bundle.atomic_folder import MANIFEST as MANIFEST
from strapdown.bundle.atomic_folder import check_destination as check_destination
from strapdown.bundle.atomic_folder import claimed as claimed
from strapdown.errors import ConfigError, DataError, Finding, add_warning, printable

TIMING = "timing.json"
LATENCY = "latency.json"
#: Answer of a timestamp authority (RFC 3161) to the digest of the manifest.
TIMESTAMP = "manifest.json.tsr"
#: Files outside the seal: clocks differ, and a signature or timestamp is of the seal.
UNSEALED = (TIMING, LATENCY, TIMESTAMP)
SIGNATURE_FILE = re.compile(r"signature-[0-9a-f]{16}\.json")
SCHEMA = "strapdown bundle 2"


@dataclass(frozen=True)
class InputFiles:
    """Files that a result depends on.

    Attributes
    ----------
    role : str
        ``log``, ``truth``, ``gyro-bias``, ``reference-log`` or ``sensor``.
    path : Path
        As given: a file, or a folder.
    files : tuple of Path
        Every file that was read.
    digests : tuple of str
        SHA-256 of each when it was read.
    copied : bool
        Whether a bundle copies them, whatever their size: they come from tables in memory and
        exist only there.
    """

    role: str
    path: Path
    files: tuple[Path, ...]
    digests: tuple[str, ...]
    copied: bool = False


@dataclass(frozen=True)
class Seal:
    """Seal of a written bundle.

    Attributes
    ----------
    path : Path
        The folder.
    digest : str
        SHA-256 of its manifest.
    """

    path: Path
    digest: str


#: Digests of large files, by what shows that one has not changed since, the oldest first.
_KNOWN: dict[tuple[int, ...], str] = {}
_MOST_KNOWN = 64
#: Size from which a digest takes a noticeable time, bytes; and time since the last change from
#: which on another one has another stamp, whatever the resolution of the clock of a file, ns.
LARGE, SETTLED = 1 << 24, 2_000_000_000


def sha256(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal.

    A log is read for it once, though it is asked for again when a result is sealed: the system
    changes the stamp of a file (ctime) with its content, and no program can set that stamp.
    """
    with path.open("rb") as stream:
        state, begun = _state(stream), time.time_ns()
        if state not in _KNOWN:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
            *_, size, modified, changed = state
            settled = max(modified, changed) < begun - SETTLED and _state(stream) == state
            if os.name != "posix" or size < LARGE or not settled:
                return digest
            while len(_KNOWN) >= _MOST_KNOWN:
                _KNOWN.pop(next(iter(_KNOWN)), None)
            _KNOWN[state] = digest
        return _KNOWN[state]


def _state(stream: BinaryIO) -> tuple[int, ...]:
    about = os.fstat(stream.fileno())
    return about.st_dev, about.st_ino, about.st_size, about.st_mtime_ns, about.st_ctime_ns


def input_files(role: str, path: str, files: tuple[Path, ...]) -> InputFiles:
    """List files read in a role, with their present digests."""
    return InputFiles(role, Path(path), files, tuple(sha256(file) for file in files))


def sensor_file(sensor: str | None) -> tuple[InputFiles, ...]:
    """Return the file of a sensor that is not from the catalogue."""
    from strapdown.sensors.catalogue import SENSORS

    if sensor is None or sensor.lower() in SENSORS:
        return ()
    return (input_files("sensor", sensor, (Path(sensor),)),)


def log_files(
    path: str, files: tuple[Path, ...], calibration: str | None
) -> tuple[InputFiles, ...]:
    """Return the files of a log, and that of the calibration with which it was read."""
    log = input_files("log", path, files)
    if calibration is None:
        return (log,)
    return log, input_files("calibration", calibration, (Path(calibration),))


def files_of(root: Path) -> list[str]:
    """Everything but folders; a link to a folder is not a folder of the bundle."""
    found = (p for p in root.rglob("*") if p.is_symlink() or not p.is_dir())
    return sorted(p.relative_to(root).as_posix() for p in found)


# Files beside the seal, because clocks differ.


def write_timing(
    seal: Seal, seconds: dict[str, float], sample_ns: dict[str, dict[str, float]] | None = None
) -> None:
    """Write the times of a run beside its bundle's seal.

    `seconds`: stage to seconds. `sample_ns`: algorithm to nanoseconds per sample in each precision.
    """
    timing: dict[str, Any] = {"seconds": {stage: round(t, 4) for stage, t in seconds.items()}}
    if sample_ns:
        timing["sample_ns"] = sample_ns
    atomic_folder.replace_file(seal.path / TIMING, to_json(timing).encode(), seal.path)


def write_latency(seal: Seal, latency: Mapping[str, Any]) -> None:
    """Write the latency of the samples beside the bundle's seal.

    `latency`: as JSON.
    """
    atomic_folder.replace_file(seal.path / LATENCY, to_json(latency).encode(), seal.path)


# JSON format of bundles.


def to_json(content: Any) -> str:
    """Format JSON for bundles: readable, in the given order, reproducible byte by byte."""
    text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    # Names of files need not be valid text, and marks of direction would change how it looks.
    return printable(text, lines=True, json=True)


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file of a bundle, the same bytes on every system."""
    path.write_text(to_json(content), encoding="utf-8", newline="\n")


# Paths of inputs in a configuration.


def names_file(key: str, value: Any) -> bool:
    """Whether a value of a configuration is the path of an input.

    `key`: name of the field, of a list that of the list. `value`: a path; for a sensor or a model
    of severity, a file path with its suffix, or a name of the catalogue.
    """
    if not isinstance(value, str):
        return False
    return key.endswith("path") or (
        key in ("sensor", "severity", "calibration") and value.lower().endswith(".toml")
    )


def named_paths(value: Any, key: str = "") -> Iterator[str]:
    """Every path of an input in a configuration; `key`: that of the value."""
    if isinstance(value, list):
        for item in value:
            yield from named_paths(item, key)
    elif isinstance(value, dict):
        for name, item in value.items():
            yield from named_paths(item, name)
    elif names_file(key, value):
        yield value


def with_paths(value: Any, change: Callable[[str], str], key: str = "") -> Any:
    """Return a configuration with every path of an input replaced.

    `value`: the configuration, or a part. `change`: maps a path to its replacement. `key`: that of
    the value.
    """
    if isinstance(value, dict):
        return {k: with_paths(v, change, k) for k, v in value.items()}
    if isinstance(value, list):
        return [with_paths(v, change, key) for v in value]
    return change(value) if names_file(key, value) else value


def resolved(value: Any, root: Path, moved: Mapping[str, Path] | None = None) -> Any:
    """Return a configuration with the paths of its inputs as they are now.

    `value`: from a manifest. `root`: folder of the bundle. `moved`: from `found_references`.
    """
    places = moved or {}
    return with_paths(value, lambda path: str(places.get(path, root / path)))


# Write a bundle atomically.


@contextmanager
def write_bundle(
    out: Path,
    *,
    command: str,
    configuration: dict[str, Any],
    inputs: Sequence[InputFiles] = (),
    force: bool = False,
    seals: list[Seal],
) -> Iterator[Path]:
    """Write a bundle atomically.

    `out`: folder to create. An existing one is replaced only if `force` is set and it is empty or a
    bundle itself. `command`: command that can repeat the run. `configuration`: the resolved
    configuration; paths of inputs are replaced by those in or from the bundle. `inputs`: copied if
    they total at most 64 MiB, otherwise referred to by path. `seals`: the seal is appended when the
    bundle is complete. Yields an empty folder; its content at the end of the block becomes the
    bundle. ConfigError: `out` exists and must not be replaced, or another run writes it.
    """

    def seal(folder: Path) -> None:
        write_json(folder / MANIFEST, make_manifest(folder, command, configuration, inputs))
        digests.append(sha256(folder / MANIFEST))

    digests: list[str] = []
    with claimed(out, force) as folder, atomic_folder.written_whole(folder, seal) as staging:
        yield staging
    seals.append(Seal(out.absolute(), *digests))


# The manifest of a bundle, and copies of its inputs.


# Inputs up to this total size are copied into the bundle, which then is self-contained.
COPY_LIMIT = 64 * 1024 * 1024  # bytes


def make_manifest(
    folder: Path, command: str, configuration: dict[str, Any], inputs: Sequence[InputFiles]
) -> dict[str, Any]:
    """Create the manifest of a finished folder, and copy its inputs into it.

    `folder`: its files are the outputs. `command`, `configuration`, `inputs`: as for
    `write_bundle`. DataError: an input has changed since it was read.
    """
    outputs = [
        {"name": name, "sha256": sha256(folder / name), "bytes": (folder / name).stat().st_size}
        for name in files_of(folder)
        if name not in UNSEALED
    ]
    for item in inputs:
        for file, digest in zip(item.files, item.digests, strict=True):
            if not file.is_file() or sha256(file) != digest:
                raise DataError("bundle.input-changed", file=file.name)
    kept, moved = _keep(folder, inputs)
    return {
        "schema": SCHEMA,
        "command": command,
        "configuration": with_paths(configuration, lambda path: moved.get(path, path)),
        "inputs": kept,
        "outputs": outputs,
        "versions": versions(),
        "platform": machine(),
        "environment": list(environment()),
    }


def _keep(
    folder: Path, inputs: Sequence[InputFiles]
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Copy the inputs, or refer to them; return their manifest entries and present paths."""
    small = sum(f.stat().st_size for i in inputs for f in i.files) <= COPY_LIMIT
    kept: list[dict[str, Any]] = []
    moved: dict[str, str] = {}
    places: dict[Path, Path] = {}
    names: set[Path] = set()
    for item in inputs:
        copy = small or item.copied
        # Each path has a folder, under the given name; a link's target may have lost its suffix.
        own = item.path.name or item.path.resolve().name
        place, number = Path("inputs") / item.role / own, 2
        # Several logs may share a name, and a file may have been read for each.
        while places.get(place, item.path) != item.path:
            place = Path("inputs") / f"{item.role}-{number}" / own
            number += 1
        if item.path.is_dir():
            # Files of one folder with two roles share a folder.
            place = next((p for p, path in places.items() if path == item.path), place)
        elif place in places:
            continue
        places[place] = item.path
        for file, digest in zip(item.files, item.digests, strict=True):
            name = place / file.relative_to(item.path) if item.path.is_dir() else place
            if name in names:
                continue
            names.add(name)
            if copy:
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(file, folder / name)
            kept.append(
                {
                    "role": item.role,
                    "name": name.as_posix() if copy else str(file.resolve()),
                    "kept": "copy" if copy else "reference",
                    "sha256": digest,
                    "bytes": file.stat().st_size,
                }
            )
        moved[str(item.path)] = place.as_posix() if copy else str(item.path.resolve())
    return kept, moved


# Dependencies of the results besides the inputs: packages and the platform.


PACKAGES = ("strapdown", "numpy", "scipy", "numba", "pandas", "pyarrow", "h5py", "jinja2", "typst")


def versions() -> dict[str, str]:
    """Versions of the packages that affect results, and the digest of our own sources."""
    found = {"python": platform.python_version(), "strapdown source": source_digest()}
    return found | {name: own[0] for name in PACKAGES if (own := _installed(name)) is not None}


@functools.cache
def _installed(name: str) -> tuple[str, tuple[str, ...]] | None:
    """Version of an installed package, and the lines of what it requires.

    By its file METADATA: `importlib.metadata` parses the whole of each as an e-mail, which takes
    longer than the digest of all our sources.
    """
    try:
        package = distribution(name)
    except PackageNotFoundError:
        return None
    head = (package.read_text("METADATA") or "").partition("\n\n")[0]
    if not (stated := re.findall(r"(?m)^Version: (.*)$", head)):
        return package.version, tuple(package.requires or ())
    return stated[0], tuple(re.findall(r"(?m)^Requires-Dist: (.*)$", head))


#: Extras with readers, references and signatures; the others are for development.
RUN_EXTRAS = ("logs", "mavlink", "pdf", "peers", "sign")


@functools.cache
def environment() -> tuple[str, ...]:
    """Return all installed packages that strapdown can import, as ``name==version``.

    From these a later user makes the same environment: those that it requires, and of `RUN_EXTRAS`
    those that are installed. `versions` has the ones that numbers depend on.
    """
    found: dict[str, str] = {}
    wanted = ["strapdown"]
    while wanted:
        name = wanted.pop()
        key = re.sub(r"[-_.]+", "-", name).lower()
        if key in found:
            continue
        if (package := _installed(name)) is None:
            continue  # of an extra, or of another platform
        found[key], requires = package
        for line in requires:
            extra = re.search(r"extra\s*==\s*[\"']([\w-]+)", line)
            if extra is None or (key == "strapdown" and extra[1] in RUN_EXTRAS):
                wanted.append(re.split(r"[\s;<>=!~\[(]", line, maxsplit=1)[0])
    return tuple(f"{name}=={found[name]}" for name in sorted(found))


@functools.cache
def source_digest() -> str:
    """SHA-256 of the sources and data of this package, as installations of a version may differ.

    Of the name and the content of each file except compiled ones, in order of names.
    """
    root = Path(__file__).parents[1]
    digest = hashlib.sha256()
    names = (
        os.path.relpath(os.path.join(folder, name), root)  # noqa: PTH118
        for folder, _, files in os.walk(root)
        for name in files
        if name.endswith((".py", ".toml", ".typ", ".jinja", ".html", ".js", ".css"))
    )
    for name in sorted(name.replace(os.sep, "/") for name in names):
        content = hashlib.sha256((root / name).read_bytes()).hexdigest()
        digest.update(f"{name} {content}\n".encode())
    return digest.hexdigest()


def machine() -> dict[str, str]:
    """Platform properties that can change the last bit of a result."""
    from strapdown._kernels.compilation import COMPILER, MODE

    # The model of the processor, by which numpy and BLAS choose their code.
    model: list[str] = []
    with suppress(OSError):
        first = Path("/proc/cpuinfo").read_text(encoding="utf-8").partition("\n\n")[0]
        said = dict(re.findall(r"(.+?)\s*: (.*)", first))
        keys = ("model name", "cpu family", "model", "CPU implementer", "CPU part")
        model = [said[key].strip() for key in keys if key in said]
    return {
        "system": platform.system(),
        "machine": platform.machine(),
        "cpu": " ".join(model) if model else platform.processor(),
        "kernels": COMPILER or MODE,
        "libc": " ".join(platform.libc_ver()).strip(),
    }


# Read a manifest, and list the changes since it was sealed.


KEPT = ("copy", "reference")
#: Largest manifest, bytes: one with hundreds of records is smaller.
LARGEST = 50_000_000


def read_manifest(bundle: Path) -> dict[str, Any]:
    """Read the manifest of a bundle.

    DataError: the manifest is missing or damaged.
    """
    path = bundle / MANIFEST
    if not bundle.exists():
        raise DataError("bundle.no-such-folder", file=str(bundle))
    if not bundle.is_dir():
        raise DataError("bundle.no-folder", file=str(bundle))
    if not path.is_file():
        raise DataError("bundle.no-manifest", file=str(bundle))
    if path.is_symlink() or path.stat().st_size > LARGEST:
        raise DataError("bundle.malformed", file=MANIFEST)
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise DataError("bundle.not-json", file=MANIFEST, reason=error) from None
    if not isinstance(manifest, dict) or not {"schema", "versions"} <= set(manifest):
        raise DataError("bundle.unknown-form", file=MANIFEST)
    if manifest["schema"] != SCHEMA:
        known = manifest["versions"]
        version = known.get("strapdown", "unknown") if isinstance(known, dict) else "unknown"
        raise DataError(
            "bundle.other-schema", file=MANIFEST, schema=manifest["schema"], version=version
        )
    if set(KEYS) - set(manifest):
        raise DataError("bundle.unknown-form", file=MANIFEST)
    _refuse_escape(manifest)
    return manifest


KEYS = (
    "schema",
    "command",
    "configuration",
    "inputs",
    "outputs",
    "versions",
    "platform",
    "environment",
)


def _refuse_escape(manifest: dict[str, Any]) -> None:
    """Refuse a malformed manifest, or one with own files outside its folder."""
    try:
        for item in [*manifest["inputs"], *manifest["outputs"]]:
            path, refers = Path(item["name"]), item.get("kept") == "reference"
            if not isinstance(item["sha256"], str) or path.is_absolute() != refers:
                raise ValueError
            if not isinstance(item["bytes"], int) or item.get("kept", "copy") not in KEPT:
                raise ValueError
            parts = [os.fsencode(part) for part in path.parts]
            if b".." in parts or b"\0" in b"".join(parts) or max(map(len, parts)) > 255:
                raise ValueError
        _refuse_unsealed_paths(manifest)
        lists = [manifest[part].values() for part in ("versions", "platform")]
        if not all(isinstance(v, str) for each in lists for v in each):
            raise ValueError
        # People hand this list to an installer.
        if not all(re.fullmatch(r"[\w.-]+==[\w.+!-]+", line) for line in manifest["environment"]):
            raise ValueError
        if not isinstance(manifest["command"], str):
            raise ValueError
    except (TypeError, KeyError, ValueError, AttributeError):
        raise DataError("bundle.malformed", file=MANIFEST) from None


def _refuse_unsealed_paths(manifest: dict[str, Any]) -> None:
    """Refuse a configuration that reads files not covered by the seal."""
    sealed = {item["name"] for item in manifest["inputs"]}
    sealed |= {str(Path(name).parent) for name in sealed}
    for path in named_paths(manifest["configuration"]):
        if path not in sealed:
            raise ValueError


def unsealed_changes(
    bundle: Path, manifest: dict[str, Any], moved: Mapping[str, Path] | None = None
) -> list[Finding]:
    """List the files of a bundle that differ from the seal.

    `manifest`: from `read_manifest`. `moved`: from `found_references`. Returns a finding per file:
    changed, missing, a link, or not in the manifest.
    """
    changes: list[Finding] = []
    items = {item["name"]: item for item in [*manifest["inputs"], *manifest["outputs"]]}
    for name, item in items.items():
        own = item.get("kept", "copy") == "copy"
        path = bundle / name if own else (moved or {}).get(name, Path(name))
        if own and _is_linked(bundle, name):
            add_warning(changes, "bundle.a-link", file=name)
        elif not path.is_file():
            add_warning(changes, "bundle.file-missing", file=name)
        elif sha256(path) != item["sha256"]:
            add_warning(changes, "bundle.file-changed", file=name)
        elif path.stat().st_size != item["bytes"]:
            add_warning(changes, "bundle.other-size", file=name, bytes=item["bytes"])
    for name in files_of(bundle):
        beside = name in (MANIFEST, *UNSEALED) or SIGNATURE_FILE.fullmatch(name)
        if beside and (bundle / name).is_symlink():
            add_warning(changes, "bundle.a-link", file=name)
        elif not beside and name not in items:
            add_warning(changes, "bundle.not-in-manifest", file=name)
    return changes


def _is_linked(bundle: Path, name: str) -> bool:
    """Whether a file, or a folder on the way to it, is a symbolic link: it may change at will."""
    path = bundle / name
    return any(p.is_symlink() for p in (path, *path.parents[: len(Path(name).parts) - 1]))


# Inputs outside a bundle.


def found_references(manifest: dict[str, Any], given: Sequence[Path]) -> dict[str, Path]:
    """Find the inputs that a bundle refers to, among the files and folders that the user allows.

    `manifest`: from `read_manifest`. `given`: files or folders. An input may have moved: a file is
    found by its digest, a folder takes the place of the recorded one. From each recorded path, of
    files and of folders, to where it is now. ConfigError: an input is not covered by `given`: a
    manifest may name any file of this machine.
    """
    folders = [Path(p) for p in named_paths(manifest["configuration"])]
    found: dict[str, Path] = {}
    missing = []
    for item in manifest["inputs"]:
        if item["kept"] == "copy":
            continue
        name = Path(item["name"])
        root = next((f for f in folders if f != name and name.is_relative_to(f)), name)
        places = [place for one in given for place in _places(name, root, one, item["bytes"])]
        for place in places:
            file = place / name.relative_to(root)
            if file.is_file() and (place is places[-1] or sha256(file) == item["sha256"]):
                found |= {item["name"]: file, str(root): place}
                break
        else:
            missing.append(item["name"])
    if missing:
        raise ConfigError("bundle.inputs-outside", file=MANIFEST, quantity="inputs", names=missing)
    return found


def _places(name: Path, root: Path, given: Path, size: int) -> list[Path]:
    """Return where a recorded input of that size, or the folder that it is in, may be now."""
    absolute = given.absolute()
    if name.is_relative_to(absolute):
        return [root]
    if not absolute.is_dir():
        return [absolute] if root == name else []
    if root != name:
        return [absolute, absolute / root.name]
    # It may have another name there; its digest decides.
    other = sorted(p for p in absolute.iterdir() if p.is_file() and p.stat().st_size == size)
    return [*other, absolute / name.name]
