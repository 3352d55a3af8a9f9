"""What a part is: its pins as KiCad wants them, and the values that are computed with."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Pin:
    """A pin of one unit: number in the package, name, electrical type of KiCad, side of the symbol."""

    number: str
    name: str
    type: str = "passive"
    side: str = "L"


@dataclass(frozen=True)
class Kind:
    """A symbol. `units`: the pins of each unit of a package."""

    units: tuple[tuple[Pin, ...], ...]
    prefix: str


def _pins(text: str) -> tuple[Pin, ...]:
    """`NUMBER:NAME:TYPE:SIDE`, each but the name may be left out from the end."""
    return tuple(Pin(*item.split(":")) for item in text.split())


def _two(prefix: str, one: str = "1", two: str = "2") -> Kind:
    return Kind((_pins(f"1:{one}:passive:L 2:{two}:passive:R"),), prefix)


def _row(prefix: str, count: int) -> Kind:
    return Kind((_pins(" ".join(f"{n}:{n}" for n in range(1, count + 1))),), prefix)


_QUAD = "{p}:+:input:L {n}:-:input:L {o}:OUT:output:R"

KINDS: dict[str, Kind] = {
    "R": _two("R"),
    "C": _two("C"),
    "L": _two("L"),
    "F": _two("F"),
    # Anode first, as in SPICE; KiCad's diodes have their cathode at pin 1.
    "D": Kind((_pins("2:A:passive:L 1:K:passive:R"),), "D"),
    "TVS": _two("D"),
    "DIVIDER": Kind((_pins("1:A:passive:L 3:MID:passive:R 2:B:passive:L"),), "RN"),
    # BAS70-04: two in series, the middle is pin 3.
    "CLAMP": Kind((_pins("1:A:passive:L 3:MID:passive:R 2:K:passive:L"),), "D"),
    "NPN": Kind((_pins("1:B:input:L 2:C:passive:R 3:E:passive:R"),), "Q"),
    "PMOS": Kind((_pins("1:G:input:L 2:D:passive:L 3:S:passive:R"),), "Q"),
    "OPAMP": Kind((_pins("3:+:input:L 4:-:input:L 1:OUT:output:R 5:V+:power_in:R 2:V-:power_in:R"),), "U"),
    "OPAMP4": Kind(
        (
            _pins(_QUAD.format(p=3, n=2, o=1)),
            _pins(_QUAD.format(p=5, n=6, o=7)),
            _pins(_QUAD.format(p=10, n=9, o=8)),
            _pins(_QUAD.format(p=12, n=13, o=14)),
            _pins("4:V+:power_in:L 11:V-:power_in:R"),
        ),
        "U",
    ),
    "INA": Kind(
        (
            _pins(
                "3:IN+:input:L 2:IN-:input:L 1:RG1:passive:L 8:RG2:passive:L "
                "6:OUT:output:R 5:REF:input:R 7:V+:power_in:R 4:V-:power_in:R"
            ),
        ),
        "U",
    ),
    "OPTO4": Kind(
        (
            _pins("1:A:passive:L 2:K:passive:L 16:C:open_collector:R 15:E:passive:R"),
            _pins("3:A:passive:L 4:K:passive:L 14:C:open_collector:R 13:E:passive:R"),
            _pins("5:A:passive:L 6:K:passive:L 12:C:open_collector:R 11:E:passive:R"),
            _pins("7:A:passive:L 8:K:passive:L 10:C:open_collector:R 9:E:passive:R"),
        ),
        "U",
    ),
    "RELAY": Kind((_pins("1:A:passive:L 2:K:passive:L 4:S1:passive:R 3:S2:passive:R"),), "U"),
    "RS485": Kind(
        (
            _pins(
                "1:R:output:L 2:~RE:input:L 3:DE:input:L 4:D:input:L "
                "8:VCC:power_in:R 6:A:bidirectional:R 7:B:bidirectional:R 5:GND:power_in:R"
            ),
        ),
        "U",
    ),
    "RESET": Kind((_pins("3:VCC:power_in:L 1:GND:power_in:L 2:~RESET:open_collector:R"),), "U"),
    "BUCK": Kind(
        (_pins("5:VIN:power_in:L 4:~SHDN:input:L 2:GND:power_in:L 1:CB:passive:R 6:SW:passive:R 3:FB:input:R"),),
        "U",
    ),
    "X1": _row("J", 1),
    "X2": _row("J", 2),
    "X3": _row("J", 3),
    "X4": _row("J", 4),
    "X5": _row("J", 5),
    "X6": _row("J", 6),
    "X8": _row("J", 8),
    "X10": _row("J", 10),
}

EVERY, F429ZI, G474RE, NOT_FITTED = "every", "F429ZI", "G474RE", "not fitted"


@dataclass(frozen=True)
class Part:
    """One unit of one part. `nets` follow the pins of its kind; "" is not connected."""

    block: str
    ref: str
    kind: str
    value: str
    nets: tuple[str, ...]
    mpn: str
    alternatives: tuple[str, ...] = ()
    footprint: str = ""
    # Share, and its change per kelvin.
    tolerance: float = 0.0
    per_kelvin: float = 0.0
    # Name of its SPICE model; without one it is not simulated.
    model: str = ""
    unit: int = 1
    fit: str = EVERY
    note: str = ""

    @property
    def name(self) -> str:
        """Reference with the unit's letter, where there are several."""
        return self.ref + ("ABCDE"[self.unit - 1] if len(KINDS[self.kind].units) > 1 else "")

    @property
    def pins(self) -> tuple[Pin, ...]:
        return KINDS[self.kind].units[self.unit - 1]

    def number(self) -> float:
        return number(self.value.split()[0])

    def of(self, value: float) -> Part:
        """The same part with another value."""
        return replace(self, value=f"{value:.9g}")

    def told(self, parameters: str) -> Part:
        """The same part whose model has these parameters as well."""
        return replace(self, value=f"{self.value} {parameters}")


def number(text: str) -> float:
    """`4.7k` → 4700.0."""
    scale = {"p": 1e-12, "n": 1e-9, "u": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6}
    return float(text[:-1]) * scale[text[-1]] if text[-1] in scale else float(text)
