"""The shield: every part with its nets, once for both boards. All else in this folder comes from here.

Numbers of parts: 1xx, 2xx, 3xx belong to gauge 1, 2, 3; 4xx command, monitor and supply; 5xx digital; 6xx power;
7xx RS-485 and reset; J are connectors.
"""

from __future__ import annotations

from circuit import F429ZI, G474RE, NOT_FITTED, Part, number

REVISION = "A1"

# Nets that reach everywhere.
RAILS = ("GND", "V24", "V12", "V5", "V3V3", "AREF", "MID")

E24 = tuple(f"{n}00" for n in "10 11 12 13 15 16 18 20 22 24 27 30 33 36 39 43 47 51 56 62 68 75 82 91".split())


def r(block: str, ref: str, value: str, a: str, b: str, percent: float = 1.0, **more: str) -> Part:
    """A resistor: 1 % and 100 ppm/K, or 0.1 % and 25 ppm/K, 0603."""
    exact = percent < 1.0
    plain, other = _resistor_numbers(value, exact)
    fit = more.pop("fit", "every")
    return Part(
        block, ref, "R", value, (a, b), more.pop("mpn", plain), (more.pop("other", other),),
        more.pop("footprint", "Resistor_SMD:R_0603_1608Metric"), percent / 100.0,
        25e-6 if exact else 100e-6, "R", fit=fit, note=more.pop("note", ""),
    )  # fmt: skip


def _resistor_numbers(value: str, exact: bool) -> tuple[str, str]:
    """Yageo RC and Vishay CRCW; Susumu RG and Panasonic ERA."""
    ohms = number(value)
    if ohms == 0.0:
        return "RC0603JR-070RL", "CRCW06030000Z0EA"
    if exact:
        digits = f"{ohms:.3e}"
        mantissa, power = digits.split("e")
        four = mantissa.replace(".", "")[:4]
        # Values of the E24 row have two digits and a power, the others three.
        code = f"{four[:2]}{int(power) - 1}" if four in E24 else f"{four[:3]}{int(power) - 2}"
        return f"RG1608P-{code}-B-T5", f"ERA-3AEB{code}V"
    letter, scaled = next((s, ohms / f) for s, f in (("M", 1e6), ("K", 1e3), ("R", 1.0)) if ohms >= f)
    short, long = f"{scaled:.3g}", f"{scaled:.3g}"
    short = short.replace(".", letter) if "." in short else short + letter
    long = (long if "." in long else long + ".") + "00"
    return f"RC0603FR-07{short}L", f"CRCW0603{long[:4].replace('.', letter)}FKEA"


CAPACITORS = {
    "1n": ("GRM1885C1H102JA01D", "CC0603JRNPO9BN102", "C_0603_1608Metric", 0.05),
    "10n": ("GRM1885C1H103JA01D", "C1608C0G1H103J080AA", "C_0603_1608Metric", 0.05),
    "100n": ("GRM188R71H104KA93D", "CC0603KRX7R9BB104", "C_0603_1608Metric", 0.10),
    "4.7u": ("GRM31CR71H475KA12L", "CL31B475KBHNNNE", "C_1206_3216Metric", 0.10),
    "22u": ("GRM31CR61E226KE15L", "CL31A226KAHNNNE", "C_1206_3216Metric", 0.10),
    "47u": ("EEE-FT1H470AP", "UCD1H470MNL1GS", "CP_Elec_6.3x7.7", 0.20),
}


def c(block: str, ref: str, value: str, a: str, b: str = "GND") -> Part:
    mpn, other, footprint, tolerance = CAPACITORS[value]
    return Part(block, ref, "C", value, (a, b), mpn, (other,), f"Capacitor_SMD:{footprint}", tolerance, model="C")


