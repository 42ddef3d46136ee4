"""The reference housing as a STEP file against the parametric box: modes and levels.

``python tests/evidence/step_study.py [--store DIR]`` writes ``step_record.json``; some six minutes on two cores, with
NGSolve. To 1100 Hz, which holds the first mesh harmonic of every condition.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import platform
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1]), str(HERE.parent / "housing")]

import tdacoustic as td  # noqa: E402
from tdacoustic.drive import DriveModel, HousingSound  # noqa: E402
from tdacoustic.drive.gear_unit import gear_unit_of  # noqa: E402
from tdacoustic.drive.housing_box import box_of  # noqa: E402
from tdacoustic.steps import Store  # noqa: E402
from tdacoustic.workflows.housing_sound import housing_sound  # noqa: E402

PACKAGE = HERE.parents[1] / "tdacoustic"
RECORD = HERE / "step_record.json"

HIGHEST_HZ = 1100.0
FINE_HZ = np.arange(100.0, 1100.0, 2.0)
SIZES = ("size_m", "wall_mm", "bearing_panel_mm", "top_bottom_mm")


def source_files() -> list[Path]:
    """Modules that the figures come from."""
    drive = [PACKAGE / "drive" / f"{name}.py" for name in ("housing_solid", "solid_in_air", "housing_steps")]
    radiation = [PACKAGE / "radiation" / f"{name}.py" for name in ("body_in_air", "box_in_air", "transfer_vectors")]
    housing = [PACKAGE / "housing" / f"{name}.py" for name in ("box_modes", "elasticity", "eigenmodes")]
    held = sorted((PACKAGE / "housing" / "step_file").glob("*.py"))
    return [*held, *housing, *drive, *radiation, HERE / "step_study.py"]


def sources() -> str:
    """Return their stamp."""
    digest = hashlib.sha256()
    for path in source_files():
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


def record() -> dict[str, Any]:
    """Return what was recorded."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8")))


def twins(folder: Path) -> tuple[td.Fleet, td.Fleet]:
    """Return the reference drive with its box, and with a STEP file of that box."""
    from step_housings import parametric, write

    text = (HERE.parents[1] / "calibration" / "reference-drive" / "fleet.toml").read_text(encoding="utf-8")
    (folder / "box.toml").write_text(text, encoding="utf-8")
    box = td.load_fleet(folder / "box.toml").replaced({"radiation.max_frequency_hz": HIGHEST_HZ})
    write(parametric(box_of(box, gear_unit_of(box))), folder / "housing.step")
    lines = [line for line in text.splitlines() if not line.startswith(SIZES)]
    lines.insert(lines.index("[housing]") + 1, 'step_file = "housing.step"')
    (folder / "step.toml").write_text("\n".join(lines), encoding="utf-8")
    return box, td.load_fleet(folder / "step.toml").replaced({"radiation.max_frequency_hz": HIGHEST_HZ})


def computed(fleet: td.Fleet, store: Store) -> HousingSound:
    """Return the sound of a housing."""
    sound, _ = housing_sound(fleet, store, 1)
    assert sound is not None
    return sound


def fine_levels(sound: HousingSound) -> np.ndarray:  # type: ignore[type-arg]
    """Return the mean level at 4 m over a fine axis, of forces on all seats in all directions, in dB re 1 Pa²/N²."""
    loads = np.zeros((4, 3, FINE_HZ.size), dtype=np.complex128)
    loads[:] = np.array([1.0, -0.6, 0.8, 0.5])[:, None, None] * np.array([0.3, 0.5, 1.0])[:, None]
    moved = sound.modes.response(FINE_HZ, loads, 0.02)
    squares = [sound.mean.of_modes(f, column) for f, column in zip(FINE_HZ.tolist(), moved.T, strict=True)]
    return np.asarray(10.0 * np.log10(squares))


def spread(off: np.ndarray) -> dict[str, float]:  # type: ignore[type-arg]
    """Return what differences come to."""
    return {
        "median": round(float(np.median(np.abs(off))), 4),
        "rms": round(float(np.sqrt(np.mean(off**2))), 4),
        "worst": round(float(np.abs(off).max()), 4),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--store", type=Path)
    arguments = parser.parse_args()
    before = sources()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        fleets = twins(folder)
        store = Store(arguments.store or folder / "store")
        box, step = (computed(fleet, store) for fleet in fleets)
        predictions = [
            DriveModel(fleet, housing=sound).evaluate() for fleet, sound in zip(fleets, (box, step), strict=True)
        ]
    natural = min(box.modes.natural, step.modes.natural)
    modes = 100.0 * (step.modes.frequency_hz[:natural] / box.modes.frequency_hz[:natural] - 1.0)
    conditions = []
    for one, other in zip(*(prediction.sound for prediction in predictions), strict=True):
        off = {}
        for path in ("structure", "mesh", "motor", "total"):
            levels = one.level_db("4 m", path), other.level_db("4 m", path)
            off[path] = None if None in levels else round(levels[1] - levels[0], 4)  # type: ignore[operator]
        conditions.append({"condition": one.condition, "off_db": off})
    around = [b.level_db - a.level_db for a, b in zip(*(p.directivity for p in predictions), strict=True)]
    fine = fine_levels(step) - fine_levels(box)
    if sources() != before:
        sys.exit("the sources changed during the run: nothing is written")

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=HERE).stdout.strip()

    found = {
        "schema": "tdacoustic-step-study/1",
        "commit": git("rev-parse", "HEAD"),
        "modified": bool(git("status", "--porcelain", "--", *map(str, source_files()))),
        "versions": {"python": platform.python_version(), **{n: version(n) for n in ("numpy", "scipy", "ngsolve")}},
        "sources_sha256": before,
        "natural_modes": {"box": box.modes.natural, "step": step.modes.natural},
        "modes_off_percent": spread(modes),
        "conditions": conditions,
        "directivity_off_db": spread(np.concatenate(around)),
        "fine_axis_off_db": spread(fine),
        "unknowns": step.modes.unknowns,
        "panels": {"box": box.body.surface(1000.0).n_panels, "step": len(step.modes.grids[0].velocities)},
    }
    RECORD.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
