"""Names of today: what differs from version 0.1, and nothing else.

A commit that renames a command, an option, a key, a column or a status word says so here, as in
`COMMANDS = {**adapter_0_1.Names.COMMANDS, "outage": "outage"}`. A commit that changes a number
says so in `changes.toml`.
"""

from __future__ import annotations

import re
from typing import ClassVar

import adapter_0_1

UNITS = {
    "m": ("north", "east", "up"),
    "m_s": ("VN", "VE", "VD", "forward", "lateral", "vertical", "right"),
    "rad_s": ("x", "y", "z"),
    "rad": ("heading",),
}
# Names of today and of version 0.1, within the paths that match.
RENAMED = [
    (r"/outage\.json/", "outage.json", "coast.json"),
    (r"/heading_integrity\.csv/", "confirmed_99_deg", "borne_out_99_deg"),
    (r"/heading_integrity\.csv/", "check", "witness"),
    (r"/heading_integrity\.csv/", "check_difference_deg", "witness_difference_deg"),
    (r"/heading_integrity\.csv/", "check_sd_deg", "witness_sd_deg"),
    (r"/heading_integrity\.csv/", "check_since_s", "witness_since_s"),
    (r"/verdict\.json/", "position", "place"),
    (r"/verdict\.json/", "confirmed", "borne_out"),
    (r"/verdict\.json/", "confirmed_by", "borne_out_by"),
    (r"/verdict\.json/", "trusted_below_deg", "green_below_deg"),
    (r"/verdict\.json/", "rejected_beyond_deg", "red_beyond_deg"),
    (r"/verdict\.json/", "position_difference", "place_apart"),
    (r"/verdict\.json/", "heading_difference", "heading_apart"),
    (r"/(verdict\.json|navigation\.json|stdout)/", "measurement", "aid"),
    (r"/(navigation\.json|stdout)/", "gnss_outage_tests", "withheld"),
    (r"/(navigation\.json|stdout)/", "path_length_m", "way_m"),
    (r"/(coast\.json|stdout)/", "measurements", "aids"),
    (r"/(coast\.json|stdout)/", "predicted_95_m", "foretold_95_m"),
    (r"/budget\.csv/", "measurements_m2", "aids_m2"),
    (r"/(align\.json|stdout)/", "after_a_turn", "what_a_turn_would_tell"),
    (r"/(align\.json|stdout)/", "stationary", "standing"),
    (r"/(attitude\.json|stdout)/", "positions", "places"),
]
UNIT_OF = {label: unit for unit, labels in UNITS.items() for label in labels}


class Names(adapter_0_1.Names):
    """Neutral terms in the words of today, and today's results in neutral terms."""

    COMMANDS: ClassVar[dict[str, str]] = {**adapter_0_1.Names.COMMANDS, "outage": "outage"}
    OPTIONS: ClassVar[dict[str, str]] = {**adapter_0_1.Names.OPTIONS, "export": "--export"}

    # The status of a heading is written in neutral words.
    WORDS: ClassVar[dict[str, str]] = {
        neutral: theirs
        for neutral, theirs in adapter_0_1.Names.WORDS.items()
        if theirs not in ("green", "amber", "red")
    }
    QUANTITIES: ClassVar[list[tuple[str, str]]] = [
        (r"(/heading_integrity\.csv/|/verdict\.json/.*)status$", r"\1heading_status"),
        (r"/heading_integrity\.csv/", "/heading_integrity/"),
        *adapter_0_1.Names.QUANTITIES,
    ]
    STATUS_KEYS = adapter_0_1.Names.STATUS_KEYS | {"check", "measurement"}

    def quantity(self, path):
        """As before; version 0.1 gave variances and weights of innovations the component's unit."""
        if found := re.search(r"/innovations/([^/]*)/(s|weight)_([a-zA-Z]+)[^/]*$", path):
            table, part, label = found.groups()
            down = "m" if "position" in table else "m_s"
            path = f"{path[: found.start(2)]}{part}_{label}_{UNIT_OF.get(label, down)}"
        for where, today, before in RENAMED:
            if re.search(where, f"{path}/"):
                path = "/".join(before if part == today else part for part in path.split("/"))
        return super().quantity(path)


ADAPTER = Names()
