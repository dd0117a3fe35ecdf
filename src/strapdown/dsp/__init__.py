"""Digital filters: CFC classes, resampling, derivatives, delays between signals.

Arrays in, arrays out; each states its effect on noise and on time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from strapdown.lazy_names import load_on_first_use

if TYPE_CHECKING:
    from strapdown.dsp.samples import running_integral

__all__ = ["running_integral"]

load_on_first_use(__name__, {"samples": "running_integral"})
