"""Record one run in the environment that this is started in: arrays by quantity, and status words.

    python recorder.py ADAPTER RUN OUT DATA     record one run
    python recorder.py ADAPTER --about          say which package and libraries are at work

`OUT/RUN.npz` has the arrays, `OUT/RUN.json` the exit codes and status words. Only the command line,
the files that it writes and what `strapdown.__all__` exports are used, through the adapter that
knows the names of this version.
"""

from __future__ import annotations

import csv
import importlib
import json
import math
import os
import platform
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from runs import RUNS, Call, Command, Tamper, Text, Toml

# A step of the record that takes longer than this hangs.
LONGEST_STEP_S = 900


class Found:
    """Quantities and status words of a run, under neutral names."""

    def __init__(self, adapter):
        self.adapter = adapter
        self.arrays = {}
        self.words = {}
        self.exits = {}

    def number(self, path, values):
        name = self.adapter.quantity(path)
        if name is not None:
            if name in self.arrays:
                raise ValueError(f"two quantities are called {name}")
            self.arrays[name] = np.asarray(values, dtype=np.float64)

    def word(self, path, values):
        name = self.adapter.quantity(path)
        cells = values if isinstance(values, list) else [values]
        if name is not None and not any(" " in cell for cell in cells):  # a sentence is no word
            self.words[name] = (
                [self.adapter.word(v) for v in values]
                if isinstance(values, list)
                else self.adapter.word(values)
            )


# --- JSON --------------------------------------------------------------------------------------


def _is_number(value):
    return value is None or isinstance(value, bool | int | float)


def _float(value):
    return math.nan if value is None else float(value)


def walk_json(found, path, value, status_keys):
    """Take every number of a document by its key path, and the strings under status keys."""
    key = path.rsplit("/", 1)[-1]
    if _is_number(value):
        found.number(path, _float(value))
    elif isinstance(value, str):
        if key in status_keys:
            found.word(path, value)
    elif isinstance(value, dict):
        for name, part in value.items():
            walk_json(found, f"{path}/{name}", part, status_keys)
    elif value and all(isinstance(row, dict) for row in value):
        _walk_rows(found, path, value, status_keys)
    elif value and all(_is_number(part) for part in value):
        found.number(path, [_float(part) for part in value])
    elif value and all(isinstance(part, str) for part in value):
        if key in status_keys:
            found.word(path, value)
    elif _rectangular(value):
        found.number(path, value)
    else:
        for index, part in enumerate(value):
            walk_json(found, f"{path}/{index}", part, status_keys)


def _rectangular(value):
    """Whether nested lists are an array of numbers."""
    try:
        return np.array(value).dtype.kind in "fi"
    except ValueError:
        return False


def _walk_rows(found, path, rows, status_keys):
    """A list of objects is a table: a column for each key, as far as its cells are scalars."""
    for name in dict.fromkeys(name for row in rows for name in row):
        cells = [row.get(name) for row in rows]
        if all(_is_number(cell) for cell in cells):
            found.number(f"{path}/{name}", [_float(cell) for cell in cells])
        elif all(cell is None or isinstance(cell, str) for cell in cells):
            if name in status_keys:
                found.word(f"{path}/{name}", ["" if cell is None else cell for cell in cells])
        else:
            for index, cell in enumerate(cells):
                walk_json(found, f"{path}/{index}/{name}", cell, status_keys)


# --- files ---------------------------------------------------------------------------------------


def read_csv(found, path, file):
    with file.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.reader(line for line in lines if not line.startswith("#") and line.strip()))
    if not rows:
        return
    head, body = rows[0], rows[1:]
    for index, name in enumerate(head):
        cells = [row[index] if index < len(row) else "" for row in body]
        try:
            found.number(f"{path}/{name}", [float(c) if c.strip() else math.nan for c in cells])
        except ValueError:
            if name in found.adapter.STATUS_KEYS:
                found.word(f"{path}/{name}", cells)


