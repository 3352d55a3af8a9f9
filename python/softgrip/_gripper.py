"""The gripper."""

from __future__ import annotations

import csv
import enum
import os
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, fields
from types import TracebackType

from . import _status
from ._errors import Dropped, GripperError, Refused, WaitTimeout
from ._line import Line
from ._settings import Settings
from ._status import Loss, State, Status

#: Registers: payload, grip pressure, command, what the arm does, what has become of the command, whether the
#: settings are stored, and counters (docs/registers.md).
_PAYLOAD_AT = 0x1100
_PRESSURE_AT = 0x1103
_COMMAND_AT = 0x1104
_MOTION_AT = 0x1105
_RESULT_AT = 0x1106
_STORED_AT = 0x1109
_COUNTERS_AT = 0x1044
_COUNTERS = ("holds", "losses", "refusals", "tares", "sweeps")

_KINDS = ("sphere", "cylinder")

#: Between two looks at the gripper, s.
_LOOK_S = 0.005
#: Storing takes no longer, with a sector of flash to be erased, s.
_SAVE_S = 10.0


class _Command(enum.IntEnum):
    GRIP = 1
    GRIP_PRESSURE = 2
    GRIP_PAYLOAD = 3
    RELEASE = 4
    STOP = 5
    ACKNOWLEDGE = 6
    TARE = 7
    SWEEP = 8
    SAVE = 9


