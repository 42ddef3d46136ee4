"""Gears and housing acting on each other: what a housing that gives way changes, over frequency and condition."""

from __future__ import annotations

from typing import Final

from tdacoustic.drive.coupling import COUPLINGS, CoupledCondition, Coupling, ForceDifference
from tdacoustic.gears import DIRECTIONS, GEARS
from tdacoustic.gears.foundation import CORRECTION_LOSS
from tdacoustic.reporting.document import (
    Block,
    Cell,
    Column,
    Details,
    FigureBlock,
    Paragraph,
    Section,
    Sentences,
    Table,
)
from tdacoustic.reporting.figure import Axis, Element, Figure, Line, LineStyle, Rule
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import DIRECTION_SLOTS, gear_word, hertz, named_conditions
from tdacoustic.reporting.sections.words import pretty_signs
from tdacoustic.results import FleetPrediction

__all__ = ["coupling_section"]

WORDS: Final = {"one_way": mark("one-way"), "two_way": mark("two-way")}
STYLES: Final[dict[str, LineStyle]] = {"one_way": "dashed", "two_way": "solid"}

SMALLEST_DB: Final = 0.05
"""Changes that are none at the decimals shown."""

METHOD = mark(
    "One-way coupling takes the bearing forces on seats that do not move and applies them to the housing. In two-way "
    "coupling the seats give way: the housing's modes enter the receptance that the mesh feels and the force that a "
    "bearing carries, and that force acts on the housing."
)
USED: Final = {
    "one_way": mark('All other numbers of this report are one-way ([model] coupling = "one_way").'),
    "two_way": mark('All other numbers of this report are two-way ([model] coupling = "two_way").'),
}
CURVES = mark(
    "Curves are for teeth in contact at the mean stiffness of the mesh, per µm of transmission error (amplitude): "
    "linear in it, so they hold for any."
)
BEYOND = mark(
    "Beyond {highest}, up to which the housing's modes are computed, the sum of the same modes stands for it; shapes "
    "of the static correction, which are no resonances, are damped by a loss factor of {loss:g} [assumed]. For the "
    "reference drive in the reference housing, held against modes to 3 kHz, δ's peak to peak is within 0.6 % at nine "
    "of ten speeds and helix angles (2.3 % at most) and the bearing forces are within 0.15 dB (0.3 dB)."
)
DAMPING = mark(
    "The housing's loss factor is structural in the balance. Multipliers and integration in time take it as viscous "
    "dampers that agree at each resonance (there, 0.06 % and 0.12 dB at most). With two-way coupling the largest "
    "multiplier is mostly that of a housing mode ringing down, so it lies closer to 1."
)
LEFT_OUT = mark(
    "A gear's bearings move as the mean of their two seats by the lever rule, so the tilt of a shaft is left out. The "
    "mass of shafts, the air and the torque that the housing takes up are left out as before. The mean forces do not "
    "change: what the soft springs of the housing give way to is no stiffness of the gears."
)


def coupling_section(result: FleetPrediction) -> Section | None:
    """Return the section on one-way against two-way coupling; None where no housing is computed."""
    coupling = result.prediction.coupling
    if coupling is None:
        return None
    differences = coupling.curves.differences(*_range(coupling))
    beyond = say(BEYOND, highest=hertz(coupling.highest_hz), loss=CORRECTION_LOSS)
    blocks: list[Block] = [
        Paragraph(f"{say(METHOD)} {say(USED[coupling.used])}"),
        Sentences(_said(coupling, differences)),
        FigureBlock(_receptance(coupling), "calculated"),
        *(FigureBlock(_differences(coupling, gear), "calculated") for gear in range(len(GEARS))),
        _by_direction(coupling, differences),
        _by_condition(coupling),
        Details(
            say("Bearing forces with either coupling"),
            [
                Paragraph(say(CURVES)),
                *(FigureBlock(_forces(coupling, gear), "calculated") for gear in range(len(GEARS))),
            ],
        ),
        Sentences([beyond, say(DAMPING), say(LEFT_OUT)]),
    ]
    return Section("coupling", say("Gears and housing coupled both ways"), blocks)


