"""Whether a KeyboardInterrupt comes from Ctrl-C, or was raised by the code that it came out of.

Python answers a signal by raising it wherever the program stands, so the exception says nothing of its
origin; only whether a signal arrived does.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["signals_noted"]

STOPPING = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def signals_noted() -> Iterator[Callable[[], bool]]:
    """Gives a function: may a KeyboardInterrupt of the block come from outside?

    No, where no signal arrived that Python answers by it; yes also where a handler of somebody else is set,
    whose doing is not known.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False  # Python answers signals in the main thread alone
        return
    arrived = False

    def noted(number: int, frame: FrameType | None) -> None:
        nonlocal arrived
        arrived = True
        signal.default_int_handler(number, frame)

    before = {number: signal.getsignal(number) for number in STOPPING}
    ours = [number for number, handler in before.items() if handler is signal.default_int_handler]
    quiet = (signal.default_int_handler, signal.SIG_DFL, signal.SIG_IGN)
    is_unknown = any(handler not in quiet for handler in before.values())
    try:
        for number in ours:
            signal.signal(number, noted)
        yield lambda: arrived or is_unknown
    finally:
        for number in ours:
            if signal.getsignal(number) is noted:  # else the block has set another
                signal.signal(number, signal.default_int_handler)
