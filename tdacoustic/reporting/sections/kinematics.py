"""What turns how fast: stated, calculated, measured and observed, and on which numbers that rests."""

from __future__ import annotations

import re
from functools import reduce

from tdacoustic.attribution import RunKinematics
from tdacoustic.measured.runs import MeasuredRun
from tdacoustic.reporting.document import Block, Cell, Column, Paragraph, Section, Sentences, Table
from tdacoustic.reporting.language import mark, say
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
    "train.wheel_diameter_mm": (mark("Wheel diameter"), "mm"),
    "motor.pole_pairs": (mark("Pole pairs of the motor"), ""),
    "motor.slip": (mark("Slip of the rotor"), ""),
    "motor.carrier_hz": (mark("Carrier of the inverter"), "Hz"),
}
_EXCITATION_UNITS = {
    "carrier": mark("times the carrier"),
    "supply": mark("times the supply frequency"),
    "shaft": mark("times the motor shaft's turns"),
}
RECORDED_SPEED = "the recorded speed"
"""Of data that a program may have made, so not called measured."""


def kinematics(analysis: Analysis) -> Section | None:
    """Return the section on speeds and mesh frequencies, or None without a fleet or a run."""
    if analysis.fleet is None or not analysis.runs:
        return None
    blocks: list[Block] = []
    held = [(run, analysis.kinematics[run.name]) for run in analysis.runs if run.name in analysis.kinematics]
    if held:
        text = say(
            "The calculated mesh frequency follows from the stated speed, the wheel diameter and the teeth (from the "
            "recorded speed where none is stated). The observed one is fitted to the lines of the gearbox's sensors; "
            "± is one standard deviation, and the excess is observed over calculated, minus one. "
            "Slip between wheel and rail is not part of the calculation."
        )
        origins = sorted({found.speed_source for _, found in held})
        refer = say("Orders refer to the motor speed from: {origins}.", origins="; ".join(origins))
        blocks += [Paragraph(f"{text} {refer}"), _table(analysis, held)]
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
        Column("motor_measured_rpm", say("Motor"), say("recorded, rpm"), 1, "number"),
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
            "Run {run}: {causes}; one was calculated at {frequency:.1f} Hz.",
            run=run.name,
            causes=found.causes,
            frequency=found.mesh_hz,
        )
    return say(
        "Run {run}: the mesh is observed at {observed:.1f} Hz, {excess} against the calculated {calculated:.1f} Hz; "
        "{causes}.",
        run=run.name,
        observed=found.observed_mesh_hz,
        excess=pretty_signs(f"{100.0 * found.excess:+.2f} %"),
        calculated=found.mesh_hz,
        causes=_rivals(found.causes),
    )


def _rivals(causes: str) -> str:
    """The causes as attribution names them; several are rivals, which the recordings alone do not tell apart."""
    parts = pretty_signs(causes).replace("the measured speed", RECORDED_SPEED).split("; ")
    if len(parts) == 1:
        return parts[0]
    recorded = [part for part in parts if part.startswith(RECORDED_SPEED)]
    ruled_out = [say("it is {cause}", cause=part) for part in parts if part.startswith("not ")]
    rivals = [part for part in parts if not part.startswith((RECORDED_SPEED, "not "))]
    if rivals:
        causes = reduce(lambda one, other: say("{cause}, or {other}", cause=one, other=other), rivals)
        recorded.append(say("it may come from {causes}", causes=causes))
    return "; ".join([*recorded, *ruled_out])


def _parameters(analysis: Analysis) -> Table:
    assert analysis.fleet is not None
    title = say("What the kinematics rests on, from the fleet file of {fleet}", fleet=analysis.fleet.name)
    return parameter_table(
        "kinematics-parameters",
        title,
        analysis.fleet,
        lambda key: _named(analysis, key) if USED.fullmatch(key) else None,
    )


def _named(analysis: Analysis, key: str) -> tuple[str, str]:
    if key in _WORDS:
        words, unit = _WORDS[key]
        return say(words), unit
    assert analysis.fleet is not None
    parts = key.split(".")
    if parts[0] == "gear_pair":
        pairs = analysis.fleet.gear_pair
        if len(pairs) == 1:
            return say("Teeth of pinion and wheel"), ""
        return say("Teeth of pinion and wheel, gear pair {pair}", pair=pairs[int(parts[1]) - 1].name), ""
    assert analysis.fleet.motor is not None
    name = analysis.fleet.motor.excitation[int(parts[2]) - 1].name
    if parts[-1] == "fixed_hz":
        return say("Excitation {excitation}, fixed part", excitation=name), "Hz"
    return say("Excitation {excitation}", excitation=name), say(_EXCITATION_UNITS[parts[-1]])
