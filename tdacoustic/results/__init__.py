"""What the commands found, as reports, files and notebooks read it."""

from tdacoustic.results.analysis import Analysis, LogInput

__all__ = ["Analysis", "LogInput"]
