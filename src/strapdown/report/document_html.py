"""A document as one page that needs no network, and works without scripts."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from strapdown.progress import Progress, silent
from strapdown.report.document import (
    Document,
    document_data,
    draw_stills,
    write_drawings,
    write_text,
)

_TITLE_ELEMENT = re.compile("<title>.*?</title>", re.DOTALL)
_PLACE = re.compile(r"\{\{ (?:policy|title|body) \}\}")
_SIGNS = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "'": "&#39;", '"': "&#34;"})
_SIGNS_OF_SCRIPT = str.maketrans({sign: f"\\u{ord(sign):04x}" for sign in "<>&"})
#: Characters from which a cell is wide.
_LONG = 30
_HOW_TO = (
    '<span class="livenote">In a chart: point for values, which every chart over the same time '
    "and the plan show, too; drag to zoom, double-click to return, click a name in the legend to "
    "hide it.</span>"
)


def write_report(
    document: Document, folder: Path, progress: Progress = silent, *, figures: bool = True
) -> tuple[str, ...]:
    """Write ``report.html`` and, in ``figures``, its drawings; return the drawn charts."""
    progress("drawing the figures", 0.86)
    stills = draw_stills(document)
    if figures:
        write_drawings(document, stills, folder / "figures")
    progress("writing the page", 0.93)
    write_text(folder / "report.html", document_page(document, stills=stills))
    return stills


def document_page(document: Document, *, stills: Sequence[str] | None = None) -> str:
    """Lay out a document as an HTML page.

    `document`: its texts are made plain, then escaped. `stills`: drawn charts from `draw_stills`,
    if already made. Returns: HTML, the same for the same document, whole without scripts but for
    scenes that move. Charts are SVG of `chart_svg`, with every text escaped; pictures are embedded
    as images, which cannot run scripts or fetch resources. A content policy in the page allows its
    own script and no other.
    """
    drawn = draw_stills(document) if stills is None else stills
    data = document_data(document, drawn, _image, alive=True)
    sections, title = data["sections"], _text(data["title"])
    blocks = [*data["front"], *(b for s in sections for b in (*s["blocks"], *s["more"]))]
    templates = files("strapdown.report").joinpath("templates")
    script, policy = "", "'none'"
    if any(b["kind"] in ("chart", "animation") for b in blocks) or any(
        s["folded"] or s["more"] for s in sections
    ):
        script = templates.joinpath("document.js").read_text("utf-8")
        # A script that the policy does not list does not run.
        digest = hashlib.sha256(script.encode()).digest()
        policy = f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
    contents = "".join(
        f'<li><span class="no" aria-hidden="true">{one["number"]}</span>'
        f'<a href="#{_text(one["anchor"])}">{_text(one["title"])}</a></li>'
        for one in sections
    )
    body = [
        '<a class="skip" href="#contents">Skip to the contents</a>' if sections else "",
        f"\n<main>\n<header>\n<h1>{title}</h1>\n",
        f'<p class="subtitle">{_text(data["subtitle"])}</p>' if data["subtitle"] else "",
        _facts(data["facts"]) if data["facts"] else "",
        _links(data["links"]) if data["links"] else "",
        "\n</header>\n",
        *map(_block, data["front"]),
        '<nav id="contents" aria-labelledby="contents-head">'
        f'<h2 id="contents-head">Contents</h2>\n<ol>{contents}</ol></nav>\n'
        if sections
        else "",
        *map(_section, sections),
        f"<footer>{_text(data['footer'])}{_HOW_TO if script else ''}</footer>"
        if data["footer"] or script
        else "",
        "\n</main>\n",
        f"<script>{script}</script>" if script else "",
    ]
    begin, between, after, end = _PLACE.split(
        templates.joinpath("document.html").read_text("utf-8")
    )
    page = [begin, _text(policy), between, title, after, *body, end]
    return "".join(page).removesuffix("\n")


def _text(text: str) -> str:
    """Escape a text for an element or an attribute."""
    return str(text).translate(_SIGNS)


def _section(one: Mapping[str, Any]) -> str:
    """A section under its heading; a folded one opens by its heading."""
    anchor = _text(one["anchor"])
    holds = f'<span class="holds">{one["holds"]}</span>' if one["folded"] and one["holds"] else ""
    heading = (
        f'<h2 id="{anchor}"><span class="no">{one["number"]}</span>'
        f"<span>{_text(one['title'])}</span>{holds}</h2>"
    )
    body = "".join(map(_block, one["blocks"]))
    if one["folded"]:
        body = f"<details><summary>{heading}</summary>\n{body}</details>"
    else:
        body = f"{heading}\n{body}"
        if one["more"]:
            # Figures behind a fold, which has their titles.
            titles = "; ".join(_text(figure["title"]) for figure in one["more"])
            more = "".join(map(_block, one["more"]))
            body += f'<details><summary class="more">{titles}</summary>\n{more}</details>\n'
    return f'<section aria-labelledby="{anchor}">\n{body}</section>\n'


def _block(block: Mapping[str, Any]) -> str:
    """One block of any kind, with a line end after it."""
    match block["kind"]:
        case "paragraph":
            style, text = block["style"], _text(block["text"])
            if style == "mono":
                return f"<pre>{text}</pre>\n"
            look = "" if style == "plain" else f' class="{style}"'
            role = ' role="note"' if style == "warning" else ""
            return f"<p{look}{role}>{text}</p>\n"
        case "items":
            tag = "ol" if block["numbered"] else "ul"
            rows = "".join(
                f"<li>{f'<b>{_text(head)}</b>' if head else ''}{' – ' if head and text else ''}"
                f"{_text(text)}</li>"
                for head, text in block["rows"]
            )
            return f"<{tag}>{rows}</{tag}>\n"
        case "links":
            return f"{_links(block['rows'])}\n"
        case "facts":
            return f"{_facts(block['rows'])}\n"
        case "table":
            return _table(block)
        case "chart":
            return _chart(block)
        case "animation":
            return _animation(block)
        case "picture":
            caption = _caption(block, "Figure")
            return f"<figure>{_picture(block)}<figcaption>{caption}</figcaption></figure>\n"
        case _:
            return _key_figures(block)


def _links(rows: Iterable[tuple[str, str]]) -> str:
    shown = " · ".join(f'<a href="{_text(file)}">{_text(text)}</a>' for file, text in rows)
    return f'<p class="links">{shown}</p>'


def _facts(rows: Iterable[tuple[str, str]]) -> str:
    shown = "".join(f"<dt>{_text(name)}</dt><dd>{_text(text)}</dd>" for name, text in rows)
    return f'<dl class="facts">{shown}</dl>'


def _caption(block: Mapping[str, Any], kind: str) -> str:
    """Number, title and caption of a table or a figure."""
    number = f"<b>{kind} {block['number']}.</b> " if block["number"] else ""
    title = f"<b>{_text(block['title'])}.</b> " if block["title"] else ""
    return f"{number}{title}{_text(block['caption'])}"


def _table(block: Mapping[str, Any]) -> str:
    words = block["words"]
    caption = f"<caption>{_caption(block, 'Table')}</caption>" if block["number"] else ""
    names = ""
    for name, word in zip(block["columns"], words, strict=True):
        look = "" if word else ' class="num"'
        # A header without a name is none.
        names += f'<th scope="col"{look}>{_text(name)}</th>' if name else "<td></td>"
    rows = ""
    for row, passed, strong in zip(block["rows"], block["passed"], block["strong"], strict=True):
        rows += '<tr class="strong">' if strong else "<tr>"
        for k, (cell, word, mark) in enumerate(zip(row, words, passed, strict=True)):
            look = "" if word else "num"
            look += " long" if len(cell) >= _LONG else "" if word or k == 0 else " short"
            if k == 0:
                rows += f'<th scope="row" class="{look}">{_text(cell)}</th>'
            else:
                rows += f'<td class="{look}{" passed" if mark else ""}">{_text(cell)}</td>'
        rows += "</tr>\n"
    columns = ", ".join(filter(None, block["columns"]))
    label = _text(block["title"] or block["caption"] or f"Table: {columns}")
    return (
        f'<div class="table"><div class="scroll" tabindex="0" role="region" aria-label="{label}">'
        f"<table>\n{caption}<thead><tr>{names}</tr></thead>\n<tbody>{rows}</tbody>\n"
        "</table></div></div>\n"
    )


def _chart(block: Mapping[str, Any]) -> str:
    # The browser would show a title wherever the pointer rests on the chart.
    svg = _TITLE_ELEMENT.sub("", block["svg"], count=1)
    # Names in its legend can be pressed, so it is a group and no image.
    svg = svg.replace(' xmlns="http://www.w3.org/2000/svg"', "", 1)
    svg = svg.replace(' role="img"', f' role="group" aria-label="{_text(block["alt"])}"', 1)
    # On a narrow screen it scrolls, by keys as well.
    focus = "" if "data-entry" in svg else ' tabindex="0"'
    return (
        f'<figure data-figure="chart" data-x-label="{_text(block["x_label"])}">\n'
        f'<div class="chart"{focus}>{svg}</div>\n'
        f'<div class="tip" hidden></div>\n<figcaption>{_caption(block, "Figure")}</figcaption>\n'
        "</figure>\n"
    )


def _animation(block: Mapping[str, Any]) -> str:
    scene, alt, title = block["scene"], _text(block["alt"]), _text(block["title"])
    still = '<p class="still note">This scene needs scripts.</p>'
    if block["still"]:
        still = f'<img class="still" src="{_text(block["still"])}" alt="{alt}">'
    legend = "".join(
        f'<span><i style="border-color:{_text(entry["colour"])}'
        f'{";border-top-style:dashed" if entry["dash"] else ""}"></i>{_text(entry["name"])}</span>'
        for entry in scene.legend
    )
    notes = "".join(
        f'<span class="{name}"> {_text(block[key])}</span>'
        for name, key in (("livenote", "live_caption"), ("stillnote", "still_caption"))
        if block[key]
    )
    # No text in the data can end the script element or begin another.
    scene_data = json.dumps(
        scene.data(), ensure_ascii=True, allow_nan=False, separators=(",", ":")
    ).translate(_SIGNS_OF_SCRIPT)
    return (
        f'<figure data-figure="scene">\n{still}\n'
        f'<div class="scene"><canvas role="img" aria-label="{alt}" '
        f'style="height:{_text(scene.height)}px"></canvas>\n<p class="legend">{legend}</p></div>\n'
        '<div class="controls" hidden><button type="button">Play</button><input type="range" '
        f'min="0" value="0" step="1" aria-label="Frame of: {title}"><output></output></div>\n'
        f"<figcaption>{_caption(block, 'Figure')}{notes}</figcaption>\n"
        f'<script type="application/json">{scene_data}</script>\n</figure>\n'
    )


def _picture(block: Mapping[str, Any]) -> str:
    width = f"{block['width_mm'] / 1.7:.1f}"
    return f'<img src="{_text(block["still"])}" alt="{_text(block["alt"])}" style="width:{width}%">'


def _key_figures(block: Mapping[str, Any]) -> str:
    keys = ""
    for key in block["figures"]:
        # The bound goes to the next line as a whole.
        value, *bounds = (_text(part) for part in key["value"].split("\u00a0±\u00a0"))
        parts = f"<span>{value}</span>" + "".join(f" <span>±&nbsp;{one}</span>" for one in bounds)
        note = f'<dd class="remark">{_text(key["note"])}</dd>' if key["note"] else ""
        keys += (
            f'<div><dt>{_text(key["name"])}</dt><dd class="value">{parts}</dd>'
            f'<dd class="bound">{_text(key["bound"])}</dd>{note}</div>'
        )
    pictures = "".join(
        f'<figure style="flex-grow:{one["width_mm"]:.0f}">{_picture(one)}'
        f"<figcaption>{_caption(one, '')}</figcaption></figure>"
        for one in block["pictures"]
    )
    below = f'<div class="keypictures">{pictures}</div>' if pictures else ""
    return f'<dl class="keys">{keys}</dl>\n{below}'


def _image(svg: str) -> str:
    # A lone surrogate has no UTF-8.
    whole = base64.b64encode(svg.encode("utf-8", "replace")).decode("ascii")
    return f"data:image/svg+xml;base64,{whole}"
