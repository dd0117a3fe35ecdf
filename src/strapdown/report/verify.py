"""Re-run a sealed bundle and compare, bit for bit and then number for number."""

from __future__ import annotations

import json
import math
import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from strapdown.attitude_comparison.comparison import run_comparison
from strapdown.attitude_comparison.options import AttitudeSpec
from strapdown.bundle import (
    MANIFEST,
    machine,
    names_file,
    read_manifest,
    resolved,
    sha256,
    unsealed_changes,
    versions,
)
from strapdown.config import CrashSimulationSpec, SimulateSpec, TrajectorySpec
from strapdown.config.crash_case import CaseSpec
from strapdown.config.reading import changed_options
from strapdown.errors import DataError, StrapdownError
from strapdown.formats import read_raw
from strapdown.report import crash_live
from strapdown.report.alignment import ALIGNMENT
from strapdown.report.attitude import write_attitude
from strapdown.report.coast import COAST
from strapdown.report.crash_case import CRASH
from strapdown.report.crash_simulation import write_crash_simulation
from strapdown.report.doctor import DOCTOR
from strapdown.report.navigation import NAVIGATION
from strapdown.report.report_bundle import ReportBundle
from strapdown.report.simulation import write_simulation, write_trajectory_simulation

# Another processor or library may round the last digits differently, and a long integration
# amplifies that. A larger difference is a different result.
EQUAL = 1e-6
_NUMBER = re.compile(r"-?\d+\.?\d*(?:[eE][+-]?\d+)?")


@dataclass(frozen=True)
class Verification:
    """Result of re-running a bundle.

    Attributes
    ----------
    verdict : str
        ``identical``, ``numerically equal`` or ``changed``.
    within : float
        Largest difference of a number, relative if it exceeds 1; zero if identical.
    digest : str
        SHA-256 of the manifest, to be compared with the printed or recorded one.
    details : tuple of str
        Changes and differences, one sentence each.
    """

    verdict: str
    within: float
    digest: str
    details: tuple[str, ...]


#: Commands with a `ReportBundle`; ``attitude``, ``simulate`` and ``crash --live`` write theirs.
BUNDLES: dict[str, ReportBundle[Any]] = {
    bundle.command: bundle for bundle in (ALIGNMENT, COAST, CRASH, DOCTOR, NAVIGATION)
}


def _rerun(command: str, configuration: dict[str, Any], out: Path, sealed: set[str]) -> None:
    """Repeat a run from its configuration; `sealed`: names of the sealed files."""
    # Page and figures change no number; PNG figures are not part of the configuration.
    report = bool(configuration.get("report", True))
    if command in BUNDLES:
        BUNDLES[command].rerun(configuration, out, report=report)
    elif command == "attitude":
        keys = {key: value for key, value in configuration.items() if key != "report"}
        png = any(name.endswith(".png") for name in sealed)
        bench = run_comparison(AttitudeSpec.model_validate(keys))
        write_attitude(bench, out, png=png, report=report)
    elif command == crash_live.COMMAND:
        crash_live.rerun(configuration, out)
    elif "trajectory" in configuration:
        trajectory = TrajectorySpec.model_validate(configuration["trajectory"])
        write_trajectory_simulation(trajectory, out)
    elif "crash" in configuration:
        crash = CrashSimulationSpec.model_validate(configuration["crash"])
        write_crash_simulation(crash, out)
    else:
        write_simulation(SimulateSpec.model_validate(configuration), out)


