"""JSON as bundles hold it."""

from __future__ import annotations

import json
from typing import Any

__all__ = ["to_json"]


def to_json(content: Any) -> str:
    """JSON as bundles hold it: readable, in the order given, the same bytes every time."""
    text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    # Names of files need not be text; what is not is shown as a question mark.
    return text.encode("utf-8", "replace").decode("utf-8")
