"""Fleets and campaigns of the project with the field of point sources.

Their own fleets ask for the housing's transfer vectors, which take a minute and NGSolve; tests of anything else do
without.
"""

import atexit
import functools
import re
import shutil
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

_STUDIES = re.compile(r"(?m)^\[\[(?:reference|feature)\]\]\n(?:(?!\[).*\n?)*")
"""Another source's numbers and features: holding them against the model takes seconds a prediction."""

_PLAIN = {
    'method = "boundary_elements"': 'method = "point_sources"',
    'gear_path = "structure"': 'gear_path = "masuda"',
    'displacement = "static_ratio"': 'displacement = "um_pp"',
    'map_conditions = ["5", "1"]': "map_conditions = []",
}


@functools.cache
def _folder():
    folder = Path(tempfile.mkdtemp(prefix="tdacoustic-tests-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@functools.cache
def plain_fleet(name):
    """The file of ``calibration/NAME``, elsewhere, with point sources alone and without references and features."""
    text = (ROOT / "calibration" / name / "fleet.toml").read_text(encoding="utf-8")
    assert 'method = "boundary_elements"' in text
    text = _STUDIES.sub("", text)
    for old, new in _PLAIN.items():
        text = text.replace(old, new)
    path = _folder() / "calibration" / name / "fleet.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


@functools.cache
def plain_campaign(name):
    """The folder of ``recordings/NAME``, elsewhere, with a fleet of point sources."""
    folder = _folder() / "recordings" / name
    shutil.copytree(ROOT / "recordings" / name, folder, dirs_exist_ok=True)
    plain_fleet("crrc-freight")
    return folder
