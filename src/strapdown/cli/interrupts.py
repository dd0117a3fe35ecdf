"""Deliver interrupts that Python drops."""

from __future__ import annotations

import _thread
import signal
import sys
import threading
from typing import Any

__all__ = ["keep_interrupts"]

_SOON = 0.005  # s


def keep_interrupts() -> None:
    """Deliver an interrupt again where Python drops it.

    Notes
    -----
    A signal handler runs between any two steps of the program, and so at times within a callback
    of a weak reference or a finalizer, whose exceptions Python reports and ignores: the program
    would continue to its end. It is sent again until it is raised elsewhere.
    """
    before = sys.unraisablehook

    def hook(lost: Any) -> None:
        number = _signal_of(lost)
        if number is None:
            before(lost)
            return
        # From another thread and later: within the callback it would be dropped once more.
        again = threading.Timer(_SOON, _thread.interrupt_main, (number,))
        again.daemon = True
        again.start()

    sys.unraisablehook = hook


def _signal_of(lost: Any) -> int | None:
    """Signal of a dropped exception; None for another error."""
    if issubclass(lost.exc_type, KeyboardInterrupt):
        return int(signal.SIGINT)
    if issubclass(lost.exc_type, SystemExit):
        code = getattr(lost.exc_value, "code", None)
        if isinstance(code, int) and code > 128:
            return code - 128
    return None
