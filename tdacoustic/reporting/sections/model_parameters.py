"""What the model rests on: every parameter of gears, housing and sound field that it used, assumed ones tagged."""

from __future__ import annotations

from typing import Final

from tdacoustic.fleet import Fleet
from tdacoustic.reporting.document import Block, Notice, Section
from tdacoustic.reporting.language import say
from tdacoustic.reporting.sections.housing_parameters import housing_named
from tdacoustic.reporting.sections.meshing_noise import PARAMETERS as MASUDA
from tdacoustic.reporting.sections.parameters import parameter_table
from tdacoustic.reporting.sections.words import joined
from tdacoustic.results import FleetPrediction

__all__ = ["assumed_words", "model_parameters", "named"]

_PAIR: Final = {
    "teeth": ("Teeth of pinion and wheel", ""),
    "normal_module_mm": ("Normal module", "mm"),
    "pressure_angle_deg": ("Pressure angle of the rack", "°"),
    "helix_angle_deg": ("Helix angle", "°"),
    "addendum_coefficient": ("Addendum coefficient", ""),
    "clearance_coefficient": ("Clearance coefficient", ""),
    "profile_shift": ("Profile shifts of pinion and wheel", ""),
    "centre_distance_mm": ("Centre distance", "mm"),
    "face_width_mm": ("Face width", "mm"),
    "backlash_um": ("Backlash, 2b", "µm"),
    "transmission_error_um": ("Transmission error at mesh x1, x2, ...", "µm"),
}
_DYNAMICS: Final = {
    "mass_kg": ("Masses of pinion and wheel", "kg"),
    "inertia_kg_m2": ("Inertias of pinion and wheel", "kg m²"),
    "pinion_bearing_stiffness_n_per_m": ("Bearing stiffness of the pinion, x, y, z", "N/m"),
    "wheel_bearing_stiffness_n_per_m": ("Bearing stiffness of the wheel, x, y, z", "N/m"),
    "bearing_damping_ratio": ("Damping ratio of the bearings", ""),
    "mesh_damping_ratio": ("Damping ratio of the mesh", ""),
    "mesh_damping": ("When the mesh damps", ""),
}
_OPERATION: Final = {
    "train_speed_km_h": ("Train speeds", "km/h"),
    "mode": ("Mode of operation", ""),
    "torque": ("Law of the torque", ""),
    "helix_angle_deg": ("Helix angles of the sweep", "°"),
}
_OF_LAW: Final = {
    "constant": ("torque_n_m", ("Torque of one motor", "N m")),
    "constant_power": ("power_kw", ("Power of one motor", "kW")),
    "running_resistance": ("resistance_n", ("Resistance of one drive, a, b V, c V²", "N, V in km/h")),
    "table": ("torque_table", ("Torque of one motor", "N m")),
}
_OTHERS: Final = {
    "train.wheel_diameter_mm": ("Wheel diameter", "mm"),
}


def model_parameters(result: FleetPrediction) -> Section:
    """Return the section on what the model rests on."""
    fleet = result.fleet
    parts = say("gears and sound field") if result.prediction.housing is None else say("gears, housing and sound field")
    caption = say(
        "Parameters that the model of {parts} used, from the fleet file of {name}", parts=parts, name=fleet.name
    )
    table = parameter_table("model-parameters", caption, fleet, lambda key: named(fleet, key))
    standing = [row[2] for row in table.rows]
    assumed = standing.count("assumed")
    blocks: list[Block] = [table]
    if assumed:
        text = say(
            "{assumed} of {n_standing} parameters are assumed: they come from no drawing and no measurement.",
            assumed=assumed,
            n_standing=len(standing),
        )
        blocks.insert(0, Notice("assumed", text))
    return Section("model-parameters", say("What the model rests on"), blocks)


def named(fleet: Fleet, key: str) -> tuple[str, str] | None:
    """Return words and unit of a parameter that the model of gears, housing and sound field uses, None of another."""
    if key in _OTHERS or key in MASUDA:
        return {**_OTHERS, **MASUDA}[key]
    section, _, last = key.rpartition(".")
    if section == "gear_dynamics":
        return _DYNAMICS.get(last)
    if section == "operation":
        law, words = _OF_LAW[fleet.operation.torque.value]
        return words if last == law else _OPERATION.get(last)
    if section == f"gear_pair.{fleet.modelled_pair_number}":
        return _PAIR.get(last)
    if section.startswith("gear_pair.") and last == "teeth":
        return say(
            "Teeth of gear pair {name}, for its ratio", name=fleet.gear_pair[int(section.split(".")[1]) - 1].name
        ), ""
    return housing_named(fleet, key)


def assumed_words(fleet: Fleet) -> str:
    """Name the assumed parameters of gears, bearings and load, in a sentence."""
    found = []
    for parameter in fleet.parameters():
        belongs = parameter.key.startswith(("gear_pair.", "gear_dynamics.", "operation."))
        words = named(fleet, parameter.key) if belongs and parameter.value is not None else None
        if words is not None and parameter.origin.startswith("assumed") and words[0] not in found:
            found.append(words[0].split(",")[0])
    return joined([f"{words[:1].lower()}{words[1:]}" for words in found]) or "nothing"
