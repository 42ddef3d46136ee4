"""``[radiation]``: from surfaces and sources to the sound field."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from tdacoustic.fleet.parameter import Parameter, default
from tdacoustic.toml_models import Positive, Table

__all__ = ["Radiation"]


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
