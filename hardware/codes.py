"""What the converter shows of a fault, tick by tick: `codes/NAME.csv`, which `tests/host/shield.rs` runs through the
controller.

A file begins where the fault does. Codes are those of 16 bits, left-aligned, mean of a tick.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from circuit import Part
from experiments import SUPPLIES, Each, gauge_circuit
from front_end import AREF, bridge
from spice import deck, netlist, waves

FOLDER = Path(__file__).parent / "codes"
TICKS = 40
# Everything has settled by then, ms.
BEGINS_MS = 60
# Two versions of ngspice choose other time steps. One step of the converter is 16.
TOLERANCE = 48

# A wire that opens, or a short that comes, when the fault does.
SWITCHES = """
VNOT NOT 0 PULSE(1 0 {at}m 1u 1u 10 20)
VNOW NOW 0 PULSE(0 1 {at}m 1u 1u 10 20)
.model CONTACT SW(Ron=10m Roff=100g Vt=0.5)
"""
WHOLE, BROKEN, SHORT = "RW{n} {a} {b} 10m", "SW{n} {a} {b} NOT 0 CONTACT", "SW{n} {a} {b} NOW 0 CONTACT"


@dataclass(frozen=True)
class Scenario:
    """A gauge's cable: wires that break, pairs that touch, or ends that are swapped from the start; and its strain, µε, by
    ms since the fault begins."""

    name: str
    breaks: tuple[str, ...] = ()
    touches: tuple[tuple[str, str], ...] = ()
    swapped: tuple[str, str] | None = None
    strain: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    # The reference at the shield, V, from the fault on.
    aref: float = AREF


SCENARIOS = (
    Scenario("gauge-open-sig", breaks=("SIG1",)),
    Scenario("gauge-open-exc", breaks=("EXC1",)),
    Scenario("gauge-open-gnd", breaks=("GND",)),
    Scenario("gauge-unplugged", breaks=("SIG1", "EXC1", "GND")),
    Scenario("gauge-short-sig-exc", touches=(("SIG1", "EXC1"),)),
    Scenario("gauge-short-sig-gnd", touches=(("SIG1", "GND"),)),
    Scenario("gauge-short-exc-gnd", touches=(("EXC1", "GND"),)),
    Scenario("gauge-swapped-sig-exc", swapped=("SIG1", "EXC1")),
    Scenario("gauge-swapped-sig-gnd", swapped=("SIG1", "GND")),
    # A step, and it stays.
    Scenario("gauge-beyond-scale", strain=((0.0, 0.0), (1.0, 23_000.0))),
    # As a finger that snaps free and swings: there and back.
    Scenario("gauge-swings-beyond-scale", strain=((0.0, 17_000.0), (6.0, 24_000.0), (12.0, 17_000.0))),
    Scenario("reference-lost", aref=0.0),
)


def gauge(scenario: Scenario) -> list[float]:
    """Mean volts of each tick at the gauge's pin."""
    ends = {"EXC1": "EXC1", "SIG1": "SIG1", "GND": "0"}
    if scenario.swapped:
        one, other = scenario.swapped
        ends[one], ends[other] = ends[other], ends[one]
    lines = []
    for n, wire in enumerate(("EXC1", "SIG1", "GND")):
        form = BROKEN if wire in scenario.breaks else WHOLE
        lines.append(form.format(n=n, a=ends[wire], b=f"FAR{wire}"))
    for n, (a, b) in enumerate(scenario.touches, 3):
        lines.append(SHORT.format(n=n, a=ends[a], b=ends[b]))
    points = [(BEGINS_MS + ms, ue) for ms, ue in scenario.strain]
    steps = " ".join(f"{ms}m {ue}" for ms, ue in [(0.0, points[0][1]), *points])
    upper, lower = bridge(1.0)
    more, less = lower - 1000.0, upper - 1000.0
    lines += [
        f"VUE UE 0 PWL({steps})",
        f"BU FAREXC1 FARSIG1 I = v(FAREXC1,FARSIG1)/(1000 + {less:.9g}*v(UE))",
        f"BL FARSIG1 FARGND I = v(FARSIG1,FARGND)/(1000 + {more:.9g}*v(UE))",
    ]
    supplies = SUPPLIES.format(aref=AREF)
    if scenario.aref != AREF:
        # The shield's AREF pin comes off; the chip's reference does not.
        supplies = supplies.replace("VA AREF", "VA BOARD") + "SA BOARD AREF NOT 0 CONTACT\nRA AREF 0 1meg\n"
    return ticks(list(gauge_circuit()), supplies + "\n".join(lines), "GAUGE1")