def _range(coupling: Coupling) -> tuple[float, float]:
    """From the lowest to the highest mesh frequency that the modes reach."""
    mesh = [held.mesh_hz for held in coupling.conditions if held.mesh_hz <= coupling.highest_hz]
    if len(set(mesh)) < 2:
        return float(coupling.curves.frequency_hz[0]), coupling.highest_hz
    return min(mesh), max(mesh)


def _decibels(value: float) -> str:
    return pretty_signs(f"{round(value, 1) + 0.0:+.1f} dB") if abs(value) >= SMALLEST_DB else "0.0 dB"


def _said(coupling: Coupling, differences: tuple[ForceDifference, ...]) -> list[str]:
    low, high = _range(coupling)
    least = min(differences, key=lambda found: found.lowest[0])
    most = max(differences, key=lambda found: found.highest[0])
    medians = [found.median_db for found in differences]
    said = [
        say(
            "Between {from_frequency} and {to_frequency} the bearing forces with two-way coupling differ from the "
            "one-way ones by {lowest} (at {lowest_at}) to {highest} (at {highest_at}). At half of the frequencies they "
            "differ by more than {least:.1f} to {most:.1f} dB, depending on gear and direction.",
            from_frequency=hertz(low),
            to_frequency=hertz(high),
            lowest=_decibels(least.lowest[0]),
            lowest_at=f"{hertz(least.lowest[1])}, {gear_word(least.gear)} {least.direction}",
            highest=_decibels(most.highest[0]),
            highest_at=f"{hertz(most.highest[1])}, {gear_word(most.gear)} {most.direction}",
            least=min(medians),
            most=max(medians),
        )
    ]
    said += [_change_words(say("The housing's own sound at 4 m"), coupling, "structure_db")]
    said += [_change_words(say("The total at 4 m"), coupling, "total_db")]
    said += [_swing_words(coupling)]
    return [sentence for sentence in said if sentence]


def _change_words(what: str, coupling: Coupling, name: str) -> str:
    """By how much a level changes from one-way to two-way, least and most."""
    held = [(two - one, c) for c in coupling.conditions for one, two in [getattr(c, name)] if None not in (one, two)]
    if not held:
        return ""
    (least, one), (most, other) = min(held, key=lambda p: p[0]), max(held, key=lambda p: p[0])
    values: dict[str, object] = {"level": what, "name": one.condition, "smallest": SMALLEST_DB}
    if max(abs(least), abs(most)) < SMALLEST_DB:
        if len(held) == 1:
            return say(
                "{level} does not change in condition {name} with two-way coupling (less than {smallest:g} dB).",
                **values,
            )
        return say("{level} does not change with two-way coupling (less than {smallest:g} dB).", **values)
    if len(held) == 1:
        return say(
            "{level} changes by {change} in condition {name} with two-way coupling.", change=_decibels(least), **values
        )
    return say(
        "{level} changes by {least} (condition {name}) to {most} (condition {other}) with two-way coupling.",
        least=_decibels(least),
        most=_decibels(most),
        other=other.condition,
        **values,
    )


def _swing_words(coupling: Coupling) -> str:
    held = [(two / one - 1.0, c) for c in coupling.conditions for one, two in [c.dte_pp_m] if one and two]
    missing = [c.condition for c in coupling.conditions if None in c.dte_pp_m]
    said = []
    if held:
        most, where = max(held, key=lambda pair: abs(pair[0]))
        text = say(
            "The dynamic transmission error changes most in condition {name}, by {change:+.1f} %.",
            name=where.condition,
            change=100.0 * most,
        )
        said.append(pretty_signs(text))
    if missing:
        said.append(
            say(
                "In {conditions} the balance finds no stable motion with the other coupling, which is not integrated "
                "in time.",
                conditions=named_conditions(missing),
            )
        )
    return " ".join(said)


def _rules(coupling: Coupling) -> list[Element]:
    return [Rule(held.mesh_hz, held.condition) for held in coupling.conditions if held.mesh_hz <= coupling.highest_hz]


def _axis(coupling: Coupling) -> Axis:
    low, high = _range(coupling)
    return Axis(say("Frequency"), "Hz", limits=(0.6 * low, min(1.15 * high, coupling.highest_hz)))


