"""``[radiation]``: from surfaces and sources to the sound field."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import Field, model_validator

from tdacoustic.fleet.parameter import Parameter, default
from tdacoustic.toml_models import Name, Positive, Table

__all__ = ["Radiation"]

MOST_CELLS: Final = 300
"""Along a side of a map: three planes of so many take minutes a condition."""


class Radiation(Table):
    """``[radiation]``.

    Parameters
    ----------
    method : Parameter of str
        ``"point_sources"`` or ``"boundary_elements"``.
    space : Parameter of str
        ``"free"`` or ``"half"``.
    max_frequency_hz, elements_per_wavelength : Parameter of float
    sphere_radius_m : Parameter of float
        Of the surface whose level is averaged.
    circle_radius_m : Parameter of float
        Of the directivity.
    temperature_degc, humidity_percent : Parameter of float
        Of the air.
    air_absorption : Parameter of bool
        Whether the air takes from tones on their way (ISO 9613-1).
    map_conditions : tuple of str
        Conditions whose field is mapped in three planes around the housing; none unless named.
    map_half_width_m, map_spacing_m : Parameter of float
        Of the maps: from the drive's centre to their edges, and between their points.
    """

    method: Parameter[Literal["point_sources", "boundary_elements"]] = default("point_sources")
    space: Parameter[Literal["free", "half"]] = default("free")
    max_frequency_hz: Parameter[Positive] = default(3000.0)
    elements_per_wavelength: Parameter[Positive] = default(7.5)
    sphere_radius_m: Parameter[Positive] = default(4.0, "paper, section 5.1")
    circle_radius_m: Parameter[Positive] = default(12.0, "paper, section 5.1")
    temperature_degc: Parameter[Annotated[float, Field(ge=-60.0, le=80.0)]] = default(20.0)
    humidity_percent: Parameter[Annotated[float, Field(ge=0.0, le=100.0)]] = default(50.0)
    air_absorption: Parameter[bool] = default(False)
    map_conditions: tuple[Name, ...] = ()
    map_half_width_m: Parameter[Positive] = default(1.5)
    map_spacing_m: Parameter[Positive] = default(0.05)

    @model_validator(mode="after")
    def _maps_can_be(self) -> Radiation:
        twice = next((n for i, n in enumerate(self.map_conditions) if n in self.map_conditions[:i]), None)
        if twice is not None:
            raise ValueError(f"map_conditions names {twice!r} twice")
        most = 2.0 * self.map_half_width_m.value / self.map_spacing_m.value
        if not 2.0 <= most <= MOST_CELLS:
            raise ValueError(
                f"map_spacing_m must divide the maps into 2 to {MOST_CELLS} cells along a side of "
                f"{2.0 * self.map_half_width_m.value:g} m, got {self.map_spacing_m.value:g} m"
            )
        return self
