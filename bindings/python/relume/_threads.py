# SPDX-License-Identifier: MIT
"""The threads that the library's tasks run on.

ctypes drops what a callback raises, and the library goes on as if its tasks were done. Here they are always done first. What was
raised meanwhile, for example by PyThreadState_SetAsyncExc(), is raised after the library's function. Python raises such an exception
between steps of its own code, never within a call of C code: each step that must be whole is one such call."""
import collections
import contextlib
import itertools
import os
import queue
import threading

from ._signals import counted


class Batch:
    """Tasks of one call, which its own thread and workers take."""

    def __init__(self, tasks, task, data):
        self._waiting, self._ended, self._seen = collections.deque(range(tasks)), queue.SimpleQueue(), collections.deque()
        self._tasks, self._task, self._data = tasks, task, data

    def work(self):
        """Do the tasks that no thread has taken."""
        done = map(self._task, itertools.repeat(self._data), iter(self._waiting.popleft, None))
        with contextlib.suppress(IndexError):  # none is left
            collections.deque(map(self._ended.put, done), maxlen=0)

    def wait(self):
        """Until all tasks have ended. May be called again where it was interrupted."""
        self._seen.extend(map(self._ended.get, itertools.repeat(True, self._tasks - len(self._seen))))


def _need_stack(calls=20):
    """RecursionError now, rather than when a task has been taken."""
    if calls:
        _need_stack(calls - 1)


class Raised(threading.local):
    """What was raised in a thread while the tasks of its call ran."""
    error = None


class Workers:
    """Threads beside those that ask for them, begun when there are tasks; they end with this."""

    def __init__(self, most):
        self._most, self.raised, self.entered = most, Raised(), counted(int)
        self._begin()

    def __del__(self):
        for _ in range(self._most - len(self._places)):
            self._asked.put(None)

    def _begin(self):
        self._asked, self._process = queue.SimpleQueue(), os.getpid()
        self._places = collections.deque(range(self._most))  # of threads that have not begun

    def run(self, _, tasks, task, data):
        """All tasks are done when this returns, whatever is raised: they use memory of the call that asked for them."""
        _need_stack()
        batch, asked = Batch(tasks, task, data), False
        while True:
            try:
                if not asked:
                    asked = True
                    self.entered()
                    self._ask(batch, min(self._most, tasks - 1))
                batch.work()  # all workers may wait for this call: it may come from a `visibility` that one of them runs
                return batch.wait()
            except BaseException as error:  # pylint: disable=broad-except
                self.raised.error = error

    def _ask(self, batch, count):
        if self._process != os.getpid():  # a fork has none of the threads
            self._begin()
        with contextlib.suppress(RuntimeError, IndexError):  # no thread can be begun, or another call has begun the last
            while self._most - len(self._places) < count:
                self._places.pop()
                threading.Thread(target=_serve, args=(self._asked,), daemon=True).start()
        for _ in range(count):
            self._asked.put(batch)


def _serve(asked):
    for batch in iter(asked.get, None):
        batch.work()
        del batch  # its tasks are no more


class Threads:
    """Calls of the library whose tasks run on workers."""

    def __init__(self, workers):
        self._workers = Workers(workers)
        self.parallel_for = counted(self._workers.run)
        self._calls, self._told = set(), 0

    def call(self, function, *arguments):
        """A function of the library. Then raises what was raised while its tasks ran."""
        this, raised = object(), self._workers.raised
        outer, raised.error = raised.error, None  # of the frame whose `visibility` makes this call
        try:
            try:
                self._calls.add(this)
                return function(*arguments)
            finally:
                lost = self._lost()
                self._calls.discard(this)
                if raised.error is not None:
                    raise raised.error
                if lost:
                    raise RuntimeError('an exception, which sys.unraisablehook was told, came before tasks of this call had begun: '
                                       'its results are incomplete. Repeat it, a frame after reset()')
        finally:
            raised.error = outer

    def _lost(self):
        """Whether tasks were asked for and not begun. Where several calls run, the last to end says so."""
        begun = self.parallel_for.cache_info().misses
        if len(self._calls) > 1:
            return False
        told, self._told = self._told, max(self._told, begun - self._workers.entered.cache_info().misses)
        return self._told > told
