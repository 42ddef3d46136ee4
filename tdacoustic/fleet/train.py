"""``[train]``: what rolls."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from tdacoustic.fleet.parameter import Parameter
from tdacoustic.toml_models import Table

__all__ = ["Train"]


class Train(Table):
    """``[train]``.

    Parameters
    ----------
    wheel_diameter_mm : Parameter of float
        Of the rolling circle, 100 to 3000 (a metre in millimetres is a common slip); a run may state a worn one.
    """

    wheel_diameter_mm: Parameter[Annotated[float, Field(ge=100.0, le=3000.0)]]

    @property
    def wheel_diameter_m(self) -> float:
        """In metres."""
        return 1e-3 * self.wheel_diameter_mm.value
