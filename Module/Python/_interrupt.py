# SPDX-FileCopyrightText: Teravox contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Ctrl-C during long calls into C++.

Python sets KeyboardInterrupt when the next byte code runs: in a VTK call that may be an observer,
where VTK ends the whole program. So the interrupt is only noted, and raised when the call is over.
"""
import contextlib
import signal
import threading


class Interrupt:
    """Whether Ctrl-C was pressed."""

    def __init__(self):
        self.pressed = False


@contextlib.contextmanager
def noted():
    """Notes Ctrl-C in the block and raises KeyboardInterrupt at its end. Yields an Interrupt.

    Only in the main thread, and only where nobody else handles SIGINT: else nothing changes.
    """
    interrupt = Interrupt()
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield interrupt
        return

    def note(_, __):
        interrupt.pressed = True

    signal.signal(signal.SIGINT, note)
    try:
        yield interrupt
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if interrupt.pressed:
            raise KeyboardInterrupt
