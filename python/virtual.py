"""Starts `softgrip serve` for a test, and reads what it says."""

from __future__ import annotations

import contextlib
import os
import pathlib
import re
import signal
import subprocess
import threading
import time
from collections.abc import Iterator

ROOT = pathlib.Path(__file__).parent.parent

#: Patience with a machine that has much else to do, s.
LONG = 60.0


def binary() -> str:
    """The command `softgrip`."""
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    return os.environ.get("SOFTGRIP", str(target / "debug/softgrip"))


class Virtual:
    """A running virtual gripper."""

    def __init__(self, *arguments: str) -> None:
        self.lines: list[str] = []
        self._process = subprocess.Popen(
            [binary(), "serve", *arguments], stdout=subprocess.PIPE, text=True
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        first = self.wait_for("serving on")
        found = re.match(r"serving on (.+): Modbus", first)
        assert found, first
        self.port: str = found[1]
        """What a client opens."""

    def _read(self) -> None:
        assert self._process.stdout
        for line in self._process.stdout:
            self.lines.append(line.rstrip("\n"))

    def said(self, text: str, *, after: str = "") -> bool:
        """Whether a line has this in it, behind one with ``after``."""
        lines = iter(self.lines)
        return any(after in line for line in lines) and any(text in line for line in lines)

    def wait_for(self, text: str) -> str:
        """The first line with this in it, once it is there."""
        end = time.monotonic() + LONG
        while time.monotonic() < end:
            for line in list(self.lines):
                if text in line:
                    return line
            assert self._process.poll() is None or self._reader.is_alive(), (
                f"ended with {self._process.returncode}: {self.lines}"
            )
            time.sleep(0.005)
        raise AssertionError(f"nothing said of {text!r}: {self.lines}")

    def in_order(self, *texts: str) -> None:
        """Checks that lines with these came one after the other."""
        lines = iter(self.lines)
        for text in texts:
            assert any(text in line for line in lines), f"{text!r} is not there in order: {self.lines}"

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Keeps it from running meanwhile, as a busy machine does."""
        self._process.send_signal(signal.SIGSTOP)
        # It may run on for a moment.
        os.waitid(os.P_PID, self._process.pid, os.WSTOPPED)
        try:
            yield
        finally:
            self._process.send_signal(signal.SIGCONT)

    def stop(self) -> None:
        """Ends it as Ctrl-C does, and checks that it ends well; once."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        status = self._process.wait(LONG)
        self._reader.join(LONG)
        assert status == 0, f"status {status}: {self.lines}"


def until(what: str, is_so) -> None:
    """Waits until it is so."""
    end = time.monotonic() + LONG
    while not is_so():
        assert time.monotonic() < end, f"never: {what}"
        time.sleep(0.002)
