"""Random documents in TOML, each of whose values is on one line alone and cannot be mistaken."""

from __future__ import annotations

import json
from random import Random

BARE = ["a", "b", "unit", "speed_m_per_s", "x-1", "7", "true", "1979-05-27"]
QUOTED = ["", "a.b", "with space", "#no", '"', "'", "é", "[a]", "=", "a\tb", "\\", "unit "]
# What a scanner may trip over where it does not know that it is in a comment or a string.
TRICKS = ["# [a]", 'x = """', "'''", "[[b]]", "a = 1", "}", "]", ",", '"', "\\", "{", ""]


class Document:
    """Text, and the marker of every value by its path."""

    def __init__(self, random: Random) -> None:
        self.random = random
        self.count = 0
        self.text = ""
        self._table(3, (), header=True)

    def _table(self, depth: int, path: tuple[str, ...], *, header: bool) -> None:
        random, later, used = self.random, [], set()
        for _ in range(random.randint(0, 4)):
            key = self._new_key(used)
            kind = random.choice(["pair", "pair", "dotted", "table", "tables"])
            if kind == "dotted":
                inner = random.choice(BARE)
                self._line(f"{self._key(key)}{random.choice(['.', ' . '])}{self._key(inner)}", 2)
            elif kind == "pair" or depth == 0 or not header:
                self._line(self._key(key), 2)
            else:
                later.append((kind, key))
        for kind, key in later:
            inner = (*path, key)
            name = random.choice([".", " . "]).join(self._key(part) for part in inner)
            for _ in range(random.randint(1, 3) if kind == "tables" else 1):
                marks = ("[[", "]]") if kind == "tables" else ("[", "]")
                self.text += f"{self._indent()}{marks[0]} {name} {marks[1]}{self._end()}"
                self._table(depth - 1, inner, header=True)

    def _new_key(self, used: set[str]) -> str:
        key = self.random.choice([k for k in BARE + QUOTED if k not in used])
        used.add(key)
        return key

    def _key(self, key: str) -> str:
        styles = [json.dumps(key, ensure_ascii=False)]
        if key in BARE:
            styles += [key, key]
        if "'" not in key and "\t" not in key:
            styles.append(f"'{key}'")
        return self.random.choice(styles)

    def _line(self, key: str, depth: int) -> None:
        equals = self.random.choice(["=", " = ", "\t=  "])
        self.text += f"{self._indent()}{key}{equals}{self._value(depth)}{self._end()}"

    def _value(self, depth: int) -> str:
        random = self.random
        kind = random.choice(["scalar"] * 4 + ["array", "inline"] * (depth > 0))
        if kind == "array":
            return self._array(depth)
        if kind == "inline":
            used: set[str] = set()
            pairs = [
                f"{self._key(self._new_key(used))} = {self._value(depth - 1)}"
                for _ in range(random.randint(0, 3))
            ]
            return "{ " + ", ".join(pairs) + " }"
        return self._scalar()

    def _array(self, depth: int) -> str:
        random, text = self.random, "["
        for k in range(random.randint(0, 3)):
            text += ("," if k else "") + random.choice(["", " ", "\n  ", self._end()])
            text += self._value(depth - 1)
        if text != "[":
            text += random.choice(["", ",", ", # last ]\n", "\n"])
        return text + "]"

    def _scalar(self) -> str:
        self.count += 1
        mark, trick = f"9{self.count:04d}7", self.random.choice(TRICKS)
        plain = trick.replace("\\", "").replace('"', "").replace("'", "")
        return self.random.choice(
            [
                mark,
                f"-{mark}",
                f"{mark}.25",
                f"1979-05-27 07:32:00.{mark}",
                json.dumps(mark + trick),
                f"'{mark}{plain}'",
                f'"""{mark}\n{plain}"" \\" \\\\\n  [a]\n b = 1"""',
                f"'''{mark}\n{plain}''\n[[b]]\n'''",
                f'"""{mark}"""""',
                f"'''{mark}'''''",
            ]
        )

    def _indent(self) -> str:
        return self.random.choice(["", "", "  ", "\t"])

    def _end(self) -> str:
        comment = f" # {self.random.choice(TRICKS)}" if self.random.random() < 0.3 else ""
        return comment + self.random.choice(
            ["\n", "\n", "\n\n", f"\n# {self.random.choice(TRICKS)}\n"]
        )
