"""Logs + campaign -> recordings: sources found, scales applied, cuts made; what cannot be used is said."""

from tdacoustic.ingest.bind import bind_run
from tdacoustic.ingest.bound import Bound, Refusal
from tdacoustic.ingest.conversion import Conversion, convert
from tdacoustic.ingest.coverage import check_coverage
from tdacoustic.ingest.single import bind_log

__all__ = ["Bound", "Conversion", "Refusal", "bind_log", "bind_run", "check_coverage", "convert"]
