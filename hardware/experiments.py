"""What the shield must do, tried on its netlist: each experiment gives rows of what was found and what is allowed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from random import Random
from typing import Any

from circuit import Part
from front_end import AREF, bridge, constants
from spice import copied, deck, measured, netlist, run, varied, waves

# Calls a function with each of these arguments, on all cores.
Each = Callable[[Callable[..., Any], list[tuple[Any, ...]]], list[Any]]

SAMPLES = 200
KELVIN = (-25.0, 0.0, 25.0)
SUPPLIES = "VA AREF 0 {aref}\nV5 V5 0 5\nV33 V3V3 0 {aref}\n"
SCALE = constants()
UE_PER_V = SCALE["gauge_full_scale_ue"] / SCALE["gauge_full_scale_v"]
KPA_PER_V = SCALE["regulator_full_scale_kpa"] / 10.0


@dataclass(frozen=True)
class Row:
    """A result and its limits."""

    what: str
    low: float
    high: float
    least: float
    most: float
    unit: str

    @property
    def good(self) -> bool:
        return self.least <= self.low and self.high <= self.most


def spread(what: str, values: list[float], least: float, most: float, unit: str) -> Row:
    return Row(what, min(values), max(values), least, most, unit)


@cache
def gauge_circuit() -> tuple[Part, ...]:
    return tuple(netlist(["reference", "gauge 1"]))


def rail(random: Random) -> float:
    """The board's 3.3 V regulator is good for 3 % over temperature (LD39050 data sheet)."""
    return AREF * (1.0 + random.uniform(-0.03, 0.03))


def gauge_sample(n: int, wild: float) -> list[tuple[float, float, float]]:
    """Strain that a board shows at −20 000, 0 and 20 000 µε, at 0, 25 and 50 °C."""
    strains = (-20_000.0, 0.0, 20_000.0)
    random = Random(f"gauge {n}")
    aref = rail(random)
    # Foil gauges as delivered: ±0.3 %, gauge factor ±1 %.
    arms = [1.0 + wild * random.uniform(-3e-3, 3e-3) for _ in range(2)]
    factor = 1.0 + wild * random.uniform(-0.01, 0.01)
    circuit: list[Part] = []
    wires, prints = [], []
    for t, kelvin in enumerate(KELVIN):
        warm = varied(list(gauge_circuit()), Random(f"parts {n}"), kelvin, wild)
        for s, strain in enumerate(strains):
            mark = f"_{t}{s}"
            circuit += copied(warm, mark)
            upper, lower = bridge(strain * factor)
            wires += [
                f"RU{mark} EXC1{mark} SIG1{mark} {upper * arms[0]:.9g}",
                f"RL{mark} SIG1{mark} 0 {lower * arms[1]:.9g}",
            ]
            prints.append(f"print v(GAUGE1{mark})")
    bench = SUPPLIES.format(aref=aref) + "\n".join([*wires, ".control", "op", *prints, ".endc"])
    said = measured(run(deck(f"gauge, sample {n}", circuit, bench)))
    shown = [
        (v * AREF / aref - SCALE["gauge_zero_v"]) * UE_PER_V
        for v in (said[f"v(gauge1_{t}{s})"] for t in range(3) for s in range(3))
    ]
    return [(shown[i], shown[i + 1], shown[i + 2]) for i in (0, 3, 6)]


