"""Component files: which numbers of which file a local column consists of."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tdacoustic.errors import FormatError
from tdacoustic.formats.atfx.document import ComponentText, Instance
from tdacoustic.formats.atfx.graph import Graph, count_of, label_of
from tdacoustic.formats.atfx.values import Component

__all__ = ["ComponentFiles", "NotNumbersError", "own_file"]

TYPES = (
    *("dt_boolean", "dt_byte", "dt_short", "dt_long", "dt_longlong", "ieeefloat4", "ieeefloat8", "dt_short_beo"),
    *("dt_long_beo", "dt_longlong_beo", "ieeefloat4_beo", "ieeefloat8_beo", "dt_string", "dt_bytestr", "dt_blob"),
    *("dt_boolean_flags_beo", "dt_byte_flags_beo", "dt_string_flags_beo", "dt_bytestr_beo", "dt_sbyte"),
    *("dt_sbyte_flags_beo", "dt_ushort", "dt_ushort_beo", "dt_ulong", "dt_ulong_beo", "dt_string_utf8"),
    *("dt_string_utf8_flags_beo", "dt_bit_int", "dt_bit_int_beo", "dt_bit_uint", "dt_bit_uint_beo"),
    *("dt_bit_ieeefloat", "dt_bit_ieeefloat_beo", "dt_bytestr_leo"),
)
"""``typespec_enum`` of the base model, in the order of its numbers."""

DTYPES = {
    **{"dt_byte": "u1", "dt_byte_flags_beo": "u1", "dt_sbyte": "i1", "dt_sbyte_flags_beo": "i1"},
    **{"dt_short": "<i2", "dt_long": "<i4", "dt_longlong": "<i8", "dt_ushort": "<u2", "dt_ulong": "<u4"},
    **{"dt_short_beo": ">i2", "dt_long_beo": ">i4", "dt_longlong_beo": ">i8"},
    **{"dt_ushort_beo": ">u2", "dt_ulong_beo": ">u4"},
    **{"ieeefloat4": "<f4", "ieeefloat8": "<f8", "ieeefloat4_beo": ">f4", "ieeefloat8_beo": ">f8"},
    **{"dt_float": "<f4", "dt_double": "<f8", "dt_float_beo": ">f4", "dt_double_beo": ">f8"},
}
WIDTH_OF_FLAGS = 2


class NotNumbersError(Exception):
    """What a column holds are no numbers; the text says what they are."""


@dataclass(frozen=True)
class _Layout:
    """A component as the file states it, its parts as texts."""

    label: str
    filename: str
    value_type: str
    n_values: int
    start: str | None
    block_size: str | None
    per_block: str | None
    value_offset: str | None


def own_file(log: Path, name: str) -> Path:
    """Return a file that a log names, which must lie in the log's own folder.

    Raises
    ------
    FormatError
        It lies elsewhere, by its name or by a symbolic link, or there is no such file.
    """
    text = name.strip().replace("\\", "/")
    outside = FormatError(
        f"{log}: it names the component file {name[:200]!r}, which is not in the log's own folder; such a file is not "
        "read"
    )
    if not text or not text.isprintable() or text.startswith(("/", "~")) or ":" in text or ".." in text.split("/"):
        raise outside
    found = log.parent / text
    try:
        if not found.resolve().is_relative_to(log.parent.resolve()):
            raise outside
        if not found.is_file():
            raise FormatError(f"{log}: its component file {name[:200]!r} is not there")
    except (OSError, RuntimeError) as error:
        raise FormatError(f"{log}: its component file {name[:200]!r} cannot be read ({error})") from error
    return found


class ComponentFiles:
    """The component files of a log, and their sizes.

    Parameters
    ----------
    path : Path
        The log.
    graph : Graph
    """

    def __init__(self, path: Path, graph: Graph) -> None:
        self.path = path
        self.graph = graph
        self.sizes: dict[str, int] = {}

    def of_text(self, label: str, text: ComponentText) -> Component:
        """Return the component that stands in place of values or flags.

        Raises
        ------
        FormatError, NotNumbersError
            It is wrong; it holds no numbers.
        """
        fields: Mapping[str, str] = text.fields
        identifier = fields.get("identifier", "")
        if identifier not in self.graph.document.files:
            raise FormatError(f"{self.path}: {label}: no component file is called {identifier[:60]!r}")
        layout = _Layout(
            label,
            self.graph.document.files[identifier],
            fields.get("datatype", ""),
            count_of(self.path, label, "length", fields.get("length")),
            fields.get("inioffset"),
            fields.get("blocksize"),
            fields.get("valperblock"),
            fields.get("valoffsets"),
        )
        return self._component(layout)

    def of_instance(self, label: str, instance: Instance) -> Component:
        """Return the values of an external component.

        Raises
        ------
        FormatError, NotNumbersError
            It is wrong; it holds no numbers.
        """
        said = instance.attributes
        layout = _Layout(
            label,
            self._filename(instance, "filename_url", "ao_values_file", "ao_extcomp_values"),
            said.get("value_type", ""),
            self.graph.count(instance, "component_length"),
            said.get("start_offset"),
            said.get("block_size"),
            said.get("valuesperblock"),
            said.get("value_offset"),
        )
        return self._component(layout)

    def flags_of_instance(self, label: str, instance: Instance) -> Component | None:
        """Return the flags of an external component: 16-bit numbers one after the other; None where it has none."""
        name = self._filename(instance, "flags_filename_url", "ao_flags_file", "ao_extcomp_flags", required=False)
        if not name:
            return None
        order = "_beo" if _type_of(instance.attributes.get("value_type", "")).endswith("_beo") else ""
        n_values = self.graph.count(instance, "component_length")
        start = instance.attributes.get("flags_start_offset") or "0"
        return self._component(_Layout(f"{label}, flags", name, f"dt_short{order}", n_values, start, None, None, None))

    def _filename(self, instance: Instance, attribute: str, relation: str, inverse: str, required: bool = True) -> str:
        name = instance.attributes.get(attribute, "")
        if not name:
            file = self.graph.only(instance, relation, "aofile", inverse)
            name = "" if file is None else file.attributes.get("ao_location", "")
        if not name and required:
            raise FormatError(f"{self.path}: {label_of(instance)} names no file")
        return name

    def _component(self, layout: _Layout) -> Component:
        kind = _type_of(layout.value_type)
        if kind not in DTYPES:
            what = kind if kind in TYPES else f"the unknown type {layout.value_type[:40]!r}"
            raise NotNumbersError(f"its values are of type {what}")
        width = int(DTYPES[kind][-1])
        per_block = self._count(layout, "values per block", layout.per_block) or max(1, layout.n_values)
        value_offset = self._count(layout, "value offset", layout.value_offset)
        block_size = self._count(layout, "block size", layout.block_size)
        if block_size == 0 and layout.per_block not in (None, "", "0") and per_block < layout.n_values:
            raise FormatError(f"{self.path}: {layout.label}: its blocks of {per_block} values have 0 bytes")
        block_size = block_size or per_block * width
        if block_size < value_offset + per_block * width and per_block < layout.n_values:
            raise FormatError(
                f"{self.path}: {layout.label}: a block of {block_size} bytes cannot hold {per_block} values of {width} "
                f"bytes from byte {value_offset} on"
            )
        address = self._count(layout, "start offset", layout.start) + value_offset
        component = Component(
            layout.filename.strip().replace("\\", "/"), DTYPES[kind], address, layout.n_values, block_size, per_block
        )
        self._check_size(layout, component)
        return component

    def _count(self, layout: _Layout, key: str, text: str | None) -> int:
        return count_of(self.path, layout.label, key, text, 0)

    def _check_size(self, layout: _Layout, component: Component) -> None:
        """Compare what is claimed with what the file holds."""
        if component.name not in self.sizes:
            self.sizes[component.name] = own_file(self.path, component.name).stat().st_size
        size = self.sizes[component.name]
        if component.end > size:
            raise FormatError(
                f"{self.path}: truncated: {layout.label} claims {component.n_values} values up to byte {component.end} "
                f"of {layout.filename[:100]!r}, which has {size} bytes"
            )


def _type_of(text: str) -> str:
    """Return the name of a value type that is given by its name or by its number."""
    text = re.sub(r"\s+", "", text).lower()
    return TYPES[int(text)] if text.isascii() and text.isdigit() and int(text[:6]) < len(TYPES) else text
