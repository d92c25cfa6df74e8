# SPDX-License-Identifier: MIT
"""Signals while the library runs. Python runs their handlers where a function begins, also where the library calls one: what they
raise there, such as Ctrl-C's KeyboardInterrupt, would be dropped by ctypes, and the call with it."""
import functools
import signal
from _signal import getsignal  # that of `signal` makes an enum for each, which takes longer than a small call of the library
from threading import get_ident

_SIGNALS = [int(number) for number in signal.valid_signals()]


def counted(function):
    """`function`, whose calls cache_info().misses counts: in C code, before an exception can strike where the function begins, which
    ctypes would drop with the call."""
    return functools.lru_cache(maxsize=0)(function)


class HeldSignals:
    """Those of one call of the library: their handlers run after it. What Python does not handle stays as it is."""

    def __init__(self):
        self._handlers, self._arrived = {}, {}
        self._thread, self._hold = get_ident(), True

    def call(self, function, *arguments):
        """`function` of the library, then the handlers of what has arrived meanwhile."""
        try:
            self._begin()
            return function(*arguments)
        finally:
            self._end()

    def host(self, function, *arguments):
        """The host's own function, called by the library: handlers run at once, and what they raise comes out of it."""
        if get_ident() != self._thread:
            return function(*arguments)
        try:
            self._hold = False
            return function(*arguments)
        finally:
            self._hold = True

    def _begin(self):
        for number in _SIGNALS:
            handler = getsignal(number)
            if callable(handler):
                try:
                    self._handlers[number] = handler
                    signal.signal(number, self._take)
                except ValueError:  # not the main thread, which alone runs handlers
                    return

    def _take(self, number, frame):
        if self._hold:
            self._arrived[number] = frame
        else:
            self._handlers[number](number, frame)

    def _end(self):
        try:
            for number, handler in self._handlers.items():
                if getsignal(number) == self._take:  # else the host has set another one meanwhile
                    signal.signal(number, handler)
        finally:
            self._hold = False  # from now on what still calls _take, such as the host's new one, gets through
            self._deliver()

    def _deliver(self):
        if self._arrived:
            number, frame = self._arrived.popitem()
            try:
                self._handlers[number](number, frame)
            finally:
                self._deliver()
