"""A document as one page that needs no network, and works without scripts."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

from strapdown.report.document import Document, document_data, draw_stills

_TITLE = re.compile("<title>.*?</title>", re.DOTALL)


def document_page(document: Document, *, stills: Sequence[str] | None = None) -> str:
    """Lay out a document as an HTML page.

    Parameters
    ----------
    document : Document
        Texts are made plain by `document.plain_document`, then escaped.
    stills : sequence of str, optional
        Drawn charts from `document_data.draw_stills`, if already made.

    Returns
    -------
    str
        HTML, the same for the same document, whole without scripts but for scenes that move.
        Charts are SVG of `chart_svg`, with every text escaped; pictures are embedded as images,
        which cannot run scripts or fetch resources. A content policy in the page allows its own
        script and no other.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    drawn = draw_stills(document) if stills is None else stills
    data = document_data(document, drawn, _image, alive=True)
    sections = (block for section in data["sections"] for block in section["blocks"])
    alive = False
    for block in (*data["front"], *sections):
        if "svg" in block:
            # The browser would show a title wherever the pointer rests on the chart.
            drawn_svg = _TITLE.sub("", block["svg"], count=1)
            block["svg"] = Markup(drawn_svg.replace(' xmlns="http://www.w3.org/2000/svg"', "", 1))
        elif "scene" in block:
            block["json"] = _embedded(block["scene"].data())
        else:
            continue
        alive = True
    script = files("strapdown.report").joinpath("templates", "document.js").read_text("utf-8")
    environment = Environment(
        loader=PackageLoader("strapdown.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("document.html").render(
        document=data,
        script=Markup(script) if alive else "",
        policy=_digest(script) if alive else "'none'",
    )


def _image(svg: str) -> str:
    # A lone surrogate has no UTF-8.
    whole = base64.b64encode(svg.encode("utf-8", "replace")).decode("ascii")
    return f"data:image/svg+xml;base64,{whole}"


def _digest(script: str) -> str:
    """Digest of a script for the page's content policy; an unlisted script does not run."""
    whole = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    return f"'sha256-{whole}'"


def _embedded(figure: Mapping[str, Any]) -> Any:
    """Encode JSON for a script element; no text in it can end the element or begin another."""
    from markupsafe import Markup

    text = json.dumps(figure, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    for char in "<>&":
        text = text.replace(char, f"\\u{ord(char):04x}")
    return Markup(text)
