"""Local columns: their numbers, how they are scaled, and their unit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from tdacoustic.errors import FormatError, UnitError
from tdacoustic.formats.atfx.components import ComponentFiles, NotNumbersError
from tdacoustic.formats.atfx.document import ComponentText, InlineText, Instance
from tdacoustic.formats.atfx.graph import Graph, label_of
from tdacoustic.formats.atfx.values import Component, Implicit, Inline, Part, find_inline
from tdacoustic.formats.integers import full_scale_of
from tdacoustic.units import parse_unit

__all__ = ["Column", "Source", "Unit", "read_column"]

REPRESENTATIONS = (
    *("explicit", "implicit_constant", "implicit_linear", "implicit_saw", "raw_linear", "raw_polynomial", "formula"),
    *("external_component", "raw_linear_external", "raw_polynomial_external", "raw_linear_calibrated"),
    *("raw_linear_calibrated_external", "raw_rational", "raw_rational_external"),
)
"""``seq_rep_enum`` of the base model, in the order of its numbers."""

INLINE_INTEGERS = {"a_int8": (0, 255), "a_int16": (-(2**15), 2**15 - 1), "a_int32": (-(2**31), 2**31 - 1)}
INLINE_NUMBERS = frozenset({*INLINE_INTEGERS, "a_int64", "a_float32", "a_float64"})
VALID, DEFINED = 1, 8
"""Bits of a value's flag: both must be set, or the value is none."""
MAX_GRADE = 12


@dataclass(frozen=True)
class Unit:
    """A unit as the file has it.

    Parameters
    ----------
    name : str or None
    factor : float or None
        To the unit of its physical dimension.
    is_time : bool
        Whether its physical dimension is time alone.
    """

    name: str | None = None
    factor: float | None = None
    is_time: bool = False


@dataclass(frozen=True)
class Source:
    """Where a column's numbers are, and what is made of them.

    Parameters
    ----------
    parts : tuple of Component, Inline or Implicit
        One after the other.
    coefficients : tuple of float
        Of the polynomial that is made of a stored number; empty where it is taken as it is.
    flags : tuple of Component or Inline
        A flag for each value, one after the other; empty where there are none.
    """

    parts: tuple[Part, ...]
    coefficients: tuple[float, ...] = ()
    flags: tuple[Component | Inline, ...] = ()

    @property
    def n_values(self) -> int:
        """Number of values."""
        return sum(part.n_values for part in self.parts)


@dataclass(frozen=True)
class Column:
    """A local column.

    Parameters
    ----------
    name : str
    source : Source or None
        None where it is left out.
    reason : str
        Why it is left out.
    independent : bool
        Whether others are measured over it.
    unit : Unit
    limits : (float, float) or None
        Ends of the stored type of integers, scaled.
    full_scale : float or None
        See `tdacoustic.recording.LogChannel`.
    stated_range : (float, float) or None
        Smallest and largest value that the file states.
    flags : tuple of str
    """

    name: str
    source: Source | None
    reason: str
    independent: bool
    unit: Unit
    limits: tuple[float, float] | None = None
    full_scale: float | None = None
    stated_range: tuple[float, float] | None = None
    flags: tuple[str, ...] = ()


def read_column(
    path: Path, stream: BinaryIO, graph: Graph, files: ComponentFiles, column: Instance, n_rows: int | None
) -> Column:
    """Read what the file says of a local column.

    Parameters
    ----------
    path : Path
    stream : BinaryIO
        The log itself.
    graph : Graph
    files : ComponentFiles
    column : Instance
    n_rows : int or None
        Of its submatrix, where it states them.

    Raises
    ------
    FormatError
        What it claims cannot be, or is not there.
    """
    quantity = graph.only(column, "measurement_quantity", "aomeasurementquantity", "local_columns")
    name = column.attributes.get("name") or (quantity.attributes.get("name", "") if quantity else "")
    flags: list[str] = []
    unit = _unit(graph, quantity, flags)
    independent = column.attributes.get("independent", "0").lower() in ("1", "true")
    source, reason, limits, full_scale = None, "", None, None
    global_flag = column.attributes.get("global_flag")
    try:
        if global_flag and "flags" not in column.arrays and not _is_valid(graph.count(column, "global_flag")):
            raise NotNumbersError(f"its global flag, {global_flag[:20]}, says that its values are not valid")
        source = _source(path, stream, graph, files, column, n_rows)
        limits, full_scale = _limits(column, source, unit, flags)
    except NotNumbersError as error:
        reason = str(error)
    if source is not None and n_rows is not None and source.n_values != n_rows:
        raise FormatError(
            f"{path}: {label_of(column)} has {source.n_values} values, its submatrix claims {n_rows} rows"
        )
    stated = _stated_range(graph, column, quantity)
    return Column(name, source, reason, independent, unit, limits, full_scale, stated, tuple(flags))


