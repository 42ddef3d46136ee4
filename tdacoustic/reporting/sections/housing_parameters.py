"""Words for the parameters of the housing and of the sound field."""

from __future__ import annotations

from typing import Final

from tdacoustic.fleet import Fleet
from tdacoustic.reporting.language import mark, say
from tdacoustic.reporting.sections.gear_words import gear_word

__all__ = ["HOUSING_SECTIONS", "housing_named"]

HOUSING_SECTIONS: Final = ("housing.", "radiation.", "model.")
"""What keys of `housing_named` begin with, places of sources aside."""

_FIELD: Final = {
    "radiation.method": (mark("How the sound field is computed"), ""),
    "radiation.space": (mark("Space around the drive"), ""),
    "radiation.max_frequency_hz": (mark("Frequency up to which forces are listed"), "Hz"),
    "radiation.sphere_radius_m": (mark("Radius of the surface that levels are averaged over"), "m"),
    "radiation.circle_radius_m": (mark("Radius of the circle of directions"), "m"),
    "radiation.temperature_degc": (mark("Temperature of the air"), "°C"),
    "model.gear_path": (mark("What of the gears the total adds"), ""),
    "model.motor_gain_db": (mark("Added to the motor's sound power levels"), "dB"),
}
_WITH_HOUSING: Final = {
    "radiation.max_frequency_hz": (mark("Highest frequency of the housing and of listed forces"), "Hz"),
    "radiation.elements_per_wavelength": (mark("Boundary elements a wavelength"), ""),
    "radiation.map_half_width_m": (mark("Maps close to the housing: from the drive's centre to their edges"), "m"),
    "radiation.map_spacing_m": (mark("Maps close to the housing: between their points"), "m"),
    "model.coupling": (mark("Coupling of gears and housing"), ""),
    "model.structure_gain_db": (mark("Added to the structure's levels"), "dB"),
    "motor.position_m": (mark("Position of the motor's sources, x, y, z"), "m"),
    "masuda.position_m": (mark("Position of the mesh's source, x, y, z"), "m"),
    "housing.size_m": (mark("Housing: size along the shafts, along travel, up"), "m"),
    "housing.step_file": (mark("Housing: STEP file"), ""),
    "housing.position_m": (mark("Housing: its middle in the drive's frame, x, y, z"), "m"),
    "housing.wall_mm": (mark("Housing: thickness of the end walls"), "mm"),
    "housing.bearing_panel_mm": (mark("Housing: thickness of the bearing panels"), "mm"),
    "housing.top_bottom_mm": (mark("Housing: thickness of top and bottom"), "mm"),
    "housing.material.modulus_gpa": (mark("Housing: modulus of elasticity"), "GPa"),
    "housing.material.density_kg_m3": (mark("Housing: density"), "kg/m³"),
    "housing.material.poisson": (mark("Housing: Poisson's ratio"), ""),
    "housing.loss_factor": (mark("Housing: loss factor"), ""),
    "housing.cavity_loss_factor": (mark("Housing: loss factor of the air inside"), ""),
    "housing.hanger_stiffness_n_per_m": (mark("Housing: stiffness of the hanger, x, y, z"), "N/m"),
}
_SEAT: Final = {
    "position_m": (mark("Seats of the {shaft}: x and z of the shaft, y of its gear"), "m"),
    "radius_m": (mark("Seats of the {shaft}: radius"), "m"),
    "thickness_mm": (mark("Seats of the {shaft}: thickness, panel included"), "mm"),
    "stiffness_n_per_m": (mark("Seats of the {shaft}: springs at each of the two, x, y, z"), "N/m"),
}


def housing_named(fleet: Fleet, key: str) -> tuple[str, str] | None:
    """Return words and unit of a parameter of housing or sound field that the model uses, None of another."""
    with_housing = fleet.radiation.method.value == "boundary_elements"
    if with_housing and key == "housing.position_m" and fleet.step_path is not None:
        return say("Housing: origin of its STEP file in the drive's frame, x, y, z"), "m"
    if with_housing and key.startswith("housing.seat.") and fleet.housing is not None:
        number, _, last = key.removeprefix("housing.seat.").partition(".")
        if last in _SEAT:
            words, unit = _SEAT[last]
            return say(words, shaft=gear_word(fleet.housing.seat[int(number) - 1].shaft)), unit
    found = (_FIELD | _WITH_HOUSING if with_housing else _FIELD).get(key)
    return None if found is None else (say(found[0]), found[1])
