"""Bill of materials, one line per part number."""

from __future__ import annotations

import csv
import io
import re

from circuit import Part


def bom(parts: list[Part]) -> str:
    """CSV; `fit` says for which board, where it is not every one."""
    lines: dict[tuple[str, str], list[Part]] = {}
    for part in parts:
        if part.unit == 1:
            lines.setdefault((part.mpn, part.fit), []).append(part)
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(
        ["references", "quantity", "value", "part", "first alternative", "second alternative", "tolerance, %",
         "footprint", "fit", "note"]
    )  # fmt: skip
    for (mpn, fit), same in lines.items():
        first = same[0]
        references = sorted({part.ref for part in same}, key=lambda ref: re.findall(r"\d+|\D+", ref)[::-1])
        one, two, *_ = *first.alternatives, "", ""
        tolerance = f"{100.0 * first.tolerance:g}" if first.kind in ("R", "C") else ""
        table.writerow(
            [
                " ".join(references),
                len(references),
                first.value,
                mpn,
                one,
                two,
                tolerance,
                first.footprint,
                fit,
                first.note,
            ]
        )
    return out.getvalue()
