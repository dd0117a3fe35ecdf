"""Interrupts that Python drops, and how they end the program all the same."""

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
    A handler of a signal runs between any two steps of the program, and so at times within a
    callback of a weak reference or a finalizer, whose exceptions Python reports and forgets: the
    program would go on to its end as if nobody had asked it to stop. While matplotlib draws, one
    interrupt of twelve falls there. It is sent again until it falls elsewhere.
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
    """Which signal raised what was dropped; None where it was another error."""
    if issubclass(lost.exc_type, KeyboardInterrupt):
        return int(signal.SIGINT)
    if issubclass(lost.exc_type, SystemExit):
        code = getattr(lost.exc_value, "code", None)
        if isinstance(code, int) and code > 128:
            return code - 128
    return None
