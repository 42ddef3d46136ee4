"""The XML of an ATFX file: its application model, and the instances of the base elements that matter here.

An ATFX file describes its own tables: each application element is derived from an element of the ODS base model, and
so are its attributes and relations. Only base names are looked at; what a vendor calls an element does not matter.

The XML is walked in pieces and never held: values that stand in it are remembered by their place in the file
(`InlineText`). No document type, no entity and no reference to another document is accepted, and what is kept is
bounded.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.sax.handler import ContentHandler

from defusedxml.common import DefusedXmlException
from defusedxml.expatreader import DefusedExpatParser

from tdacoustic.errors import FormatError

__all__ = ["ComponentText", "Document", "InlineText", "Instance", "Relation", "read_document"]

MAX_XML_BYTES = 1 << 30
"""Of the XML alone; values of this size belong into component files."""
MAX_DEPTH = 64
MAX_TEXT = 1 << 20
MAX_KEPT_BYTES = 48 << 20
COST_OF_A_TEXT = 200
MAX_TOKEN_BYTES = 8 << 20
"""What the XML parser may hold back: a tag or a comment longer than this is taken for an attack or damage."""
CHUNK_BYTES = 1 << 16

WANTED: Mapping[str, frozenset[str]] = {
    "aomeasurement": frozenset({"name", "measurement_begin"}),
    "aosubmatrix": frozenset({"name", "number_of_rows"}),
    "aolocalcolumn": frozenset(
        {"name", "independent", "global_flag", "sequence_representation", "generation_parameters", "values", "flags"}
        | {"minimum", "maximum"}
    ),
    "aomeasurementquantity": frozenset({"name", "datatype", "minimum", "maximum"}),
    "aoquantity": frozenset({"name"}),
    "aounit": frozenset({"name", "factor", "offset"}),
    "aophysicaldimension": frozenset(
        {"length_exp", "mass_exp", "time_exp", "current_exp", "temperature_exp", "molar_amount_exp"}
        | {"luminous_intensity_exp"}
    ),
    "aoexternalcomponent": frozenset(
        {"name", "component_length", "value_type", "ordinal_number", "start_offset", "block_size", "valuesperblock"}
        | {"value_offset", "filename_url", "flags_filename_url", "flags_start_offset"}
    ),
    "aofile": frozenset({"name", "ao_location"}),
}
"""Base elements that are kept, with their base attributes; their relations to each other are kept too."""

ARRAYS = frozenset({"values", "flags"})
"""Attributes that may hold many numbers, or a component."""
SHOWN = ("exported_by", "exporter", "exporter_version", "base_model_version")


@dataclass(frozen=True)
class InlineText:
    """Where an element of many numbers stands: the offsets of its tag and of what follows its text.

    Parameters
    ----------
    kind : str
        Name of the element: ``A_FLOAT64``, ...; that of the attribute where the numbers stand in it directly.
    start, end : int
        Of its opening tag, of its closing tag.
    """

    kind: str
    start: int
    end: int


@dataclass(frozen=True)
class ComponentText:
    """A ``component`` element in place of values: the texts of its parts by name."""

    fields: Mapping[str, str]


@dataclass(frozen=True)
class Relation:
    """Identifiers of the related instances, and the application element they are of."""

    element: str
    ids: tuple[str, ...]


@dataclass(frozen=True)
class Instance:
    """An instance of an application element that is derived from one of `WANTED`.

    Parameters
    ----------
    element : str
        Name of the application element.
    base : str
        Of its base element, lower case.
    id : str
    attributes : mapping of str to str
        Texts by base attribute.
    relations : mapping of str to Relation
        By base relation.
    arrays : mapping of str to (InlineText or ComponentText)
        Of ``values`` and ``flags``.
    """

    element: str
    base: str
    id: str
    attributes: Mapping[str, str]
    relations: Mapping[str, Relation]
    arrays: Mapping[str, InlineText | ComponentText]


@dataclass
class _Element:
    """An application element: its base, and its attributes and relations by the names it gives them."""

    base: str = ""
    id_name: str = ""
    attributes: dict[str, str] = field(default_factory=dict)
    relations: dict[str, tuple[str, str]] = field(default_factory=dict)


@dataclass(frozen=True)
class Document:
    """What is kept of an ATFX file.

    Parameters
    ----------
    files : mapping of str to str
        Names of component files by their identifier.
    instances : tuple of Instance
        In the order of the file.
    shown : tuple of (str, str)
        Documentation worth showing.
    """

    files: Mapping[str, str]
    instances: tuple[Instance, ...]
    shown: tuple[tuple[str, str], ...]


class _Parser(DefusedExpatParser):  # type: ignore[misc, unused-ignore]
    """Says at which byte of the file the tag stands that is being told of."""

    def __init__(self) -> None:
        super().__init__(forbid_dtd=True, forbid_entities=True, forbid_external=True)

    @property
    def byte_index(self) -> int:
        index: int = self._parser.CurrentByteIndex
        return index


class _Handler(ContentHandler):
    """Gathers the model, then the instances."""

    def __init__(self, path: Path, parser: _Parser) -> None:
        super().__init__()
        self.path = path
        self.parser = parser
        self.files: dict[str, str] = {}
        self.shown: list[tuple[str, str]] = []
        self.instances: list[Instance] = []
        self._elements: dict[str, _Element] = {}
        self._seen: set[tuple[str, str]] = set()
        self._stack: list[str] = []
        self._text: list[str] | None = None
        self._n_text = 0
        self._fields: dict[str, str] = {}
        self._kept = 0
        self._element: _Element | None = None
        self._attributes: dict[str, str] = {}
        self._relations: dict[str, Relation] = {}
        self._arrays: dict[str, InlineText | ComponentText] = {}
        self._array_start: tuple[int, int] | None = None

    def startElement(self, name: str, attrs: Any) -> None:
        """Go one level down."""
        self._stack.append(name.rpartition(":")[2])
        stack, depth = self._stack, len(self._stack)
        if depth > MAX_DEPTH:
            raise FormatError(f"{self.path}: its XML is nested more than {MAX_DEPTH} deep")
        if depth == 1 and stack[0] != "atfx_file":
            raise FormatError(f"{self.path}: no ATFX file: its XML is of {stack[0][:40]!r}")
        self._text, self._n_text = [], 0
        if stack[1:2] == ["instance_data"]:
            self._start_in_instances(depth)
        elif depth == 3:
            self._fields = {}
            if stack[1:] == ["application_model", "application_element"]:
                self._element = _Element()
        elif depth == 4 and stack[1] == "application_model":
            self._fields = {}

    def _start_in_instances(self, depth: int) -> None:
        stack = self._stack
        if depth == 3:
            element = self._elements.get(stack[2])
            self._element = element if element is not None and element.base in WANTED else None
            self._attributes, self._relations, self._arrays = {}, {}, {}
        elif depth > 3 and self._element is None:
            self._text = None
        elif depth > 3 and self._element is not None and self._element.attributes.get(stack[3]) in ARRAYS:
            self._fields = {} if depth == 5 else self._fields
            self._text = None if depth < 6 or stack[4] != "component" else []
            if depth < 6:
                self._array_start = (depth, self.parser.byte_index)

    def characters(self, content: str) -> None:
        """Keep the text of an element, where it is of any use."""
        if self._text is None:
            return
        self._n_text += len(content)
        if self._n_text > MAX_TEXT:
            raise FormatError(
                f"{self.path}: a text of more than {MAX_TEXT} characters in <{'/'.join(self._stack[1:])[:100]}>"
            )
        self._text.append(content)

    def endElement(self, name: str) -> None:
        """Keep what the element said, and go one level up."""
        stack, depth = self._stack, len(self._stack)
        text = "".join(self._text or ()).strip()
        if stack[1:2] == ["instance_data"]:
            self._end_in_instances(depth, text)
        elif stack[1:2] == ["application_model"]:
            self._end_in_model(depth, text)
        elif stack[1:3] == ["files", "component"]:
            if depth == 4:
                self._fields[stack[3]] = self._count(text)
            elif "identifier" in self._fields:
                self.files[self._fields["identifier"]] = self._fields.get("filename", "")
        elif stack[-1] in SHOWN and depth <= 3 and text:
            self.shown.append((stack[-1].replace("_", " "), self._count(text)))
        self._text = [] if depth < 3 else None
        stack.pop()

    def _end_in_model(self, depth: int, text: str) -> None:
        stack, element = self._stack, self._element
        if element is None or stack[2:3] != ["application_element"]:
            return
        if depth == 3:
            self._element = None
        elif depth == 4 and stack[3] == "name":
            if text in self._elements:
                raise FormatError(f"{self.path}: its application model has two elements {text[:60]!r}")
            self._elements[self._count(text)] = element
        elif depth == 4 and stack[3] == "basetype":
            element.base = text.lower()
        elif depth == 5:
            self._fields[stack[4]] = self._count(text)
        elif depth == 4 and stack[3] == "application_attribute":
            base = self._fields.get("base_attribute", "").lower()
            if base == "id":
                element.id_name = self._fields.get("name", "")
            elif base:
                element.attributes[self._fields.get("name", "")] = base
        elif depth == 4 and stack[3] == "relation_attribute":
            base = self._fields.get("base_relation", "").lower()
            if base:
                element.relations[self._fields.get("name", "")] = (base, self._fields.get("ref_to", ""))

    def _end_in_instances(self, depth: int, text: str) -> None:
        stack, element = self._stack, self._element
        if depth == 3 and not self._elements:
            raise FormatError(f"{self.path}: its instances come before its application model")
        if element is None or depth < 3:
            return
        if depth == 3:
            self._keep_instance(element)
            self._element = None
            return
        base = element.attributes.get(stack[3], "")
        if base in ARRAYS:
            self._end_in_array(depth, base, text)
        elif depth == 4 and stack[3] == element.id_name:
            self._attributes["id"] = self._count(text)
        elif depth == 4 and base in WANTED[element.base]:
            self._attributes[base] = self._count(text)
        elif depth == 4 and stack[3] in element.relations:
            relation, target = element.relations[stack[3]]
            if target in self._elements and self._elements[target].base in WANTED and text:
                ids = tuple(text.split())
                self._count(text, len(ids))
                self._relations[relation] = Relation(target, ids)

    def _end_in_array(self, depth: int, base: str, text: str) -> None:
        """Numbers, ``<attribute><A_FLOAT64>numbers``, or ``<attribute><component><part>text``."""
        stack = self._stack
        if depth == 6 and stack[4] == "component":
            self._fields[stack[5]] = self._count(text)
        elif depth in (4, 5) and self._array_start is not None and self._array_start[0] == depth:
            if base in self._arrays:
                raise FormatError(f"{self.path}: a local column has its {base} twice, near byte {self._array_start[1]}")
            self._count(stack[-1])
            if depth == 5 and stack[4] == "component":
                self._arrays[base] = ComponentText(dict(self._fields))
                return
            self._arrays[base] = InlineText(stack[-1], self._array_start[1], self.parser.byte_index)

    def _keep_instance(self, element: _Element) -> None:
        identifier = self._attributes.pop("id", "")
        name = self._stack[2]
        if (name, identifier) in self._seen:
            raise FormatError(f"{self.path}: two instances of {name[:60]!r} have the identifier {identifier[:40]!r}")
        self._seen.add((name, identifier))
        self._count(name, 2)
        self.instances.append(Instance(name, element.base, identifier, self._attributes, self._relations, self._arrays))

    def _count(self, text: str, n_objects: int = 1) -> str:
        """Count a text among what is kept; returns it.

        Raises
        ------
        FormatError
            More is kept than any sensible file needs.
        """
        self._kept += len(text) + n_objects * COST_OF_A_TEXT
        if self._kept > MAX_KEPT_BYTES:
            raise FormatError(f"{self.path}: its XML describes more than is read ({MAX_KEPT_BYTES >> 20} MiB)")
        return text


def read_document(path: Path) -> Document:
    """Walk the XML of an ATFX file.

    Returns
    -------
    Document

    Raises
    ------
    FormatError
        Not well-formed, truncated, with a document type or entities, too large, or no ATFX file.
    """
    size = path.stat().st_size
    if size > MAX_XML_BYTES:
        raise FormatError(
            f"{path}: its XML has {size} bytes, at most {MAX_XML_BYTES} are read; export the values to component files"
        )
    parser = _Parser()
    handler = _Handler(path, parser)
    parser.setContentHandler(handler)
    n_fed = 0
    try:
        with path.open("rb") as stream:
            while chunk := stream.read(CHUNK_BYTES):
                parser.feed(chunk)
                n_fed += len(chunk)
                if n_fed - parser.byte_index > MAX_TOKEN_BYTES:
                    raise FormatError(f"{path}: a tag or comment of its XML has more than {MAX_TOKEN_BYTES} bytes")
        parser.close()
    except DefusedXmlException as error:
        raise FormatError(
            f"{path}: its XML has a document type or entities, which are not read ({type(error).__name__})"
        ) from error
    except FormatError:
        raise
    except Exception as error:  # SAXParseException, and what the decoders raise
        text = " ".join(str(error).split()).removeprefix("<unknown>:")
        word = "truncated or damaged" if n_fed >= size else "damaged"
        raise FormatError(f"{path}: {word} ATFX file: its XML is not well-formed (line {text[:200]})") from error
    return Document(handler.files, tuple(handler.instances), tuple(handler.shown))
