"""How a launch is told to stop: by Ctrl-C, SIGTERM or SIGHUP, on Windows by Ctrl-Break
in place of the last. All have the same effect, and none stops it immediately.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType

SIGNALS = [
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    if hasattr(signal, name)
]
"""The signals that ask a launch to stop, as far as the system has them."""


@contextmanager
def deaf() -> Iterator[bool]:
    """Inside, this thread hears none of SIGNALS, nor do processes that it starts, from
    their first instruction on.

    Says whether that is so: Windows cannot hold signals back.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield False
        return
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        yield True
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


class HeldInterrupt:
    """Remembers a first Ctrl-C in `asked` instead of raising it; a second one is
    raised.

    The same holds for each of SIGNALS that is handled like Ctrl-C. Does nothing outside
    the main thread, or where they are ignored or handled by someone else.
    """

    def __init__(self) -> None:
        self.asked = False
        self.held: list[int] = []

    def __enter__(self) -> "HeldInterrupt":
        if threading.current_thread() is threading.main_thread():
            self.held = [
                number
                for number in SIGNALS
                if signal.getsignal(number) is signal.default_int_handler
            ]
            for number in self.held:
                signal.signal(number, self._hold)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if threading.current_thread() is threading.main_thread():
            for number in self.held:
                signal.signal(number, signal.default_int_handler)

    def _hold(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            signal.default_int_handler(number, frame)
        self.asked = True


@contextmanager
def ended_by_ctrl_c() -> Iterator[None]:
    """Inside, Ctrl-C ends the process at once instead of raising KeyboardInterrupt.

    Python sees a signal only between two kernel calls, and a single call may take for
    ever.
    """
    in_main_thread = threading.current_thread() is threading.main_thread()
    changes = (
        in_main_thread and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )
    if changes:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        if changes:
            signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def ended_like_ctrl_c() -> Iterator[None]:
    """Inside, SIGTERM and SIGHUP raise KeyboardInterrupt; without this they would end
    the process silently.

    If they are ignored, as under nohup, or handled by someone else, this does not
    change.
    """
    in_main_thread = threading.current_thread() is threading.main_thread()
    changed = [
        number
        for number in SIGNALS
        if in_main_thread and signal.getsignal(number) is signal.SIG_DFL
    ]
    for number in changed:
        signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number in changed:
            signal.signal(number, signal.SIG_DFL)