def read_archive(found, path, file):
    with np.load(file, allow_pickle=False) as archive:
        for name in archive.files:
            if archive[name].dtype.kind in "fiub":
                found.number(f"{path}/{name}", archive[name])


def read_hdf5(found, path, file):
    import h5py

    def visit(name, item):
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu":
            found.number(f"{path}/{name}", item[()])

    with h5py.File(file) as tree:
        tree.visititems(visit)


def read_matlab(found, path, file):
    import h5py
    from scipy.io import loadmat

    if h5py.is_hdf5(file):  # version 7.3
        read_hdf5(found, path, file)
        return
    for name, values in loadmat(file).items():
        if getattr(values, "dtype", np.dtype(object)).kind in "fiu":
            found.number(f"{path}/{name}", values)


def read_parquet(found, path, file):
    import pandas as pd

    table = pd.read_parquet(file).reset_index()
    for name in table.columns:
        if table[name].dtype.kind in "fiu":
            found.number(f"{path}/{name}", table[name].to_numpy())


def read_numbers(found, path, file):
    """A text file of numbers: its lines that hold nothing else."""
    values = []
    for line in file.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            values += [float(part) for part in line.replace(",", " ").split()]
        except ValueError:
            continue
    found.number(f"{path}/numbers", values)


def read_kml(found, path, file):
    text = " ".join(re.findall(r"<coordinates>(.*?)</coordinates>", file.read_text("utf-8"), re.S))
    found.number(f"{path}/numbers", [float(v) for v in text.replace(",", " ").split()])


def read_json(found, path, file):
    walk_json(found, path, json.loads(file.read_text("utf-8")), found.adapter.STATUS_KEYS)


READERS = {
    ".csv": read_csv,
    ".npz": read_archive,
    ".h5": read_hdf5,
    ".mat": read_matlab,
    ".parquet": read_parquet,
    ".tum": read_numbers,
    ".nav": read_numbers,
    ".kml": read_kml,
    ".json": read_json,
    ".geojson": read_json,
}


def read_folder(found, label, folder):
    """Take every file of a result that holds numbers; copies of inputs are left out."""
    for file in sorted(folder.rglob("*")):
        name = file.relative_to(folder).as_posix()
        if not file.is_file() or name.startswith("inputs/"):
            continue
        path = f"{label}/{name}"
        if re.fullmatch(r"\.\d{3}", file.suffix):  # a channel of ISO MME
            read_numbers(found, path, file)
        elif file.suffix in READERS and found.adapter.quantity(path) is not None:
            READERS[file.suffix](found, path, file)


# --- steps ---------------------------------------------------------------------------------------


def environment():
    """What the commands run in: no compiled kernels of another source, and no colors.

    The package names its own folder of compiled kernels after the digest of their sources. A
    NUMBA_CACHE_DIR in its place could return kernels from before a change.
    """
    kept = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    return {**kept, "NO_COLOR": "1", "COLUMNS": "100", "PYTHONUTF8": "1"}


def run_command(found, step, number, folder, data):
    adapter = found.adapter
    words = [str(word).replace("{data}", data) for word in adapter.arguments(step)]
    if step.out is not None:
        words += [adapter.option("out"), step.out]
    done = subprocess.run(
        [sys.executable, "-m", "strapdown", *words],
        cwd=folder,
        env=environment(),
        input=adapter.lines(step.stdin) if step.stdin is not None else None,
        stdin=subprocess.DEVNULL if step.stdin is None else None,
        capture_output=True,
        encoding="utf-8",
        timeout=LONGEST_STEP_S,
    )
    label = step.label or step.out or f"{number:02d}"
    found.exits[f"{number:02d} {step.command}"] = done.returncode
    if done.returncode != step.exit:
        sys.stderr.write(
            f"step {number}: {' '.join(words)}\n  exit code {done.returncode} where the list of "
            f"runs has {step.exit}\n{done.stdout[-2000:]}{done.stderr[-2000:]}\n"
        )
    keys = {*adapter.STATUS_KEYS, *step.words}
    if step.stdout == "json" and done.stdout.strip():
        walk_json(found, f"{label}/stdout", json.loads(done.stdout), keys)
    elif step.stdout == "lines":
        rows = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
        walk_json(found, f"{label}/stdout", rows, keys)
    if step.out is not None and (folder / step.out).is_dir() and step.keep:
        read_folder(found, label, folder / step.out)


