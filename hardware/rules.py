"""Electrical rules that need no KiCad: every pin is on a net, every net has its drivers, every part its numbers."""

from __future__ import annotations

from collections import defaultdict

from circuit import KINDS, NOT_FITTED, Part
from shield import BOARDS, SIGNALS


def broken(parts: list[Part]) -> list[str]:
    """What is wrong, a line each."""
    wrong: list[str] = []
    nets: dict[str, list[tuple[Part, str]]] = defaultdict(list)
    units: dict[str, list[Part]] = defaultdict(list)
    for part in parts:
        units[part.ref].append(part)
        if len(part.nets) != len(part.pins):
            wrong.append(f"{part.name}: {len(part.nets)} nets for {len(part.pins)} pins")
        for net, pin in zip(part.nets, part.pins, strict=False):
            if net:
                nets[net].append((part, pin.type))
        if not part.mpn or not part.alternatives or not part.footprint:
            wrong.append(f"{part.name}: no part number, no alternative, or no footprint")
    for ref, found in units.items():
        # Of an optocoupler each unit stands alone; an amplifier needs all, its supply among them.
        numbers = [part.unit for part in found]
        if sorted(numbers) != list(range(1, len(KINDS[found[0].kind].units) + 1)):
            wrong.append(f"{ref}: has units {numbers}")
    for net, pins in nets.items():
        wrong += of_net(net, pins)
    return wrong + of_boards(nets)


def of_net(net: str, pins: list[tuple[Part, str]]) -> list[str]:
    wrong = []
    if len(pins) < 2:
        wrong.append(f"{net}: one pin alone, of {pins[0][0].name}")
    drivers = [part.name for part, type in pins if type == "output"]
    if len(drivers) > 1:
        wrong.append(f"{net}: driven by {', '.join(drivers)}")
    if all(type == "input" for _, type in pins):
        wrong.append(f"{net}: nothing but inputs")
    if all(part.fit == NOT_FITTED for part, _ in pins):
        wrong.append(f"{net}: nothing on it is fitted")
    return wrong


def of_boards(nets: dict[str, list[tuple[Part, str]]]) -> list[str]:
    """Each signal reaches its place on each board's headers, and no place has two signals."""
    wrong = []
    for at, (board, _, fit) in enumerate(BOARDS):
        taken: dict[str, str] = {}
        for signal, _, _, *places in SIGNALS:
            header, _ = places[at]
            if taken.setdefault(header, signal) != signal:
                wrong.append(f"{board}: {header} is {taken[header]} and {signal}")
            links = [part for part, _ in nets[header] if part.block == "board links" and part.fit == fit]
            direct = any(part.block == "connectors" for part, _ in nets[signal])
            linked = any(signal in part.nets for part in links)
            if not (direct or linked):
                wrong.append(f"{board}: {signal} does not reach {header}")
    return wrong
