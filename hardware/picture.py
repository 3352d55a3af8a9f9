"""Schematic pictures, a block each, by netlistsvg (npm, MIT), which places and routes by itself."""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

from circuit import Part
from shield import RAILS

# Blocks that repeat another with other numbers, or have nothing to route.
LEFT_OUT = ("gauge 2", "gauge 3", "board links", "connectors")


def slug(block: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", block.lower()).strip("-")


def pictures(parts: list[Part]) -> dict[str, list[Part]]:
    """Which parts each picture has."""
    blocks: dict[str, list[Part]] = {}
    for part in parts:
        if part.block not in LEFT_OUT:
            blocks.setdefault(part.block, []).append(part)
    # Of four inputs and outputs one is shown.
    for block, first in (("24 V inputs", "GRIP"), ("24 V outputs", "READY")):
        blocks[block] = [part for part in blocks[block] if first in "".join(part.nets) or "GRIP_LED" in part.nets]
    return blocks


def source(block: str, parts: list[Part], everything: list[Part]) -> str:
    """What netlistsvg reads."""
    numbers: dict[str, int] = {}
    outside = {net for part in everything if part.block != block for net in part.nets}
    cells: dict[str, object] = {}

    def net(name: str) -> int:
        # A rail is drawn anew at every pin, so each of its symbols is a net of its own.
        if name in RAILS or not name:
            number = 1000 + len(cells)
            kind, pin = ("gnd", "A") if name == "GND" else ("vcc", "A")
            if name:
                cells[f"{name} {number}"] = cell(kind, {pin: number}, {pin: "input"}, name)
            return number
        return numbers.setdefault(name, 2 + len(numbers))

    for part in parts:
        nets = dict(zip((pin.name for pin in part.pins), part.nets, strict=True))
        add_part(cells, part, nets, net)
    ports = {
        name: {"direction": direction(name, parts), "bits": [number]}
        for name, number in numbers.items()
        if name in outside
    }
    return json.dumps({"modules": {block: {"ports": ports, "cells": cells}}}, indent=1)


def cell(
    kind: str, connections: dict[str, int], directions: dict[str, str], value: str, ref: str = ""
) -> dict[str, object]:
    return {
        "type": kind,
        "port_directions": directions,
        "connections": {pin: [number] for pin, number in connections.items()},
        "attributes": {"value": value, "ref": ref, "name": value},
    }


def direction(name: str, parts: list[Part]) -> str:
    drives = any(
        pin.type in ("output", "open_collector") and net == name
        for part in parts
        for pin, net in zip(part.pins, part.nets, strict=True)
    )
    return "output" if drives or name.startswith(("GAUGE", "CMD_OUT")) else "input"


TWO = {
    "R": ("r", "A", "B"),
    "F": ("r", "A", "B"),
    "C": ("c", "A", "B"),
    "L": ("l", "A", "B"),
    "D": ("d", "+", "-"),
    "TVS": ("d_sk", "+", "-"),
}


def add_part(cells: dict[str, object], part: Part, nets: dict[str, str], net: Callable[[str], int]) -> None:
    if part.kind in TWO:
        shape, one, two = TWO[part.kind]
        first, second = part.nets
        if part.kind == "TVS":
            first, second = second, first
        elif part.kind != "D" and first in RAILS and second not in RAILS and first == "GND":
            first, second = second, first
        way = "v" if {first, second} & set(RAILS) else "h"
        ends = {one: net(first), two: net(second)}
        cells[part.name] = cell(f"{shape}_{way}", ends, {one: "input", two: "output"}, part.value, part.name)
        return
    shown = f"{part.name} {part.value}"
    if part.kind in ("OPAMP", "OPAMP4") and len(part.nets) >= 3:
        # Its lower supply is ground, which nobody needs to see.
        names = {"+": "+", "-": "-", "OUT": "OUT", "V+": "VCC"}
        ends = {names[pin]: net(of) for pin, of in nets.items() if pin in names}
        sides = {pin: "output" if pin == "OUT" else "input" for pin in ends}
        cells[part.name] = cell("op", ends, sides, part.value, part.name)
        return
    ends = {name: net(of) for name, of in nets.items() if of}
    sides = {pin.name: ("input" if pin.side == "L" else "output") for pin in part.pins if nets[pin.name]}
    cells[part.name] = cell(shown, ends, sides, part.value, part.name)


def stamp(text: str) -> str:
    """Says from which source a picture was drawn, so that a stale one is found without netlistsvg."""
    return f"<!-- from {hashlib.sha256(text.encode()).hexdigest()} -->"


def draw(text: str, netlistsvg: str) -> str:
    package = Path(netlistsvg).resolve().parent.parent
    with tempfile.TemporaryDirectory() as folder:
        read, written = Path(folder) / "in.json", Path(folder) / "out.svg"
        read.write_text(text)
        skin = package / "lib" / "analog.svg"
        subprocess.run(
            [netlistsvg, str(read), "-o", str(written), "--skin", str(skin)], check=True, capture_output=True
        )
        return stamp(text) + "\n" + written.read_text()
