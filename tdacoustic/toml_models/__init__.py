"""What the TOML files that people write have in common: strict tables, names, reading, one-line messages."""

from tdacoustic.toml_models.messages import (
    MAX_LINES,
    TOP_LEVEL,
    Vocabulary,
    file_error,
    joined,
    nearest,
    problem_words,
    shown,
)
from tdacoustic.toml_models.names import MAX_NAME_LENGTH, Name, legal_name, name_problem, unique_name
from tdacoustic.toml_models.paths import PathText, address_problem, is_address, path_problem, small_file
from tdacoustic.toml_models.reading import check_schema, file_or_inside, frozen, meta_lines, read_toml, steering_sign
from tdacoustic.toml_models.values import NonNegative, Positive, Table, Text, each_once

__all__ = [
    "MAX_LINES",
    "MAX_NAME_LENGTH",
    "TOP_LEVEL",
    "Name",
    "NonNegative",
    "PathText",
    "Positive",
    "Table",
    "Text",
    "Vocabulary",
    "address_problem",
    "check_schema",
    "each_once",
    "file_error",
    "file_or_inside",
    "frozen",
    "is_address",
    "joined",
    "legal_name",
    "meta_lines",
    "name_problem",
    "nearest",
    "path_problem",
    "problem_words",
    "read_toml",
    "shown",
    "small_file",
    "steering_sign",
    "unique_name",
]