def diode(block: str, ref: str, nets: tuple[str, ...], model: str, kind: str = "D") -> Part:
    mpn, others, footprint = {
        "1N4148": ("1N4148W-7-F", ("1N4148WS-E3-08",), "Diode_SMD:D_SOD-123"),
        "BAS70": ("BAS70-04,215", ("BAS70-04-7-F", "BAS70-04-E3-08"), "Package_TO_SOT_SMD:SOT-23"),
        "C12": ("BZT52C12-7-F", ("BZT52C12-E3-08",), "Diode_SMD:D_SOD-123"),
        "C13": ("BZT52C13-7-F", ("BZT52C13-E3-08",), "Diode_SMD:D_SOD-123"),
        "TVS6": ("SMAJ6.0A", ("SMAJ6.0A-13-F",), "Diode_SMD:D_SMA"),
        "TVS13": ("SMAJ13A", ("SMAJ13A-13-F",), "Diode_SMD:D_SMA"),
        "TVS26": ("SMBJ26CA", ("SMBJ26CA-13-F",), "Diode_SMD:D_SMB"),
        "TVS33": ("SMAJ33CA", ("SMAJ33CA-13-F",), "Diode_SMD:D_SMA"),
        "ESD24": ("PESD24VL1BA,115", ("CDSOD323-T24C",), "Diode_SMD:D_SOD-323"),
        "SS16": ("SS16", ("B160-13-F",), "Diode_SMD:D_SMA"),
    }[model]
    return Part(block, ref, kind, mpn.split(",")[0], nets, mpn, others, footprint, model=model)


def ptc(block: str, ref: str, a: str, b: str, hold: str = "50 mA") -> Part:
    """Cold resistance between the data sheet's least and most after a trip; MC takes ±80 % of 28 Ω."""
    mpn, other, footprint = {
        "50 mA": ("1210L005WR", "MF-USMF005-2", "Fuse:Fuse_1210_3225Metric"),
        "1.1 A": ("1812L110/33MR", "MF-MSMF110/24X-2", "Fuse:Fuse_1812_4532Metric"),
    }[hold]
    ohms = "28" if hold == "50 mA" else "0.2"
    return Part(block, ref, "F", ohms, (a, b), mpn, (other,), footprint, 0.8, model="R", note=f"PTC, holds {hold}")


def connector(
    ref: str, value: str, nets: tuple[str, ...], mpn: str, other: str, footprint: str, fit: str = "every"
) -> Part:
    return Part("connectors", ref, f"X{len(nets)}", value, nets, mpn, (other,), footprint, fit=fit)


def terminal(ref: str, value: str, nets: tuple[str, ...]) -> Part:
    """Pluggable, 3.5 mm; the plug is Phoenix MC 1.5/n-ST-3.5."""
    n = len(nets)
    return connector(
        ref, value, nets, f"Phoenix MC 1,5/{n}-G-3,5", f"Wuerth 6913221100{n:02}",
        f"Connector_Phoenix_MC:PhoenixContact_MC_1,5_{n}-G-3.5_1x{n:02}_P3.50mm_Horizontal",
    )  # fmt: skip


def header(ref: str, value: str, nets: tuple[str, ...], fit: str = "every") -> Part:
    n = len(nets)
    return connector(
        ref, value, nets, f"Samtec SSQ-1{n:02}-03-T-S", f"Wuerth 613 0{n:02} 11 821",
        f"Connector_PinSocket_2.54mm:PinSocket_1x{n:02}_P2.54mm_Vertical", fit=fit,
    )  # fmt: skip


QUAD = ("MCP6024-I/SL", ("TLV9064IDR", "OPA4374AID"), "Package_SO:SOIC-14_3.9x8.7mm_P1.27mm")


def quad(block: str, unit: int, nets: tuple[str, ...]) -> Part:
    mpn, others, footprint = QUAD
    model = "RRIO5" if unit < 5 else ""
    return Part(block, "U1", "OPAMP4", "MCP6024", nets, mpn, others, footprint, model=model, unit=unit)


