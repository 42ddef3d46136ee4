"""Which single numbers of a fleet can be moved, and how a fleet with one of them moved is made."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, Literal

from tdacoustic.fleet import Fleet
from tdacoustic.fleet.parameter import ASSUMED

__all__ = ["LeftOut", "Variation", "variations_of"]

_NO_NUMBERS_OF_THE_DRIVE: Final = (
    *("operation.train_speed_km_h", "operation.helix_angle_deg"),  # they say what is computed
)
_OF_THE_AIR: Final = ("radiation.temperature_degc", "radiation.humidity_percent")
"""What ``[radiation]`` says of the world; its other numbers say where and how finely to compute."""
_MULTIPLES: Final = ("carrier", "supply", "shaft")
_LAWS: Final = {
    "operation.torque_n_m": "constant",
    "operation.power_kw": "constant_power",
    "operation.resistance_n": "running_resistance",
    "operation.torque_table": "table",
}


@dataclass(frozen=True)
class Variation:
    """A number of a fleet that can be moved.

    Parameters
    ----------
    key : str
        Of a parameter, or of an entry of a list; of a table over speed all rows move together.
    origin : str
    value : float or None
        In the unit that the key names; None of a table.
    kind : {"relative", "level"}
        A level in dB moves by dB, all else by a factor.
    """

    key: str
    origin: str
    value: float | None
    kind: Literal["relative", "level"]

    @property
    def is_assumed(self) -> bool:
        """Whether nothing outside of us stands behind the value."""
        return self.origin.startswith(ASSUMED)

    def moved_value(self, amount: float) -> float | None:
        """Return the value moved by a factor, or by dB; None of a table."""
        if self.value is None:
            return None
        return self.value + amount if self.kind == "level" else self.value * amount

    def moved(self, fleet: Fleet, amount: float) -> Fleet:
        """Return a fleet with the number moved by a factor, or by dB; its origin stays.

        Raises
        ------
        FleetError
            A file could not have that value.
        """
        if self.value is not None:
            return fleet.replaced({self.key: self.moved_value(amount)}, origin=self.origin)
        rows = fleet.value_of(self.key)
        add, by = (amount, 1.0) if self.kind == "level" else (0.0, amount)
        moved = tuple((row[0], *(by * number + add for number in row[1:])) for row in rows)
        return fleet.replaced({self.key: moved}, origin=self.origin)


@dataclass(frozen=True)
class LeftOut:
    """A number of a fleet that was not moved.

    Parameters
    ----------
    key, origin : str
    reason : str
    """

    key: str
    origin: str
    reason: str


def variations_of(fleet: Fleet) -> Iterator[Variation | LeftOut]:
    """Yield the numbers of a fleet; words, whole numbers and what only says what to compute are no numbers here.

    Parameters
    ----------
    fleet : Fleet
    """
    for stated in fleet.parameters():
        last = stated.key.rpartition(".")[2]
        law = _LAWS.get(stated.key)
        multiple = stated.key.startswith("motor.excitation.") and last in _MULTIPLES
        other_law = law is not None and law != fleet.operation.torque.value
        of_method = stated.key.startswith("radiation.") and stated.key not in _OF_THE_AIR
        if stated.key in _NO_NUMBERS_OF_THE_DRIVE or multiple or other_law or of_method:
            continue
        yield from _of_value(stated.key, stated.origin, stated.value)


def _of_value(key: str, origin: str, value: Any) -> Iterator[Variation | LeftOut]:
    kind: Literal["relative", "level"] = "level" if key.partition("_db")[1] else "relative"
    if isinstance(value, float):
        if value == 0.0 and kind == "relative":
            yield LeftOut(key, origin, "is 0, which no factor moves")
        else:
            yield Variation(key, origin, value, kind)
    elif isinstance(value, tuple) and value and all(isinstance(row, tuple) for row in value):
        yield Variation(key, origin, None, kind)
    elif isinstance(value, tuple) and all(isinstance(entry, float) for entry in value):
        for number, entry in enumerate(value, 1):
            yield from _of_value(f"{key}.{number}", origin, entry)
