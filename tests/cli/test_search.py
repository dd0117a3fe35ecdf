"""A newcomer's words find the right page of the manual within the first three results.

The search is that of Sphinx (`searchtools.js`), scored here over an index of the same form. By
default the index is made of the sources: hand-written pages and messages with their headings and
words, terms of the glossary as index entries, and public names as objects. What it leaves out, the
text of generated pages of objects, scores no higher than any other text. A light stemmer stands in
for Snowball's. ``STRAPDOWN_SEARCHINDEX=…/searchindex.js`` scores the index of a built manual with
Snowball's instead.

An entry of the glossary is right where its text links to a right page.
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections import defaultdict
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

import strapdown

DOCS = Path(__file__).parents[2] / "docs"
BUILT = os.environ.get("STRAPDOWN_SEARCHINDEX")
#: Words that Sphinx leaves out of an index and of a query.
LEFT_OUT = """
a about above after again against all am an and any are as at be because been before being
below between both but by cannot could did do does doing down during each few for from
further had has have having he her here hers herself him himself his how i if in into is it
its itself me more most my myself no nor not of off on once only or other ought our ours
ourselves out over own same she should so some such than that the their theirs them
themselves then there these they this those through to too under until up very was we were
what when where which while who whom why with would you your yours yourself yourselves
"""
STOPWORDS = set(LEFT_OUT.split())
#: What is typed, and the pages that answer it.
QUERIES = {
    "zupt": "aids walking",
    "zaru": "aids",
    "nhc": "aids",
    "ekf": "filter",
    "eskf": "error_models filter",
    "kalman filter": "filter",
    "gyro bias": "error_models sensors attitude",
    "imu noise": "sensors allan",
    "arw": "sensors allan",
    "allan": "allan",
    "compare two runs": "compare",
    "delta-v": "crash crash_tutorial",
    "pdof": "crash conventions",
    "edr": "crash crash_tutorial formats",
    "airbag pulse": "crash crash_tutorial",
    "iso mme": "formats",
    "my phone log": "formats doctor start",
    "gps time": "formats convert",
    "csv columns": "formats",
    "ROS bag": "formats",
    "u-blox": "formats",
    "px4 log": "formats",
    "time stamps": "formats",
    "wrong axes": "formats doctor",
    "quaternion order": "conventions",
    "coordinate frame": "conventions concepts",
    "heading vs course": "concepts align conventions",
    "ned to enu": "convert conventions",
    "lever arm": "gnss extrinsics",
    "time offset": "gnss extrinsics",
    "extrinsics": "extrinsics",
    "rtk": "gnss",
    "no heading": "trust attitude align",
    "yaw drift": "attitude trust",
    "gyrocompass": "align",
    "tunnel": "outage",
    "dead reckoning": "navigate walking",
    "earth rate": "earth",
    "gravity": "earth",
    "magnetometer": "attitude aids",
    "odometer": "aids",
    "barometer": "aids",
    "rts": "smoothing",
    "outliers": "filter consistency",
    "nees": "consistency",
    "what is 95 %": "concepts",
    "protection level": "concepts",
    "observability": "concepts",
    "accuracy": "accuracy",
    "speed and memory": "performance",
    "coning": "increments",
    "mechanization": "mechanization",
    "sample rate": "answer",
    "ahrs": "attitude",
    "microcontroller": "export",
    "arduino": "export",
    "real time": "live",
    "simulate": "scenarios trajectories",
    "pedestrian": "walking",
    "kml": "convert formats",
    "kf-gins": "coming_from formats",
    "pyins": "coming_from",
    "tightly coupled": "coming_from",
    "slam": "coming_from",
    "exit code": "results messages",
    "error message": "messages",
    "verify": "seal",
    "install": "index start",
    "numpy": "api",
    "plug-in": "api",
    "which command": "which_command",
}


class Index(NamedTuple):
    """An index of Sphinx, by names of pages."""

    titles: dict[str, str]
    sections: dict[str, set[str]]
    entries: dict[str, set[str]]
    objects: dict[str, str]
    words: dict[str, set[str]]
    title_words: dict[str, set[str]]


def stem(word: str) -> str:
    """Cut the endings of plurals and verbs."""
    word = word.lower()
    for ending in ("ing", "ed", "es", "s", "e"):
        if word.endswith(ending) and len(word) - len(ending) > 2:
            return word.removesuffix(ending)
    return word


def split(text: str) -> list[str]:
    """Words of a text, as Sphinx cuts them."""
    return re.findall(r"\w+", text)


def pages() -> dict[str, str]:
    """Texts of all pages, by name."""
    texts = {}
    for page in sorted(DOCS.rglob("*.md")):
        name = str(page.relative_to(DOCS).with_suffix(""))
        if not name.startswith(("_build", "api/", "messages/", "decisions/")):
            texts[name] = page.read_text(encoding="utf-8")
    for room in (Path(strapdown.__file__).parent / "messages").glob("*.toml"):
        found = tomllib.loads(room.read_text(encoding="utf-8"))
        lines = [f"{room.stem}.{c} {e['what']} {e.get('remedy', '')}" for c, e in found.items()]
        texts[f"messages/{room.stem}"] = f"# Messages: {room.stem}\n" + "\n".join(lines)
    return texts


def glossary() -> dict[str, str]:
    """Definition of each term, in lower case."""
    text = (DOCS / "glossary.md").read_text(encoding="utf-8")
    block = re.search(r"```\{glossary\}\n(.*?)```", text, re.S)[1]
    found = {}
    for entry in block.strip().split("\n\n"):
        terms = [line for line in entry.splitlines() if not line.startswith(" ")]
        found |= {term.lower(): entry for term in terms}
    return found


@cache
def of_sources() -> Index:
    """Make the index of the sources."""
    index = Index({}, *({} for _ in range(2)), {}, defaultdict(set), defaultdict(set))
    for name, text in pages().items():
        prose = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
        heads = [head.replace("`", "") for head in re.findall(r"^#+ (.*)$", prose, re.M)]
        index.titles[name] = heads[0]
        for head in heads:
            index.sections.setdefault(head, set()).add(name)
            for word in split(head):
                if word.lower() not in STOPWORDS:
                    index.title_words[stem(word)].add(name)
        for word in split(re.sub(r"\]\([^)]*\)", "]", text)):
            if word.lower() not in STOPWORDS:
                index.words[stem(word)].add(name)
    index.entries.update((term, {"glossary"}) for term in glossary())
    for name in strapdown.__all__:
        index.objects[f"strapdown.{name}"] = f"api/strapdown.{name}"
        index.titles[f"api/strapdown.{name}"] = f"strapdown.{name}"
        for word in ("strapdown", name):
            index.title_words[stem(word)].add(f"api/strapdown.{name}")
    return index


@cache
def of_built() -> Index:
    """Read the index of a built manual."""
    text = Path(BUILT).read_text(encoding="utf-8")
    found = json.loads(text[text.index("(") + 1 : text.rindex(")")])
    names = found["docnames"]

    def named(files: int | list[int]) -> set[str]:
        return {names[k] for k in ([files] if isinstance(files, int) else files)}

    return Index(
        dict(zip(names, found["titles"], strict=True)),
        {title: {names[k] for k, _ in where} for title, where in found["alltitles"].items()},
        {
            entry: {names[k] for k, _, main in where if main}
            for entry, where in found["indexentries"].items()
        },
        {
            f"{prefix}.{one[4]}" if prefix else one[4]: names[one[0]]
            for prefix, some in found["objects"].items()
            for one in some
        },
        {word: named(files) for word, files in found["terms"].items()},
        {word: named(files) for word, files in found["titleterms"].items()},
    )


def stemmer():
    """Return the stemmer of the index."""
    if not BUILT:
        return stem
    snowball = pytest.importorskip("snowballstemmer").stemmer("english")
    return lambda word: snowball.stemWord(word.lower())


def results(query: str) -> list[str]:
    """Pages in the order of the search, each once; ``glossary#TERM`` for an entry of it."""
    index = of_built() if BUILT else of_sources()
    typed = query.lower().strip()
    scored: list[tuple[float, str, str]] = []
    for title, where in index.sections.items():
        if typed in title.lower() and len(typed) >= len(title) / 2:
            score = round(15 * len(typed) / len(title))
            for page in where:
                main = index.titles[page] == title
                shown = title if main else f"{index.titles[page]} > {title}"
                scored.append((score + main, shown, page))
    for entry, where in index.entries.items():
        if typed in entry and len(typed) >= len(entry) / 2:
            score = round(100 * len(typed) / len(entry))
            scored += [(score, index.titles[page], f"{page}#{entry}") for page in where]
    for name, page in index.objects.items():
        last = name.lower().split(".")[-1]
        for word in (words := split(typed)):
            if word in name.lower() and all(other in name.lower() for other in words):
                score = 11 if word in (last, name.lower()) else 6 if word in last else 0
                scored.append((score + 5, name, page))
    scored += [(score, index.titles[p], p) for p, score in of_text(index, typed).items()]
    ordered = sorted(scored, key=lambda one: (-one[0], one[1]))
    return list(dict.fromkeys(page for _, _, page in ordered))