def reference() -> list[Part]:
    """Half of the converters' reference, and the gauges' supply from it, by a quad follower at 5 V."""
    b = "reference"
    return [
        Part(b, "RN1", "DIVIDER", "10k", ("AREF", "HALF", "GND"), "MPMT1002AT5", ("ACASA1002S1002P1AT",),
             "Package_TO_SOT_SMD:SOT-23", 0.001, 25e-6, "DIVIDER", note="pair: 0.05 %, 5 ppm/K between the two"),
        c(b, "C1", "100n", "HALF"),
        r(b, "R1", "1k", "AREF", "AREF_F"),
        c(b, "C2", "100n", "AREF_F"),
        quad(b, 1, ("HALF", "MID", "MID")),
        quad(b, 5, ("V5", "GND")),
        c(b, "C3", "100n", "V5"),
    ]  # fmt: skip


def gauge(n: int) -> list[Part]:
    """A half bridge's amplifier: supply with a limit, pull-up at the wire, gain 18.36 about half the reference."""
    b, p = f"gauge {n}", f"{n}"
    exc, sig, pin = f"EXC{n}", f"SIG{n}", f"GAUGE{n}"
    return [
        quad(b, n + 1, ("AREF_F", f"FB{n}", f"DRV{n}")),
        r(b, f"R{p}01", "220", f"DRV{n}", f"LIM{n}"),
        diode(b, f"D{p}01", ("GND", f"LIM{n}"), "TVS6"),
        ptc(b, f"F{p}01", f"LIM{n}", exc),
        r(b, f"R{p}02", "22k", exc, f"FB{n}"),
        c(b, f"C{p}01", "1n", f"DRV{n}", f"FB{n}"),
        c(b, f"C{p}02", "100n", exc),
        diode(b, f"D{p}02", (sig, "GND"), "ESD24", "TVS"),
        r(b, f"R{p}03", "2.2M", sig, "AREF"),
        r(b, f"R{p}04", "10k", sig, f"INP{n}"),
        r(b, f"R{p}05", "10k", "MID", f"INN{n}"),
        c(b, f"C{p}03", "1n", f"INP{n}"),
        c(b, f"C{p}04", "1n", f"INN{n}"),
        c(b, f"C{p}05", "10n", f"INP{n}", f"INN{n}"),
        r(b, f"R{p}06", "5.76k", f"RGA{n}", f"RGB{n}", 0.1),
        Part(b, f"U{p}01", "INA", "INA333", (f"INP{n}", f"INN{n}", f"RGA{n}", f"RGB{n}", f"AMP{n}", "MID", "V3V3", "GND"),
             "INA333AIDGKR", ("INA317IDGKR",), "Package_SO:VSSOP-8_3x3mm_P0.65mm", 0.0025, model="INA"),
        c(b, f"C{p}06", "100n", "V3V3"),
        r(b, f"R{p}07", "1k", f"AMP{n}", pin),
        c(b, f"C{p}07", "10n", pin),
    ]  # fmt: skip


def command() -> list[Part]:
    """0–10 V from the buffered converter: gain 3.71 less 0.34 of the reference, so that its lowest 0.3 V are 0 V."""
    b = "command"
    return [
        r(b, "R401", "10k", "COMMAND", "GND"),
        r(b, "R402", "1k", "COMMAND", "CMD_IN"),
        c(b, "C401", "1n", "CMD_IN"),
        Part(b, "U401", "OPAMP", "TLV9301", ("CMD_IN", "CMD_FB", "CMD_DRV", "V12", "GND"), "TLV9301IDBVR",
             ("OPA197IDBVR", "OPA192IDBVR"), "Package_TO_SOT_SMD:SOT-23-5", model="RRO12"),
        r(b, "R403", "8.45k", "CMD_FB", "GND", 0.1),
        r(b, "R404", "59k", "CMD_FB", "AREF", 0.1),
        r(b, "R405", "20k", "CMD_OUT", "CMD_FB", 0.1),
        c(b, "C402", "1n", "CMD_DRV", "CMD_FB"),
        r(b, "R406", "220", "CMD_DRV", "CMD_LIM"),
        diode(b, "D401", ("GND", "CMD_LIM"), "TVS13"),
        ptc(b, "F401", "CMD_LIM", "CMD_OUT"),
        r(b, "R407", "10k", "CMD_OUT", "GND"),
        diode(b, "D402", ("CMD_OUT", "GND"), "ESD24", "TVS"),
        c(b, "C403", "100n", "V12"),
    ]  # fmt: skip


