"""Pages: one offline file, every text from outside escaped."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


def render(template: str, context: Mapping[str, Any]) -> str:
    """Render a template into a page that needs nothing else.

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
    # The one text that is code: plotly's own.
    return environment.get_template(template).render(plotly_js=Markup(get_plotlyjs()), **context)


def embedded(figure: Mapping[str, Any]) -> Any:
    """JSON that may stand inside a script element, whatever text it holds.

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
