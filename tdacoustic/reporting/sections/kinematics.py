"""What turns how fast: stated, calculated, measured and observed, and on which numbers that rests."""

from __future__ import annotations

import re

from tdacoustic.attribution import RunKinematics
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.reporting.document import Block, Cell, Column, Paragraph, Section, Sentences, Table
from tdacoustic.reporting.sections.parameters import parameter_table
from tdacoustic.reporting.sections.words import pretty_signs
from tdacoustic.results import Analysis

__all__ = ["kinematics"]

USED = re.compile(
    r"train\.wheel_diameter_mm|gear_pair\.\d+\.teeth|motor\.(pole_pairs|slip|carrier_hz)"
    r"|motor\.excitation\.\d+\.(carrier|supply|shaft|fixed_hz)"
)
"""Parameters of the fleet that the kinematics rests on."""

_WORDS = {
    "train.wheel_diameter_mm": ("Wheel diameter", "mm"),
    "motor.pole_pairs": ("Pole pairs of the motor", ""),
    "motor.slip": ("Slip of the rotor", ""),
    "motor.carrier_hz": ("Carrier of the inverter", "Hz"),
}
_EXCITATION_WORDS = {
    "carrier": ("", "times the carrier"),
    "supply": ("", "times the supply frequency"),
    "shaft": ("", "times the motor shaft's turns"),
    "fixed_hz": ("fixed part", "Hz"),
}


def kinematics(analysis: Analysis) -> Section | None:
    """Return the section on speeds and mesh frequencies, or None without a fleet or a run."""
    if analysis.fleet is None or not analysis.runs:
        return None
    blocks: list[Block] = []
    held = [(run, analysis.kinematics[run.name]) for run in analysis.runs if run.name in analysis.kinematics]
    if held:
        text = (
            "The calculated mesh frequency follows from the stated speed, the wheel diameter and the teeth (from the "
            "measured speed where none is stated). The observed one is fitted to the lines of the gearbox's sensors; "
            "± is one standard deviation, and the excess is observed "
            "over calculated, minus one. Slip between wheel and rail is not part of the calculation."
        )
        origins = sorted({found.speed_source for _, found in held})
        text += f" Orders refer to the motor speed from: {'; '.join(origins)}."
        blocks += [Paragraph(text), _table(analysis, held)]
        blocks.append(Sentences([_causes(run, found) for run, found in held]))
    else:
        blocks.append(Paragraph("No steady run whose speed is known, so no order has a frequency."))
    blocks.append(_parameters(analysis))
    return Section("kinematics", "Speeds and mesh frequencies", blocks)


def _is_measured(found: RunKinematics) -> bool:
    return found.speed_source != "stated speed"


def _table(analysis: Analysis, held: list[tuple[MeasuredRun, RunKinematics]]) -> Table:
    one_source = len({found.speed_source for _, found in held}) == 1
    worn = any(run.run.wheel_diameter_mm is not None for run, _ in held)
    columns = [
        Column("run", "Run"),
        Column("train_speed_km_h", "Stated", "km/h", 1, "number"),
        *([Column("wheel_diameter_mm", "Wheel", "mm", 1, "number")] if worn else []),
        Column("motor_calculated_rpm", "Motor", "calculated, rpm", 1, "number"),
        Column("motor_measured_rpm", "Motor", "measured, rpm", 1, "number"),
        Column("mesh_calculated_hz", "Mesh", "calculated, Hz", 1, "number"),
        Column("mesh_observed_hz", "Mesh", "observed, Hz", 1, "number"),
        Column("mesh_error_hz", "±", "1 σ, Hz", 2, "number"),
        Column("excess_percent", "Excess", "%", 2, "number"),
        *([] if one_source else [Column("speed_source", "Speed from")]),
    ]
    rows = []
    for run, found in held:
        cells: dict[str, Cell] = {
            "run": run.name,
            "train_speed_km_h": run.run.train_speed_km_h,
            "wheel_diameter_mm": run.run.wheel_diameter_mm,
            "motor_calculated_rpm": None if found.motor_hz_stated is None else 60.0 * found.motor_hz_stated,
            "motor_measured_rpm": 60.0 * found.motor_hz if _is_measured(found) else None,
            "speed_source": found.speed_source,
            "mesh_calculated_hz": found.mesh_hz,
            "mesh_observed_hz": found.observed_mesh_hz,
            "mesh_error_hz": found.observed_error_hz,
            "excess_percent": None if found.excess is None else 100.0 * found.excess,
        }
        rows.append([cells[column.key] for column in columns])
    return Table("kinematics", "Speeds and mesh frequencies by run", columns, rows, origin=analysis.campaign.origin)


def _causes(run: MeasuredRun, found: RunKinematics) -> str:
    """One sentence: how far the observed mesh is off, and what that may come from."""
    if found.observed_mesh_hz is None or found.excess is None:
        return f"Run {run.name}: {found.causes}; one was calculated at {found.mesh_hz:.1f} Hz."
    off = pretty_signs(f"{100.0 * found.excess:+.2f} %")
    seen = (
        f"the mesh is observed at {found.observed_mesh_hz:.1f} Hz, {off} against the calculated {found.mesh_hz:.1f} Hz"
    )
    return f"Run {run.name}: {seen}; {_rivals(found.causes)}."


def _rivals(causes: str) -> str:
    """The causes as attribution names them; several are rivals, which the recordings alone do not tell apart."""
    parts = pretty_signs(causes).split("; ")
    if len(parts) == 1:
        return parts[0]
    measured = [part for part in parts if part.startswith("the measured speed")]
    ruled_out = [f"it is {part}" for part in parts if part.startswith("not ")]
    rivals = [part for part in parts if not part.startswith(("the measured speed", "not "))]
    return "; ".join([*measured, f"it may come from {', or '.join(rivals)}", *ruled_out])


def _parameters(analysis: Analysis) -> Table:
    assert analysis.fleet is not None
    title = f"What the kinematics rests on, from the fleet file of {analysis.fleet.name}"
    return parameter_table(
        "kinematics-parameters",
        title,
        analysis.fleet,
        lambda key: _named(analysis, key) if USED.fullmatch(key) else None,
    )


def _named(analysis: Analysis, key: str) -> tuple[str, str]:
    if key in _WORDS:
        return _WORDS[key]
    assert analysis.fleet is not None
    parts = key.split(".")
    if parts[0] == "gear_pair":
        pairs = analysis.fleet.gear_pair
        which = f", gear pair {pairs[int(parts[1]) - 1].name}" if len(pairs) > 1 else ""
        return f"Teeth of pinion and wheel{which}", ""
    assert analysis.fleet.motor is not None
    words, unit = _EXCITATION_WORDS[parts[-1]]
    name = analysis.fleet.motor.excitation[int(parts[2]) - 1].name
    return f"Excitation {name}{', ' if words else ''}{words}", unit