def tamper(step, folder, adapter):
    """Change the last digit of a table of a result."""
    file = folder / step.folder / adapter.file(step.file)
    content = bytearray(file.read_bytes())
    for at in range(len(content) - 1, 0, -1):
        if content[at : at + 1].isdigit():
            content[at] = ord("1") if content[at] != ord("1") else ord("2")
            break
    file.write_bytes(bytes(content))


def write_inputs(run, folder, adapter):
    for name, content in run.files.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, Toml):
            text = toml_text(adapter.document(content.kind, content.document))
            file.write_text(text, encoding="utf-8")
        elif isinstance(content, Text):
            file.write_text(content.text, encoding="utf-8")
        else:
            file.write_bytes(content)


def toml_text(document):
    """Write a document as TOML: scalars and lists inline, tables by their headers."""
    lines = []

    def value(item):
        if isinstance(item, dict):
            return "{ " + ", ".join(f"{k} = {value(v)}" for k, v in item.items()) + " }"
        if isinstance(item, list | tuple):
            return "[" + ", ".join(value(v) for v in item) + "]"
        return json.dumps(item)

    def table(name, content):
        if name:
            lines.append(f"[{name}]")
        for key, item in content.items():
            if not isinstance(item, dict):
                lines.append(f"{key} = {value(item)}")
        for key, item in content.items():
            if isinstance(item, dict):
                table(f"{name}.{key}" if name else key, item)

    table("", document)
    return "\n".join(lines) + "\n"


def record(run, adapter, out, data):
    found = Found(adapter)
    with tempfile.TemporaryDirectory(prefix="record-") as name:
        folder = Path(name)
        write_inputs(run, folder, adapter)
        for number, step in enumerate(run.steps):
            if isinstance(step, Command):
                run_command(found, step, number, folder, data)
            elif isinstance(step, Tamper):
                tamper(step, folder, adapter)
            elif isinstance(step, Call):
                arguments = [str(a).replace("{data}", data) for a in step.arguments]
                os.chdir(folder)
                results = adapter.CALLS[step.function](*arguments)
                for quantity, values in results.items():
                    path = f"{step.label or step.function}/{quantity}"
                    if isinstance(values, str):
                        found.word(path, values)
                    else:
                        found.number(path, values)
        os.chdir(out)
    np.savez(out / f"{run.name}.npz", **dict(sorted(found.arrays.items())))
    document = {"exit": found.exits, "status": dict(sorted(found.words.items()))}
    (out / f"{run.name}.json").write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")


def about():
    """The package, and the versions on which a last bit depends."""
    import importlib.metadata as metadata

    import strapdown

    names = ("numpy", "scipy", "numba", "llvmlite", "pandas", "pyarrow", "h5py")
    return {
        "version": strapdown.__version__,
        "file": str(Path(strapdown.__file__).resolve()),
        "libraries": {
            "python": platform.python_version(),
            **{name: metadata.version(name) for name in names},
        },
    }


def main(words):
    os.environ.pop("NUMBA_CACHE_DIR", None)
    if words[1:] == ["--about"]:
        print(json.dumps(about()))
        return
    name, run, out, data = words
    record(RUNS[run], importlib.import_module(name).ADAPTER, Path(out).resolve(), data)


if __name__ == "__main__":
    main(sys.argv[1:])
