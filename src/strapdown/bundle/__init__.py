"""Sealed bundles: what a run wrote, what it read, and how to run it again.

A bundle is a folder. ``manifest.json`` in it names the command, the resolved configuration,
the seed, the versions, the platform, and the SHA-256 of every input and output; its own
SHA-256 is the seal. A bundle is written beside its place and moved there whole, so that a run
that fails leaves nothing. ``timing.json`` stands outside the seal, because clocks differ.
"""

from __future__ import annotations

from strapdown.bundle.configuration_paths import resolved
from strapdown.bundle.reading import read_manifest, unsealed_changes
from strapdown.bundle.seal import Seal, sha256, write_latency, write_timing
from strapdown.bundle.writing import write_bundle

__all__ = [
    "Seal",
    "read_manifest",
    "resolved",
    "sha256",
    "unsealed_changes",
    "write_bundle",
    "write_latency",
    "write_timing",
]
