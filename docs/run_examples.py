"""Run every example of the manual and compare what it prints with what is written.

``python docs/run_examples.py`` says where they differ; ``--write`` puts what was printed into the
pages. Each page has a temporary folder of its own, in which its examples run in order; the files of
``examples`` are in it under that name. A line
that is ``…`` alone stands for any number of lines, and ``…`` in a line for any text. Recordings
are looked for where STRAPDOWN_DATA points; a page that needs them is left out without it.

The pages in ``notebooks`` are notebooks kept as text (jupytext's form "myst"). Their cells run in
order in one Python process; what a cell prints, and the value of its last line, is compared with
the ``text`` block under it.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
BLOCK = re.compile(r"^```console\n(.*?)^```$", re.M | re.S)
CELL = re.compile(
    r"^```\{code-cell\} ipython3\n(?P<code>.*?)^```\n(?P<shown>\n```text\n(?P<out>.*?)^```\n)?",
    re.M | re.S,
)
# Runs the cells that it is given as JSON; tells what each printed, and where one failed.
RUNNER = """
import ast, contextlib, io, json, sys, traceback
space, printed = {"__name__": "__main__"}, []
for code in json.load(sys.stdin):
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        try:
            body = ast.parse(code)
            last = body.body[-1] if body.body else None
            value = isinstance(last, ast.Expr)
            if value:
                body.body.pop()
            exec(compile(body, "cell", "exec"), space)
            if value:
                shown = eval(compile(ast.Expression(last.value), "cell", "eval"), space)
                if shown is not None:
                    print(repr(shown))
        except Exception:
            traceback.print_exc()
    printed.append(out.getvalue())
json.dump(printed, sys.stdout)
"""
# Rounding noise, which another processor makes otherwise.
NOISE = re.compile(r"\d\.\d+e-1\d")


def commands(block: str) -> list[tuple[str, list[str]]]:
    """Split a block into commands and the lines under each."""
    found: list[tuple[str, list[str]]] = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], []))
        else:
            found[-1][1].append(line)
    return found


def run(command: str, folder: Path) -> list[str]:
    """Return what a command prints, without what differs from machine to machine."""
    done = subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env=os.environ | {"COLUMNS": "110"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    text = done.stdout.replace(str(folder), "…")
    text = re.sub(r"sha256 [0-9a-f]{64}", "sha256 …", text)
    return "\n".join(line.rstrip() for line in text.splitlines()).strip("\n").splitlines()


def same(expected: list[str], printed: list[str]) -> bool:
    """Compare, with the ellipses that stand for anything."""
    pattern = ""
    for line in expected:
        if line.strip() == "…":
            pattern += r"(?:.*\n)*"
        else:
            line = re.sub(r"sha256 [0-9a-f]+…", "sha256 …", NOISE.sub("…", line))
            pattern += re.escape(line).replace("…", ".*") + r"\n"
    return re.fullmatch(pattern, "".join(f"{line}\n" for line in printed)) is not None


def trimmed(expected: list[str], printed: list[str]) -> list[str]:
    """Return what was printed, cut where the page cuts it, as far as that can be told.

    A cut is kept where the line next to it on the page begins with the same word as a line
    that was printed.
    """
    first, last = 0, len(printed)
    words = [(line.split() or [""])[0] for line in printed]
    shown = [line.split()[0] for line in expected if line.strip() not in ("", "…")]
    if expected and expected[0] == "…" and shown and shown[0] in words:
        first = words.index(shown[0])
    if expected and expected[-1] == "…" and shown and shown[-1] in words:
        last = len(words) - words[::-1].index(shown[-1])
    return ["…"] * (first > 0) + printed[first:last] + ["…"] * (last < len(printed))


def run_cells(cells: list[str], folder: Path) -> list[list[str]]:
    """Return the lines that each cell prints, run in order in one process."""
    done = subprocess.run(
        [sys.executable, "-c", RUNNER],
        cwd=folder,
        env=os.environ | {"COLUMNS": "110"},
        input=json.dumps(cells),
        capture_output=True,
        text=True,
        check=True,
    )
    found = []
    for out in json.loads(done.stdout):
        lines = [line.rstrip() for line in out.replace(str(folder), "…").splitlines()]
        found.append("\n".join(lines).strip("\n").splitlines())
    return found


def check_notebook(page: Path, write: bool) -> int:
    """Run the cells of a notebook kept as text; return how many print something else."""
    text = page.read_text(encoding="utf-8")
    blocks = list(CELL.finditer(text))
    with tempfile.TemporaryDirectory() as folder:
        printed = run_cells([b["code"] for b in blocks], Path(folder))
    differ, pieces, last = 0, [], 0
    for block, lines in zip(blocks, printed, strict=True):
        good = same((block["out"] or "").splitlines(), lines)
        pieces.append(text[last : block.start()])
        last = block.end()
        if good:
            pieces.append(block[0])
            continue
        differ += 1
        print(f"{page.name}: {block['code']}" + "\n".join(f"  {line}" for line in lines))
        cell = block[0][: len(block[0]) - len(block["shown"] or "")]
        shown = "\n```text\n" + "".join(f"{line}\n" for line in lines) + "```\n"
        pieces.append(cell + (shown if lines else ""))
    if write and differ:
        page.write_text("".join([*pieces, text[last:]]), encoding="utf-8")
    return differ


def check(page: Path, write: bool) -> int:
    """Run the examples of one page; return how many differ."""
    text = page.read_text(encoding="utf-8")
    needs = "$STRAPDOWN_DATA/" in text or 'environ["STRAPDOWN_DATA"]' in text
    if needs and not os.environ.get("STRAPDOWN_DATA"):
        return 0
    if CELL.search(text):
        return check_notebook(page, write)
    blocks = list(BLOCK.finditer(text))
    if not blocks:
        return 0
    differ, pieces, last = 0, [], 0
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(HERE / "examples", Path(folder) / "examples")
        for match in blocks:
            lines = []
            for command, expected in commands(match.group(1)):
                printed = run(command, Path(folder))
                good = same(expected, printed)
                if not good:
                    differ += 1
                    print(f"{page.name}: $ {command}\n" + "\n".join(f"  {p}" for p in printed))
                lines += [f"$ {command}", *(expected if good else trimmed(expected, printed))]
            pieces += [text[last : match.start(1)], "\n".join(lines) + "\n"]
            last = match.end(1)
    if write and differ:
        page.write_text("".join([*pieces, text[last:]]), encoding="utf-8")
    return differ


if __name__ == "__main__":
    pages = [Path(a) for a in sys.argv[1:] if a != "--write"] or [
        # What is said about bad input has files of its own, and is held by the tests.
        *(page for page in sorted(HERE.glob("*.md")) if page.name != "messages.md"),
        *sorted(HERE.glob("notebooks/*.md")),
    ]
    sys.exit(1 if sum(check(page, "--write" in sys.argv) for page in pages) else 0)
