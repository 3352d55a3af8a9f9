"""The tables of `boards/README.md` that follow from the circuit."""

from __future__ import annotations

import re

from front_end import AREF, Circuit, constants
from shield import BOARDS, SIGNALS, parts


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def ohms(value: str) -> str:
    return {"k": f"{value[:-1]} kΩ", "M": f"{value[:-1]} MΩ"}.get(value[-1], f"{value} Ω")


def pins() -> str:
    head = ["signal", "direction"] + [f"{name}: header, pin" for name, _, _ in BOARDS]
    rows = [
        [what, direction, *(f"{header}, {pin}" for header, pin in places)] for _, what, direction, *places in SIGNALS
    ]
    return table(head, rows)


def connectors() -> str:
    rows = [
        [part.ref, part.value, *["; ".join(f"{n} {net}" for n, net in enumerate(part.nets, 1))]]
        for part in parts()
        # The rest are the board's own headers.
        if part.block == "connectors" and len(part.ref) == 2
    ]
    return table(["connector", "for", "contacts"], rows)


def gauges() -> str:
    circuit, scale = Circuit(), constants()
    at = {ue: f"{circuit.gauge_v(1, ue):.3f} V" for ue in (-25_000.0, -20_000.0, 0.0, 20_000.0, 25_000.0)}
    value = {ref: ohms(circuit.parts[f"R1{ref}"].value) for ref in ("01", "03", "04", "06", "07")}
    return table(
        ["point", "value"],
        [
            ["bridge", "half bridge of two active gauges of 1 kΩ ± 0.3 % between EXC and GND, its middle at SIG, so that it "
             "follows the converter's reference; GND–SIG is the side that is stretched in closing"],
            ["EXC", f"AREF by a follower that senses at the connector, through {value['01']} and a 50 mA PTC"],
            ["pull-up", f"{value['03']} from SIG to AREF, before the amplifier"],
            ["amplifier", f"INA333 at 3.3 V, {value['06']} 0.1 %: gain {circuit.gauge_gain(1):.2f}; its other input and its "
             "reference on half of AREF, buffered"],
            ["input filter", f"{value['04']} each side, 10 nF between them, 1 nF each to ground"],
            ["at the pin, without strain", at[0.0]],
            ["at ±20 000 µε", f"{at[20_000.0]} and {at[-20_000.0]}; more strain in the direction of closing is more volts"],
            ["at ±25 000 µε", f"{at[25_000.0]} and {at[-25_000.0]}: still linear"],
            ["short, open", f"below {scale['gauge_short_below_v']:.2f} V, above {scale['gauge_open_above_v']:.1f} V: the amplifier "
             "ends within 50 mV of ground and rail"],
            ["filter at the pin", f"{value['07']} and 10 nF to ground"],
        ],
    )  # fmt: skip


def command() -> str:
    circuit, scale = Circuit(), constants()
    codes = {name: 4096.0 / AREF * scale[f"command_{name}_v"] for name in ("zero", "full_scale")}
    per_kpa = (codes["full_scale"] - codes["zero"]) / scale["regulator_full_scale_kpa"]
    value = {ref: ohms(circuit.parts[f"R{ref}"].value) for ref in ("401", "402", "403", "404", "405", "406", "407")}
    lost = circuit["R405"] / circuit["R404"]
    return table(
        ["point", "value"],
        [
            ["regulator", "proportional, 0–10 V command for 0–200 kPa (2 bar), 0–10 V monitor, closed and venting without command"],
            ["converter", f"buffer **on**; {scale['command_zero_v']:.3f} V (code {codes['zero']:.1f}) is 0 V, "
             f"{scale['command_full_scale_v']:.3f} V (code {codes['full_scale']:.0f}) is 10 V, {per_kpa:.2f} codes per kPa"],
            ["pull-down", f"{value['401']} at the converter's pin"],
            ["amplifier", f"TLV9301 at 12 V: {circuit.command_gain():.3f} times the converter's voltage less {lost:.3f} AREF "
             f"({value['405']} from the connector, {value['403']} to ground, {value['404']} to AREF, 0.1 %); {value['402']} and 1 nF before it"],
            ["protection", f"{value['406']} and a 50 mA PTC inside the loop, SMAJ13A between them; {value['407']} at the connector"],
        ],
    )  # fmt: skip


def dividers() -> str:
    circuit, scale = Circuit(), constants()
    of = {ref: ohms(circuit.parts[ref].value) for ref in ("R411", "R412", "R421", "R422")}
    at_24 = 24.0 / scale["supply_divider"]
    return table(
        ["signal", "divider", "at the pin"],
        [
            ["monitor, 0–10 V for 0–200 kPa", f"{of['R411']} over {of['R412']}, 0.1 %",
             f"0–{scale['monitor_full_scale_v']:.3f} V; above {scale['monitor_high_above_v']:.1f} V is reported as a fault"],
            ["supply, 24 V", f"{of['R421']} over {of['R422']}, 1 %", f"{at_24:.2f} V"],
        ],
    )  # fmt: skip


TABLES = {"pins": pins, "connectors": connectors, "gauges": gauges, "command": command, "dividers": dividers}


def page(text: str) -> str:
    """The page with its tables between markers as the circuit has them."""
    for name, make in TABLES.items():
        begin, end = f"<!-- hardware/build: {name} -->\n", "\n<!-- end -->"
        pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.S)
        found = pattern.findall(text)
        if len(found) != 1:
            raise SystemExit(f"boards/README.md: not exactly one table between {begin.strip()} and {end.strip()}")
        text = text.replace(found[0], begin + make() + end)
    return text