def monitor(volts: str, broken: bool) -> list[float]:
    """Mean volts of each tick at the monitor's pin, where its wire breaks or carries something else."""
    wire = BROKEN if broken else WHOLE
    around = f"V33 V3V3 0 {AREF}\nV24 V24 0 24\nVM FAR 0 {volts}\n" + wire.format(n=0, a="FAR", b="MON_IN")
    return ticks(netlist(["monitor and supply"]), around, "MONITOR")


def supply(_: str) -> list[float]:
    """24 V that fails: mean volts of each tick at the supply's pin."""
    around = f"V33 V3V3 0 {AREF}\nRM MON_IN 0 1k\nVS V24 0 PWL(0 24 {BEGINS_MS}m 24 {BEGINS_MS + 1}m 15)"
    return ticks(netlist(["monitor and supply"]), around, "SUPPLY")


def ticks(circuit: list[Part], around: str, net: str) -> list[float]:
    bench = (
        around
        + SWITCHES.format(at=BEGINS_MS)
        + f".control\ntran 20u {BEGINS_MS + TICKS}m 0 20u\nlinearize v({net})\n.endc"
    )
    wave = waves(deck(net, circuit, bench), [f"v({net})"])
    means = []
    for tick in range(TICKS):
        begin = 1e-3 * (BEGINS_MS + tick)
        inside = [volts for time, volts in wave if begin - 1e-9 <= time < begin + 1e-3 - 1e-9]
        means.append(sum(inside) / len(inside))
    return means


def code(volts: float) -> int:
    """As 12 bits, left-aligned."""
    return min(max(int(volts / AREF * 4096.0), 0), 4095) * 16


# A monitor at 140 kPa: its wire breaks, or 24 V get on it.
OTHERS: tuple[tuple[str, Callable[..., list[float]], tuple[str | bool, ...]], ...] = (
    ("monitor-open", monitor, ("7", True)),
    ("monitor-24v", monitor, (f"PULSE(7 24 {BEGINS_MS}m 1u 1u 10 20)", False)),
    ("supply-fails", supply, ("",)),
)


def named(name: str) -> tuple[str, list[int]]:
    for scenario in SCENARIOS:
        if scenario.name == name:
            return name, [code(volts) for volts in gauge(scenario)]
    other, make, arguments = next(found for found in OTHERS if found[0] == name)
    return other, [code(volts) for volts in make(*arguments)]


def simulated(each: Each) -> dict[str, list[int]]:
    names = [scenario.name for scenario in SCENARIOS] + [name for name, _, _ in OTHERS]
    return dict(each(named, [(name,) for name in names]))


def write(each: Each) -> list[str]:
    FOLDER.mkdir(exist_ok=True)
    for name, found in simulated(each).items():
        rows = "".join(f"{tick},{value}\n" for tick, value in enumerate(found))
        (FOLDER / f"{name}.csv").write_text("tick,code\n" + rows)
    return []


def differ(each: Each) -> list[str]:
    """Which files are not what the circuit shows."""
    wrong = []
    for name, found in simulated(each).items():
        file = FOLDER / f"{name}.csv"
        lines = file.read_text().splitlines()[1:] if file.exists() else []
        kept = [int(line.split(",")[1]) for line in lines]
        off = max((abs(a - b) for a, b in zip(kept, found, strict=False)), default=0)
        if len(kept) != len(found) or off > TOLERANCE:
            wrong.append(f"hardware/codes/{name}.csv is off by {off} codes: run hardware/simulate codes --write")
    return wrong
