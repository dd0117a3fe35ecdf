"""Read the manifest of a bundle, and list the changes since it was sealed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from strapdown.bundle.configuration_paths import named_paths
from strapdown.bundle.seal import MANIFEST, SCHEMA, UNSEALED, files_of, sha256
from strapdown.errors import DataError

KEPT = ("copy", "reference")


def read_manifest(bundle: Path) -> dict[str, Any]:
    """Read the manifest of a bundle.

    DataError: the manifest is missing or damaged.
    """
    path = bundle / MANIFEST
    if not bundle.exists():
        raise DataError("bundle.no-such-folder", file=str(bundle))
    if not path.is_file():
        raise DataError("bundle.no-manifest", file=str(bundle))
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise DataError("bundle.not-json", file=MANIFEST, reason=error) from None
    wanted = {"schema", "command", "configuration", "inputs", "outputs", "versions", "platform"}
    if not isinstance(manifest, dict) or wanted - set(manifest):
        raise DataError("bundle.unknown-form", file=MANIFEST)
    if manifest["schema"] != SCHEMA:
        known = manifest["versions"]
        version = known.get("strapdown", "unknown") if isinstance(known, dict) else "unknown"
        raise DataError(
            "bundle.other-schema", file=MANIFEST, schema=manifest["schema"], version=version
        )
    _refuse_escape(manifest)
    return manifest


def _refuse_escape(manifest: dict[str, Any]) -> None:
    """Refuse a malformed manifest, or one with own files outside its folder."""
    try:
        for item in [*manifest["inputs"], *manifest["outputs"]]:
            path, refers = Path(item["name"]), item.get("kept") == "reference"
            if not isinstance(item["sha256"], str) or path.is_absolute() != refers:
                raise ValueError
            if not isinstance(item["bytes"], int) or item.get("kept", "copy") not in KEPT:
                raise ValueError
            if ".." in path.parts:
                raise ValueError
        _refuse_unsealed_paths(manifest)
        for part in ("versions", "platform"):
            if not all(isinstance(v, str) for v in manifest[part].values()):
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


def unsealed_changes(bundle: Path, manifest: dict[str, Any]) -> list[str]:
    """List the files of a bundle that differ from the seal.

    `manifest`: from `read_manifest`. Returns one sentence per file: changed, missing, or not in the
    manifest.
    """
    changes = []
    expected: set[str] = {MANIFEST, *UNSEALED}
    for item in [*manifest["inputs"], *manifest["outputs"]]:
        path = bundle / item["name"]  # an absolute path stays what it is
        expected.add(item["name"])
        if not path.is_file():
            changes.append(f"{item['name']}: missing")
        elif sha256(path) != item["sha256"]:
            changes.append(f"{item['name']}: changed after it was sealed")
        elif path.stat().st_size != item["bytes"]:
            changes.append(f"{item['name']}: not of the {item['bytes']} bytes of the manifest")
    changes += [f"{name}: not in the manifest" for name in files_of(bundle) if name not in expected]
    return changes