def _receptance(coupling: Coupling) -> Figure:
    curves = coupling.curves
    lines: list[Element] = [
        Line(curves.frequency_hz, curves.receptance_m_per_n[kind], say(WORDS[name]), STYLES[name], color=kind)
        for kind, name in enumerate(COUPLINGS)
    ]
    return Figure(
        "coupling-receptance",
        say("What the mesh feels: displacement along the line of action per mesh force"),
        say(
            "Magnitude of the receptance of gears, bearings and (two-way) housing, without the mesh. Vertical "
            "lines: the "
            "mesh frequencies of the conditions."
        ),
        _axis(coupling),
        Axis(say("Receptance"), "m/N", "log"),
        [*lines, *_rules(coupling)],
        height=360,
    )


def _differences(coupling: Coupling, gear: int) -> Figure:
    curves = coupling.curves
    lines: list[Element] = [
        Line(curves.frequency_hz, curves.difference_db[gear, d], direction, color=DIRECTION_SLOTS[direction])
        for d, direction in enumerate(DIRECTIONS)
    ]
    return Figure(
        f"coupling-{GEARS[gear]}",
        say("Forces on the bearings of the {gear}: two-way less one-way", gear=gear_word(GEARS[gear])),
        say(
            "Teeth in contact at the mean stiffness of the mesh; above 0 the housing that gives way raises the force. "
            "Vertical lines: the mesh frequencies of the conditions."
        ),
        _axis(coupling),
        Axis(say("Difference"), "dB"),
        [*lines, *_rules(coupling)],
        height=360,
    )


def _forces(coupling: Coupling, gear: int) -> Figure:
    curves = coupling.curves
    lines: list[Element] = [
        Line(
            curves.frequency_hz,
            curves.bearing_force_n_per_um[kind, gear, d],
            f"{direction}, {say(WORDS[name])}",
            STYLES[name],
            color=DIRECTION_SLOTS[direction],
        )
        for d, direction in enumerate(DIRECTIONS)
        for kind, name in enumerate(COUPLINGS)
    ]
    return Figure(
        f"coupling-forces-{GEARS[gear]}",
        say("Forces on the bearings of the {gear} per µm of transmission error", gear=gear_word(GEARS[gear])),
        say(
            "Teeth in contact at the mean stiffness of the mesh. Vertical lines: the mesh frequencies of the "
            "conditions."
        ),
        _axis(coupling),
        Axis(say("Force"), "N/µm", "log"),
        [*lines, *_rules(coupling)],
        height=380,
    )


def _by_direction(coupling: Coupling, differences: tuple[ForceDifference, ...]) -> Table:
    rows: list[list[Cell]] = [
        [gear_word(found.gear), found.direction, found.median_db, *found.lowest, *found.highest]
        for found in differences
    ]
    low, high = _range(coupling)
    columns = (
        Column("gear", say("Gear")),
        Column("direction", say("Direction")),
        Column("median_db", say("Median"), say("dB, magnitude"), 1, "number"),
        Column("lowest_db", say("Lowest"), "dB", 1, "number"),
        Column("lowest_hz", say("at"), "Hz", 0, "number"),
        Column("highest_db", say("Highest"), "dB", 1, "number"),
        Column("highest_hz", say("at"), "Hz", 0, "number"),
    )
    caption = say(
        "Bearing forces, two-way less one-way, between {lowest} and {highest}", lowest=hertz(low), highest=hertz(high)
    )
    return Table("coupling-directions", caption, columns, rows, origin="calculated")


def _by_condition(coupling: Coupling) -> Table:
    columns = [Column("condition", say("Condition")), Column("mesh_frequency_hz", say("Mesh"), "Hz", 1, "number")]
    for key, title, unit, digits in (
        ("dte_pp", say("DTE"), "µm", 2),
        ("structure", say("Structure"), "dB", 1),
        ("total", say("Total"), "dB", 1),
    ):
        columns += [
            Column(f"{key}_{kind}", title, f"{unit}, {say(WORDS[kind])}", digits, "number") for kind in COUPLINGS
        ]
    rows = [_condition_cells(held) for held in coupling.conditions]
    return Table(
        "coupling-conditions",
        say("The conditions with either coupling, levels at 4 m"),
        columns,
        rows,
        origin="calculated",
    )


def _condition_cells(held: CoupledCondition) -> list[Cell]:
    swings = [None if value is None else 1e6 * value for value in held.dte_pp_m]
    return [held.condition, held.mesh_hz, *swings, *held.structure_db, *held.total_db]
