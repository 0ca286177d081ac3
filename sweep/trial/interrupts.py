"""Signals that ask a run to stop: Ctrl-C, SIGTERM and SIGHUP.

Windows has Ctrl-Break instead of SIGHUP. All signals have an equal effect, and no
signal stops a run immediately.
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
"""Signals that ask a run to stop, as far as the system supports these signals."""


@contextmanager
def deaf() -> Iterator[bool]:
    """Block SIGNALS in this thread, and in processes that the thread starts.

    In a new process the signals are blocked from the first instruction. Yields whether
    the signals are blocked: Windows cannot block signals.
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
    """Block in which a first Ctrl-C only sets `asked`; a second Ctrl-C is raised.

    This also applies to each of SIGNALS that is handled like Ctrl-C. There is no effect
    outside the main thread, or for signals that are ignored or have another handler.
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
    """Let Ctrl-C end the process at once instead of raising KeyboardInterrupt.

    Python handles a signal only between two kernel calls, and a single call may never
    end.
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
    """Let SIGTERM and SIGHUP raise KeyboardInterrupt instead of ending the process.

    Signals that are ignored, such as under nohup, or that have another handler, do not
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
