"""Sealed bundles: outputs and inputs of a run, with all that is needed to repeat it.

A bundle is a folder. ``manifest.json`` in it names the command, the resolved configuration,
the seed, the versions, the platform, and the SHA-256 of every input and output; its own
SHA-256 is the seal. A bundle is written to a temporary folder and renamed as a whole, so that
a failed run leaves no files. ``timing.json`` is outside the seal, because clocks differ.
"""

from __future__ import annotations

from strapdown.bundle.reading import read_manifest, unsealed_changes
from strapdown.bundle.seal import Seal, sha256
from strapdown.bundle.writing import write_bundle

__all__ = [
    "Seal",
    "read_manifest",
    "sha256",
    "unsealed_changes",
    "write_bundle",
]
