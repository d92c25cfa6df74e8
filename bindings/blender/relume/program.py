# SPDX-License-Identifier: MIT
"""The command `relume` as a process that is watched: progress, messages, cancelling. Knows nothing of Blender."""
import json
import shutil
import subprocess
import threading


class RelumeError(Exception):
    """What went wrong, as the user is told."""


def find(path):
    """The program: `path`, or the one of PATH where that is empty."""
    found = shutil.which(path or "relume")
    if found:
        return found
    if path:
        raise RelumeError(f'"{path}" is not a program; set the path of relume in the add-on\'s preferences')
    raise RelumeError("no program relume in PATH; install Relume, or set its path in the add-on's preferences")


class Run:
    """A command under way. Attributes follow it: stage, overall [0..1], warnings, and in the end status and output."""

    def __init__(self, program, *words):
        self.stage, self.overall, self.warnings, self.errors, self.status = "", 0.0, [], [], None
        self._asked_to_end = False
        command = [program, *(str(word) for word in words), "--progress", "json"]
        self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                         text=True, encoding="utf-8", errors="replace")
        self._output = []
        self._threads = [threading.Thread(target=self._read, args=each, daemon=True)
                         for each in ((self._process.stderr, self._take), (self._process.stdout, self._output.append))]
        for thread in self._threads:
            thread.start()

    @staticmethod
    def _read(pipe, take):
        with pipe:
            for line in pipe:
                take(line)

    def _take(self, line):
        try:
            event = json.loads(line)
        except ValueError:  # errors of older programs, and of the system, are lines of text
            self.errors.append(line.strip().removeprefix("relume: error: "))
            return
        if event.get("event") == "progress":
            self.stage, self.overall = event["stage"], event.get("overall", event["fraction"])
        elif event.get("severity") == "warning":
            self.warnings.append(event["text"])
        elif event.get("severity") == "error":
            self.errors.append(event["text"])

    def ended(self):
        """Whether it has; then status and output are there."""
        if self._process.poll() is None:
            return False
        for thread in self._threads:
            thread.join()
        self.status = self._process.returncode
        return True

    def wait(self):
        self._process.wait()
        self.ended()
        return self

    def cancel(self):
        """Ask it to end; files are then as they were."""
        if self._process.poll() is None:
            self._asked_to_end = True
            self._process.terminate()

    @property
    def output(self):
        return "".join(self._output)

    @property
    def cancelled(self):
        return self._asked_to_end and self.status != 0

    def check(self):
        """Raises what it said when it failed."""
        if self.status != 0:
            said = [text.replace(", or give --allow-stale", "") for text in self.errors]  # which is for the command line
            raise RelumeError("\n".join(said) or f"relume ended with {self.status}")
        return self
