"""Sphinx configuration of the manual. Building it and reading it need no network."""

from __future__ import annotations

import re
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.ext.autosummary import autosummary_toc

from strapdown import __version__
from strapdown.cli.modules_list import HEADINGS, cell_text, listed_modules

project = "strapdown"
version = release = __version__
html_title = f"strapdown {__version__}"
html_show_copyright = False

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
]
exclude_patterns = ["_build"]
templates_path = ["_templates"]

myst_enable_extensions = ["attrs_inline", "deflist", "dollarmath"]
myst_heading_anchors = 3

# The docstrings give type, shape, unit and frame of every argument; annotations would only
# repeat the first of them.
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autosummary_generate = True
# `name` in a docstring is a link where a page has that name.
default_role = "py:obj"
# Two names that differ in case alone would be one file on some systems.
autosummary_filename_map = {"strapdown.attitude": "strapdown.attitude_function"}
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["manual.css"]
html_math_renderer = "mathml"


# What a command printed may hold an apostrophe, which a lexer takes for an open quotation.
suppress_warnings = ["misc.highlighting_failure"]


def _math(self: Any, node: Any) -> None:
    """Write a formula as MathML, which browsers set themselves: no script to load."""
    block = isinstance(node, nodes.math_block)
    text = tex2mathml(node.astext(), as_block=block)
    self.body.append(f'<div class="math">{text}</div>' if block else text)
    raise nodes.SkipNode


class CodeCell(Directive):
    """A cell of a notebook kept as text, shown as the Python that it is."""

    has_content = True
    optional_arguments = 1

    def run(self) -> list[Any]:
        """Return the cell as a block of code."""
        text = "\n".join(self.content)
        return [nodes.literal_block(text, text, language="python")]


def _write_messages(app: Any) -> None:
    """Make a page of each room of the catalogue of sentences."""
    folder = Path(app.srcdir) / "messages"
    folder.mkdir(exist_ok=True)
    rooms = resources.files("strapdown").joinpath("messages")
    for room in rooms.iterdir():
        if not room.name.endswith(".toml"):
            continue
        name = room.name.removesuffix(".toml")
        parts = [f"# Messages: {name}\n", "How to read a code: [messages](../messages.md).\n"]
        for code, entry in sorted(tomllib.loads(room.read_text(encoding="utf-8")).items()):
            lines = [f"`{name}.{code}`{{#{name}-{code}}}", f": {_prose(entry['what'])}"]
            if entry.get("remedy"):
                lines.append(f"  \n  *{_prose(entry['remedy'])}*")
            parts.append("\n".join(lines) + "\n")
        (folder / f"{name}.md").write_text("\n".join(parts), encoding="utf-8")


def _without_toctree(app: Any, doctree: Any) -> None:
    """Keep pages of single objects out of the sidebar: 400 links on each page."""
    for node in list(doctree.findall(autosummary_toc)):
        node.parent.remove(node)


def _levels(app: Any, page: str, template: str, context: dict[str, Any], _: Any) -> None:
    """Give captions of the sidebar a level and scrolling boxes a place in the order of keys."""
    role, name = 'role="heading"', "furo_navigation_tree"
    context[name] = context.get(name, "").replace(role, f'{role} aria-level="2"')
    # What scrolls on a narrow screen is to be reached by keys.
    for kind in ("table-wrapper", "math-wrapper"):
        box = f'<div class="{kind}'
        context["body"] = context.get("body", "").replace(box, f'<div tabindex="0" class="{kind}')


_MODULES = """# Modules and formats

Every name that a command, a configuration or a function accepts. The page is made of the tables in
the code when the manual is built; `strapdown modules` prints it with your plug-ins, and `--json`
as data.
"""


def _write_modules(app: Any) -> None:
    """Make the page of modules of the lists of `strapdown modules`."""
    parts = [_MODULES]
    for listed in listed_modules()[0]:
        columns = list(listed.rows[0])
        rows = [[_prose(cell_text(row[c])) for c in columns] for row in listed.rows]
        parts.append(f"## {_prose(listed.title)}\n")
        heads = [[HEADINGS.get(c, c) for c in columns], ["---"] * len(columns)]
        parts += [f"| {' | '.join(cells)} |" for cells in [*heads, *rows]] + [""]
    (Path(app.srcdir) / "modules.md").write_text("\n".join(parts), encoding="utf-8")


def _prose(template: str) -> str:
    """Text of a template as Markdown that is taken as it is."""
    text = re.sub(r"\{(\w+(?:\.\w+)?)(?:![rsa])?:[^{}]*(?:\{\w+\})?[^{}]*\}", r"{\1}", template)
    text = " ".join(text.replace("{{", "{").replace("}}", "}").split())
    return "".join(f"\\{c}" if c in "\\`*_{}[]()#+-.!|<>$:~" else c for c in text)


def setup(app: Any) -> dict[str, bool]:
    """Register the writer of formulas, and cells of notebooks."""
    app.connect("builder-inited", _write_messages)
    app.connect("builder-inited", _write_modules)
    app.connect("doctree-read", _without_toctree, priority=100)
    app.connect("html-page-context", _levels, priority=900)
    app.add_directive("code-cell", CodeCell)
    app.add_html_math_renderer("mathml", (_math, None), (_math, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
