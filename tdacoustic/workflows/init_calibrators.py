"""Runs with a calibrator in a first ``campaign.toml``: told by the names of their files."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from tdacoustic.workflows.toml_text import toml_string

__all__ = ["calibrator_run_lines", "is_calibrator_log"]

_CALIBRATOR: Final = re.compile(
    r"(?:^|(?<=[\W\d_]))(cal|calib\w*?|calibration|kal|kalib\w*?|pistonphone|pistonfon)(?![^\W\d_])", re.IGNORECASE
)
_AFTER: Final = re.compile(r"(?:^|(?<=[\W\d_]))(after|post|end|nach|nachher|apres)(?![^\W\d_])", re.IGNORECASE)


def is_calibrator_log(stem: str) -> bool:
    """Whether a file's name says that a calibrator was recorded in it.

    Examples
    --------
    >>> [is_calibrator_log(stem) for stem in ("cal_mic1", "Kalibrierung nachher", "run_3_calib", "vertical", "scale")]
    [True, True, True, False, False]
    """
    return _CALIBRATOR.search(stem) is not None


def calibrator_run_lines(stem: str, path: str, name: str, missing: list[str]) -> Iterator[str]:
    """Yield the lines of a ``[[run]]`` with a calibrator; what is to be added is noted in `missing`.

    Parameters
    ----------
    stem : str
        Of the file.
    path, name : str
        As the campaign is to have them.
    missing : list of str
    """
    kind = "calibration_after" if _AFTER.search(stem) else "calibration_before"
    yield "[[run]]"
    yield f"name = {toml_string(name)}"
    yield f'kind = "{kind}"   # from the file\'s name; before or after (calibration_after) the runs?'
    yield '# calibrator = "94 dB"   # MISSING: what it gives; "10 m/s^2" of a vibration calibrator'
    yield "# calibrator_frequency_hz = 1000   # default: what such calibrators usually have"
    yield '# calibrated = ["..."]   # default: the channels in which its tone stands out'
    yield f"logs = [{toml_string(path)}]"
    missing.append(f"run {name!r}: calibrator, what it gives (the file's name says that it is one)")
