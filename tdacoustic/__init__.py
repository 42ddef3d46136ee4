"""tdacoustic: from the logs of a field test to a report on the noise of a traction drive.

From a log to a plotted spectrum with its lines::

    import tdacoustic as td

    recording = td.read("run.h5")
    spectrum = td.spectrum(recording, "mic_1")
    lines = td.find_lines(spectrum)
    td.plot(spectrum, lines)

From a campaign to its tables as pandas frames: ``td.analyze("campaign.toml").tables["lines"]``; from a fleet to
those of its model: ``td.predict("fleet.toml").tables["conditions"]``; and all of it: ``td.run("campaign.toml")``.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_PUBLIC = {
    "DriveModel": "tdacoustic.drive",
    "TdacousticError": "tdacoustic.errors",
    "analyze": "tdacoustic.workflows.analyze",
    "calibrate": "tdacoustic.workflows.calibrate",
    "find_families": "tdacoustic.lines",
    "find_lines": "tdacoustic.lines",
    "load_campaign": "tdacoustic.campaign",
    "load_fleet": "tdacoustic.fleet",
    "plot": "tdacoustic.workflows.interactive",
    "predict": "tdacoustic.workflows.predict",
    "read": "tdacoustic.workflows.interactive",
    "run": "tdacoustic.workflows.run",
    "scan": "tdacoustic.formats",
    "spectrum": "tdacoustic.workflows.interactive",
}
"""Public names and where they live; each is imported when it is first used."""

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'tdacoustic' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
