"""Names of today: what differs from version 0.1, and nothing else.

A commit that renames a command, an option, a key, a column or a status word says so here, as in
`COMMANDS = {**adapter_0_1.Names.COMMANDS, "outage": "outage"}`. A commit that changes a number
says so in `changes.toml`.
"""

from __future__ import annotations

import re

import adapter_0_1

UNITS = {
    "m": ("north", "east", "up"),
    "m_s": ("VN", "VE", "VD", "forward", "lateral", "vertical", "right"),
    "rad_s": ("x", "y", "z"),
    "rad": ("heading",),
}
UNIT_OF = {label: unit for unit, labels in UNITS.items() for label in labels}


class Names(adapter_0_1.Names):
    """Neutral terms in the words of today, and today's results in neutral terms."""

    def quantity(self, path):
        """As before; version 0.1 gave variances and weights of innovations the component's unit."""
        if found := re.search(r"/innovations/([^/]*)/(s|weight)_([a-zA-Z]+)[^/]*$", path):
            table, part, label = found.groups()
            down = "m" if "position" in table else "m_s"
            path = f"{path[: found.start(2)]}{part}_{label}_{UNIT_OF.get(label, down)}"
        return super().quantity(path)


ADAPTER = Names()
