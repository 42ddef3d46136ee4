"""The CSV contracts: their columns, how they are written, and their rows as views of results."""

from tdacoustic.tables.measured import measured_tables
from tdacoustic.tables.predicted import predicted_tables
from tdacoustic.tables.schema import COLUMNS
from tdacoustic.tables.what_if import what_if_table
from tdacoustic.tables.writing import csv_text

__all__ = ["COLUMNS", "csv_text", "measured_tables", "predicted_tables", "what_if_table"]