def gauges(each: Each) -> list[Row]:
    boards = each(gauge_sample, [(n, 1.0) for n in range(SAMPLES)])
    drifts = each(gauge_sample, [(n, 0.0) for n in range(SAMPLES // 4)])
    zeros = [zero for board in boards for _, zero, _ in board]
    gains = [100.0 * ((high - low) / 40_000.0 - 1.0) for board in boards for low, _, high in board]
    bend = [0.5 * (high + low) - zero for board in boards for low, zero, high in board]
    drift = [zero - board[1][1] for board in drifts for _, zero, _ in board]
    of_gain = [100.0 * ((high - low) / (board[1][2] - board[1][0]) - 1.0) for board in drifts for low, _, high in board]
    return [
        # `TARE_LIMIT_UE` in src/zero.rs.
        spread("gauge, zero, 0 to 50 °C", zeros, -2_000.0, 2_000.0, "µε"),
        # A sweep learns 0.5 to 2 (docs/settings.md); what a board may be off without one is what its gauges are.
        spread("gauge, gain, 0 to 50 °C", gains, -3.0, 3.0, "%"),
        spread("gauge, bend at mid-scale", bend, -20.0, 20.0, "µε"),
        # What the zero's tracking follows at rest is slower than a warming board by far.
        spread("gauge, drift of zero, electronics, ±25 K", drift, -200.0, 200.0, "µε"),
        spread("gauge, drift of gain, electronics, ±25 K", of_gain, -0.5, 0.5, "%"),
    ]


def bandwidth(_: Each) -> list[Row]:
    """A loss takes 30 ms, a tick averages over 1: slower than a tick's Nyquist, faster than 3 ms."""
    upper, lower = bridge(0.0)
    bench = (
        SUPPLIES.format(aref=AREF)
        + f"RU EXC1 SIG1 {upper}\nRL SIG1 S {lower}\nVS S 0 AC 1\n.control\nac dec 200 1 100k\n"
        "let share = vdb(GAUGE1) - vdb(GAUGE1)[0]\nmeas ac corner when share=-3 fall=1\n.endc"
    )
    corner = measured(run(deck("bandwidth", list(gauge_circuit()), bench)))["corner"]
    bench = (
        SUPPLIES.format(aref=AREF)
        + f"RU EXC1 SIG1 {upper}\nRL SIG1 S {lower}\nVS S 0 PULSE(0 10m 20m 1u 1u 1 2)\n.control\n"
        "tran 5u 40m\nmeas tran first find v(GAUGE1) at=19m\nmeas tran last find v(GAUGE1) at=39m\n"
        "let share = (v(GAUGE1) - first) / (last - first)\nmeas tran rise trig share val=0.1 rise=1 targ share val=0.9 rise=1\n.endc"
    )
    rise = 1e6 * measured(run(deck("step", list(gauge_circuit()), bench)))["rise"]
    return [
        spread("gauge, −3 dB", [corner], 500.0, 1_200.0, "Hz"),
        spread("gauge, rise 10 to 90 %", [rise], 250.0, 700.0, "µs"),
    ]


POWER = ["command", "power"]
# The chip's pin: a converter with its buffer while `on` is up (DS9405: 5 kΩ load, so some 15 Ω), what leaks else.
PIN = """
VDAC DAC 0 {dac}
SDAC DAC COMMAND ON 0 SWITCH
BLEAK 0 COMMAND I = {leak}*(1 - min(max(v(ON), 0), 1))
.model SWITCH SW(Ron=15 Roff=1t Vt=0.5)
"""


def command_sample(n: int) -> list[tuple[float, float]]:
    """kPa asked for, and kPa too much at the connector, of one board; the first is code 0 and its volts."""
    random = Random(f"command {n}")
    kelvin = random.choice(KELVIN)
    aref = rail(random)
    gain, offset = 1.0 + random.uniform(-0.005, 0.005), random.uniform(-10e-3, 10e-3)
    asked = (0.0, 5.0, 20.0, 100.0, 160.0, 200.0)
    board = varied(netlist(["command"]), Random(f"command parts {n}"), kelvin)
    span = SCALE["command_full_scale_v"] - SCALE["command_zero_v"]
    circuit, wires, prints = [], [], []
    for at, kpa in enumerate(asked):
        circuit += copied(board, f"_{at}")
        dac = (SCALE["command_zero_v"] + span * kpa / 200.0) / AREF * aref if kpa else 0.0
        # The buffer ends at 0.2 V (DS9405) at worst, at some tens of millivolts as users measure.
        dac = max(dac * gain + offset, random.choice((0.0, 0.07, 0.2)))
        wires += [f"VD{at} COMMAND_{at} 0 {dac:.9g}", f"VP{at} V12_{at} 0 12", f"RL{at} CMD_OUT_{at} 0 10k"]
        prints.append(f"print v(CMD_OUT_{at})")
    bench = f"VA AREF 0 {aref}\n" + "\n".join([*wires, ".control", "op", *prints, ".endc"])
    said = measured(run(deck(f"command, sample {n}", circuit, bench)))
    volts = [said[f"v(cmd_out_{at})"] for at in range(len(asked))]
    return [(0.0, volts[0])] + [
        # Of the rail, which the monitor's pressure is told by, too.
        (kpa, v * KPA_PER_V - kpa * aref / AREF)
        for kpa, v in zip(asked[1:], volts[1:], strict=True)
    ]


def command(each: Each) -> list[Row]:
    boards = each(command_sample, [(n,) for n in range(SAMPLES)])
    by_pressure: dict[float, list[float]] = {}
    for board in boards:
        for kpa, off in board:
            by_pressure.setdefault(kpa, []).append(off)
    rows = [spread("command, code 0", by_pressure.pop(0.0), -0.05, 0.05, "V")]
    for kpa, off in by_pressure.items():
        allowed = 1.0 + 0.015 * kpa
        rows.append(spread(f"command, {kpa:.0f} kPa, off by, less the rail's", off, -allowed, allowed, "kPa"))
    return rows


def sequence(
    title: str, supplies: str, on: str, dac: str, leak: str, until_ms: float, more: str = ""
) -> list[list[float]]:
    """Time and command output while supplies and the chip come and go."""
    bench = (
        supplies + f"VON ON 0 {on}\nRREG CMD_OUT 0 10k\n" + PIN.format(dac=dac, leak=leak) + more
        + f".control\ntran 10u {until_ms}m uic\n.endc"
    )  # fmt: skip
    return waves(deck(title, netlist(POWER), bench), ["v(CMD_OUT)", "v(AREF)", "v(V12)"])


def up(after_ms: float, volts: float, rise_ms: float = 2.0) -> str:
    return f"PWL(0 0 {after_ms}m 0 {after_ms + rise_ms}m {volts})"


def starts(_: Each) -> list[Row]:
    """Power-up in both orders, reset, brown-out. An open finger allows 5 kPa, which are 0.25 V, for a moment."""
    rows = []
    for leak, name in (("1u", "1 µA"), ("-1u", "−1 µA"), ("5u", "5 µA")):
        rest = 0.05 if "5" not in name else 0.25
        for order, first, second in (("24 V first", 2.0, 20.0), ("3.3 V first", 20.0, 2.0)):
            supplies = f"V24 V24_IN 0 {up(first, 24.0)}\nVA AREF 0 {up(second, AREF)}\n"
            # The converter is on, at code 0, 5 ms after the rail.
            on = f"PWL(0 0 {second + 7}m 0 {second + 7.001}m 1)"
            wave = sequence(f"power-up, {order}, {name}", supplies, on, "0", leak, 60.0)
            rows.append(
                spread(f"power-up, {order}, pin leaks {name}: most", [max(row[1] for row in wave)], -0.25, 0.25, "V")
            )
            still = [row[1] for row in wave if row[0] > max(first, second) * 1e-3 + 5e-3]
            rows.append(spread(f"power-up, {order}, pin leaks {name}: at rest", still, -rest, rest, "V"))
    running = f"V24 V24_IN 0 24\nVA AREF 0 {AREF}\n"
    for leak, name in (("1u", "1 µA"), ("-1u", "−1 µA")):
        # Held at 160 kPa until the reset at 40 ms.
        dac = str(2.46)
        wave = sequence(f"reset, {name}", running, "PWL(0 1 40m 1 40.001m 0)", dac, leak, 60.0)
        before = [row[1] for row in wave if 0.038 < row[0] < 0.0399]
        after = [row[1] for row in wave if row[0] > 0.0405]
        rows.append(spread("reset from 160 kPa: before", before, 7.9, 8.1, "V"))
        rows.append(spread(f"reset from 160 kPa, pin leaks {name}: 0.5 ms after and on", after, -0.05, 0.05, "V"))
        off = next(row[0] for row in wave if row[0] > 0.0401 and row[1] < 0.05)
        rows.append(
            spread(f"reset from 160 kPa, pin leaks {name}: below 50 mV after", [1e6 * (off - 0.040)], 0.0, 500.0, "µs")
        )
    rows += brown_out() + dips() + step()
    return rows


def step() -> list[Row]:
    """From nothing to 10 V, with 10 nF of cable: 5 kPa too much are 0.25 V."""
    running = f"V24 V24_IN 0 24\nVA AREF 0 {AREF}\n"
    dac = f"PULSE(0 {SCALE['command_full_scale_v']} 40m 1u 1u 10 20)"
    wave = sequence("step", running, "1", dac, "0", 60.0, "CCABLE CMD_OUT 0 10n\n")
    there = next(row[0] for row in wave if row[0] > 0.040 and row[1] > 9.9)
    return [
        spread("command, step to 10 V with 10 nF of cable: most", [max(row[1] for row in wave)], 9.9, 10.25, "V"),
        spread("command, step to 10 V with 10 nF of cable: 9.9 V after", [1e6 * (there - 0.040)], 0.0, 1_000.0, "µs"),
    ]


def brown_out() -> list[Row]:
    """The 3.3 V rail sags from 40 ms on, at 200 kPa. The supervisor (APX803-29: 2.93 V) resets the chip."""
    sag = "PWL(0 3.3 40m 3.3 48m 0)"
    fall_at = 40e-3 + 8e-3 * (1.0 - 2.93 / 3.3)
    on = f"PWL(0 1 {fall_at:.6f} 1 {fall_at + 20e-6:.6f} 0)"
    # The converter's output is a share of the rail.
    wave = sequence("brown-out", f"V24 V24_IN 0 24\nVA AREF 0 {sag}\n", on, f"{sag.replace('3.3', '3.0')}", "1u", 80.0)
    lowest = [row[1] for row in wave if 0.040 < row[0] < fall_at]
    after = [row[1] for row in wave if row[0] > fall_at + 0.5e-3]
    return [
        spread("brown-out at 200 kPa: command until the reset", lowest, 8.5, 10.1, "V"),
        spread("brown-out at 200 kPa: 0.5 ms after the reset and on", after, -0.05, 0.05, "V"),
    ]


def dips() -> list[Row]:
    """24 V goes and comes back while 120 kPa are held, the 3.3 V from USB."""
    supplies = f"V24 V24_IN 0 PWL(0 24 40m 24 41m 0 80m 0 81m 24)\nVA AREF 0 {AREF}\n"
    wave = sequence("24 V dips", supplies, "1", "1.921", "0", 140.0)
    held = [row[1] for row in wave if 0.038 < row[0] < 0.040]
    return [
        spread("24 V dips at 120 kPa: before", held, 5.9, 6.1, "V"),
        spread(
            "24 V dips at 120 kPa: most from then on", [max(row[1] for row in wave if row[0] > 0.040)], 5.9, 6.25, "V"
        ),
    ]


def monitor_sample(n: int) -> tuple[float, float, float]:
    """Pressure told at 0 and 120 kPa, and volts of supply told at 24, less what is right."""
    random = Random(f"monitor {n}")
    board = varied(netlist(["monitor and supply"]), random, random.choice(KELVIN))
    # BAS70 data sheet: 100 nA at most at 50 V, either diode. What the chip's pin leaks, up to 1 µA and 1.4 kPa, is in the
    # limits of boards/README.md.
    leak = random.uniform(-100e-9, 100e-9)
    found = []
    for volts in (0.0, 6.0):
        bench = f"VM MON_IN 0 {volts}\nV24 V24 0 24\nV33 V3V3 0 3.3\nIL 0 MONITOR {leak:.4g}\n.control\nop\nprint v(MONITOR) v(SUPPLY)\n.endc"
        said = measured(run(deck(f"monitor, sample {n}", board, bench)))
        found.append(said["v(monitor)"] * 200.0 / SCALE["monitor_full_scale_v"] - volts * KPA_PER_V)
    return found[0], found[1], said["v(supply)"] * SCALE["supply_divider"] - 24.0


def monitor(each: Each) -> list[Row]:
    boards = each(monitor_sample, [(n,) for n in range(SAMPLES // 2)])
    zero, at_120, supply = (list(column) for column in zip(*boards, strict=True))
    return [
        spread("monitor at 0 kPa, off by", zero, -0.5, 0.5, "kPa"),
        spread("monitor at 120 kPa, off by", at_120, -1.0, 1.0, "kPa"),
        spread("supply at 24 V, off by", supply, -0.75, 0.75, "V"),
    ]


def inputs(_: Each) -> list[Row]:
    """A PLC's 0 is at most 5 V, its 1 at least 15 V (IEC 61131-2, type 1). The chip: 0.3 and 0.7 of 3.3 V."""
    rows = []
    circuit = [part for part in netlist(["24 V inputs"]) if "GRIP" in "".join(part.nets) or part.name == "U501A"]
    for volts, ctr, least, most in (
        (5.0, 4.0, 2.31, 3.3),
        (5.0, 0.5, 2.31, 3.3),
        (15.0, 0.5, 0.0, 0.99),
        (30.0, 0.5, 0.0, 0.99),
    ):
        board = [part.told(f"ctr={ctr}") if part.model == "OPTO" else part for part in circuit]
        bench = f"VI GRIP_24V IN_0V {volts}\nRG IN_0V 0 1\nV33 V3V3 0 3.3\n.control\nop\nprint v(GRIP) i(VI)\n.endc"
        said = measured(run(deck(f"input at {volts} V", board, bench)))
        rows.append(
            spread(
                f"input at {volts:.0f} V, transfer ratio {100 * ctr:.0f} %: the chip's pin",
                [said["v(grip)"]],
                least,
                most,
                "V",
            )
        )
    bench = "VI GRIP_24V IN_0V -24\nRG IN_0V 0 1\nV33 V3V3 0 3.3\n.control\nop\nprint v(GRIP_LED,IN_0V)\n.endc"
    said = measured(run(deck("input reversed", circuit, bench)))
    rows.append(spread("input at −24 V: across the optocoupler's diode", list(said.values())[:1], -5.0, 0.0, "V"))
    return rows


# What touches a pin: 24 V through a wire, or 150 pF charged to 8 kV through 330 Ω (IEC 61000-4-2, by contact).
WIRE = "VX X 0 {volts}\nRX X HIT 0.1\n"
SPARK = "VX X 0 8k\nRX X SPARK 1g\nCX SPARK 0 150p\nRH SPARK HIT 330\n"
TOUCH = "SX HIT {net} GO 0 TOUCH\nVGO GO 0 PULSE(0 1 1m 1n 1n 1 2)\n.model TOUCH SW(Ron=10m Roff=1t Vt=0.5)\n"
LONG, SHORT = ".control\ntran 20u 4m\n.endc", ".control\ntran 1n 1.002m 0.9995m 1n\n.endc"


def touched(circuit: list[Part], around: str, net: str, hit: str, nodes: list[str]) -> list[list[float]]:
    """The named nodes while something touches a net."""
    until = SHORT if hit == SPARK else LONG
    return waves(deck(f"{net} touched", circuit, around + hit + TOUCH.format(net=net) + until), nodes)


def most_ma(circuit: list[Part], around: str, net: str, hit: str, through: str) -> float:
    """The highest current in a resistor."""
    part = next(part for part in circuit if part.name == through)
    wave = touched(circuit, around, net, hit, [f"v({node})" for node in part.nets])
    return max(abs(1e3 * (row[1] - row[2]) / part.number()) for row in wave)


def survival(_: Each) -> list[Row]:
    """24 V and sparks on each pin of a connector: what then reaches the chips, against what they bear."""
    upper, lower = bridge(0.0)
    gauge, analogue = list(gauge_circuit()), netlist(["command", "monitor and supply"])
    bridged = SUPPLIES.format(aref=AREF) + f"RU EXC1 SIG1 {upper}\nRL SIG1 0 {lower}\n"
    powered = f"VA AREF 0 {AREF}\nV33 V3V3 0 {AREF}\nV24 V24 0 24\nV12 V12 0 12\nVD COMMAND 0 1\n"
    # Data sheets: INA333 10 mA; MCP6024 2 mA into an input, 30 mA an output; TLV9301 10 mA into an input, and it limits
    # its output to 60 mA; the chip (DS9405): 4 V, and −0.3 V or 5 mA.
    resistors = (
        ("gauge's SIG", gauge, bridged, "SIG1", "R104", "amplifier's input", 10.0),
        ("gauge's EXC", gauge, bridged, "EXC1", "R102", "follower's input", 2.0),
        ("gauge's EXC", gauge, bridged, "EXC1", "R101", "follower's output", 30.0),
        ("command", analogue, powered + "RM MON_IN 0 1k\n", "CMD_OUT", "R405", "amplifier's input", 10.0),
        ("command", analogue, powered + "RM MON_IN 0 1k\n", "CMD_OUT", "R406", "amplifier's output", 60.0),
    )
    rows = []
    for name, hit in (("24 V", WIRE.format(volts=24)), ("−24 V", WIRE.format(volts=-24)), ("8 kV", SPARK)):
        for pin, circuit, around, net, through, what, most in resistors:
            found = most_ma(circuit, around, net, hit, through)
            rows.append(spread(f"{name} on the {pin}: into the {what}", [found], 0.0, most, "mA"))
        wave = touched(analogue, powered + "RM MON_IN 0 10k\n", "MON_IN", hit, ["v(MONITOR)", "v(MON_IN)"])
        rows.append(spread(f"{name} on the monitor: the chip's pin", [row[1] for row in wave], -0.4, 4.0, "V"))
        injected = [1e3 * (row[2] - row[1]) / 69.8e3 for row in wave]
        rows.append(spread(f"{name} on the monitor: into the chip's pin", injected, -5.0, 5.0, "mA"))
    return rows


def supply(_: Each) -> list[Row]:
    """24 V plugged in hot, reversed, and a surge of 60 V. The capacitors are for 50 V, all other parts behind for more."""
    rows = []
    load = "RB V24 0 100\n"
    for name, source, least, most in (
        ("hot plug through 0.1 Ω and 2 µH", "PULSE(0 24 1m 1u 1u 1 2)", 0.0, 32.0),
        ("reversed", "PULSE(0 -24 1m 1u 1u 1 2)", -0.5, 0.5),
        ("60 V through 2 Ω for 1 ms", "PWL(0 24 5m 24 5.01m 60 6m 60 6.01m 24)", 0.0, 50.0),
    ):
        ohms = "2" if "60 V" in name else "0.1"
        bench = (
            f"VI A 0 {source}\nRI A B {ohms}\nLI B V24_IN 2u\nVA AREF 0 3.3\n"
            + load
            + ".control\ntran 2u 12m uic\n.endc"
        )
        wave = waves(deck(name, netlist(["power"]), bench), ["v(V24)"])
        rows.append(spread(f"24 V in, {name}: inside", [row[1] for row in wave], least, most, "V"))
    return rows


def nominal(_: Each) -> list[Row]:
    """The simulator agrees with the closed forms that the firmware's constants come from, and an operating point is what
    the circuit settles to."""
    rows = []
    for strain in (-20_000.0, 0.0, 20_000.0):
        upper, lower = bridge(strain)
        wires = SUPPLIES.format(aref=AREF) + f"RU EXC1 SIG1 {upper}\nRL SIG1 0 {lower}\n"
        said = measured(run(deck("nominal", list(gauge_circuit()), wires + ".control\nop\nprint v(GAUGE1)\n.endc")))[
            "v(gauge1)"
        ]
        later = measured(
            run(
                deck(
                    "settled",
                    list(gauge_circuit()),
                    wires + ".control\ntran 20u 60m uic\nmeas tran v find v(GAUGE1) at=59m\n.endc",
                )
            )
        )["v"]
        right = SCALE["gauge_zero_v"] + strain / UE_PER_V
        rows.append(
            spread(
                f"gauge at {strain:.0f} µε, less the firmware's",
                [1e3 * (said - right), 1e3 * (later - right)],
                -2.0,
                2.0,
                "mV",
            )
        )
    return rows


EXPERIMENTS: dict[str, Callable[[Each], list[Row]]] = {
    "nominal": nominal,
    "gauges": gauges,
    "bandwidth": bandwidth,
    "command": command,
    "starts": starts,
    "monitor": monitor,
    "inputs": inputs,
    "survival": survival,
    "supply": supply,
}
