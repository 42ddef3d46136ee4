"""What loads, responses and reports need of a housing, whichever way its shape is given."""

from __future__ import annotations

from typing import Protocol

from tdacoustic.housing.box import Seat

__all__ = ["Seated"]


class Seated(Protocol):
    """A housing with two seats for each of two shafts: `Box`, or `SolidHousing` of a STEP file."""

    @property
    def seats(self) -> tuple[Seat, Seat]:
        """Of pinion and wheel."""
        ...

    @property
    def loss_factor(self) -> float:
        """Structural."""
        ...

    @property
    def extent_m(self) -> tuple[float, float, float]:
        """Outer dimensions along x, y, z."""
        ...

    def share_of_left(self, seat: Seat) -> float:
        """Part of a gear's bearing force that the bearing at +y takes."""
        ...
