"""Maker of ATFX files from f-strings and numpy alone; it shares nothing with the reader.

The layouts follow two public examples of the openATFX project: one of IPETRONIK (names in English, components inside
`Values`, an implicit time, flags between the values, several submatrices), one of PAK (other names for everything,
``ec`` instances, a written time), and one of ASAM's own (values in the XML).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from log_makers import RATE_HZ, Made, signals

NAMES = {
    "AoEnvironment": "Environment",
    "AoTest": "Test",
    "AoMeasurement": "Measurement",
    "AoSubmatrix": "SubMatrix",
    "AoMeasurementQuantity": "MeasurementQuantity",
    "AoLocalColumn": "LocalColumn",
    "AoQuantity": "Quantity",
    "AoUnit": "Unit",
    "AoPhysicalDimension": "Physicaldimension",
    "AoExternalComponent": "ExternalComponent",
    "AoFile": "ExtCompFile",
}
SHORT_NAMES = {
    **{"AoEnvironment": "env", "AoTest": "prj", "AoMeasurement": "dts", "AoSubmatrix": "sm", "AoLocalColumn": "lc"},
    **{"AoMeasurementQuantity": "meq", "AoQuantity": "quantity", "AoUnit": "unt", "AoPhysicalDimension": "dim"},
    **{"AoExternalComponent": "ec", "AoFile": "datei"},
}
ATTRIBUTES = {
    "AoMeasurement": ["measurement_begin"],
    "AoSubmatrix": ["number_of_rows"],
    "AoLocalColumn": [
        *("global_flag", "independent", "sequence_representation", "generation_parameters", "raw_datatype"),
        *("values", "flags", "minimum", "maximum"),
    ],
    "AoMeasurementQuantity": ["datatype"],
    "AoUnit": ["factor", "offset"],
    "AoPhysicalDimension": ["length_exp", "mass_exp", "time_exp"],
    "AoExternalComponent": [
        *("component_length", "value_type", "ordinal_number", "start_offset", "block_size", "valuesperblock"),
        *("value_offset", "filename_url", "flags_filename_url", "flags_start_offset"),
    ],
    "AoFile": ["ao_location"],
}
RELATIONS = {  # of a base element: base relation, the other base element, the inverse relation
    "AoMeasurement": [("submatrices", "AoSubmatrix", "measurement")],
    "AoSubmatrix": [("measurement", "AoMeasurement", "submatrices"), ("local_columns", "AoLocalColumn", "submatrix")],
    "AoLocalColumn": [
        ("submatrix", "AoSubmatrix", "local_columns"),
        ("measurement_quantity", "AoMeasurementQuantity", "local_columns"),
        ("external_component", "AoExternalComponent", "local_column"),
    ],
    "AoMeasurementQuantity": [
        ("local_columns", "AoLocalColumn", "measurement_quantity"),
        ("unit", "AoUnit", "measurement_quantities"),
        ("quantity", "AoQuantity", "measurement_quantities"),
    ],
    "AoQuantity": [("default_unit", "AoUnit", "quantities")],
    "AoUnit": [
        ("measurement_quantities", "AoMeasurementQuantity", "unit"),
        ("phys_dimension", "AoPhysicalDimension", "units"),
    ],
    "AoExternalComponent": [
        ("local_column", "AoLocalColumn", "external_component"),
        ("ao_values_file", "AoFile", "ao_extcomp_values"),
        ("ao_flags_file", "AoFile", "ao_extcomp_flags"),
    ],
}


@dataclass
class Atfx:
    """An ATFX file that is being written; instances are added as XML."""

    names: dict[str, str] = field(default_factory=lambda: NAMES)
    files: list[tuple[str, str]] = field(default_factory=list)
    rows: list[str] = field(default_factory=list)
    n: int = 0
    namespace: str = ' xmlns="http://www.asam.net/ODS/5.1/Schema"'

    def camel(self, base: str) -> str:
        """The application's name of a base attribute or relation."""
        if self.names is SHORT_NAMES:
            return {"name": "iname", "measurement_begin": "mea_begin"}.get(base, f"x_{base}")
        return "".join(part.capitalize() for part in base.split("_"))

    def add(self, base: str, name: str, more: str = "", identifier: int | None = None, **said) -> int:
        """Add an instance with its base attributes and relations; returns its identifier."""
        self.n += 1
        identifier = self.n if identifier is None else identifier
        texts = [("id", identifier), ("name", name), *said.items()]
        inner = "".join(f"<{self.camel(key)}>{value}</{self.camel(key)}>" for key, value in texts if value is not None)
        self.rows.append(f"<{self.names[base]}>{inner}{more}</{self.names[base]}>\n")
        return identifier

    def array(self, attribute: str, inner: str) -> str:
        return f"<{self.camel(attribute)}>{inner}</{self.camel(attribute)}>"

    def component(self, attribute: str, identifier: str, kind: str, n: int, **layout) -> str:
        """A component in place of values; `layout` of start, block, per_block, offset."""
        fields = {
            "identifier": identifier,
            "datatype": kind,
            "length": n,
            "inioffset": layout.get("start", 0),
            "blocksize": layout.get("block"),
            "valperblock": layout.get("per_block"),
            "valoffsets": layout.get("offset", 0),
        }
        inner = "".join(f"<{key}>{value}</{key}>" for key, value in fields.items() if value is not None)
        return self.array(attribute, f"<component>{inner}</component>")

    def model(self) -> str:
        elements = []
        for base, name in self.names.items():
            attributes = [("id", "id"), ("name", "name"), *((key, key) for key in ATTRIBUTES.get(base, []))]
            inner = "".join(
                f"<application_attribute><name>{self.camel(key)}</name><base_attribute>{key}</base_attribute>"
                "</application_attribute>\n"
                for key, _ in attributes
            )
            inner += "".join(
                f"<relation_attribute><name>{self.camel(relation)}</name><ref_to>{self.names[other]}</ref_to>"
                f"<base_relation>{relation}</base_relation><min_occurs>0</min_occurs><max_occurs>Many</max_occurs>"
                f"<inverse_name>{self.camel(inverse)}</inverse_name></relation_attribute>\n"
                for relation, other, inverse in RELATIONS.get(base, [])
            )
            elements.append(
                f"<application_element><name>{name}</name><basetype>{base}</basetype>\n{inner}</application_element>\n"
            )
        return f"<application_model>\n{''.join(elements)}</application_model>\n"

    def text(self, prologue: str = '<?xml version="1.0" encoding="UTF-8"?>\n') -> str:
        files = "".join(
            f"<component><identifier>{identifier}</identifier><filename>{name}</filename></component>\n"
            for identifier, name in self.files
        )
        return (
            f'{prologue}<atfx_file version="atfx_file: V1.1.0"{self.namespace}>\n'
            "<documentation><exporter>a maker</exporter></documentation>\n"
            f"<base_model_version>asam31</base_model_version>\n<files>\n{files}</files>\n"
            f"{self.model()}<instance_data>\n{''.join(self.rows)}</instance_data>\n</atfx_file>\n"
        )

    def write(self, path: Path, **how) -> Path:
        path.write_text(self.text(**how), encoding="utf-8")
        return path

    def unit(self, name: str, factor: float = 1.0, time: bool = False) -> int:
        dimension = self.add("AoPhysicalDimension", name, length_exp=0, mass_exp=0, time_exp=int(time))
        return self.add("AoUnit", name, factor=factor, offset=0.0, phys_dimension=dimension)

    def matrix(self, n_rows: int | None, begin: str | None = "20141007171440250") -> int:
        measurement = self.add("AoMeasurement", "drive 1", measurement_begin=begin)
        return self.add("AoSubmatrix", "sm", number_of_rows=n_rows, measurement=measurement)

    def column(self, matrix: int, name: str, unit: int | None, more: str = "", **said) -> int:
        """A local column with its measurement quantity, related from the column's side alone."""
        quantity = self.add("AoMeasurementQuantity", name, datatype="DT_DOUBLE", unit=unit)
        said = {"independent": 0, "sequence_representation": "explicit", "global_flag": 15} | said
        return self.add("AoLocalColumn", name, more, submatrix=matrix, measurement_quantity=quantity, **said)

    def time(self, matrix: int, unit: int | None, start: float = 0.0, step: float = 1 / RATE_HZ, name="Time") -> int:
        parameters = f"{start!r} {step!r}"
        return self.column(
            matrix, name, unit, independent=1, sequence_representation="implicit_linear",
            generation_parameters=parameters,
        )  # fmt: skip


