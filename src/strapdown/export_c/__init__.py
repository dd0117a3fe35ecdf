"""An attitude algorithm as one C99 file, translated from the kernels."""

from strapdown.export_c.program import export_c

__all__ = ["export_c"]