def _is_valid(flag: int) -> bool:
    return flag & VALID != 0 and flag & DEFINED != 0


def _source(
    path: Path, stream: BinaryIO, graph: Graph, files: ComponentFiles, column: Instance, n_rows: int | None
) -> Source:
    label = label_of(column)
    text = column.attributes.get("sequence_representation", "").strip().lower()
    kind = REPRESENTATIONS[int(text)] if text.isdigit() and int(text[:6]) < len(REPRESENTATIONS) else text or "explicit"
    if kind not in REPRESENTATIONS:
        raise FormatError(f"{path}: {label}: its sequence representation {text[:40]!r} is not known")
    if kind in ("formula", "implicit_saw") or kind.startswith("raw_rational"):
        raise NotNumbersError(f"its sequence representation is {kind}, which is not read")
    parameters = _parameters(path, label, column, kind)
    if kind.startswith("implicit_"):
        if n_rows is None:
            raise FormatError(f"{path}: {label} is {kind}, but nothing says how many values it has")
        step = parameters[1] if kind == "implicit_linear" else 0.0
        return Source((Implicit(parameters[0], step, n_rows),))
    parts = _parts(path, stream, graph, files, column)
    source = Source(parts, _coefficients(path, label, kind, parameters), _flags(path, stream, graph, files, column))
    if source.flags and sum(part.n_values for part in source.flags) != source.n_values:
        n_flags = sum(part.n_values for part in source.flags)
        raise FormatError(f"{path}: {label} has {source.n_values} values and {n_flags} flags")
    return source


def _parameters(path: Path, label: str, column: Instance, kind: str) -> list[float]:
    words = column.attributes.get("generation_parameters", "").split()
    kind = kind.removesuffix("_external")
    wanted = {"implicit_constant": 1, "implicit_linear": 2, "raw_linear": 2, "raw_linear_calibrated": 3}.get(kind)
    if wanted is None and kind != "raw_polynomial":
        return []
    try:
        numbers = [float(word.replace("_", "?")) for word in words]
    except ValueError:
        numbers = [math.nan]
    if not all(map(math.isfinite, numbers)):
        raise FormatError(f"{path}: {label}: its generation parameters are no numbers: {' '.join(words)[:60]!r}")
    grade = int(numbers[0]) if numbers and 0 <= numbers[0] <= MAX_GRADE else -1
    wanted = grade + 2 if wanted is None else wanted
    if len(numbers) != wanted or (kind == "raw_polynomial" and numbers[0] != grade):
        need = "a grade and its coefficients" if kind == "raw_polynomial" else f"{wanted}"
        raise FormatError(f"{path}: {label} is {kind} and needs {need} as generation parameters, got {words[:6]}")
    return numbers


def _coefficients(path: Path, label: str, kind: str, parameters: list[float]) -> tuple[float, ...]:
    """Coefficients of the polynomial of the stored number, after the ODS base model."""
    kind = kind.removesuffix("_external")
    if kind == "raw_linear":
        found = (parameters[0], parameters[1])
    elif kind == "raw_linear_calibrated":
        found = (parameters[0] * parameters[2], parameters[1] * parameters[2])
    elif kind == "raw_polynomial":
        return tuple(parameters[1:])
    else:
        return ()
    if found[1] == 0.0:
        raise FormatError(f"{path}: {label}: the factor of its values is 0")
    return found


def _parts(
    path: Path, stream: BinaryIO, graph: Graph, files: ComponentFiles, column: Instance
) -> tuple[Component | Inline, ...]:
    label = label_of(column)
    array = column.arrays.get("values")
    external = _external(graph, column)
    if external and array is not None and not _is_empty(array):
        raise FormatError(f"{path}: {label} has values and external components")
    if external:
        return tuple(files.of_instance(label, instance) for instance in external)
    if array is None:
        raise FormatError(f"{path}: {label} has no values")
    if isinstance(array, ComponentText):
        return (files.of_text(label, array),)
    if array.kind.lower() not in INLINE_NUMBERS:
        raise NotNumbersError(f"its values are of type {array.kind[:40]}")
    return (find_inline(path, stream, array.start, array.end),)


def _is_empty(array: InlineText | ComponentText) -> bool:
    return isinstance(array, InlineText) and array.end - array.start < len(array.kind) + 4