def numbers(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def make_atfx_inline(folder: Path) -> Made:
    x = signals()
    atfx = Atfx()
    matrix = atfx.matrix(x.shape[1])
    seconds, metres = atfx.unit("s", time=True), atfx.unit("m/s²")
    atfx.time(matrix, seconds)
    for name, row in zip(("motor", "mic"), x, strict=True):
        atfx.column(matrix, name, metres, atfx.array("values", f"<A_FLOAT64>\n{numbers(row)}\n</A_FLOAT64>"))
    return Made(atfx.write(folder / "inline.atfx"), ["motor", "mic"], x, 0.0)


def make_atfx_interleaved(folder: Path) -> Made:
    """As IPETRONIK: each value followed by its flag, the component inside `Values`; float32 and float64, big-endian."""
    x = signals()
    x[0] = x[0].astype(np.float32)
    blocks = np.zeros(x.shape[1], [("a", "<f4"), ("fa", "<i2"), ("b", ">f8"), ("fb", "<i2")])
    blocks["a"], blocks["b"], blocks["fa"], blocks["fb"] = x[0], x[1], 15, 15
    (folder / "data").mkdir(exist_ok=True)
    (folder / "data" / "run.bda").write_bytes(b"head" + blocks.tobytes())
    atfx = Atfx(files=[("BinaryDataFile", "data\\run.bda")])
    matrix = atfx.matrix(x.shape[1])
    seconds, metres = atfx.unit("s", time=True), atfx.unit("m/s^2")
    atfx.time(matrix, seconds)
    layout = {"n": x.shape[1], "block": 16, "per_block": 1}
    for name, kind, offset, flag in (("motor", "ieeefloat4", 4, 8), ("mic", "ieeefloat8_beo", 10, 18)):
        values = atfx.component("values", "BinaryDataFile", kind, start=4, offset=offset - 4, **layout)
        flags = atfx.component("flags", "BinaryDataFile", "dt_short", start=4, offset=flag - 4, **layout)
        atfx.column(matrix, name, metres, values + flags, global_flag=None)
    return Made(atfx.write(folder / "run.atfx"), ["motor", "mic"], x, 0.0)


def make_atfx_components(folder: Path) -> Made:
    """As PAK: other names, external components as instances, in two pieces, scaled; a written time in milliseconds."""
    x = signals()
    counts = np.round(x / 0.5 * 30000.0).astype(np.int16)
    x = counts * (0.5 / 30000.0) + 0.125
    cut = 400
    (folder / "values.btf").write_bytes(
        counts[0, :cut].astype(">i2").tobytes() + counts[1].astype("<i4").tobytes() + counts[0, cut:].tobytes()
    )
    atfx = Atfx(names=SHORT_NAMES, namespace="")
    matrix = atfx.matrix(x.shape[1], "20141007171440")
    milliseconds, pascal = atfx.unit("ms", 1e-3, time=True), atfx.unit("Pa")
    t = np.arange(x.shape[1]) / RATE_HZ * 1e3
    atfx.column(matrix, "Time", milliseconds, atfx.array("values", f"<A_FLOAT64>{numbers(t)}</A_FLOAT64>"),
                independent=1)  # fmt: skip
    scaled = {"sequence_representation": "raw_linear_external", "generation_parameters": f"0.125 {0.5 / 30000.0!r}"}
    first = atfx.column(matrix, "motor", pascal, **scaled)
    second = atfx.column(matrix, "mic", pascal, **scaled)
    n = x.shape[1]
    file = atfx.add("AoFile", "values", ao_location="values.btf")
    for column, ordinal, kind, count, start in (
        (first, 2, "dt_short", n - cut, 2 * cut + 4 * n),
        (first, 1, "dt_short_beo", cut, 0),
        (second, 1, "dt_long", n, 2 * cut),
    ):
        atfx.add(
            "AoExternalComponent", "c", component_length=count, value_type=kind, ordinal_number=ordinal,
            start_offset=start, block_size=count * (4 if kind == "dt_long" else 2), valuesperblock=count,
            value_offset=0, local_column=column, ao_values_file=file,
        )  # fmt: skip
    return Made(atfx.write(folder / "pak.atfx"), ["motor", "mic"], x, 1e-15)


MAKERS = [make_atfx_inline, make_atfx_interleaved, make_atfx_components]
