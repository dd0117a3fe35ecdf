"""A chart alone: shown by a notebook, or written as SVG, PNG or PDF."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from strapdown.errors import ConfigError
from strapdown.report.chart import Chart, Panel
from strapdown.report.chart_svg import still

_PPI = 200
_TYPST = '#set page(width: auto, height: auto, margin: 4pt)\n#image("chart.svg")\n'


@dataclass(frozen=True)
class ChartFigure:
    """A chart as a picture; `panels` hold its data: lines, bands and bars with their values.

    A notebook displays it; `save` writes it.
    """

    chart: Chart

    @property
    def panels(self) -> tuple[Panel, ...]:
        """Panels with their data, from the top."""
        return self.chart.panels

    def svg(self, *, caption: bool = False) -> str:
        """Return the picture as SVG, with its title and, if wanted, its caption below."""
        return still(self.chart, title=True, caption=caption)

    def save(self, path: str | Path, *, caption: bool = False) -> None:
        """Write the picture: SVG, PNG or PDF by the ending of the file's name.

        Parameters
        ----------
        path : str or Path
        caption : bool
            Whether to write the caption in the picture, for use without a page.

        Raises
        ------
        ConfigError
            Another ending.
        """
        path = Path(path)
        ending = path.suffix.lower().lstrip(".")
        if ending == "svg":
            path.write_text(self.svg(caption=caption), encoding="utf-8", newline="\n")
        elif ending in ("png", "pdf"):
            path.write_bytes(_typeset(self.svg(caption=caption), ending))
        else:
            raise ConfigError("report.unknown-picture", file=str(path), word=ending)

    def _repr_svg_(self) -> str:
        return self.svg()

    def __repr__(self) -> str:
        """Return the title and the number of panels."""
        return f"<ChartFigure: {self.chart.title}; {len(self.panels)} panels>"


def _typeset(svg: str, ending: str) -> bytes:
    """Draw an SVG with the fonts inside typst: the same bytes on every machine."""
    from strapdown.report.document_pdf import shown, typst_library

    with tempfile.TemporaryDirectory(prefix="strapdown-") as name:
        folder = Path(name)
        (folder / "chart.svg").write_text(shown(svg), encoding="utf-8", newline="\n")
        (folder / "chart.typ").write_text(_TYPST, encoding="utf-8", newline="\n")
        made: bytes = typst_library().compile(
            str(folder / "chart.typ"),
            root=str(folder),
            font_paths=[],
            ignore_system_fonts=True,
            format=ending,
            ppi=_PPI,
            timestamp=0,
        )
    return made
