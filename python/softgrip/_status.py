"""What the gripper shows."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import dataclass

#: Value of a signed register that is not known.
UNKNOWN = -0x8000


class State(enum.IntEnum):
    """Where the gripper is."""

    IDLE = 1
    CLOSING = 2
    HOLDING = 3
    EMPTY = 4
    RELEASING = 5
    FAULT = 6
    SWEEPING = 7


class LossCause(enum.IntEnum):
    """Why a loss was reported."""

    COLLAPSE = 1
    """The contact of all fingers collapsed."""
    ONE_SIDED = 2
    """One finger emptied."""
    MISSING = 3
    """Nothing was there after a change of pressure."""


@dataclass(frozen=True)
class Loss:
    """A loss that nobody has acknowledged."""

    cause: LossCause
    """Why it was reported."""
    onset_ms: int
    """When it began, in ms since the gripper's start."""
    flagged_ms: int
    """When it was reported, in ms since the gripper's start."""
    latency_ms: float
    """From the one to the other."""
    evidence_percent: tuple[float | None, ...]
    """How far the residual of each finger had fallen, in percent of its plateau."""


@dataclass(frozen=True)
class Status:
    """The gripper at one moment."""

    t_s: float
    """When it was read, in s of ``time.monotonic()``."""
    state: State
    """Where it is."""
    fault: int
    """Number of the latched fault (docs/faults.md), 0 for none."""
    holding: bool
    """Something is held."""
    lost: bool
    """A loss is latched, and a grip would be refused."""
    tare_due: bool
    """A tare is asked for."""
    pressure_kpa: float | None
    """Measured pressure."""
    setpoint_kpa: float | None
    """Where the pressure is to be now."""
    bend_deg: float | None
    """Estimated bend of the fingers."""
    level_percent: float | None
    """While something is held: summed contact residual over its plateau."""
    margin_percent: float | None
    """While a payload is held: lift beyond its load."""
    touching: tuple[bool, ...]
    """Which fingers touch."""
    residual_ue: tuple[float | None, ...]
    """Contact residual of each finger, in microstrain."""


#: The registers of a status: the first, and how many.
STATUS_AT = 0x1010
STATUS_COUNT = 12
#: The registers of a loss.
LOSS_AT = 0x1030
LOSS_COUNT = 9


def signed(word: int, unit: float = 1.0) -> float | None:
    """The value of a signed register in its unit; none if it is not known."""
    value = word - 0x10000 if word & 0x8000 else word
    # 878 tenths are 87.8, and not 87.80000000000001.
    return None if value == UNKNOWN else round(value * unit, 3)


def long(upper: int, lower: int) -> int:
    """The value of two registers."""
    return upper << 16 | lower


def status(words: Sequence[int], t_s: float) -> Status:
    """The status of its registers."""
    flags = words[2]
    return Status(
        t_s=t_s,
        state=State(words[0]),
        fault=words[1],
        holding=bool(flags & 1),
        lost=bool(flags & 2),
        tare_due=bool(flags & 4),
        pressure_kpa=signed(words[3], 0.1),
        setpoint_kpa=signed(words[4], 0.1),
        bend_deg=signed(words[5], 0.1),
        level_percent=signed(words[6], 0.1),
        margin_percent=signed(words[7], 0.1),
        touching=tuple(bool(words[8] >> finger & 1) for finger in range(3)),
        residual_ue=tuple(signed(word) for word in words[9:12]),
    )


def loss(words: Sequence[int]) -> Loss | None:
    """The loss of its registers; none if there is none."""
    if words[0] == 0:
        return None
    return Loss(
        cause=LossCause(words[0]),
        onset_ms=long(words[1], words[2]),
        flagged_ms=long(words[3], words[4]),
        latency_ms=round(words[5] * 0.1, 1),
        evidence_percent=tuple(signed(word, 0.1) for word in words[6:9]),
    )
