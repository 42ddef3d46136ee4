"""From a calibrated fleet to the next one: what was found there is known before, at a discount."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from tdacoustic.errors import FittingError
from tdacoustic.fitting.parameters import FreeParameter
from tdacoustic.fleet import Fleet

__all__ = ["Transferred", "transferred_priors"]


@dataclass(frozen=True)
class Transferred:
    """A parameter of a calibrated fleet as prior of another one's.

    Parameters
    ----------
    key : str
    earlier : float
    earlier_stderr : float
    origin : str
        Of the earlier value.
    prior_sigma : float
        Its standard deviation times the discount, in the parameter's own unit.
    alone, alone_stderr : float or None
        What the new data say without any of the priors carried over; None where they do not determine it.
    """

    key: str
    earlier: float
    earlier_stderr: float
    origin: str
    prior_sigma: float
    alone: float | None = None
    alone_stderr: float | None = None

    @property
    def difference(self) -> float | None:
        """New less earlier value over the deviation of the new one and of the prior; None where there is no new one."""
        if self.alone is None or self.alone_stderr is None:
            return None
        spread = math.hypot(self.alone_stderr, self.prior_sigma)
        return (self.alone - self.earlier) / spread if spread > 0.0 else None


def transferred_priors(
    free: Sequence[FreeParameter], earlier: Fleet, discount: float
) -> tuple[tuple[FreeParameter, ...], tuple[Transferred, ...]]:
    """Return the parameters with priors from a calibrated fleet, and what was carried over.

    A parameter that has a prior of its own keeps it, and so does one that was not calibrated there.

    Parameters
    ----------
    free : sequence of FreeParameter
    earlier : Fleet
        Calibrated: its parameters carry standard deviations.
    discount : float
        Factor, at least 1, on the earlier standard deviation: another fleet is not the same.

    Raises
    ------
    FittingError
        A discount below 1, or an earlier fleet of which no free parameter was calibrated.
    """
    if not discount >= 1.0:
        raise FittingError(f"prior_discount must be >= 1, got {discount!r}")
    made, carried = [], []
    for parameter in free:
        found = _carried(parameter, earlier, discount)
        made.append(parameter if found is None else _with_prior(parameter, found))
        carried += [] if found is None else [found]
    if not carried:
        raise FittingError(
            f"{earlier.path}: none of {', '.join(p.name for p in free)} was calibrated there (a calibrated value has a "
            "stderr)"
        )
    return tuple(made), tuple(carried)


def _carried(parameter: FreeParameter, earlier: Fleet, discount: float) -> Transferred | None:
    stated = next((held for held in earlier.parameters() if held.key == parameter.name), None)
    if stated is None or not stated.stderr or parameter.prior is not None or not parameter.is_moved:
        return None
    sigma = discount * stated.stderr
    return Transferred(parameter.name, float(stated.value), float(stated.stderr), stated.origin, sigma)


def _with_prior(parameter: FreeParameter, carried: Transferred) -> FreeParameter:
    if parameter.scale == "log":
        return replace(parameter, prior=(math.log(carried.earlier), carried.prior_sigma / carried.earlier))
    return replace(parameter, prior=(carried.earlier, carried.prior_sigma))
