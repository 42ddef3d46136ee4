"""What a user says about a channel's scale, and whether it hangs together."""

from __future__ import annotations

from dataclasses import dataclass

from tdacoustic.errors import UnitError
from tdacoustic.units import (
    QUANTITIES,
    QUANTITY_SI_SYMBOL,
    Unit,
    parse_full_scale,
    parse_sensitivity,
    parse_unit,
    quantity_of_unit,
)

__all__ = ["ELECTRICAL_SYMBOLS", "Scale", "full_scale_of", "physical_unit_text", "si_symbols"]

ELECTRICAL_SYMBOLS = frozenset({"V", "C", "A"})
"""SI symbols a sensor's signal can have."""


def si_symbols(quantity: str) -> frozenset[str] | None:
    """SI symbols that values of a quantity may have; None where any may (tacho, other).

    Examples
    --------
    >>> sorted(si_symbols("speed"))
    ['1/s', 'm/s']
    """
    if quantity == "speed":
        return frozenset({"1/s", "m/s"})
    symbol = QUANTITY_SI_SYMBOL.get(quantity)
    return None if symbol is None else frozenset({symbol})


def physical_unit_text(sensitivity: str) -> str:
    """Return what stands below the fraction line of a sensitivity.

    Examples
    --------
    >>> physical_unit_text("10.2 mV/(m/s^2)")
    'm/s^2'
    """
    text = sensitivity.partition("/")[2].strip()
    return text[1:-1] if text.startswith("(") and text.endswith(")") else text


def full_scale_of(text: str) -> tuple[float, Unit]:
    """Read a full scale; a bare number, whose last digit could pass for a unit, is refused.

    Raises
    ------
    UnitError
        Not of the form ``"20 Pa"``.

    Examples
    --------
    >>> full_scale_of("20 Pa")[0]
    20.0
    """
    if not any(character.isalpha() or character in "%°" for character in text):
        raise UnitError(f"full_scale {text!r} is not of the form '20 Pa'")
    return parse_full_scale(text)


@dataclass(frozen=True)
class Scale:
    """The keys of a ``[[channel]]`` that say what its numbers mean.

    Parameters
    ----------
    quantity, unit, sensitivity, full_scale : str or None
        As in ``campaign.toml``.
    """

    quantity: str | None = None
    unit: str | None = None
    sensitivity: str | None = None
    full_scale: str | None = None

    def stated_quantity(self) -> str | None:
        """Return the quantity as stated, else as the sensitivity, the full scale or the unit implies it.

        An electrical unit or full scale beside no sensitivity implies nothing:
        volts may be any sensor's.

        Examples
        --------
        >>> Scale(unit="V", sensitivity="50 mV/Pa").stated_quantity()
        'sound_pressure'
        >>> Scale(unit="V").stated_quantity() is None
        True
        """
        if self.quantity is not None:
            return self.quantity
        if self.sensitivity is not None:
            return quantity_of_unit(physical_unit_text(self.sensitivity))
        if self.full_scale is not None:
            unit = full_scale_of(self.full_scale)[1]
            return None if unit.si_symbol in ELECTRICAL_SYMBOLS else quantity_of_unit(unit.symbol)
        if self.unit is not None and parse_unit(self.unit).si_symbol not in ELECTRICAL_SYMBOLS:
            return quantity_of_unit(self.unit)
        return None

    def check(self) -> None:
        """Raise where the keys are not understood or contradict each other.

        Raises
        ------
        UnitError
            The message begins with the key.
        """
        if self.quantity is not None and self.quantity not in QUANTITIES:
            raise UnitError(f"quantity must be one of {', '.join(QUANTITIES)}, got {self.quantity!r}")
        unit = parse_unit(self.unit) if self.unit is not None else None
        full_scale = full_scale_of(self.full_scale)[1] if self.full_scale is not None else None
        if unit is not None and full_scale is not None and unit.si_symbol != full_scale.si_symbol:
            raise UnitError(f"full_scale {self.full_scale!r} does not fit unit {self.unit!r}")
        allowed = si_symbols(self.quantity) if self.quantity is not None else None
        wanted = " or ".join(sorted(allowed or ()))
        if self.sensitivity is None:
            for key, text, given in (("unit", self.unit, unit), ("full_scale", self.full_scale, full_scale)):
                if given is None or allowed is None or given.si_symbol in ELECTRICAL_SYMBOLS | allowed:
                    continue
                raise UnitError(f"{key} {text!r} does not fit quantity {self.quantity!r}, which is in {wanted}")
            return
        if self.quantity == "tacho":
            raise UnitError("sensitivity has no meaning for a tacho, whose pulses are counted; leave it out")
        sensitivity = parse_sensitivity(self.sensitivity)
        if allowed is not None and sensitivity.physical_si_symbol not in allowed:
            raise UnitError(
                f"sensitivity {self.sensitivity!r} does not fit quantity {self.quantity!r}, which is in {wanted}"
            )
        for key, text, given in (("unit", self.unit, unit), ("full_scale", self.full_scale, full_scale)):
            if given is not None and given.si_symbol != sensitivity.electrical_si_symbol:
                raise UnitError(
                    f"{key} {text!r} does not fit sensitivity {self.sensitivity!r}, "
                    f"which is for {sensitivity.electrical_si_symbol}"
                )