def of_text(index: Index, typed: str) -> dict[str, int]:
    """Pages that have all words, with the score of the best."""
    cut = stemmer()
    words = {cut(word) for word in split(typed) if not word.isdigit() and word not in STOPWORDS}
    marks: dict[str, dict[str, int]] = defaultdict(dict)
    for word in words:
        for table, whole, part in ((index.words, 5, 2), (index.title_words, 15, 7)):
            if word in table:
                for page in table[word]:
                    marks[page][word] = whole
            elif len(word) > 2:
                for term, where in table.items():
                    if word in term:
                        for page in where:
                            marks[page][word] = part
    enough = {len(words), len([word for word in words if len(word) > 2])}
    return {page: max(found.values()) for page, found in marks.items() if len(found) in enough}


@pytest.mark.parametrize("query", QUERIES)
def test_a_query_finds_the_right_page_among_the_first_three(query):
    right = QUERIES[query].split()
    terms = glossary()
    answers = []
    for page in results(query)[:3]:
        name, _, term = page.partition("#")
        links = re.findall(r"\]\((\w+)\.md", terms[term]) if name == "glossary" and term else []
        answers += [name, *links]
    assert set(answers) & set(right), results(query)[:8]


def test_every_right_page_exists():
    assert {page for right in QUERIES.values() for page in right.split()} <= set(pages())
    assert len(QUERIES) >= 60
