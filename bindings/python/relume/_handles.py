# SPDX-License-Identifier: MIT
"""What the library makes and destroys."""
import contextlib
from ctypes import byref, c_void_p, sizeof
from typing import Any, TypeVar

from ._arrays import whole
from ._library import API_VERSION, ContextDesc, ParallelFor, RelumeError, runtime
from ._signals import HeldSignals
from ._threads import Threads

Self = TypeVar('Self', bound='Handle')


class Handle:
    """Something of the library that is destroyed once: by close(), at the end of a `with`, or with the object."""
    _destroy: Any = None  # functions of the library: this one,
    _error: Any = None    # and the text of what failed last
    _handle: Any = None
    _context: Any = None

    def __new__(cls, *_, **__):
        self = super().__new__(cls)
        self._calls = set()  # that run; what is added and taken away in one step, no signal or thread miscounts
        return self

    def close(self) -> None:
        """RuntimeError: a call of it runs, such as a frame whose `visibility` this is called in; it stays open."""
        if not self._calls:
            handle, self._handle = self._handle, None
            if not self._calls:  # none has begun meanwhile
                if handle:
                    self._destroy(handle)
                self._context = None  # its threads end with the last that has it
                return
            self._handle = handle
        raise RuntimeError(f'this {type(self).__name__} cannot be closed while a call of it runs, such as a frame: '
                           'close it when that has returned')

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def __del__(self):
        self.close()

    def __reduce__(self):
        raise TypeError(f'this {type(self).__name__} cannot be copied or pickled; make another')

    def _open(self):
        if not self._handle:
            raise ValueError(f'this {type(self).__name__} is closed')
        return self._handle

    @contextlib.contextmanager
    def _running(self):
        """The handle, for calls of the library during which close() is refused."""
        call = object()
        try:
            self._calls.add(call)
            yield self._open()
        finally:
            self._calls.discard(call)

    def _create(self, maker, function, *arguments):
        """The handle, by a function of the library that takes the maker's first, and last where to write this one."""
        self._handle = c_void_p()
        maker._call(function, *arguments, byref(self._handle))

    def _call(self, function, *arguments):
        """A function of the library that takes this handle first."""
        with self._running() as handle:
            self._check(self._context.run(function, handle, *arguments))

    def _check(self, status):
        if status:  # paths in the text may be no UTF-8
            raise RelumeError(status, self._error(self._handle).decode(errors='backslashreplace'))


def opened(name, value, kind):
    """The library's handle of an argument, which must be of that kind."""
    if not isinstance(value, kind):
        raise TypeError(f'{name}: a {kind.__name__} expected, {type(value).__name__} found')
    return value._open()


class Context(Handle):
    """Errors of loading, and the threads that relighters of its bakes run on."""
    _destroy = staticmethod(runtime.relume_context_destroy)
    _error = staticmethod(runtime.relume_context_error)

    def __init__(self, threads):
        if not 1 <= whole('threads', threads) <= 1024:
            raise ValueError(f'threads: 1 to 1024 expected, {threads} found')
        self._threads = Threads(threads - 1) if threads > 1 else None
        self._parallel_for = ParallelFor(self._threads.parallel_for) if self._threads else None  # while the library may call it
        desc = ContextDesc(struct_size=sizeof(ContextDesc), api_version=API_VERSION)
        if self._parallel_for:
            desc.parallel_for = self._parallel_for
        self._handle = c_void_p()
        status = runtime.relume_context_create(byref(desc), byref(self._handle))
        if status:
            raise RelumeError(status, runtime.relume_status_text(status).decode())

    def run(self, function, *arguments, signals=None):
        """A function of the library. signals: where it calls the host's own code; it also calls back where there are threads."""
        if self._threads:
            return (signals or HeldSignals()).call(self._threads.call, function, *arguments)
        return signals.call(function, *arguments) if signals else function(*arguments)

    def _call(self, function, *arguments):
        with self._running() as handle:
            self._check(self.run(function, handle, *arguments))