class Gripper:
    """A gripper on a serial line, or the virtual one.

    ``port`` is a serial device (``/dev/ttyUSB0``, ``COM3``), the link that ``softgrip serve --tty``
    makes, or ``tcp://HOST:PORT`` for RTU over TCP.

    Every command is answered with what has become of it: one that is refused raises
    :class:`Refused` with the reason.
    """

    def __init__(
        self,
        port: str,
        *,
        device_id: int = 9,
        baudrate: int = 115_200,
        timeout_s: float = 0.5,
    ) -> None:
        self._line = Line(port, device_id, baudrate, timeout_s)
        self.settings = Settings(self._line)
        """The gripper's settings; :meth:`save_settings` stores them."""

    def __enter__(self) -> Gripper:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.disconnect()

    def disconnect(self) -> None:
        """Closes the line. The gripper goes on as it is, or as its host watchdog is set."""
        self._line.close()

    def status(self) -> Status:
        """The gripper now."""
        words = self._line.read(_status.STATUS_AT, _status.STATUS_COUNT)
        return _status.status(words, time.monotonic())

    def close(self, pressure_kpa: float | None = None) -> None:
        """Begins to close, at this pressure or at that of the settings; :meth:`wait_holding` waits for the end."""
        if pressure_kpa is None:
            self._do(_Command.GRIP)
        else:
            self._line.write(_PRESSURE_AT, [_word("pressure_kpa", pressure_kpa, 10.0)])
            self._do(_Command.GRIP_PRESSURE)

    def grip_payload(
        self, mass_g: float, acceleration_m_s2: float, kind: str = "sphere"
    ) -> None:
        """Begins to close at the lowest pressure that carries this with the margin of the settings.

        ``kind`` is ``"sphere"`` or ``"cylinder"``, in the size of the finger's recipe. One that is too heavy is
        :class:`Refused`, with the mass that would be possible as its ``detail``.
        """
        if kind not in _KINDS:
            raise ValueError(f"kind {kind!r}: must be one of {', '.join(_KINDS)}")
        mass = _word("mass_g", mass_g, 1.0)
        acceleration = _word("acceleration_m_s2", acceleration_m_s2, 1000.0)
        self._line.write(_PAYLOAD_AT, [mass, acceleration, _KINDS.index(kind)])
        self._do(_Command.GRIP_PAYLOAD)

    def wait_holding(self, timeout_s: float = 5.0) -> bool:
        """Waits until the fingers have closed. Whether they hold something."""
        settled = self._wait("the fingers to close", timeout_s, lambda s: s.state != State.CLOSING)
        return settled.holding

    def open(self, timeout_s: float = 5.0) -> None:
        """Lets go, and waits until the fingers are open."""
        self._do(_Command.RELEASE)
        self._wait("the fingers to open", timeout_s, lambda s: s.state != State.RELEASING)

    def stop(self) -> None:
        """Goes to the safe state at once."""
        self._do(_Command.STOP)

    def lost(self) -> Loss | None:
        """The loss that nobody has acknowledged; none if there is none."""
        return _status.loss(self._line.read(_status.LOSS_AT, _status.LOSS_COUNT))

    def acknowledge(self) -> None:
        """Says that what is latched, a loss or a fault, has been seen."""
        self._do(_Command.ACKNOWLEDGE)

    def arm_stands_still(self, still: bool) -> None:
        """Says what the arm does: a slip or a loss at rest is told sooner than one under an arm that may move."""
        self._line.write(_MOTION_AT, [int(still)])

    def tare(self, timeout_s: float = 5.0) -> None:
        """Takes the present strain as zero. The gripper must be open, without pressure."""
        self._learn(_Command.TARE, "tares", timeout_s)

    def sweep(self, timeout_s: float = 120.0) -> None:
        """Learns the mounted fingers in a free-bend sweep, with nothing in the grip (docs/calibration.md)."""
        self._learn(_Command.SWEEP, "sweeps", timeout_s)

    def save_settings(self) -> None:
        """Stores the settings, what a tare and a sweep have found among them, for the next start."""
        self._line.write(_COMMAND_AT, [_Command.SAVE])
        end = time.monotonic() + _SAVE_S
        while self._line.read(_STORED_AT, 1) != [0]:
            if time.monotonic() > end:
                raise GripperError("save: the gripper could not store its settings")
            time.sleep(_LOOK_S)

    def counters(self) -> dict[str, int]:
        """Holds, losses, refusals, tares and sweeps since the gripper's start; each wraps at 65536."""
        words = self._line.read(_COUNTERS_AT, len(_COUNTERS))
        return dict(zip(_COUNTERS, words))

    def record(self, duration_s: float, period_s: float = 0.01) -> Iterator[Status]:
        """One status every ``period_s`` for so long; :func:`write_csv` writes them to a file."""
        begin = time.monotonic()
        due = begin
        while due < begin + duration_s:
            time.sleep(max(0.0, due - time.monotonic()))
            yield self.status()
            # A look that took too long is left out, not made up for.
            due = max(due + period_s, time.monotonic())

    def _do(self, command: _Command) -> None:
        result, reason, detail = self._line.write_and_read(
            _COMMAND_AT, [command], _RESULT_AT, 3
        )
        what = command.name.lower().replace("_", " ")
        if result == 3:
            raise Refused(what, reason, detail)
        if result == 4:
            raise Dropped(f"{what}: a stop or a release by the digital inputs came before")

    def _learn(self, command: _Command, counter: str, timeout_s: float) -> None:
        before = self.counters()
        self._do(command)
        end = time.monotonic() + timeout_s
        while True:
            now = self.counters()
            if now[counter] != before[counter]:
                return
            if now["refusals"] != before["refusals"]:
                _, reason, detail = self._line.read(_RESULT_AT, 3)
                raise Refused(command.name.lower(), reason, detail)
            if time.monotonic() > end:
                raise WaitTimeout(f"waiting for the {command.name.lower()}: {timeout_s} s")
            time.sleep(_LOOK_S)

    def _wait(self, what: str, timeout_s: float, is_over: Callable[[Status], bool]) -> Status:
        end = time.monotonic() + timeout_s
        while True:
            status = self.status()
            if is_over(status):
                return status
            if time.monotonic() > end:
                raise WaitTimeout(f"waiting for {what}: {timeout_s} s, and {status}")
            time.sleep(_LOOK_S)


def _word(name: str, value: float, per_unit: float) -> int:
    """A quantity as a register has it."""
    word = round(value * per_unit) if value == value else -1
    if not 0 <= word <= 0xFFFF:
        raise ValueError(f"{name} {value}: must lie within 0 and {0xFFFF / per_unit}")
    return word


def write_csv(path: str | os.PathLike[str], recording: Iterable[Status]) -> None:
    """Writes a recording to a CSV file, a column for each value of a status."""
    names = [field.name for field in fields(Status)]
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        header = [
            f"{name}{finger}" if name in ("touching", "residual_ue") else name
            for name in names
            for finger in ((1, 2, 3) if name in ("touching", "residual_ue") else (None,))
        ]
        writer.writerow(header)
        for status in recording:
            row: list[object] = []
            for value in asdict(status).values():
                row.extend(value if isinstance(value, tuple) else (value,))
            writer.writerow("" if value is None else value for value in row)