def verify(bundle: str | Path) -> Verification:
    """Check a bundle against its seal, re-run it from its configuration, and compare.

    Parameters
    ----------
    bundle : str or Path
        A folder written by a run.

    Returns
    -------
    Verification
        ``changed`` if a file differs from its seal (then it is not re-run), if a number differs by
        more than 1e-6, or if any byte differs under the same versions on the same platform.

    Raises
    ------
    DataError
        The folder is not a bundle, or its manifest is damaged.
    """
    root = Path(bundle).absolute()
    manifest = read_manifest(root)
    digest = sha256(root / MANIFEST)
    changes = unsealed_changes(root, manifest)
    if changes or manifest["command"] == "crash":
        changes += changed_case(root, manifest)
    if changes:
        return Verification("changed", math.inf, digest, tuple(changes))
    if manifest["command"] == "reproduce":
        raise DataError("report.reproduced-paper", file=MANIFEST)
    if manifest["command"] not in (*BUNDLES, "attitude", "simulate", crash_live.COMMAND):
        raise DataError("report.command-not-known", file=MANIFEST, manifest=manifest["command"])
    with tempfile.TemporaryDirectory(prefix="strapdown-verify-") as folder:
        again = Path(folder) / "again"
        configuration = resolved(manifest["configuration"], root)
        try:
            sealed = {item["name"] for item in manifest["outputs"]}
            _rerun(manifest["command"], configuration, again, sealed)
        except ValidationError as error:
            raise DataError(
                "report.configuration-not-understood",
                file=MANIFEST,
                errors=error.errors()[0]["msg"],
            ) from None
        return _compare(root, again, manifest, digest)


def _compare(root: Path, again: Path, manifest: dict[str, Any], digest: str) -> Verification:
    now = read_manifest(again)
    written = {item["name"] for item in now["outputs"]}
    sealed = {item["name"]: item["sha256"] for item in manifest["outputs"]}
    details = [f"{name}: not written any more" for name in sorted(sealed.keys() - written)]
    details += [f"{name}: written now, and not sealed" for name in sorted(written - sealed.keys())]
    if _read(manifest) != _read(now):
        details.append(f"{MANIFEST}: the inputs are not in the roles in which they are read")
    conditions = _other_conditions(manifest)
    changed, within = bool(details), 0.0
    for name in sorted(sealed.keys() & written):
        if sha256(again / name) == sealed[name]:
            continue
        if not conditions:
            # The same code on the same machine must give the same bytes.
            details.append(f"{name}: differs, though versions and platform are the same")
            changed = True
            continue
        difference = _difference(root / name, again / name)
        if difference is None:
            details.append(f"{name}: drawn differently; its numbers are in the JSON")
            continue
        within = max(within, difference)
        changed |= not difference <= EQUAL
        details.append(
            f"{name}: numbers differ by up to {difference:.1e}"
            if math.isfinite(difference)
            else f"{name}: differs in more than numbers"
        )
    if not details:
        return Verification("identical", 0.0, digest, ())
    verdict = "changed" if changed else "numerically equal"
    return Verification(verdict, within, digest, (*details, *conditions))


def _read(manifest: dict[str, Any]) -> list[tuple[str, str]]:
    return sorted((str(item["role"]), str(item["sha256"])) for item in manifest["inputs"])


def _difference(a: Path, b: Path) -> float | None:
    """Largest difference of two files' numbers; infinite if anything else differs.

    None for drawings, whose bytes depend on the versions of the drawing libraries.
    """
    try:
        if a.suffix == ".json":
            leaves = [list(_leaves(json.loads(p.read_text(encoding="utf-8")))) for p in (a, b)]
            if len(leaves[0]) != len(leaves[1]):
                return math.inf
            return max(map(_leaf_difference, *leaves), default=0.0)
        if a.suffix in (".csv", ".npz", ".h5", ".mat", ".parquet"):
            return _column_difference(read_raw(a).columns, read_raw(b).columns)
    except (ValueError, RecursionError, StrapdownError):
        return math.inf
    return None


