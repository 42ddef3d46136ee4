"""The gear pair that is computed: its geometry, its stiffness and the natural frequencies of its linear system."""

from __future__ import annotations

import math

from tdacoustic.drive import GearState, GearUnit
from tdacoustic.reporting.document import Block, Cell, Column, Paragraph, Section, Sentences, Table
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import by_speed, sentence
from tdacoustic.reporting.sections.words import pretty_signs
from tdacoustic.results import FleetPrediction

__all__ = ["gear_pair"]

NEAR = 0.05
"""Relative distance of a mesh harmonic from a natural frequency within which the condition is named."""
HARMONICS = (1, 2, 3)
"""Of the mesh, that are held against natural frequencies."""
AT_REST_HZ = 1e-2
"""Frequency below which a mode is the rigid rotation, which is zero but for rounding."""


def gear_pair(result: FleetPrediction) -> Section:
    """Return the section on the gear pair."""
    unit = result.prediction.unit
    blocks: list[Block] = [Paragraph(_method(result)), _gears(unit), _pair(unit), _stiffness(unit)]
    if unit.stiffness.doubts:
        blocks.append(Sentences([sentence(doubt) for doubt in unit.stiffness.doubts]))
    blocks += [Paragraph(say(MODES)), _modes(result)]
    return Section("gear-pair", say("Gear pair"), blocks)


MODES = mark(
    "Natural frequencies are those of the undamped linear system: two gears on their bearings, the teeth in contact, "
    "the mesh at its mean stiffness. A drive passes each of them at the speeds at which a mesh harmonic meets it. "
    "Where teeth separate, resonances move to lower frequencies. The first mode is the rigid rotation of the drive."
)


def _method(result: FleetPrediction) -> str:
    unit, fleet = result.prediction.unit, result.fleet
    pair = fleet.modelled_pair
    said = [say("Geometry by ISO 21771, without play in the centre distance, tips not shortened.")]
    if pair.helix_angle_deg is None:
        said.append(say("The helix angle follows from the centre distance."))
    elif pair.centre_distance_mm is None:
        said.append(say("The centre distance follows from the helix angle."))
    if len(fleet.gear_pair) > 1:
        said.append(
            say(
                "Of {count} gear pairs in series, {pair} is computed; its pinion turns {turns:.4g} times a turn of the "
                "motor.",
                count=len(fleet.gear_pair),
                pair=unit.pair,
                turns=1.0 / unit.motor_turns,
            )
        )
    return " ".join(said)


def _gears(unit: GearUnit) -> Table:
    geometry = unit.geometry

    def diameters(radii_m: tuple[float, float]) -> tuple[float, float]:
        return 2e3 * radii_m[0], 2e3 * radii_m[1]

    def lengths(values_m: tuple[float, float]) -> tuple[float, float]:
        return 1e3 * values_m[0], 1e3 * values_m[1]

    found: list[tuple[str, str, tuple[float, float]]] = [
        (say("Reference diameter"), "mm", diameters(geometry.reference_radii_m)),
        (say("Base diameter"), "mm", diameters(geometry.base_radii_m)),
        (say("Working pitch diameter"), "mm", diameters(geometry.pitch_radii_m)),
        (say("Tip diameter"), "mm", diameters(geometry.tip_radii_m)),
        (say("Root diameter"), "mm", diameters(geometry.root_radii_m)),
        (say("Tooth thickness at the tip"), "mm", lengths(geometry.tip_thicknesses_m)),
        (say("Clearance between tip and mating root"), "mm", lengths(geometry.tip_clearances_m)),
    ]
    columns = (
        Column("quantity", say("Quantity")),
        Column("unit", say("Unit")),
        Column("pinion", say("Pinion"), "", 3, "number"),
        Column("wheel", say("Wheel"), "", 3, "number"),
    )
    rows: list[list[Cell]] = [[words, symbol, *pair] for words, symbol, pair in found]
    (z1, z2), (x1, x2) = geometry.teeth, geometry.profile_shift
    caption = pretty_signs(
        say("The two gears: {z1} and {z2} teeth, profile shifts {x1:g} and {x2:g}", z1=z1, z2=z2, x1=x1, x2=x2)
    )
    return Table("gears", caption, columns, rows, origin="calculated")


