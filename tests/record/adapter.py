"""Names of today: what differs from version 0.1, and nothing else.

A commit that renames a command, an option, a key, a column or a status word says so here, as in
`COMMANDS = {**adapter_0_1.Names.COMMANDS, "outage": "outage"}`. A commit that changes a number
says so in `changes.toml`.
"""

from __future__ import annotations

import adapter_0_1


class Names(adapter_0_1.Names):
    """Neutral terms in the words of today, and today's results in neutral terms."""


ADAPTER = Names()
