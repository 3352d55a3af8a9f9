"""What the controller must know of the circuit: volts at the converters' pins."""

from __future__ import annotations

from circuit import Part
from shield import BOARDS, REVISION, SIGNALS, parts

# Both NUCLEO boards tie VREF+ to the 3.3 V rail.
AREF = 3.3
# Half bridge of two gauges of 1 kΩ and a gauge factor of 2, one stretched and one compressed.
GAUGE_OHMS, GAUGE_FACTOR = 1000.0, 2.0
FULL_SCALE_UE = 20_000.0
REGULATOR_KPA, REGULATOR_V = 200.0, 10.0
# Between what the amplifier can put out (INA333 data sheet: 50 mV from the rails) and 25 000 µε.
SHORT_BELOW_V, OPEN_ABOVE_V = 0.1, 3.2
MONITOR_HIGH_ABOVE_V = 3.2


def bridge(strain_ue: float) -> tuple[float, float]:
    """Upper and lower arm, Ω."""
    change = 1e-6 * GAUGE_FACTOR * strain_ue
    return GAUGE_OHMS * (1.0 - change), GAUGE_OHMS * (1.0 + change)


class Circuit:
    """Values by reference."""

    def __init__(self) -> None:
        self.parts: dict[str, Part] = {part.name: part for part in parts()}

    def __getitem__(self, ref: str) -> float:
        return self.parts[ref].number()

    def gauge_gain(self, gauge: int) -> float:
        """INA333 data sheet."""
        return 1.0 + 100e3 / self[f"R{gauge}06"]

    def gauge_v(self, gauge: int, strain_ue: float) -> float:
        """At the pin: the bridge's middle, which the pull-up lifts a little, against half the reference."""
        upper, lower = bridge(strain_ue)
        pull_up = self[f"R{gauge}03"]
        middle = (AREF / upper + AREF / pull_up) / (1.0 / upper + 1.0 / lower + 1.0 / pull_up)
        return AREF / 2.0 + self.gauge_gain(gauge) * (middle - AREF / 2.0)

    def command_gain(self) -> float:
        return 1.0 + self["R405"] / self["R403"] + self["R405"] / self["R404"]

    def command_dac_v(self, output_v: float) -> float:
        """What the converter puts out for so much at the connector."""
        return (output_v + AREF * self["R405"] / self["R404"]) / self.command_gain()


def constants() -> dict[str, float]:
    """The settings `front_end.*`, to a millivolt."""
    circuit = Circuit()
    zero = circuit.gauge_v(1, 0.0)
    span = circuit.gauge_v(1, FULL_SCALE_UE) - circuit.gauge_v(1, -FULL_SCALE_UE)
    monitor = REGULATOR_V * circuit["R412"] / (circuit["R411"] + circuit["R412"])
    values = {
        "gauge_zero_v": zero,
        "gauge_full_scale_v": span / 2.0,
        "gauge_full_scale_ue": FULL_SCALE_UE,
        "gauge_short_below_v": SHORT_BELOW_V,
        "gauge_open_above_v": OPEN_ABOVE_V,
        "monitor_full_scale_v": monitor,
        "monitor_high_above_v": MONITOR_HIGH_ABOVE_V,
        "supply_divider": (circuit["R421"] + circuit["R422"]) / circuit["R422"],
        "regulator_full_scale_kpa": REGULATOR_KPA,
        "command_full_scale_v": circuit.command_dac_v(REGULATOR_V),
        "command_zero_v": circuit.command_dac_v(0.0),
    }
    return {name: round(value, 3) for name, value in values.items()}


def toml() -> str:
    """`tests/host/shield.rs` compares this with the firmware."""
    lines = [
        "# Written by hardware/build from hardware/shield.py: what the firmware must agree with.",
        f'revision = "{REVISION}"',
        "",
        "[front_end]",
        *(f"{name} = {value}" for name, value in constants().items()),
    ]
    for at, (name, file, _) in enumerate(BOARDS):
        lines += ["", "[[board]]", f'name = "{name}"', f'file = "boards/{file}.rs"', "signals = ["]
        for signal, _, direction, *places in SIGNALS:
            header, pin = places[at]
            way = direction.split(",")[0]
            lines.append(f'    {{ name = "{signal}", way = "{way}", header = "{header}", pin = "{pin}" }},')
        lines.append("]")
    return "\n".join(lines) + "\n"