def _external(graph: Graph, column: Instance) -> list[Instance]:
    """External components of a column in their order."""
    found = graph.related(column, "external_component", "aoexternalcomponent", "local_column")
    if len(found) < 2:
        return found
    numbers = [graph.count(instance, "ordinal_number") for instance in found]
    if len(set(numbers)) < len(numbers):
        raise FormatError(
            f"{graph.path}: {label_of(column)} has {len(found)} external components whose order is not clear"
        )
    return [instance for _, instance in sorted(zip(numbers, found, strict=True), key=lambda pair: pair[0])]


def _flags(
    path: Path, stream: BinaryIO, graph: Graph, files: ComponentFiles, column: Instance
) -> tuple[Component | Inline, ...]:
    label = f"{label_of(column)}, flags"
    array = column.arrays.get("flags")
    if isinstance(array, ComponentText):
        return (files.of_text(label, array),)
    if array is not None:
        inline = find_inline(path, stream, array.start, array.end)
        return (inline,) if inline.n_values else ()
    external = [files.flags_of_instance(label_of(column), instance) for instance in _external(graph, column)]
    found = tuple(item for item in external if item is not None)
    if found and len(found) < len(external):
        raise FormatError(f"{path}: {label}: only {len(found)} of {len(external)} external components have them")
    return found


def _limits(
    column: Instance, source: Source, unit: Unit, flags: list[str]
) -> tuple[tuple[float, float] | None, float | None]:
    """Ends of the stored type, and full scale where there is neither a unit nor a scaling."""
    part = source.parts[0]
    if isinstance(part, Component) and np.dtype(part.dtype).kind in "iu":
        info = np.iinfo(part.dtype)
        low, high = float(info.min), float(info.max)
    elif isinstance(part, Inline) and isinstance(array := column.arrays["values"], InlineText):
        if array.kind.lower() not in INLINE_INTEGERS:
            return None, None
        low, high = map(float, INLINE_INTEGERS[array.kind.lower()])
    else:
        return None, None
    if len(source.coefficients) > 2:
        return None, None
    constant, factor = source.coefficients or (0.0, 1.0)
    ends = sorted((constant + factor * low, constant + factor * high))
    full_scale = None
    if unit.name is None and not source.coefficients:
        full_scale, notes = full_scale_of(low, high)
        flags.extend(notes)
    return (ends[0], ends[1]), full_scale


def _stated_range(graph: Graph, column: Instance, quantity: Instance | None) -> tuple[float, float] | None:
    for instance in (column, quantity):
        if instance is None:
            continue
        low, high = graph.number(instance, "minimum"), graph.number(instance, "maximum")
        if low is not None and high is not None and low < high:
            return low, high
    return None


def _unit(graph: Graph, quantity: Instance | None, flags: list[str]) -> Unit:
    """Unit of a measurement quantity, else the default unit of its quantity."""
    if quantity is None:
        return Unit()
    unit = graph.only(quantity, "unit", "aounit", "measurement_quantities")
    if unit is None:
        general = graph.only(quantity, "quantity", "aoquantity", "measurement_quantities")
        unit = None if general is None else graph.only(general, "default_unit", "aounit", "quantities")
        if unit is None:
            return Unit()
        flags.append(f"it states no unit: the default unit of its quantity, {unit.attributes.get('name')!r}, is taken")
    dimension = graph.only(unit, "phys_dimension", "aophysicaldimension", "units")
    exponents = {} if dimension is None else {key: graph.number(dimension, key) for key in dimension.attributes}
    is_time = exponents.get("time_exp") == 1.0 and not any(
        value for key, value in exponents.items() if key not in ("name", "time_exp")
    )
    name = unit.attributes.get("name") or None
    if name is not None and name.lower() in ("-", "none", "undef", "undefined", "n/a", "unknown", "?"):
        name = None if name != "-" else name
    factor = graph.number(unit, "factor")
    _check_factor(name, factor, flags)
    return Unit(name, factor, is_time)


def _check_factor(name: str | None, factor: float | None, flags: list[str]) -> None:
    """Flag a unit whose factor says something else than its name; a rate of turn may be in turns or in radians."""
    if name is None or factor is None:
        return
    try:
        known = parse_unit(name)
    except UnitError:
        return
    meant = {known.factor}
    if known.si_symbol == "1/s":
        meant |= {known.factor * 2.0 * math.pi, known.factor * 60.0}
    if known.si_symbol == "1":
        return
    if not any(math.isclose(factor, value, rel_tol=1e-4) for value in meant):
        flags.append(f"the log says that 1 {name} is {factor:g} {known.si_symbol}: the unit's name is taken, not that")
