"""Run every shell example of the manual and compare what it prints with what is written.

``python docs/run_examples.py`` says where they differ; ``--write`` puts what was printed into the
pages. Each page has a temporary folder of its own, in which its examples run in order. A line
that is ``…`` alone stands for any number of lines, and ``…`` in a line for any text. Recordings
are looked for where STRAPDOWN_DATA points; a page that needs them is left out without it.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
BLOCK = re.compile(r"^```console\n(.*?)^```$", re.M | re.S)
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


def check(page: Path, write: bool) -> int:
    """Run the examples of one page; return how many differ."""
    text = page.read_text(encoding="utf-8")
    blocks = list(BLOCK.finditer(text))
    if not blocks or ("$STRAPDOWN_DATA/" in text and not os.environ.get("STRAPDOWN_DATA")):
        return 0
    differ, pieces, last = 0, [], 0
    with tempfile.TemporaryDirectory() as folder:
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
    pages = [Path(a) for a in sys.argv[1:] if a != "--write"] or sorted(HERE.glob("*.md"))
    sys.exit(1 if sum(check(page, "--write" in sys.argv) for page in pages) else 0)
