"""The layout of a picture, the same every time. Loads matplotlib."""

from __future__ import annotations

from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

__all__ = ["RoundedLayout"]


class RoundedLayout(ConstrainedLayoutEngine):
    """Matplotlib's constrained layout, rounded.

    Its solver takes sums in the order of addresses in memory, so that the last bit of a place
    differs from run to run, and with it the names of clips in an SVG, which are hashes.
    """

    def execute(self, fig: Figure) -> None:
        """Place the axes of a figure, to a millionth of its size."""
        super().execute(fig)
        for axes in fig.axes:
            bounds = [round(float(v), 6) for v in axes.get_position(original=True).bounds]
            axes.set_position((bounds[0], bounds[1], bounds[2], bounds[3]), which="original")
            # Axes whose place was set are left out of the next layout.
            axes.set_in_layout(True)
