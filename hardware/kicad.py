"""A KiCad 9 schematic, written without KiCad: one sheet, symbols of its own, a label at every pin.

All identifiers are hashes of names, so the same table gives the same file.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
import uuid
import xml.etree.ElementTree as xml
from pathlib import Path

from circuit import KINDS, NOT_FITTED, Part, Pin
from shield import REVISION

GRID = 1.27
# Width of a place on the sheet in grid steps, places per row of a block, columns of blocks, first row.
CELL_W, PER_ROW, COLUMNS, SHEET_TOP = 34, 7, 2, 24
PIN = 2.54
FONT = "(effects (font (size 1.27 1.27)){})"
# Nets that a connector or a regulator without a driving pin feeds: KiCad wants to be told.
FED = ("GND", "V24", "V12", "V5", "V3V3")


def ident(*names: str) -> str:
    return str(uuid.uuid5(uuid.NAMESPACE_URL, "softgrip-shield/" + "/".join(names)))


def text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)


def mm(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def is_two_pole(pins: tuple[Pin, ...]) -> bool:
    return [pin.side for pin in pins] == ["L", "R"]


def places(pins: tuple[Pin, ...]) -> list[tuple[Pin, float, float]]:
    """Where each pin of a symbol ends, mm from its middle, y upwards."""
    two = is_two_pole(pins)
    reach = 5.08 if two else 12.7
    found = []
    for side, x in (("L", -reach), ("R", reach)):
        mine = [pin for pin in pins if pin.side == side]
        for row, pin in enumerate(mine):
            y = 0.0 if two else PIN * (len(mine) // 2 - row)
            found.append((pin, x, y))
    return found


def body(kind: str, pins: tuple[Pin, ...]) -> str:
    """The drawing of a unit."""
    stroke = "(stroke (width 0.2) (type default)) (fill (type {}))"

    def line(*points: tuple[float, float], fill: str = "none") -> str:
        at = " ".join(f"(xy {mm(x)} {mm(y)})" for x, y in points)
        return f"(polyline (pts {at}) {stroke.format(fill)})"

    match kind:
        case "C":
            return "".join(
                (
                    line((-0.5, -1.8), (-0.5, 1.8)),
                    line((0.5, -1.8), (0.5, 1.8)),
                    line((-2.54, 0), (-0.5, 0)),
                    line((0.5, 0), (2.54, 0)),
                )
            )
        case "D" | "TVS":
            shape = [
                line((-1.3, 1.3), (-1.3, -1.3), (1.3, 0), (-1.3, 1.3)),
                line((1.3, 1.3), (1.3, -1.3)),
                line((-2.54, 0), (2.54, 0)),
            ]
            if kind == "TVS":
                shape.append(line((-1.3, 1.3), (-1.3, -1.3)))
            return "".join(shape)
    two = is_two_pole(pins)
    tall = 1.0 if two else max(abs(y) for _, _, y in places(pins)) + PIN
    wide = 2.54 if two else 10.16
    fill = stroke.format("none" if two else "background")
    return f"(rectangle (start {mm(-wide)} {mm(tall)}) (end {mm(wide)} {mm(-tall)}) {fill})"


def library_symbol(name: str) -> str:
    kind = KINDS[name]
    hide = (
        " (pin_numbers (hide yes)) (pin_names (offset 0) (hide yes))"
        if is_two_pole(kind.units[0])
        else " (pin_names (offset 0.5))"
    )
    out = [f'(symbol "softgrip:{name}"{hide} (exclude_from_sim no) (in_bom yes) (on_board yes)']
    for key, value in (("Reference", kind.prefix), ("Value", name), ("Footprint", ""), ("Datasheet", "")):
        out.append(f'(property "{key}" "{value}" (at 0 0 0) {FONT.format(" (hide yes)" if not value else "")})')
    for at, pins in enumerate(kind.units, 1):
        out.append(f'(symbol "{name}_{at}_1" {body(name, pins)}')
        for pin, x, y in places(pins):
            length = PIN
            angle = 0 if pin.side == "L" else 180
            out.append(
                f"(pin {pin.type} line (at {mm(x)} {mm(y)} {angle}) (length {mm(length)}) "
                f"(name {text(pin.name)} {FONT.format('')}) (number {text(pin.number)} {FONT.format('')}))"
            )
        out.append(")")
    out.append("(embedded_fonts no))")
    return " ".join(out)


FLAG = (
    '(symbol "softgrip:PWR_FLAG" (power) (pin_numbers (hide yes)) (pin_names (offset 0) (hide yes)) (exclude_from_sim no) (in_bom no) '
    '(on_board no) (property "Reference" "#FLG" (at 0 0 0) (effects (font (size 1.27 1.27)) (hide yes))) (property "Value" "PWR_FLAG" '
    '(at 0 3 0) (effects (font (size 1.27 1.27)))) (property "Footprint" "" (at 0 0 0) (effects (font (size 1.27 1.27)) (hide yes))) '
    '(property "Datasheet" "" (at 0 0 0) (effects (font (size 1.27 1.27)) (hide yes))) (symbol "PWR_FLAG_1_1" (polyline (pts (xy 0 0) '
    "(xy 0 1.27) (xy -1 1.9) (xy 0 2.54) (xy 1 1.9) (xy 0 1.27)) (stroke (width 0.2) (type default)) (fill (type none))) (pin power_out line "
    '(at 0 0 90) (length 0) (name "pwr" (effects (font (size 1.27 1.27)))) (number "1" (effects (font (size 1.27 1.27)))))) (embedded_fonts no))'
)


def label(net: str, x: float, y: float, left: bool, key: str) -> str:
    angle, side = (180, "right") if left else (0, "left")
    return (
        f"(label {text(net)} (at {mm(x)} {mm(y)} {angle}) (effects (font (size 1.27 1.27)) (justify {side} bottom)) "
        f'(uuid "{ident("label", key)}"))'
    )


def instance(part: Part, x: float, y: float, root: str) -> list[str]:
    height = max((abs(dy) for _, _, dy in places(part.pins)), default=0.0) + 2.54
    shown = [("Reference", part.ref, -height - 3.0), ("Value", part.value, -height - 1.2)]
    hidden = [
        ("Footprint", part.footprint),
        ("Datasheet", ""),
        ("MPN", part.mpn),
        ("Alternatives", "; ".join(part.alternatives)),
        ("Fit", part.fit),
    ]
    dnp = "yes" if part.fit == NOT_FITTED else "no"
    out = [
        f'(symbol (lib_id "softgrip:{part.kind}") (at {mm(x)} {mm(y)} 0) (unit {part.unit}) (exclude_from_sim no) (in_bom yes) '
        f'(on_board yes) (dnp {dnp}) (uuid "{ident("part", part.name)}")'
    ]
    for key, value, dy in shown:
        out.append(f"(property {text(key)} {text(value)} (at {mm(x)} {mm(y + dy)} 0) {FONT.format('')})")
    for key, value in hidden:
        out.append(f"(property {text(key)} {text(value)} (at {mm(x)} {mm(y)} 0) {FONT.format(' (hide yes)')})")
    for pin in part.pins:
        out.append(f'(pin {text(pin.number)} (uuid "{ident("pin", part.name, pin.number)}"))')
    out.append(f'(instances (project "shield" (path "/{root}" (reference "{part.ref}") (unit {part.unit})))))')
    nets = dict(zip(part.pins, part.nets, strict=True))
    for pin, dx, dy in places(part.pins):
        at = (x + dx, y - dy)
        key = f"{part.name}.{pin.number}"
        if nets[pin]:
            out.append(label(nets[pin], *at, pin.side == "L", key))
        else:
            out.append(f'(no_connect (at {mm(at[0])} {mm(at[1])}) (uuid "{ident("open", key)}"))')
    return out


def flag(net: str, x: float, y: float, at: int, root: str) -> list[str]:
    ref = f"#FLG{at:02}"
    return [
        f'(symbol (lib_id "softgrip:PWR_FLAG") (at {mm(x)} {mm(y)} 0) (unit 1) (exclude_from_sim no) (in_bom no) (on_board no) (dnp no) '
        f'(uuid "{ident("flag", net)}") (property "Reference" "{ref}" (at {mm(x)} {mm(y)} 0) {FONT.format(" (hide yes)")}) '
        f'(property "Value" "PWR_FLAG" (at {mm(x)} {mm(y - 4)} 0) {FONT.format("")}) (pin "1" (uuid "{ident("flagpin", net)}")) '
        f'(instances (project "shield" (path "/{root}" (reference "{ref}") (unit 1)))))',
        label(net, x, y, False, f"flag {net}"),
    ]


def rows_of(parts: list[Part]) -> int:
    """Height of a row, grid steps: what its tallest symbol needs."""
    tallest = max(max(sum(pin.side == side for pin in part.pins) for side in "LR") for part in parts)
    return 2 * tallest + 8


def schematic(parts: list[Part]) -> str:
    """The whole file."""
    root = ident("sheet")
    blocks: dict[str, list[Part]] = {}
    for part in parts:
        blocks.setdefault(part.block, []).append(part)
    heights = [SHEET_TOP] * COLUMNS
    drawn: list[str] = []
    for name, members in blocks.items():
        column = heights.index(min(heights))
        left, top = 10 + column * (CELL_W * PER_ROW + 6), heights[column]
        drawn.append(
            f"(text {text(name)} (exclude_from_sim no) (at {mm(left * GRID)} {mm(top * GRID)} 0) "
            f'(effects (font (size 3 3) (bold yes)) (justify left bottom)) (uuid "{ident("title", name)}"))'
        )
        top += 4
        for start in range(0, len(members), PER_ROW):
            row = members[start : start + PER_ROW]
            height = rows_of(row)
            for at, part in enumerate(row):
                x = (left + CELL_W // 2 + at * CELL_W) * GRID
                drawn += instance(part, x, (top + height // 2) * GRID, root)
            top += height
        heights[column] = top + 8
    for at, net in enumerate(FED, 1):
        drawn += flag(net, (20 + 24 * at) * GRID, 16 * GRID, at, root)
    kinds = sorted({part.kind for part in parts})
    symbols = "\n".join([*map(library_symbol, kinds), FLAG])
    wide, tall = (COLUMNS * (CELL_W * PER_ROW + 6) + 20) * GRID, (max(heights) + 30) * GRID
    head = (
        f'(kicad_sch (version 20250114) (generator "hardware/build") (generator_version "9.0") (uuid "{root}")\n'
        f'(paper "User" {mm(wide)} {mm(tall)})\n(title_block (title "softgrip shield") (rev "{REVISION}"))\n'
    )
    tail = f'(sheet_instances (path "/{root}" (page "1")))\n(embedded_fonts no))\n'
    return head + f"(lib_symbols\n{symbols}\n)\n" + "\n".join(drawn) + "\n" + tail


def ask(file: Path, parts: list[Part]) -> list[str]:
    """What KiCad itself says: errors of its rules, and nets that are not those of the table."""
    with tempfile.TemporaryDirectory() as folder:
        erc, netlist = Path(folder) / "erc.json", Path(folder) / "netlist.xml"
        for command in (
            ["erc", "--severity-error", "--format", "json", "-o", erc],
            ["export", "netlist", "--format", "kicadxml", "-o", netlist],
        ):
            subprocess.run(
                ["kicad-cli", "sch", *map(str, command), str(file)], check=True, capture_output=True, text=True
            )
        found = [
            f"{violation['type']}: " + "; ".join(item["description"] for item in violation["items"])
            for sheet in json.loads(erc.read_text())["sheets"]
            for violation in sheet["violations"]
        ]
        theirs = {
            (node.get("ref"), node.get("pin")): net.get("name", "").removeprefix("/")
            for net in xml.parse(netlist).getroot().iter("net")
            for node in net.iter("node")
        }
    for part in parts:
        for pin, net in zip(part.pins, part.nets, strict=True):
            name = theirs.get((part.ref, pin.number), "")
            if net and name != net:
                found.append(f"{part.ref} pin {pin.number}: on {name or 'no net'} in KiCad, on {net} in the table")
    return found