def _pair(unit: GearUnit) -> Table:
    geometry = unit.geometry
    rows: list[list[Cell]] = [
        [say("Gear ratio z2/z1"), geometry.ratio, ""],
        [say("Centre distance"), 1e3 * geometry.centre_distance_m, "mm"],
        [say("Helix angle at the reference circle"), math.degrees(geometry.helix_angle_rad), "°"],
        [say("Helix angle at the base circle"), math.degrees(geometry.base_helix_angle_rad), "°"],
        [say("Transverse pressure angle"), math.degrees(geometry.transverse_pressure_angle_rad), "°"],
        [say("Working transverse pressure angle"), math.degrees(geometry.working_pressure_angle_rad), "°"],
        [say("Transverse contact ratio"), geometry.transverse_contact_ratio, ""],
        [say("Overlap ratio"), geometry.overlap_ratio, ""],
        [say("Total contact ratio"), geometry.contact_ratio, ""],
        [say("Face width"), 1e3 * geometry.face_width_m, "mm"],
        [say("Transverse base pitch"), 1e3 * geometry.base_pitch_m, "mm"],
    ]
    return _values("pair", say("The pair"), rows)


def _stiffness(unit: GearUnit) -> Table:
    stiffness = unit.stiffness
    rows: list[list[Cell]] = [
        [say("c′, one pair of teeth, a unit of face width"), 1e-9 * stiffness.single_n_per_m2, "N/(mm µm)"],
        [say("cγα, mean of the mesh, a unit of face width"), 1e-9 * stiffness.mesh_n_per_m2, "N/(mm µm)"],
        [say("k̄, mean along the normal line of action, whole face width"), 1e-6 * stiffness.normal_n_per_m, "N/µm"],
    ]
    return _values("stiffness", say("Stiffness of the mesh by ISO 6336-1, method B, steel on steel"), rows)


def _values(name: str, caption: str, rows: list[list[Cell]]) -> Table:
    columns = (
        Column("quantity", say("Quantity")),
        Column("value", say("Value"), "", 3, "number"),
        Column("unit", say("Unit")),
    )
    return Table(name, caption, columns, rows, origin="calculated")


def _modes(result: FleetPrediction) -> Table:
    prediction = result.prediction
    frequencies = prediction.unit.system.natural_frequencies_hz()
    states = by_speed(prediction.conditions)
    km_h_per_hz = states[0].condition.train_speed_km_h / states[0].mesh_hz
    rows: list[list[Cell]] = []
    for number, frequency in enumerate(frequencies.tolist(), 1):
        if frequency < AT_REST_HZ:
            rows.append([str(number), 0.0, *(None for _ in HARMONICS), say("rigid rotation")])
            continue
        speeds = [frequency / harmonic * km_h_per_hz for harmonic in HARMONICS]
        rows.append([str(number), frequency, *speeds, _near(states, frequency)])
    columns = (
        Column("mode", say("Mode")),
        Column("natural_frequency_hz", say("Natural"), "Hz", 1, "number"),
        *(
            Column(f"mesh_{n}_km_h", say("Mesh x{harmonic}", harmonic=n), say("meets it at km/h"), 1, "number")
            for n in HARMONICS
        ),
        Column("conditions", say("Conditions within {percent:.0f} %", percent=100 * NEAR)),
    )
    caption = say("Natural frequencies, teeth in contact, bearing seats that do not move")
    return Table("modes", caption, columns, rows, origin="calculated")


def _near(states: list[GearState], frequency: float) -> str:
    found = []
    for state in states:
        for harmonic in HARMONICS:
            off = harmonic * state.mesh_hz / frequency - 1.0
            if abs(off) <= NEAR:
                found.append(f"{state.condition.name} (x{harmonic}, {100.0 * off:+.1f} %)")
    return pretty_signs(", ".join(found))
