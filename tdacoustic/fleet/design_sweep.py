"""``[[sweep]]``: other values of the fleet's parameters, each point a prediction of its own."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal, TypeAlias, get_args

from pydantic import AfterValidator, Field, PlainValidator, model_validator

from tdacoustic.fleet.keys import flat_keys
from tdacoustic.toml_models import Name, Table, each_once, nearest, shown

__all__ = ["MOST_POINTS", "DesignSweep", "Range", "Sampling", "Scale", "Swept"]

MOST_POINTS: Final = 100_000
"""Points that one ``[[sweep]]`` may have: an hour of one core with six conditions and point sources, 1.1 GB for
the tables."""

Sampling = Literal["grid", "latin_hypercube", "saltelli"]
Scale = Literal["linear", "log"]

_RANGE_KEYS: Final = ("from", "to", "scale")
_ENDS: Final = frozenset({"from", "to"})
"""A table with one of these keys is a range, another one holds keys of the fleet without quotes."""

_AS_LISTS: Final = '{ "masuda.constant_db" = [20, 30] }'
_AS_RANGES: Final = '{ "masuda.constant_db" = { from = 18, to = 26 } }'


@dataclass(frozen=True)
class Range:
    """Where a parameter may lie, each value as likely as any other.

    Parameters
    ----------
    low, high : float
        ``from`` and ``to`` in the file, in the unit of the key.
    scale : {"linear", "log"}
        ``"log"``: each ratio as likely, both ends above zero.
    """

    low: float
    high: float
    scale: Scale = "linear"


Swept: TypeAlias = tuple[Any, ...] | Range
"""Values of a grid, or the range of a parameter."""


def _parameters(value: Any) -> tuple[tuple[str, Swept], ...]:
    """A table of dotted keys with lists of values or with ranges; pairs stay, as they were made here before."""
    pairs = flat_keys(value, _ENDS) if isinstance(value, Mapping) else value if isinstance(value, tuple) else None
    if pairs is None or not all(isinstance(pair, tuple) and len(pair) == 2 for pair in pairs):
        raise ValueError(f"must be a table of lists, as {_AS_LISTS}, or of ranges, as {_AS_RANGES}, got {shown(value)}")
    if not pairs:
        raise ValueError(f"must name a key with a list of values, as {_AS_LISTS}, got an empty table")
    return tuple((key, _swept(key, held)) for key, held in pairs)


def _swept(key: str, held: Any) -> Swept:
    if isinstance(held, Range):
        return held
    if isinstance(held, Mapping):
        return _range(key, held)
    if not isinstance(held, tuple) or not held:
        raise ValueError(f"must have a list of values for {key!r}, got {shown(held)}")
    for number, one in enumerate(held):
        if not _is_finite(one):
            raise ValueError(f"must have finite values for {key!r}, got {shown(one)}")
        if any(one == other and isinstance(one, bool) == isinstance(other, bool) for other in held[:number]):
            raise ValueError(f"names {shown(one)} twice for {key!r}")
    return held


def _is_finite(value: Any) -> bool:
    if isinstance(value, tuple):
        return all(_is_finite(entry) for entry in value)
    return not isinstance(value, float) or math.isfinite(value)


def _range(key: str, held: Mapping[str, Any]) -> Range:
    unknown = next((name for name in held if name not in _RANGE_KEYS), None)
    if unknown is not None:
        near = nearest(unknown, _RANGE_KEYS)
        raise ValueError(f"names an unknown key {unknown!r} in the range of {key!r}; the nearest known key is {near!r}")
    for name in ("from", "to"):
        end = held.get(name)
        if isinstance(end, bool) or not isinstance(end, int | float) or not math.isfinite(end):
            got = shown(end) if name in held else "none"
            raise ValueError(f"must have a finite number as {name} in the range of {key!r}, got {got}")
    low, high, scale = held["from"], held["to"], held.get("scale", "linear")
    if scale not in get_args(Scale):
        raise ValueError(f"must have a scale of linear or log in the range of {key!r}, got {shown(scale)}")
    if low >= high:
        raise ValueError(f"must have from < to in the range of {key!r}, got from = {low:g} and to = {high:g}")
    if scale == "log" and low <= 0:
        raise ValueError(f'must have from > 0 in the range of {key!r} with scale = "log", got {low:g}')
    return Range(low, high, scale)


class DesignSweep(Table):
    """One ``[[sweep]]``: a design over the fleet's parameters.

    Parameters
    ----------
    name : str
        Unique.
    sampling : {"grid", "latin_hypercube", "saltelli"}
        All combinations of values; points spread over ranges, each of which is cut evenly; or the points from which
        variance-based indices are taken (Saltelli et al. 2010).
    points : int, optional
        Of a Latin hypercube.
    base_points : int, optional
        Of Saltelli's design, a power of two: it has base_points times parameters + 2 points.
    seed : int, optional
        Of a hypercube or of Saltelli's design; the same seed gives the same points. Default: made of the ranges.
    parameters : tuple of (str, tuple or Range)
        In the file a table: by dotted key of a parameter, or of an entry of a list, its values in the unit of the key,
        or with ranges ``{ from = 18, to = 26 }``. A grid is all combinations, the last key fastest.
    conditions : tuple of str
        Which to compute; default all.
    """

    name: Name
    sampling: Sampling = "grid"
    points: Annotated[int, Field(ge=2, le=MOST_POINTS)] | None = None
    base_points: Annotated[int, Field(ge=2)] | None = None
    seed: Annotated[int, Field(ge=0)] | None = None
    parameters: Annotated[tuple[tuple[str, Swept], ...], PlainValidator(_parameters)]
    conditions: Annotated[tuple[Name, ...], AfterValidator(each_once)] = ()

    @property
    def n_points(self) -> int:
        """How many points the design has."""
        if self.sampling == "grid":
            return math.prod(len(values) for values in self.values)
        return self.points or (self.base_points or 0) * (len(self.parameters) + 2)

    @property
    def keys(self) -> tuple[str, ...]:
        """Of the parameters."""
        return tuple(key for key, _ in self.parameters)

    @property
    def values(self) -> tuple[tuple[Any, ...], ...]:
        """Values of a grid's parameters; none of a design over ranges."""
        return tuple(held for _, held in self.parameters if not isinstance(held, Range))

    @property
    def ranges(self) -> tuple[Range, ...]:
        """Ranges of a design's parameters; none of a grid."""
        return tuple(held for _, held in self.parameters if isinstance(held, Range))

    @model_validator(mode="after")
    def _consistent(self) -> DesignSweep:
        self._say_what_is_needed()
        for key, held in self.parameters:
            if self.sampling == "grid" and isinstance(held, Range):
                raise ValueError(
                    f"parameters has a range for {key!r}: a grid takes lists of values; ranges need sampling = "
                    '"latin_hypercube" or "saltelli"'
                )
            if self.sampling != "grid" and not isinstance(held, Range):
                raise ValueError(
                    f"parameters has a list of values for {key!r}: sampling = {self.sampling!r} takes ranges, as "
                    f"{_AS_RANGES}"
                )
        base = self.base_points
        if base is not None and base & (base - 1):
            below = 1 << (base.bit_length() - 1)
            raise ValueError(f"base_points must be a power of two, as {below} or {2 * below}, got {base}")
        if self.n_points > MOST_POINTS:
            raise ValueError(f"{self._counted()} = {self.n_points} points, allowed are {MOST_POINTS}")
        return self

    def _say_what_is_needed(self) -> None:
        """Raise for keys that the kind of design needs, or has no use for."""
        needed = {"latin_hypercube": "points", "saltelli": "base_points"}.get(self.sampling)
        useless = [name for name in ("points", "base_points") if name != needed]
        useless += ["seed"] if self.sampling == "grid" else []
        given = [name for name in useless if getattr(self, name) is not None]
        told = [f"needs {needed}"] if needed is not None and getattr(self, needed) is None else []
        told += [f"has no use for {' and '.join(given)}"] if given else []
        if told:
            raise ValueError(f"sampling = {self.sampling!r} {' and '.join(told)}")

    def _counted(self) -> str:
        if self.sampling == "grid":
            return f"parameters has {' x '.join(str(len(values)) for values in self.values)}"
        return f"base_points has {self.base_points} x {len(self.parameters) + 2}"
