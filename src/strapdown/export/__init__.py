"""Kernels as C: the translator of all, and files for devices made from some."""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.export.attitude import export_c, export_micropython
    from strapdown.export.configuration import Channel, SensorConfiguration

__all__ = ["Channel", "SensorConfiguration", "export_c", "export_micropython"]

# The build of the package runs the translator, and has none of what a file for a device needs.
load_on_first_use(
    __name__,
    {"attitude": "export_c export_micropython", "configuration": "Channel SensorConfiguration"},
)