def monitor() -> list[Part]:
    b = "monitor and supply"
    return [
        diode(b, "D405", ("MON_IN", "GND"), "ESD24", "TVS"),
        r(b, "R411", "69.8k", "MON_IN", "MONITOR", 0.1),
        r(b, "R412", "30k", "MONITOR", "GND", 0.1),
        c(b, "C411", "100n", "MONITOR"),
        diode(b, "D403", ("GND", "MONITOR", "V3V3"), "BAS70", "CLAMP"),
        r(b, "R421", "100k", "V24", "SUPPLY"),
        r(b, "R422", "10k", "SUPPLY", "GND"),
        c(b, "C421", "100n", "SUPPLY"),
        diode(b, "D404", ("GND", "SUPPLY", "V3V3"), "BAS70", "CLAMP"),
    ]


INPUTS = ("GRIP", "RELEASE", "STOP", "ACK")
OUTPUTS = ("READY", "HOLDING", "LOST", "FAULT")


def digital_input(at: int, name: str) -> list[Part]:
    """On above some 8 V: the shunt takes what 3 V would give the diode."""
    b, p = "24 V inputs", 50 + at
    wire, lamp = f"{name}_24V", f"{name}_LED"
    return [
        r(b, f"R{p}1", "4.7k", wire, lamp, mpn="RC1206FR-074K7L", other="CRCW12064K70FKEA",
          footprint="Resistor_SMD:R_1206_3216Metric"),
        r(b, f"R{p}2", "1.5k", lamp, "IN_0V"),
        diode(b, f"D{p}1", ("IN_0V", lamp), "1N4148"),
        Part(b, "U501", "OPTO4", "TLP291-4", (lamp, "IN_0V", name, "GND"), "TLP291-4(GB,E", ("LTV-247",),
             "Package_SO:SOIC-16_4.55x10.3mm_P1.27mm", model="OPTO", unit=at),
        r(b, f"R{p}3", "4.7k", "V3V3", name),
    ]  # fmt: skip


def digital_output(at: int, name: str) -> list[Part]:
    """A photo relay switches 24 V; 10 kΩ keep it off while a pin of the chip is pulled up in reset."""
    b, p = "24 V outputs", 54 + at
    return [
        r(b, f"R{p}1", "470", name, f"{name}_LED"),
        r(b, f"R{p}2", "10k", f"{name}_LED", "GND"),
        Part(b, f"U{p}1", "RELAY", "CPC1017N", (f"{name}_LED", "GND", "V24_OUT", f"{name}_24V"), "CPC1017NTR",
             ("VO1400AEFTR",), "Package_SO:SOP-4_3.8x4.1mm_P2.54mm"),
        diode(b, f"D{p}1", (f"{name}_24V", "GND"), "TVS33", "TVS"),
    ]  # fmt: skip


