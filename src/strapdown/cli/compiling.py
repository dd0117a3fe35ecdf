"""Report the compilation of kernels, which happens once on a machine and takes time."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

__all__ = ["Compilations"]

_EVENT = "numba:compile"


class Compilations:
    """Report begin and end of compilations, once numba is loaded.

    Parameters
    ----------
    tell : callable
        Called with True at the begin of the first of nested compilations, with False at its end.
    """

    def __init__(self, tell: Callable[[bool], None]) -> None:
        self._tell = tell
        self._listener: Any = None

    def listen(self) -> None:
        """Start to listen if numba is loaded; this does not load it."""
        if self._listener is not None or "numba.core.event" not in sys.modules:
            return
        from numba.core import event

        tell = self._tell

        class Listener(event.Listener):
            depth = 0

            def on_start(self, _: Any) -> None:
                self.depth += 1
                if self.depth == 1:
                    tell(True)

            def on_end(self, _: Any) -> None:
                self.depth -= 1
                if not self.depth:
                    tell(False)

        self._listener = Listener()
        self._events().register(_EVENT, self._listener)

    def stop(self) -> None:
        """Stop listening."""
        if self._listener is not None:
            self._events().unregister(_EVENT, self._listener)
            self._listener = None

    def _events(self) -> Any:
        from numba.core import event

        return event
