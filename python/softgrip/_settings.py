"""The gripper's settings, by name or number."""

from __future__ import annotations

import csv
import importlib.resources
import struct
from collections.abc import Iterator
from functools import cache

from ._line import Line

#: Two registers for each number from here on.
SETTINGS_AT = 0x2000


@cache
def numbers() -> dict[str, int]:
    """The number of every setting, by its name."""
    file = importlib.resources.files(__package__) / "settings.tsv"
    rows = csv.reader(file.read_text("utf-8").splitlines(), delimiter="\t")
    return {name: int(number) for number, name in rows}


class Settings:
    """The gripper's settings: ``settings["regulator.slew_kpa_per_s"] = 300``.

    A value is used from the next millisecond on. It is forgotten when the power goes, unless
    :meth:`Gripper.save_settings` is called. docs/settings.md has all names, units and ranges.
    """

    def __init__(self, line: Line) -> None:
        self._line = line

    def __getitem__(self, name: str | int) -> float:
        upper, lower = self._line.read(_address(name), 2)
        value: float = struct.unpack(">f", struct.pack(">HH", upper, lower))[0]
        return value

    def __setitem__(self, name: str | int, value: float) -> None:
        words = struct.unpack(">HH", struct.pack(">f", value))
        self._line.write(_address(name), words)

    def __iter__(self) -> Iterator[str]:
        return iter(numbers())

    def __len__(self) -> int:
        return len(numbers())


def _address(name: str | int) -> int:
    number = numbers().get(name) if isinstance(name, str) else name
    if number is None:
        raise KeyError(f"{name}: no such setting; docs/settings.md has them all")
    return SETTINGS_AT + 2 * number
