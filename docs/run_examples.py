"""Run every example of the manual and compare what it prints with what is written.

``python docs/run_examples.py`` says where they differ; ``--write`` puts what was printed into the
pages; ``--list`` says what of each page is run, and what is not and why. Each page has a temporary
folder of its own, in which its examples run in order; the files of ``examples`` are in it under
that name. A line that is ``…`` alone stands for any number of lines, and ``…`` in a line for any
text. Recordings are looked for where STRAPDOWN_DATA points; a page that needs them is left out
without it.

``console`` blocks are commands and what they print. ``python`` blocks, and the cells of pages that
are notebooks kept as text (jupytext's form "myst"), run after them in order in one Python process;
what one prints, and of a cell the value of its last line, is compared with the ``text`` block under
it. A line of a cell that begins with ``!`` is a command, as in Jupyter.
What cannot run has its reason above it, in a comment: ``<!-- not run: REASON -->``.
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
# A block that is an example, what it prints where that is in a block of its own, and why it is
# not run, where it is not.
BLOCK = re.compile(
    r"^(?P<mark><!-- not run: (?P<reason>.+?) -->\n)?"
    r"^```(?P<kind>console|python|sh|bash|\{code-cell\} ipython3)\n(?P<code>.*?)^```\n"
    r"(?P<shown>\n```text\n(?P<out>.*?)^```\n)?",
    re.M | re.S,
)
# Runs the code that it is given as JSON, each with whether it is a cell, whose last value is shown;
# tells what each printed, and where one failed.
RUNNER = """
import ast, contextlib, io, json, re, subprocess, sys, traceback
space, printed = {"__name__": "__main__"}, []
def command(line):
    done = subprocess.run(["bash", "-c", line], stdout=-1, stderr=-2, text=True)
    print(done.stdout, end="")
space["command"] = command
for code, is_cell in json.load(sys.stdin):
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        try:
            if is_cell:
                code = re.sub("^!(.*)", lambda line: f"command({line[1]!r})", code, flags=re.M)
            body = ast.parse(code)
            last = body.body[-1] if body.body else None
            value = is_cell and isinstance(last, ast.Expr)
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
    """Return what a command prints."""
    done = subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env=os.environ | {"COLUMNS": "110"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return plain(done.stdout, folder)


def plain(text: str, folder: Path) -> list[str]:
    """Return the lines of an output, without what differs from machine to machine."""
    text = re.sub(r"sha256 [0-9a-f]{64}", "sha256 …", text.replace(str(folder), "…"))
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


def run_cells(cells: list[tuple[str, bool]], folder: Path) -> list[list[str]]:
    """Return the lines that each piece of code prints, run in order in one process."""
    done = subprocess.run(
        [sys.executable, "-c", RUNNER],
        cwd=folder,
        env=os.environ | {"COLUMNS": "110"},
        input=json.dumps(cells),
        capture_output=True,
        text=True,
        check=True,
    )
    return [plain(out, folder) for out in json.loads(done.stdout)]


def examples(page: Path) -> list[re.Match[str]]:
    """Return the blocks of a page that are examples, in order."""
    return list(BLOCK.finditer(page.read_text(encoding="utf-8")))


def is_run(block: re.Match[str]) -> bool:
    """Say whether a block is run: it is not where it says why, nor where nothing can run it."""
    return block["reason"] is None and block["kind"] not in ("sh", "bash")


def mend_console(block: re.Match[str], folder: Path, page: Path) -> str | None:
    """Run the commands of a block; return it as it should be, None where it is."""
    lines, differ = [], False
    for command, expected in commands(block["code"]):
        printed = run(command, folder)
        good = same(expected, printed)
        if not good:
            differ = True
            print(f"{page.name}: $ {command}\n" + "\n".join(f"  {line}" for line in printed))
        lines += [f"$ {command}", *(expected if good else trimmed(expected, printed))]
    rest = block["shown"] or ""
    return "```console\n" + "\n".join(lines) + "\n```\n" + rest if differ else None


def mend_cell(block: re.Match[str], printed: list[str], page: Path) -> str | None:
    """Return a block of Python with what it printed under it, None where that is so."""
    if same((block["out"] or "").splitlines(), printed):
        return None
    print(f"{page.name}: {block['code']}" + "\n".join(f"  {line}" for line in printed))
    cell = block[0][: len(block[0]) - len(block["shown"] or "")]
    shown = "\n```text\n" + "".join(f"{line}\n" for line in printed) + "```\n"
    return cell + (shown if printed else "")


def check(page: Path, write: bool) -> int:
    """Run the examples of one page; return how many blocks differ."""
    text = page.read_text(encoding="utf-8")
    needs = "$STRAPDOWN_DATA/" in text or 'environ["STRAPDOWN_DATA"]' in text
    if needs and not os.environ.get("STRAPDOWN_DATA"):
        return 0
    blocks = [block for block in examples(page) if is_run(block)]
    cells = [block for block in blocks if block["kind"] != "console"]
    mended: dict[int, str] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(HERE / "examples", folder / "examples")
        for block in blocks:
            if block["kind"] == "console":
                found = mend_console(block, folder, page)
                if found is not None:
                    mended[block.start()] = found
        codes = [(block["code"], block["kind"] != "python") for block in cells]
        printed = run_cells(codes, folder) if codes else []
    for block, lines in zip(cells, printed, strict=True):
        found = mend_cell(block, lines, page)
        if found is not None:
            mended[block.start()] = found
    if write and mended:
        pieces, last = [], 0
        for block in blocks:
            pieces += [text[last : block.start()], mended.get(block.start(), block[0])]
            last = block.end()
        page.write_text("".join([*pieces, text[last:]]), encoding="utf-8")
    return len(mended)


def listed(page: Path) -> str:
    """Say in a line how much of a page is run, and in others what is not."""
    blocks = examples(page)
    done = [block["kind"].split("}")[0].strip("{") for block in blocks if is_run(block)]
    counted = ", ".join(f"{done.count(kind)} {kind}" for kind in sorted(set(done)))
    left = [
        f"    not run: {(block['reason'] or '?')}: {block['code'].splitlines()[0]}"
        for block in blocks
        if not is_run(block)
    ]
    return "\n".join([f"{page.name}: {counted or 'nothing to run'}", *left])


def pages() -> list[Path]:
    """Return every page whose examples are run here."""
    return [*sorted(HERE.glob("*.md")), *sorted(HERE.glob("notebooks/*.md"))]


if __name__ == "__main__":
    chosen = [Path(a) for a in sys.argv[1:] if not a.startswith("--")] or pages()
    if "--list" in sys.argv:
        print("\n".join(listed(page) for page in chosen))
        sys.exit(0)
    sys.exit(1 if sum(check(page, "--write" in sys.argv) for page in chosen) else 0)
