"""The compatible block as a raw client sees it: frames over pyserial, and the block's bits."""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass

import serial

ID = 9
REQUEST, STATUS = 0x03E8, 0x07D0
ACT, GTO, ATR = 0x0100, 0x0800, 0x1000


def crc(data: bytes) -> bytes:
    """The checksum of a frame."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return struct.pack("<H", value)


def framed(pdu: bytes) -> bytes:
    """A frame for the gripper."""
    frame = bytes([ID]) + pdu
    return frame + crc(frame)


def write_frame(words: list[int], address: int = REQUEST) -> bytes:
    """A request that writes registers, by function 16."""
    values = struct.pack(f">{len(words)}H", *words)
    return framed(struct.pack(">BHHB", 16, address, len(words), len(values)) + values)


def read_frame(count: int, address: int = STATUS, function: int = 3) -> bytes:
    """A request that reads registers."""
    return framed(struct.pack(">BHH", function, address, count))


def write_read_frame(words: list[int], count: int) -> bytes:
    """A request that writes the action request and then reads the status, by function 23."""
    values = struct.pack(f">{len(words)}H", *words)
    head = struct.pack(">BHHHHB", 23, STATUS, count, REQUEST, len(words), len(values))
    return framed(head + values)


@dataclass(frozen=True)
class Shown:
    """The bits of the status registers."""

    act: bool
    gto: bool
    sta: int
    obj: int
    flt: int
    pr: int
    po: int
    cu: int

    @classmethod
    def of(cls, words: list[int]) -> Shown:
        """Of three registers."""
        status, fault, position = words[0] >> 8, words[1], words[2]
        return cls(
            act=bool(status & 1),
            gto=bool(status >> 3 & 1),
            sta=status >> 4 & 3,
            obj=status >> 6 & 3,
            flt=fault >> 8,
            pr=fault & 0xFF,
            po=position >> 8,
            cu=position & 0xFF,
        )


class Raw:
    """A client that reads a fixed number of bytes and never flushes, as some drivers do."""

    def __init__(self, port: str) -> None:
        self.line = serial.Serial(port, 115_200, timeout=0.5)

    def ask(self, frame: bytes, length: int) -> bytes:
        """The answer, which must be as long as this. Where there is none, it is asked again, up to five times: a busy
        machine may keep the gripper from running for so long that it does not answer any more."""
        for _ in range(5):
            self.line.write(frame)
            answer = self.line.read(length)
            if answer:
                break
        assert len(answer) == length and crc(answer[:-2]) == answer[-2:], answer.hex(" ")
        assert answer[:1] == frame[:1] and answer[1] == frame[1], answer.hex(" ")
        return answer

    def write(self, words: list[int]) -> None:
        """Writes the action request by function 16."""
        answer = self.ask(write_frame(words), 8)
        assert answer[:6] == write_frame(words)[:6], answer.hex(" ")

    def read(self, count: int = 3, function: int = 3) -> Shown:
        """Reads the status."""
        return self._shown(self.ask(read_frame(count, function=function), 5 + 2 * count), count)

    def write_read(self, words: list[int]) -> Shown:
        """Writes the action request and reads the status, by function 23."""
        return self._shown(self.ask(write_read_frame(words, 3), 11), 3)

    @staticmethod
    def _shown(answer: bytes, count: int) -> Shown:
        words = list(struct.unpack(f">{count}H", answer[3:-2]))
        assert words[3:] == [0] * (count - 3), words
        return Shown.of(words)


def pause(milliseconds: float) -> None:
    """Waits as a driver's loop does."""
    time.sleep(milliseconds / 1000)
