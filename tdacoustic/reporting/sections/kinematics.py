"""What turns how fast: stated, calculated, measured and observed, and on which numbers that rests."""

from __future__ import annotations

import re

from tdacoustic.attribution import RunKinematics
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.reporting.document import Block, Cell, Column, Paragraph, Section, Sentences, Table
from tdacoustic.reporting.language import say
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
        text = say(
            "The calculated mesh frequency follows from the stated speed, the wheel diameter and the teeth (from the "
            "measured speed where none is stated). The observed one is fitted to the lines of the gearbox's sensors; "
            "± is one standard deviation, and the excess is observed "
            "over calculated, minus one. Slip between wheel and rail is not part of the calculation."
        )
        origins = sorted({found.speed_source for _, found in held})
        text += say(" Orders refer to the motor speed from: {origins}.", origins="; ".join(origins))
        blocks += [Paragraph(text), _table(analysis, held)]
        blocks.append(Sentences([_causes(run, found) for run, found in held]))
    else:
        blocks.append(Paragraph(say("No steady run whose speed is known, so no order has a frequency.")))
    blocks.append(_parameters(analysis))
    return Section("kinematics", say("Speeds and mesh frequencies"), blocks)


def _is_measured(found: RunKinematics) -> bool:
    return found.speed_source != "stated speed"


def _table(analysis: Analysis, held: list[tuple[MeasuredRun, RunKinematics]]) -> Table:
    one_source = len({found.speed_source for _, found in held}) == 1
    worn = any(run.run.wheel_diameter_mm is not None for run, _ in held)
    columns = [
        Column("run", say("Run")),
        Column("train_speed_km_h", say("Stated"), "km/h", 1, "number"),
        *([Column("wheel_diameter_mm", say("Wheel"), "mm", 1, "number")] if worn else []),
        Column("motor_calculated_rpm", say("Motor"), say("calculated, rpm"), 1, "number"),
        Column("motor_measured_rpm", say("Motor"), say("measured, rpm"), 1, "number"),
        Column("mesh_calculated_hz", say("Mesh"), say("calculated, Hz"), 1, "number"),
        Column("mesh_observed_hz", say("Mesh"), say("observed, Hz"), 1, "number"),
        Column("mesh_error_hz", "±", "1 σ, Hz", 2, "number"),
        Column("excess_percent", say("Excess"), "%", 2, "number"),
        *([] if one_source else [Column("speed_source", say("Speed from"))]),
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
    return Table(
        "kinematics", say("Speeds and mesh frequencies by run"), columns, rows, origin=analysis.campaign.origin
    )


def _causes(run: MeasuredRun, found: RunKinematics) -> str:
    """One sentence: how far the observed mesh is off, and what that may come from."""
    if found.observed_mesh_hz is None or found.excess is None:
        return say(
            "Run {name}: {causes}; one was calculated at {mesh_hz:.1f} Hz.",
            name=run.name,
            causes=found.causes,
            mesh_hz=found.mesh_hz,
        )
    off = pretty_signs(f"{100.0 * found.excess:+.2f} %")
    seen = say(
        "the mesh is observed at {observed_mesh_hz:.1f} Hz, {off} against the calculated {mesh_hz:.1f} Hz",
        observed_mesh_hz=found.observed_mesh_hz,
        off=off,
        mesh_hz=found.mesh_hz,
    )
    return say("Run {name}: {seen}; {rivals}.", name=run.name, seen=seen, rivals=_rivals(found.causes))


def _rivals(causes: str) -> str:
    """The causes as attribution names them; several are rivals, which the recordings alone do not tell apart."""
    parts = pretty_signs(causes).split("; ")
    if len(parts) == 1:
        return parts[0]
    measured = [part for part in parts if part.startswith("the measured speed")]
    ruled_out = [say("it is {part}", part=part) for part in parts if part.startswith("not ")]
    rivals = [part for part in parts if not part.startswith(("the measured speed", "not "))]
    return "; ".join([*measured, say("it may come from {rivals}", rivals=say(", or ").join(rivals)), *ruled_out])


def _parameters(analysis: Analysis) -> Table:
    assert analysis.fleet is not None
    title = say("What the kinematics rests on, from the fleet file of {name}", name=analysis.fleet.name)
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
        which = say(", gear pair {name}", name=pairs[int(parts[1]) - 1].name) if len(pairs) > 1 else ""
        return say("Teeth of pinion and wheel{which}", which=which), ""
    assert analysis.fleet.motor is not None
    words, unit = _EXCITATION_WORDS[parts[-1]]
    name = analysis.fleet.motor.excitation[int(parts[2]) - 1].name
    return say("Excitation {name}{value}{words}", name=name, value=", " if words else "", words=words), unit