def _leaf_difference(one: tuple[str, Any], two: tuple[str, Any]) -> float:
    (key, x), (other, y) = one, two
    if key != other:
        return math.inf
    if isinstance(x, float) and isinstance(y, float):
        return _apart(key, np.array([x]), np.array([y]))
    if x == y:
        return 0.0
    if not isinstance(x, str) or not isinstance(y, str):
        return math.inf
    numbers = [_NUMBER.findall(text) for text in (x, y)]
    if _NUMBER.sub("#", x) != _NUMBER.sub("#", y):
        return math.inf
    # Sentences quote numbers to three digits, the last of which may round differently; numbers
    # printed as a power of ten below rounding are rounding errors.
    near = (
        abs(float(p) - float(q)) <= 0.02 * abs(float(p)) + 1e-9
        for p, q in zip(*numbers, strict=True)
    )
    return 0.0 if all(near) else math.inf


def _column_difference(one: dict[str, NDArray[Any]], two: dict[str, NDArray[Any]]) -> float:
    if one.keys() != two.keys() or any(one[k].shape != two[k].shape for k in one):
        return math.inf
    return max((_apart(name, one[name], two[name]) for name in one), default=0.0)


def _apart(name: str, one: NDArray[Any], two: NDArray[Any]) -> float:
    """Largest difference, relative if a number exceeds 1; infinite if one is not a number."""
    if not {one.dtype.kind, two.dtype.kind} <= set("fiu"):
        return 0.0 if np.array_equal(one, two) else math.inf
    # An empty field on both sides is equal.
    apart = np.where(np.isnan(one) & np.isnan(two), 0.0, np.abs(one - two))
    if name.endswith("heading_deg"):
        # A heading just below 360 may be just above 0 on another platform.
        apart = np.minimum(apart, np.abs(apart - 360.0))
    largest = float(np.max(apart / np.fmax(1.0, np.abs(one)), initial=0.0))
    return largest if math.isfinite(largest) else math.inf


def _leaves(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Every value in JSON with the name of its field."""
    if isinstance(value, dict):
        for name, item in value.items():
            yield from _leaves(item, name)
    elif isinstance(value, list):
        for item in value:
            yield from _leaves(item, key)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield key, float(value)
    else:
        yield key, value


def _other_conditions(manifest: dict[str, Any]) -> list[str]:
    now = versions() | {f"platform {k}": v for k, v in machine().items()}
    then = manifest["versions"] | {f"platform {k}": v for k, v in manifest["platform"].items()}
    return [
        f"{name}: {then.get(name, 'absent')} then, {now.get(name, 'absent')} now"
        for name in sorted(now.keys() | then.keys())
        if now.get(name) != then.get(name)
    ]


# Differences between a sealed crash case and the case file in its bundle.


def changed_case(root: Path, manifest: dict[str, Any]) -> list[str]:
    """Name the options in which a bundle's case file and its sealed configuration differ.

    Parameters
    ----------
    root : Path
        The bundle.
    manifest : dict
        From `read_manifest`.

    Returns
    -------
    list of str
        One sentence per option, with the sealed value first; empty if both agree, or if the bundle
        is not of a crash.
    """
    configuration = manifest["configuration"]
    if manifest["command"] != "crash" or not isinstance(configuration, dict):
        return []
    name = configuration.get("case_path")
    if not isinstance(name, str):
        return []
    path = root / name
    if not path.is_file():
        return []
    try:
        stated = CaseSpec.read(path, files=False).model_dump(mode="json", exclude_none=True)
    except StrapdownError as error:
        return [f"{name}: it is not a valid case: {error.finding.what}"]
    stated.pop("name", None)
    sealed = {k: v for k, v in configuration.get("case", {}).items() if k != "name"}
    return [
        f"{name}: {what}"
        for what in changed_options(_without_files(sealed), _without_files(stated))
    ]


def _without_files(value: Any, key: str = "") -> Any:
    """Remove file names, which differ in a bundle."""
    if isinstance(value, dict):
        return {k: _without_files(v, k) for k, v in value.items() if not names_file(k, v)}
    if isinstance(value, list):
        return [_without_files(v, key) for v in value if not names_file(key, v)]
    return value
