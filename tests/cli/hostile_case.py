"""A crash case in which every text attacks: of its file, of its records, and their names."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

__all__ = ["EVIL", "WORSE", "write_hostile_case"]

#: What a case's names may hold.
EVIL = (
    "<script>alert(1)</script>\"><img src=x onerror=alert(1)></script>'--><svg/onload=alert(1)>"
    '#eval("1")$x$\\{{7*7}}{%raw%}'
)
#: What texts of several lines, and records, may hold besides.
WORSE = f"{EVIL}\x07\u202e\u2028\ufeff=cmd()|'<b><a href=javascript:alert(1)>@here"
NAMES = {
    "imu1_low_g.csv": "-o 'low' \"g\" <b>é 🚗.csv",
    "imu1_high_g.csv": "$(touch x) `y` ; & high #1.csv",
    "imu1_gyro.csv": "--help {{7*7}} <script>alert(1)<%2Fscript>.csv",
    "cameras.csv": '"><img src=x onerror=alert(1)>.csv',
}


def quoted(text: str) -> str:
    # Strings of JSON are strings of TOML where no pair of surrogates stands in them.
    return json.dumps(text, ensure_ascii=False)


def write_hostile_case(csv: Path, mme: Path, folder: Path) -> Path:
    """The first recorder of one case and the second of another, with texts that attack."""
    folder.mkdir()
    (folder / "records").mkdir()
    for own, name in NAMES.items():
        text = (csv / own).read_text(encoding="utf-8")
        head, rest = text.split("\n", 1)
        if own != "cameras.csv":
            head = ",".join(f'"{evil_column(c)}"' for c in head.split(","))
        (folder / "records" / name).write_text(f"{head}\n{rest}", encoding="utf-8")
    shutil.copytree(mme / "imu2", folder / "records" / EVIL_FOLDER)
    for path in (folder / "records" / EVIL_FOLDER).rglob("*"):
        if path.is_file():
            lines = path.read_text(encoding="utf-8").split("\n")
            text = "\n".join(evil_line(line) for line in lines)
            path.write_text(text, encoding="utf-8", newline="")
    case = folder / "<img src=x onerror=alert(1)>.toml"
    case.write_text(case_text(csv, mme), encoding="utf-8")
    return case


CAMERAS = NAMES["cameras.csv"]
EVIL_FOLDER = "imu2 <script>alert(1)"


def evil_column(name: str) -> str:
    own, unit = name.split(" [")
    return f"{own} <script>alert(1)</script><img src=x onerror=alert(1)> [{unit}"


def evil_line(line: str) -> str:
    head, colon, _ = line.partition(":")
    texts = ("Laboratory", "Customer", "Title", "Type of", "Name of test", "Location", "Transducer")
    if colon and head.startswith(texts) and "channel code" not in head:
        return f"{head}:{WORSE.replace(chr(10), ' ')}"
    return line


def case_text(csv: Path, mme: Path) -> str:
    import tomllib

    one = tomllib.loads((csv / "case.toml").read_text(encoding="utf-8"))
    two = tomllib.loads((mme / "case.toml").read_text(encoding="utf-8"))
    one["units"] = [one["units"][0], two["units"][1]]
    one |= {
        "title": EVIL,
        "number": EVIL,
        "author": EVIL,
        "description": WORSE + "\n\n" + WORSE * 40,
    }
    one["vehicle"]["name"] = one["point"]["name"] = EVIL
    one["entry"]["source"] = EVIL
    for number, unit in enumerate(one["units"], start=1):
        unit["name"] = f"{EVIL}{number}"
        for kind in (*unit["accelerometers"], unit["gyro"]):
            kind["name"] = f"{kind['name']} {EVIL}"
            if number == 1:
                kind["channels"] = {a: evil_column(c) for a, c in kind["channels"].items()}
                kind["time"] = evil_column(kind["time"])
                kind["path"] = f"records/{NAMES[kind['path']]}"
            else:
                kind["path"] = f"records/{EVIL_FOLDER}/imu2.mme"
    # One that has no gyro of its own has texts that others do not have.
    one["units"][1].pop("gyro")
    one["units"][1]["gyro_from"] = one["units"][0]["name"]
    (reference,) = one["references"]
    reference |= {"name": EVIL, "source": EVIL, "path": f"records/{CAMERAS}"}
    stated = {"kind": "delta_v", "name": EVIL + "2", "source": EVIL, "axis": "forward"}
    stated |= {"delta_v_m_per_s": -30.0, "delta_v_sd_m_per_s": 0.1, "over_s": [0.0, 0.1]}
    one["references"].append(stated)
    one["options"]["severity_inputs"] = {"age": 40.0, "gender": EVIL}
    one["options"]["monte_carlo_runs"] = 50
    return "\n".join(toml(one, ""))


def toml(table: dict, place: str) -> list[str]:
    """A table as TOML: its values first."""
    lines, tables = [], []
    for key, value in table.items():
        inner = f"{place}.{key}" if place else key
        if isinstance(value, dict) and key not in ("channels", "uncertainty", "severity_inputs"):
            tables += [f"[{inner}]", *toml(value, inner)]
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            for item in value:
                tables += [f"[[{inner}]]", *toml(item, inner)]
        else:
            lines.append(f"{key} = {plain(value)}")
    return lines + tables


def plain(value: object) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {plain(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(plain, value)) + "]"
    return quoted(value) if isinstance(value, str) else str(value)
