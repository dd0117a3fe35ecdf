"""Says when inner loops are being compiled, which happens once on a machine and takes its time."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

__all__ = ["Compilations"]

_EVENT = "numba:compile"


class Compilations:
    """Tells when compiling begins and ends, from when numba is there.

    Parameters
    ----------
    tell : callable
        Called with True when the first of nested compilations begins, with False when it ends.
    """

    def __init__(self, tell: Callable[[bool], None]) -> None:
        self._tell = tell
        self._listener: Any = None

    def listen(self) -> None:
        """Begin to listen, if numba is loaded; it is not loaded for this."""
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
        """Listen no more."""
        if self._listener is not None:
            self._events().unregister(_EVENT, self._listener)
            self._listener = None

    def _events(self) -> Any:
        from numba.core import event

        return event
