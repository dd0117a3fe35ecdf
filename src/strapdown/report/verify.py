"""Run a sealed bundle again and compare, bit for bit and then number for number."""

from __future__ import annotations

import json
import math
import re
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from strapdown.bundle import (
    MANIFEST,
    Seal,
    machine,
    read_manifest,
    sha256,
    unsealed_changes,
    versions,
)
from strapdown.config import AttitudeSpec, SimulateSpec
from strapdown.exceptions import DataError
from strapdown.report.attitude import write_attitude
from strapdown.report.simulation import write_simulation
from strapdown.systems.attitude_bench import run_bench

__all__ = ["Verification", "verify"]

# Another processor or library may round otherwise in the last places, and a long integration
# carries that on. More than this is another result.
EQUAL = 1e-6
_NUMBER = re.compile(r"-?\d+\.?\d*(?:[eE][+-]?\d+)?")


@dataclass(frozen=True)
class Verification:
    """What came of running a bundle again.

    Attributes
    ----------
    verdict : str
        ``identical``, ``numerically equal`` or ``changed``.
    within : float
        Largest difference of a number, relative where it exceeds 1; zero if identical.
    digest : str
        SHA-256 of the manifest, to be compared with the one that was printed or written down.
    details : tuple of str
        What changed, or what differs, one sentence each.
    """

    verdict: str
    within: float
    digest: str
    details: tuple[str, ...]


def _rerun_attitude(configuration: dict[str, Any], out: Path) -> Seal:
    return write_attitude(run_bench(AttitudeSpec.model_validate(configuration)), out)


def _rerun_simulation(configuration: dict[str, Any], out: Path) -> Seal:
    return write_simulation(SimulateSpec.model_validate(configuration), out)


RERUNS: dict[str, Callable[[dict[str, Any], Path], Seal]] = {
    "attitude": _rerun_attitude,
    "simulate": _rerun_simulation,
}


def verify(bundle: str | Path) -> Verification:
    """Check a bundle against its seal, run it again from its configuration, and compare.

    Parameters
    ----------
    bundle : str or Path
        A folder that a run wrote.

    Returns
    -------
    Verification
        ``changed`` where a file is not as it was sealed (then nothing is run), or where a
        number differs by more than 1e-6.

    Raises
    ------
    DataError
        The folder is no bundle, or its manifest is damaged.
    """
    root = Path(bundle).absolute()
    manifest = read_manifest(root)
    digest = sha256(root / MANIFEST)
    if changes := unsealed_changes(root, manifest):
        return Verification("changed", math.inf, digest, tuple(changes))
    if manifest["command"] not in RERUNS:
        raise DataError(
            f"its command '{manifest['command']}' is not known",
            file=MANIFEST,
            remedy="use the version of strapdown that wrote it",
        )
    with tempfile.TemporaryDirectory(prefix="strapdown-verify-") as folder:
        again = Path(folder) / "again"
        configuration = _resolved(manifest["configuration"], root)
        try:
            RERUNS[manifest["command"]](configuration, again)
        except ValidationError as error:
            raise DataError(
                f"its configuration is not understood: {error.errors()[0]['msg']}",
                file=MANIFEST,
                remedy="use the version of strapdown that wrote it",
            ) from None
        return _compare(root, again, manifest, digest)


def _resolved(value: Any, root: Path) -> Any:
    """Configuration with the paths of copied inputs made absolute."""
    if isinstance(value, dict):
        return {
            k: str(root / v) if k.endswith("path") and isinstance(v, str) else _resolved(v, root)
            for k, v in value.items()
        }
    return value


def _compare(root: Path, again: Path, manifest: dict[str, Any], digest: str) -> Verification:
    within, details, changed = 0.0, [], False
    for item in manifest["outputs"]:
        name = item["name"]
        if not (again / name).is_file():
            details.append(f"{name}: not written any more")
            changed = True
            continue
        if sha256(again / name) == item["sha256"]:
            continue
        if Path(name).suffix in (".json", ".csv"):
            difference = _difference(root / name, again / name)
            within = max(within, difference)
            changed |= difference > EQUAL
            details.append(
                f"{name}: its text differs"
                if math.isinf(difference)
                else f"{name}: numbers differ by up to {difference:.1e}"
            )
        else:
            details.append(f"{name}: drawn or packed differently; its numbers stand in the JSON")
    if not details:
        return Verification("identical", 0.0, digest, ())
    details += _other_conditions(manifest)
    return Verification(
        "changed" if changed else "numerically equal", within, digest, tuple(details)
    )


def _difference(a: Path, b: Path) -> float:
    """Largest difference of two texts' numbers; infinite where anything else differs."""
    texts = [p.read_text(encoding="utf-8") for p in (a, b)]
    if a.suffix == ".json":
        leaves = [list(_leaves(json.loads(t))) for t in texts]
    else:
        leaves = [_numbers_and_rest(t) for t in texts]
    if len(leaves[0]) != len(leaves[1]):
        return math.inf
    worst = 0.0
    for x, y in zip(*leaves, strict=True):
        if isinstance(x, float) and isinstance(y, float):
            # A heading just under 360 may come out just above 0 elsewhere.
            apart = min(abs(x - y), abs(abs(x - y) - 360.0))
            worst = max(worst, apart / max(1.0, abs(x)))
        elif x != y and not _same_but_numbers(x, y):
            return math.inf
    return worst


def _numbers_and_rest(text: str) -> list[Any]:
    return [_NUMBER.sub("#", text), *(float(n) for n in _NUMBER.findall(text))]


def _same_but_numbers(x: Any, y: Any) -> bool:
    """Sentences that quote a rounded number may round it otherwise."""
    return isinstance(x, str) and isinstance(y, str) and _NUMBER.sub("#", x) == _NUMBER.sub("#", y)


def _leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, dict):
        for key, item in value.items():
            yield key
            yield from _leaves(item)
    elif isinstance(value, list):
        for item in value:
            yield from _leaves(item)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield float(value)
    else:
        yield value


def _other_conditions(manifest: dict[str, Any]) -> list[str]:
    now = versions() | {f"platform {k}": v for k, v in machine().items()}
    then = manifest["versions"] | {f"platform {k}": v for k, v in manifest["platform"].items()}
    return [
        f"{name}: {then.get(name, 'absent')} then, {now.get(name, 'absent')} now"
        for name in sorted(now.keys() | then.keys())
        if now.get(name) != then.get(name)
    ]