def power() -> list[Part]:
    """24 V in: fuse, suppressor for both directions, reversal; 8 V for the board, 12 V for the command stage."""
    b = "power"
    return [
        ptc(b, "F601", "V24_IN", "V24_F", "1.1 A"),
        diode(b, "D601", ("V24_F", "GND"), "TVS26", "TVS"),
        Part(b, "Q601", "PMOS", "DMP6023LE", ("GATE", "V24_F", "V24"), "DMP6023LE-13", ("BSP170PH6327XTSA1",),
             "Package_TO_SOT_SMD:SOT-223-3_TabPin2", model="PMOS"),
        r(b, "R601", "100k", "GATE", "GND"),
        diode(b, "D602", ("GATE", "V24"), "C12"),
        c(b, "C601", "4.7u", "V24"),
        c(b, "C602", "47u", "V24"),
        r(b, "R602", "4.7k", "V24", "V12_B", mpn="RC1206FR-074K7L", other="CRCW12064K70FKEA",
          footprint="Resistor_SMD:R_1206_3216Metric"),
        diode(b, "D603", ("GND", "V12_B"), "C13"),
        r(b, "R603", "100", "V24", "V12_C", mpn="RC1206FR-07100RL", other="CRCW1206100RFKEA",
          footprint="Resistor_SMD:R_1206_3216Metric"),
        Part(b, "Q602", "NPN", "BCX56", ("V12_B", "V12_C", "V12"), "BCX56-16,115", ("BCX5616TA",),
             "Package_TO_SOT_SMD:SOT-89-3", model="NPN"),
        c(b, "C603", "4.7u", "V12"),
        Part(b, "U601", "BUCK", "LMR16006X", ("V24", "V24", "GND", "BOOST", "SWITCH", "BUCK_FB"), "LMR16006XDDCR",
             ("LMR16006YDDCR",), "Package_TO_SOT_SMD:SOT-23-6", note="Y: 10 uH instead of 22 uH"),
        c(b, "C604", "100n", "BOOST", "SWITCH"),
        Part(b, "D604", "D", "SS16", ("GND", "SWITCH"), "SS16", ("B160-13-F",), "Diode_SMD:D_SMA"),
        Part(b, "L601", "L", "22u", ("SWITCH", "VIN"), "SRN6045TA-220M", ("NRS6045T220MMGK",),
             "Inductor_SMD:L_Bourns_SRN6045TA"),
        c(b, "C605", "22u", "VIN"),
        r(b, "R604", "100k", "VIN", "BUCK_FB"),
        r(b, "R605", "10.5k", "BUCK_FB", "GND"),
        ptc(b, "F602", "V24", "V24_OUT", "1.1 A"),
    ]  # fmt: skip


def bus() -> list[Part]:
    b = "RS-485 and reset"
    return [
        Part(b, "U701", "RS485", "THVD2410", ("RXD", "DE", "DE", "TXD", "V3V3", "BUS_A", "BUS_B", "GND"), "THVD2410DR",
             ("THVD2450DR", "LTC2862IS8-1#PBF"), "Package_SO:SOIC-8_3.9x4.9mm_P1.27mm", note="withstands 70 V"),
        c(b, "C701", "100n", "V3V3"),
        r(b, "R701", "10k", "DE", "GND"),
        ptc(b, "F701", "BUS_A", "BUS_T"),
        r(b, "R702", "91", "BUS_T", "BUS_J", note="with the PTC 120 Ohm"),
        Part(b, "JP701", "X2", "termination", ("BUS_J", "BUS_B"), "Wuerth 61300211121", ("Samtec TSW-102-07-G-S",),
             "Connector_PinHeader_2.54mm:PinHeader_1x02_P2.54mm_Vertical"),
        r(b, "R703", "680", "V3V3", "BUS_A", fit=NOT_FITTED, note="bias; fit on one device of the line"),
        r(b, "R704", "680", "BUS_B", "GND", fit=NOT_FITTED, note="bias; fit on one device of the line"),
        Part(b, "U702", "RESET", "APX803-29", ("V3V3", "GND", "NRST"), "APX803-29SAG-7", ("MIC803-29D3VM3-TR",),
             "Package_TO_SOT_SMD:SOT-23", note="2.93 V, open drain"),
        c(b, "C702", "100n", "V3V3"),
    ]  # fmt: skip


def links() -> list[Part]:
    """0 Ω that choose the board: where its pins differ."""
    b = "board links"
    chosen = (
        ("R801", "GAUGE3", "A2", F429ZI), ("R802", "GAUGE3", "A3", G474RE),
        ("R803", "MONITOR", "A7", F429ZI), ("R804", "MONITOR", "A4", G474RE),
        ("R805", "SUPPLY", "A6", F429ZI), ("R806", "SUPPLY", "A5", G474RE),
        ("R807", "COMMAND", "D24", F429ZI), ("R808", "COMMAND", "A2", G474RE),
        ("R809", "DE", "D10", F429ZI), ("R810", "DE", "CN10-12", G474RE),
    )  # fmt: skip
    return [r(b, ref, "0", net, pin, fit=fit) for ref, net, pin, fit in chosen]


