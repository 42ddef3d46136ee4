"""The exceptions of tdacoustic.

All derive from `TdacousticError`, and each is also the built-in exception an
ordinary ``except`` would expect. A message names the thing, its value, what is
allowed and where it stands (file, channel, key).
"""

__all__ = [
    "AnalysisError",
    "CampaignError",
    "ExecutorError",
    "FetchError",
    "FittingError",
    "FleetError",
    "FormatError",
    "GatheringError",
    "GearError",
    "MissingFileError",
    "MissingPackageError",
    "MotorError",
    "OutputError",
    "RadiationError",
    "RecipeError",
    "StoreError",
    "TdacousticError",
    "UnitError",
]


class TdacousticError(Exception):
    """Root of every error that tdacoustic raises on purpose."""


class FormatError(TdacousticError, ValueError):
    """A log cannot be read: not the format it claims, truncated, or inconsistent."""


class MissingFileError(TdacousticError, FileNotFoundError):
    """A named file does not exist."""

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class MissingPackageError(TdacousticError, ImportError):
    """A package that an option needs is not installed."""


class UnitError(TdacousticError, ValueError):
    """A unit or a sensitivity is unknown, missing, or of another quantity."""


class CampaignError(TdacousticError, ValueError):
    """A campaign file is wrong: unknown key, bad value, or contradiction."""


class ExecutorError(TdacousticError, RuntimeError):
    """Nothing can be computed where it was asked to be: a cluster that is lost, workers that do not start."""


class FetchError(TdacousticError, OSError):
    """A log that is named by URL cannot be fetched."""


class FittingError(TdacousticError, ValueError):
    """A calibration that cannot be set up, or has nothing to work on."""


class FleetError(TdacousticError, ValueError):
    """A fleet file is wrong, or lacks a parameter that is needed."""


class GatheringError(TdacousticError, ValueError):
    """Results that cannot be gathered: damaged, incomplete, or none at all."""


class GearError(TdacousticError, ValueError):
    """Gears that cannot be made or cannot mesh, or a state of them that cannot be computed."""


class MotorError(TdacousticError, ValueError):
    """A motor that cannot be computed."""


class RadiationError(TdacousticError, ValueError):
    """A sound field that cannot be computed."""


class RecipeError(TdacousticError, ValueError):
    """A synthesis recipe is wrong."""


class TemplateError(TdacousticError, ValueError):
    """A report template is no valid one."""


class AnalysisError(TdacousticError, ValueError):
    """The data do not allow the analysis that was asked for."""


class StoreError(TdacousticError, OSError):
    """The store of results cannot be used."""


class OutputError(TdacousticError, OSError):
    """The output folder cannot be written, or something else is in its way."""
