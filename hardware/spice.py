"""From parts to ngspice, and back: numbers by name."""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from random import Random

from circuit import Part
from shield import parts

HERE = Path(__file__).parent
MODELS = (HERE / "models.cir").read_text()


def cards(part: Part) -> list[str]:
    """The lines of one part."""
    name, nets = part.name.replace("+", "p"), [("0" if net == "GND" else net) for net in part.nets]
    two = " ".join(nets)
    match part.model:
        case "R":
            return [f"R{name} {two} {part.number():.9g}"]
        case "C":
            return [f"C{name} {two} {part.number():.9g}"]
        case "DIVIDER":
            top, middle, bottom = nets
            half = part.number()
            off = float(parameters(part).removeprefix("ratio=") or 0.0)
            return [f"R{name}a {top} {middle} {half * (1.0 + off):.9g}", f"R{name}b {middle} {bottom} {half:.9g}"]
        case "BAS70":
            low, middle, high = nets
            return [f"D{name}a {low} {middle} DBAS70", f"D{name}b {middle} {high} DBAS70"]
        case "TVS26" | "TVS33" | "ESD24":
            # Two diodes against each other: one breaks through, the other conducts.
            one, other = nets
            model = f"D{part.model}"
            return [f"D{name}a {name}m {one} {model}", f"D{name}b {name}m {other} {model}"]
        case "1N4148" | "C12" | "C13" | "TVS6" | "TVS13":
            return [f"D{name} {two} D{part.model}"]
        case "NPN":
            base, collector, emitter = nets
            return [f"Q{name} {collector} {base} {emitter} QNPN"]
        case "PMOS":
            gate, drain, source = nets
            return [f"M{name} {drain} {gate} {source} {source} MPMOS"]
        case "RRIO5" | "RRO12" | "INA" | "OPTO":
            return [f"X{name} {two} {part.model} {parameters(part)}".rstrip()]
    return []


def parameters(part: Part) -> str:
    """`value` of a model's instance: its name as on the schematic, or `name key=number …`."""
    _, *given = part.value.split()
    return " ".join(given)


# The converter to 8 V is not simulated, nor what is around it.
NOT_SIMULATED = {"BOOST", "SWITCH", "BUCK_FB", "VIN"}


def netlist(blocks: Iterable[str] | None = None) -> list[Part]:
    """The simulated parts of some blocks, or of all."""
    wanted = None if blocks is None else set(blocks)
    return [
        part
        for part in parts()
        if part.model and not NOT_SIMULATED & {*part.nets} and (wanted is None or part.block in wanted)
    ]


def with_gains(circuit: list[Part]) -> list[Part]:
    """Each amplifier is told the resistor at its gain pins."""
    ohms = {part.nets: part.number() for part in circuit if part.kind == "R"}
    told = []
    for part in circuit:
        if part.model == "INA":
            gain = 1.0 + 100e3 / ohms[part.nets[2], part.nets[3]]
            part = part.told(f"gain={gain:.9g}")
        told.append(part)
    return told


def varied(circuit: list[Part], random: Random, kelvin: float = 0.0, wild: float = 1.0) -> list[Part]:
    """Every part somewhere in its tolerance, and at so many kelvin from 25 °C. `random` gives the same part the same
    place at every temperature, so hand in one of the same seed. `wild` is 0 for drift alone."""
    found = []
    for part in circuit:
        place, slope = random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)
        match part.model:
            case "R" | "C" | "DIVIDER":
                factor = 1.0 + wild * part.tolerance * place
                part = part.of(part.number() * factor * (1.0 + part.per_kelvin * slope * kelvin))
                if part.model == "DIVIDER":
                    # MPMT data sheet: the ratio of the two is good for 0.05 % and 5 ppm/K.
                    off = wild * 5e-4 * random.uniform(-1.0, 1.0) + 5e-6 * slope * kelvin
                    part = part.told(f"ratio={off:.6g}")
            case "INA":
                # INA333 data sheet, at a gain of 18: offset ±(25 + 75/G) uV, drift ±(0.1 + 0.5/G) uV/K, gain ±0.25 %.
                offset = 1e-6 * (29.0 * wild * place + 0.13 * slope * kelvin)
                part = part.told(f"vos={offset:.6g} error={wild * part.tolerance * random.uniform(-1.0, 1.0):.6g}")
            case "RRIO5":
                # MCP6024 data sheet: ±0.5 mV, ±3.5 uV/K.
                part = part.told(f"vos={1e-3 * 0.5 * wild * place + 3.5e-6 * slope * kelvin:.6g}")
            case "RRO12":
                # TLV9301 data sheet: ±2.5 mV, ±2 uV/K; 1 to 30 mV above ground without a load.
                low = random.uniform(1e-3, 30e-3)
                part = part.told(f"vos={1e-3 * 2.5 * wild * place + 2e-6 * slope * kelvin:.6g} lo={low:.6g}")
            case "OPTO":
                # TLP291-4 data sheet, rank GB: 100 to 400 %, half of it when old.
                part = part.told(f"ctr={random.uniform(0.5, 4.0):.6g}")
        found.append(part)
    return found


# Nets that several copies of a circuit share.
SHARED = ("GND", "AREF", "V5", "V3V3")


def copied(circuit: list[Part], suffix: str) -> list[Part]:
    """The circuit once more, beside itself."""

    def net(name: str) -> str:
        return name if name in SHARED else name + suffix

    return [replace(part, ref=part.ref + suffix, nets=tuple(map(net, part.nets))) for part in circuit]


def deck(title: str, circuit: list[Part], bench: str) -> str:
    """A whole input file: parts, what stands around them, models."""
    lines = [line for part in with_gains(circuit) for line in cards(part)]
    return "\n".join([f"* {title}", MODELS, *lines, bench, ".end", ""])


class Failed(Exception):
    """ngspice could not."""


def run(text: str) -> str:
    """What ngspice prints."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "deck.cir"
        # Without it a version that has nothing to plot says that it failed.
        file.write_text(text.replace(".endc", "quit 0\n.endc"))
        done = subprocess.run(
            ["ngspice", "-b", str(file)], capture_output=True, text=True, timeout=120, check=False, cwd=folder
        )
        said = done.stdout + done.stderr
        if done.returncode or re.search(r"(?i)aborted|^error|no such vector", said, re.M):
            raise Failed(f"{text.splitlines()[0]}\n{said[-3000:]}")
        return said


def measured(said: str) -> dict[str, float]:
    """All `name = number` of `.meas` and `print`."""
    return {name: float(value) for name, value in re.findall(r"^(\S+)\s*=\s*([-+0-9.eE]+)", said, re.M)}


def waves(text: str, nodes: list[str]) -> list[list[float]]:
    """Rows of time and the named values of a transient analysis, which the deck runs in a `.control` block."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "waves.txt"
        run(text.replace(".endc", f"wrdata {file} {' '.join(nodes)}\n.endc"))
        rows = [[float(cell) for cell in line.split()] for line in file.read_text().splitlines()]
    # `wrdata` repeats the time before each value.
    return [[row[0], *row[1::2]] for row in rows]