def connectors() -> list[Part]:
    wires = tuple(f"{name}_24V" for name in INPUTS), tuple(f"{name}_24V" for name in OUTPUTS)
    return [
        terminal("J1", "24 V", ("V24_IN", "GND")),
        terminal("J2", "regulator", ("V24", "GND", "CMD_OUT", "MON_IN")),
        *(terminal(f"J{2 + n}", f"gauge {n}", (f"EXC{n}", f"SIG{n}", "GND")) for n in (1, 2, 3)),
        terminal("J6", "inputs", (*wires[0], "IN_0V")),
        terminal("J7", "outputs", (*wires[1], "GND")),
        terminal("J8", "RS-485", ("BUS_A", "BUS_B", "GND")),
        header("J11", "Arduino power", ("", "", "NRST", "V3V3", "V5", "GND", "GND", "VIN")),
        header("J12", "Arduino A0-A5", ("GAUGE1", "GAUGE2", "A2", "A3", "A4", "A5")),
        header("J13", "Arduino D0-D7", ("RXD", "TXD", "GRIP", "READY", "RELEASE", "HOLDING", "LOST", "STOP")),
        header("J14", "Arduino D8-AREF", ("ACK", "FAULT", "D10", "", "", "", "GND", "AREF", "", "")),
        header("J15", "Zio A6 A7 D24", ("A6", "A7", "D24"), F429ZI),
        # USART1's own driver enable, beside the Arduino rows.
        header("J16", "morpho CN10-12", ("CN10-12",), G474RE),
    ]


def parts() -> list[Part]:
    """All parts, in the order of the schematic."""
    found = reference()
    for n in (1, 2, 3):
        found += gauge(n)
    found += command() + monitor()
    for at, name in enumerate(INPUTS, 1):
        found += digital_input(at, name)
    for at, name in enumerate(OUTPUTS, 1):
        found += digital_output(at, name)
    return found + power() + bus() + links() + connectors()


# Names of the firmware's signals, what they are, and where they are on each board: (header, pin of the chip).
# Pins: UM1974 and UM2505, as in Zephyr's board files. In the order of the converter's scan.
SIGNALS = (
    ("GAUGE1", "gauge of finger 1", "analogue in", ("A0", "PA3"), ("A0", "PA0")),
    ("GAUGE2", "gauge of finger 2", "analogue in", ("A1", "PC0"), ("A1", "PA1")),
    ("GAUGE3", "gauge of finger 3", "analogue in", ("A2", "PC3"), ("A3", "PB0")),
    ("MONITOR", "regulator's pressure monitor", "analogue in", ("A7", "PC2"), ("A4", "PC1")),
    ("SUPPLY", "supply", "analogue in", ("A6", "PB1"), ("A5", "PC0")),
    ("COMMAND", "regulator's command", "analogue out", ("D24", "PA4"), ("A2", "PA4")),
    ("GRIP", "GRIP", "in, low is on", ("D2", "PF15"), ("D2", "PA10")),
    ("RELEASE", "RELEASE", "in, low is on", ("D4", "PF14"), ("D4", "PB5")),
    ("STOP", "STOP", "in, low is closed", ("D7", "PF13"), ("D7", "PA8")),
    ("ACK", "ACK", "in, low is on", ("D8", "PF12"), ("D8", "PA9")),
    ("READY", "READY", "out, high is on", ("D3", "PE13"), ("D3", "PB3")),
    ("HOLDING", "HOLDING", "out, high is on", ("D5", "PE11"), ("D5", "PB4")),
    ("LOST", "LOST", "out, high is on", ("D6", "PE9"), ("D6", "PB10")),
    ("FAULT", "FAULT", "out, high is on", ("D9", "PD15"), ("D9", "PC7")),
    ("RXD", "RS-485, received (R)", "in, pulled up", ("D0", "PG9"), ("D0", "PC5")),
    ("TXD", "RS-485, to send (D)", "out", ("D1", "PG14"), ("D1", "PC4")),
    ("DE", "RS-485, driver enable (DE, RE)", "out, high sends", ("D10", "PD14"), ("CN10-12", "PA12")),
)
BOARDS = (("NUCLEO-F429ZI", "nucleo_f429zi", F429ZI), ("NUCLEO-G474RE", "nucleo_g474re", G474RE))
