"""What the model rests on: every parameter of gears, housing and sound field that it used, assumed ones tagged."""

from __future__ import annotations

from typing import Final

from tdacoustic.fleet import Fleet
from tdacoustic.reporting.document import Block, Notice, Section
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import begun_small
from tdacoustic.reporting.sections.housing_parameters import housing_named
from tdacoustic.reporting.sections.meshing_noise import masuda_named
from tdacoustic.reporting.sections.parameters import parameter_table
from tdacoustic.reporting.sections.words import joined
from tdacoustic.results import FleetPrediction

__all__ = ["assumed_words", "model_parameters", "named"]

_PAIR: Final = {
    "teeth": (mark("Teeth of pinion and wheel"), ""),
    "normal_module_mm": (mark("Normal module"), "mm"),
    "pressure_angle_deg": (mark("Pressure angle of the rack"), "°"),
    "helix_angle_deg": (mark("Helix angle"), "°"),
    "addendum_coefficient": (mark("Addendum coefficient"), ""),
    "clearance_coefficient": (mark("Clearance coefficient"), ""),
    "profile_shift": (mark("Profile shifts of pinion and wheel"), ""),
    "centre_distance_mm": (mark("Centre distance"), "mm"),
    "face_width_mm": (mark("Face width"), "mm"),
    "backlash_um": (mark("Backlash, 2b"), "µm"),
    "transmission_error_um": (mark("Transmission error at mesh x1, x2, ..."), "µm"),
}
_DYNAMICS: Final = {
    "mass_kg": (mark("Masses of pinion and wheel"), "kg"),
    "inertia_kg_m2": (mark("Inertias of pinion and wheel"), "kg m²"),
    "pinion_bearing_stiffness_n_per_m": (mark("Bearing stiffness of the pinion, x, y, z"), "N/m"),
    "wheel_bearing_stiffness_n_per_m": (mark("Bearing stiffness of the wheel, x, y, z"), "N/m"),
    "bearing_damping_ratio": (mark("Damping ratio of the bearings"), ""),
    "mesh_damping_ratio": (mark("Damping ratio of the mesh"), ""),
    "mesh_damping": (mark("When the mesh damps"), ""),
}
_OPERATION: Final = {
    "train_speed_km_h": (mark("Train speeds"), "km/h"),
    "mode": (mark("Mode of operation"), ""),
    "torque": (mark("Law of the torque"), ""),
    "helix_angle_deg": (mark("Helix angles of the sweep"), "°"),
}
_OF_LAW: Final = {
    "constant": ("torque_n_m", (mark("Torque of one motor"), "N m")),
    "constant_power": ("power_kw", (mark("Power of one motor"), "kW")),
    "running_resistance": ("resistance_n", (mark("Resistance of one drive, a, b V, c V²"), mark("N, V in km/h"))),
    "table": ("torque_table", (mark("Torque of one motor"), "N m")),
}
_OTHERS: Final = {
    "train.wheel_diameter_mm": (mark("Wheel diameter"), "mm"),
}


def model_parameters(result: FleetPrediction) -> Section:
    """Return the section on what the model rests on."""
    fleet = result.fleet
    if result.prediction.housing is None:
        caption = say(
            "Parameters that the model of gears and sound field used, from the fleet file of {name}", name=fleet.name
        )
    else:
        caption = say(
            "Parameters that the model of gears, housing and sound field used, from the fleet file of {name}",
            name=fleet.name,
        )
    table = parameter_table("model-parameters", caption, fleet, lambda key: named(fleet, key))
    standing = [row[2] for row in table.rows]
    assumed = standing.count("assumed")
    blocks: list[Block] = [table]
    if assumed:
        text = say(
            "{count} of {all} parameters are assumed: they come from no drawing and no measurement.",
            count=assumed,
            all=len(standing),
        )
        blocks.insert(0, Notice("assumed", text))
    return Section("model-parameters", say("What the model rests on"), blocks)


def named(fleet: Fleet, key: str) -> tuple[str, str] | None:
    """Return words and unit of a parameter that the model of gears, housing and sound field uses, None of another."""
    section, _, last = key.rpartition(".")
    if section.startswith("gear_pair.") and section != f"gear_pair.{fleet.modelled_pair_number}" and last == "teeth":
        pair = fleet.gear_pair[int(section.split(".")[1]) - 1]
        return say("Teeth of gear pair {name}, for its ratio", name=pair.name), ""
    found = _of_gears(fleet, section, last) or _OTHERS.get(key)
    if found is not None:
        return say(found[0]), say(found[1])
    return masuda_named(key) or housing_named(fleet, key)


def _of_gears(fleet: Fleet, section: str, last: str) -> tuple[str, str] | None:
    """Words and unit of a parameter of gears or operation, not yet said."""
    if section == "gear_dynamics":
        return _DYNAMICS.get(last)
    if section == "operation":
        law, words = _OF_LAW[fleet.operation.torque.value]
        return words if last == law else _OPERATION.get(last)
    return _PAIR.get(last) if section == f"gear_pair.{fleet.modelled_pair_number}" else None


def assumed_words(fleet: Fleet) -> str:
    """Name the assumed parameters of gears, bearings and load, in a sentence: what of their words is before a comma."""
    found = []
    for parameter in fleet.parameters():
        belongs = parameter.key.startswith(("gear_pair.", "gear_dynamics.", "operation."))
        words = named(fleet, parameter.key) if belongs and parameter.value is not None else None
        if words is not None and parameter.origin.startswith("assumed") and words[0] not in found:
            found.append(words[0].split(",")[0])
    return joined([begun_small(words) for words in found]) or say("nothing")
