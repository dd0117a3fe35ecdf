"""A document as one page that needs no network, and works without scripts."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

from strapdown.report.document import Document
from strapdown.report.document_data import document_data, draw_stills

__all__ = ["document_page"]


_HEIGHT = 420  # pixels, of a figure without a stated height


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
        HTML, the same for the same document. Pictures are embedded as images, which cannot run
        scripts or fetch resources; a content policy in the page forbids both to everything else.
    """
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    drawn = draw_stills(document) if stills is None else stills
    data = document_data(document, drawn, _image, alive=True)
    sections = (block for section in data["sections"] for block in section["blocks"])
    alive = [block for block in (*data["front"], *sections) if "figure" in block]
    for block in alive:
        block["json"] = embedded(_without_controls(block["figure"]))
        block["height"] = int(block["figure"]["layout"].get("height", _HEIGHT))
    script = files("strapdown.report").joinpath("templates", "document.js").read_text("utf-8")
    scripts = [get_plotlyjs(), script] if alive else []
    return render(
        "document.html",
        {
            "document": data,
            "alive": bool(alive),
            "script": Markup(script),
            "policy": " ".join(map(_digest, scripts)) or "'none'",
        },
    )


def _without_controls(figure: dict[str, Any]) -> dict[str, Any]:
    """Remove plotly's own buttons and sliders: the page has keyboard-accessible ones."""
    layout = {k: v for k, v in figure["layout"].items() if k not in ("updatemenus", "sliders")}
    return figure | {"layout": layout}


def _image(svg: str) -> str:
    # A lone surrogate has no UTF-8.
    whole = base64.b64encode(svg.encode("utf-8", "replace")).decode("ascii")
    return f"data:image/svg+xml;base64,{whole}"


def _digest(script: str) -> str:
    """Digest of a script for the page's content policy; an unlisted script does not run."""
    whole = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    return f"'sha256-{whole}'"


# Pages: one offline file, every external text escaped.


def render(template: str, context: Mapping[str, Any]) -> str:
    """Render a template into a self-contained page.

    Parameters
    ----------
    template : str
        File in ``templates``.
    context : mapping
        Strings are escaped by the template; charts come from `embedded`.

    Returns
    -------
    str
        HTML.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup
    from plotly.offline import get_plotlyjs

    environment = Environment(
        loader=PackageLoader("strapdown.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # The only text that is code: plotly's own.
    return environment.get_template(template).render(plotly_js=Markup(get_plotlyjs()), **context)


def embedded(figure: Mapping[str, Any]) -> Any:
    """Encode JSON safely for a script element, whatever text it holds.

    Parameters
    ----------
    figure : mapping

    Returns
    -------
    markupsafe.Markup
        With ``<``, ``>`` and ``&`` written as escapes of JSON, so that no ``</script>`` and no
        ``<!--`` can end or open anything.
    """
    from markupsafe import Markup

    text = json.dumps(figure, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    for char in "<>&":
        text = text.replace(char, f"\\u{ord(char):04x}")
    return Markup(text)
