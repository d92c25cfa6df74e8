# SPDX-License-Identifier: MIT
"""What the library makes and destroys, and the threads that it runs on."""
import collections
import concurrent.futures
import threading
from ctypes import byref, c_void_p, sizeof
from typing import TypeVar

from ._library import API_VERSION, ContextDesc, ParallelFor, RelumeError, runtime

Self = TypeVar('Self', bound='Handle')


class Handle:
    """Something of the library that is destroyed once: by close(), at the end of a `with`, or with the object."""
    _destroy = None
    _handle = None

    def close(self) -> None:
        handle, self._handle = self._handle, None
        if handle:
            self._destroy(handle)

    def __enter__(self: Self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def __del__(self):
        self.close()

    def _open(self):
        if not self._handle:
            raise ValueError(f'this {type(self).__name__} is closed')
        return self._handle


class Batch:
    """Tasks of one call. Only workers take them: an exception from outside, Ctrl-C's, comes to the main thread alone."""

    def __init__(self, tasks, task, data):
        self._waiting, self._ended, self._tasks = collections.deque(range(tasks)), [], tasks
        self._task, self._data = task, data
        self.done = threading.Event()
        if tasks == 0:
            self.done.set()

    def work(self):
        while True:
            try:
                index = self._waiting.popleft()
            except IndexError:
                return
            self._task(self._data, index)
            self._ended.append(index)
            if len(self._ended) == self._tasks:
                self.done.set()


class Context(Handle):
    """Errors of loading, and the threads that relighters of its bakes run on."""
    _destroy = staticmethod(runtime.relume_context_destroy)

    def __init__(self, threads):
        if not 1 <= threads <= 1024:
            raise ValueError(f'threads: 1 to 1024 expected, {threads} found')
        self.interrupted = None
        desc = ContextDesc(struct_size=sizeof(ContextDesc), api_version=API_VERSION)
        if threads > 1:
            self._threads = threads
            self._pool = concurrent.futures.ThreadPoolExecutor(threads)
            self._parallel_for = ParallelFor(self._run)  # must live as long as the library may call it
            desc.parallel_for = self._parallel_for
        context = c_void_p()
        status = runtime.relume_context_create(byref(desc), byref(context))
        if status:
            raise RelumeError(status, runtime.relume_status_text(status).decode())
        self._handle = context

    def _run(self, _, tasks, task, data):
        """All tasks are done when this returns, Ctrl-C or not: they use memory of the call that asked for them."""
        batch = Batch(tasks, task, data)
        while not batch.done.is_set():
            try:
                for _ in range(min(self._threads, tasks)):
                    self._pool.submit(batch.work)
                batch.done.wait()
            except RuntimeError:  # the interpreter is about to end, and takes no more work
                batch.work()
            except BaseException as error:  # pylint: disable=broad-except
                self.interrupted = error

    def take_interrupt(self):
        """What came up while tasks ran, Ctrl-C for example; None = nothing."""
        error, self.interrupted = self.interrupted, None
        return error
