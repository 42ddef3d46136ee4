"""Layouts of MAT-files that measuring programs export, as far as their shape is known.

*Simcenter Testlab* saves each signal, or each group of signals of one raster, as a
structure with ``x_values`` (``start_value``, ``increment``, ``number_of_values``,
``quantity.label``), ``y_values`` (``values``, one column a channel;
``quantity.label`` and ``quantity.unit_transformation.factor``) and
``function_record`` (``name``, a text or a list of texts). The values are in SI
units; times the factor they are in the unit of the label.

*B&K PULSE* and *HBM catman* save ``File_Header`` (``SampleFrequency``,
``NumberOfSamplesPerChannel``, ``NumberOfChannels`` as texts) and for each channel
``Channel_1_Data`` and ``Channel_1_Header`` (``SignalName``, ``Unit``).

Both shapes are those that public programs reading such files rely on; no file of
either program was at hand.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from tdacoustic.errors import UnitError
from tdacoustic.formats.matlab.sampling import HIGHEST_HZ, LOWEST_HZ, SAME, Sampling
from tdacoustic.formats.matlab.workspace import Array, Struct
from tdacoustic.formats.rates import number_in, snap_rate, thousands_doubt
from tdacoustic.units import parse_unit

__all__ = ["Described", "pulse_channels", "testlab_signal"]

TIME_LABELS = frozenset({"s", "sec", "second", "seconds"})
CHANNEL_DATA = re.compile(r"Channel_(\d{1,5})_Data")


@dataclass(frozen=True)
class Described:
    """What a layout says of an array.

    Parameters
    ----------
    array : Array
    names : tuple of str
        Of the array, or of each of its channels.
    sampling : Sampling
    time_axis : int
    unit : str or None
    scale : float
        ``value in unit = stored * scale``.
    flags : tuple of str
    left_out : str or None
        Why it is no time signal.
    """

    array: Array
    names: tuple[str, ...]
    sampling: Sampling
    time_axis: int
    unit: str | None = None
    scale: float = 1.0
    flags: tuple[str, ...] = ()
    left_out: str | None = None


def testlab_signal(struct: Struct) -> Described | None:
    """Describe a structure that Simcenter Testlab saved; None where it is none."""
    x, y = struct.struct("x_values"), struct.struct("y_values")
    array = None if y is None else y.array("values")
    if x is None or y is None or array is None or x.number("increment") is None:
        return None
    flags: list[str] = []
    claimed = x.number("number_of_values")
    axis = array.time_axis
    if claimed is not None and claimed in array.shape:
        axis = array.shape.index(int(claimed))
    elif claimed is not None:
        flags.append(
            f"{x.path('number_of_values')!r} says {claimed:.9g}, {y.path('values')!r} is {array.shape[0]} x "
            f"{array.shape[1]}"
        )
    sampling, left_out = _testlab_sampling(x)
    unit, scale = _testlab_unit(y, flags)
    record = struct.struct("function_record")
    names: tuple[str, ...] = (struct.path(),)
    if record is not None:
        listed = next((texts for name, texts in record.lists if name == "name"), ())
        single = record.text("name")
        if len(listed) == array.shape[1 - axis] and all(listed):
            names = listed
        elif single and array.is_vector:
            names = (single,)
    return Described(array, names, sampling, axis, unit, scale, tuple(flags), left_out)


def _testlab_sampling(x: Struct) -> tuple[Sampling, str | None]:
    """Sampling that the axis gives, and why it is no time axis."""
    quantity = x.struct("quantity")
    label = ((quantity.text("label") if quantity is not None else None) or "s").strip()
    if label not in TIME_LABELS:
        return Sampling(), f"are functions of an axis in {label!r}, not time signals"
    increment, start = x.number("increment") or 0.0, x.number("start_value") or 0.0
    path = f"{x.path('increment')!r}"
    rate = 1.0 / increment if increment > 0.0 else 0.0
    if not LOWEST_HZ <= rate <= HIGHEST_HZ:
        return Sampling(flags=(f"{path} is {increment:.9g}: no sampling rate is taken from it",)), None
    rate, raw = snap_rate(rate)
    return Sampling(rate, raw, start, path), None


def _testlab_unit(y: Struct, flags: list[str]) -> tuple[str | None, float]:
    """Unit and factor, where the factor leads from SI to the unit as our own table has it."""
    quantity = y.struct("quantity")
    label = None if quantity is None else quantity.text("label")
    if quantity is None or not label:
        return None, 1.0
    transformation = quantity.struct("unit_transformation")
    factor = None if transformation is None else transformation.number("factor")
    offset = 0.0 if transformation is None else transformation.number("offset") or 0.0
    path = quantity.path("label")
    try:
        unit = parse_unit(label)
    except UnitError:
        if factor is None or not factor > 0.0 or offset != 0.0:
            flags.append(f"{path!r} is {label!r}, and what leads to it is not stored: the unit is not taken")
            return None, 1.0
        return label, factor
    if factor is None and unit.factor == 1.0 and unit.offset == 0.0:
        return label, 1.0
    if factor is None or offset != 0.0 or unit.offset != 0.0 or abs(factor * unit.factor - 1.0) > 1e-3:
        flags.append(
            f"{path!r} is {label!r}, but unit_transformation (factor {factor}, offset {offset:.9g}) does not lead to "
            "it from SI: the values are left as stored, the unit is not taken"
        )
        return None, 1.0
    return label, factor


def pulse_channels(root: Struct) -> tuple[list[Described], list[str]]:
    """Describe what B&K PULSE or HBM catman saved.

    Returns
    -------
    list of Described
        Empty where it is no such file.
    list of str
        What is odd about the file.
    """
    header = root.struct("File_Header")
    numbered = {int(match[1]): array for array in root.arrays if (match := CHANNEL_DATA.fullmatch(array.name))}
    if header is None or not numbered:
        return [], []
    flags: list[str] = []
    claimed = _number(header, "NumberOfChannels")
    if claimed is not None and claimed != len(numbered):
        flags.append(f"'File_Header.NumberOfChannels' says {claimed:.9g}, {len(numbered)} channels are there")
    rate = _number(header, "SampleFrequency")
    doubt = thousands_doubt(header.text("SampleFrequency") or "")
    sampling = Sampling(flags=("'File_Header.SampleFrequency' is not there, or no number",))
    if doubt is not None:
        sampling = Sampling(flags=(f"'File_Header.SampleFrequency': {doubt}",))
    elif rate is not None and LOWEST_HZ <= rate <= HIGHEST_HZ:
        sampling = Sampling(*snap_rate(rate), 0.0, "'File_Header.SampleFrequency'")
    elif rate is not None:
        sampling = Sampling(flags=(f"'File_Header.SampleFrequency' is {rate:.9g}: no sampling rate is taken from it",))
    length = _number(header, "NumberOfSamplesPerChannel")
    return [_pulse_channel(root, array, number, sampling, length) for number, array in sorted(numbered.items())], flags


def _pulse_channel(root: Struct, array: Array, number: int, sampling: Sampling, length: float | None) -> Described:
    header = root.struct(f"Channel_{number}_Header")
    name = None if header is None else header.text("SignalName")
    flags: list[str] = []
    held = array.shape[array.time_axis]
    if length is not None and abs(length - held) > SAME:
        flags.append(
            f"'File_Header.NumberOfSamplesPerChannel' says {length:.9g}, {array.name!r} holds {held}: "
            "no sampling rate is taken from the header"
        )
        sampling = Sampling()
    correction = None if header is None else _number(header, "Correction")
    if correction is not None and correction not in (0.0, 1.0):
        flags.append(f"'Channel_{number}_Header.Correction' is {correction:.9g}: it is not applied")
    unit = None if header is None else header.text("Unit") or None
    return Described(array, (name or array.name,), sampling, array.time_axis, unit, 1.0, tuple(flags))


def _number(struct: Struct, name: str) -> float | None:
    number = struct.number(name)
    text = struct.text(name)
    return number if number is not None or text is None else number_in(text)
