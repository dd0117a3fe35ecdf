"""What a test expects of a refusal: the code and the location of its finding, not its words."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from strapdown.errors import StrapdownError


def coded(code: str, **values: Any) -> Callable[[StrapdownError], bool]:
    """Check for `pytest.raises`: code, file (by name), row, quantity and data of the finding."""

    def check(error: StrapdownError) -> bool:
        finding = error.finding
        assert finding.code == code, str(finding)
        for name, expected in values.items():
            found = finding.data[name] if name in finding.data else getattr(finding, name)
            assert (Path(found).name if name == "file" else found) == expected, str(finding)
        return True

    return check
