"""An attitude algorithm as one C99 file, translated from the kernels."""

from strapdown.export_c.program import SensorConfiguration, export_c

__all__ = ["SensorConfiguration", "export_c"]
