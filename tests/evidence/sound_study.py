"""The demonstration drive's sound by transfer vectors: over grids, over modes, and beside direct solutions.

``python tests/evidence/sound_study.py [--store DIR]`` writes ``sound_record.json``; five minutes on two idle cores,
with NGSolve. All to 1100 Hz, which holds the first mesh harmonic of every condition.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import platform
import subprocess
import tempfile
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import tdacoustic as td
from tdacoustic.drive import DriveModel, HousingSound
from tdacoustic.drive.housing_steps import panel_velocities
from tdacoustic.housing import HousingModes
from tdacoustic.radiation.boundary_elements import ExteriorProblem
from tdacoustic.radiation.multipoles import degree_for
from tdacoustic.radiation.sphere_rules import SphereRule
from tdacoustic.radiation.transfer_vectors import grid_hz_for
from tdacoustic.steps import Store
from tdacoustic.workflows.housing_sound import housing_sound

HERE = Path(__file__).resolve().parent
PACKAGE = HERE.parents[1] / "tdacoustic"
RECORD = HERE / "sound_record.json"

HIGHEST_HZ = 1100.0
ELEMENTS = (6.0, 7.5, 11.0, 15.0)
"""Elements a wavelength; the others are held against the last."""

REACHES = (0.8, 1.0, 1.1, 1.2)
"""Natural modes up to these times the highest frequency; the program keeps the last."""

PATHS = ("structure", "motor")


def source_files() -> list[Path]:
    """Modules that the figures come from."""
    names = ("box_in_air", "interpolation", "multipole_kernels", "multipoles", "received", "transfer_vectors")
    radiation = [PACKAGE / "radiation" / f"{name}.py" for name in names]
    drive = [PACKAGE / "drive" / f"housing_{name}.py" for name in ("box", "field", "steps")]
    return [*radiation, *drive, HERE / "sound_study.py"]


def sources() -> str:
    """Return their stamp."""
    digest = hashlib.sha256()
    for path in source_files():
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


def record() -> dict[str, Any]:
    """Return what is recorded."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8")))


def fleet_of(elements: float) -> td.Fleet:
    """The demonstration's drive with other grids."""
    changes = {"radiation.max_frequency_hz": HIGHEST_HZ, "radiation.elements_per_wavelength": elements}
    return td.load_fleet(HERE.parents[1] / "calibration" / "crrc-freight").replaced(changes)


def levels_of(fleet: td.Fleet, housing: HousingSound) -> dict[str, Any]:
    """Levels at 4 m by path and condition, and around the circle."""
    prediction = DriveModel(fleet, housing=housing).evaluate()
    levels = {path: [sound.level_db("4 m", path) for sound in prediction.sound] for path in PATHS}
    return {
        **levels,
        "circle": [around.level_db.tolist() for around in prediction.directivity[: len(prediction.sound)]],
    }


def over_elements(store: Store) -> list[dict[str, Any]]:
    """Levels for each grid."""
    rows = []
    for elements in ELEMENTS:
        fleet = fleet_of(elements)
        housing = housing_sound(fleet, store)[0]
        assert housing is not None
        panels = housing.body.surface(1000.0).n_panels
        rows.append({"elements_per_wavelength": elements, "panels_to_1_khz": panels, **levels_of(fleet, housing)})
        print(f"{elements:g} elements a wavelength: done", flush=True)
    return rows


def with_modes(housing: HousingSound, kept: np.ndarray) -> HousingSound:
    """The same vectors with some of the modes."""
    held = housing.modes
    modes = HousingModes(
        held.box,
        held.highest_hz,
        int(kept[: held.natural].sum()),
        held.frequency_hz[kept],
        held.seats[kept],
        held.surface,
        held.outward[kept],
        held.mass_kg,
    )
    sources = len(housing.body.sources_m)
    columns = np.concatenate([kept, np.ones(sources, dtype=bool)])
    mean = replace(housing.mean, modal=np.ascontiguousarray(housing.mean.modal[:, kept][:, :, kept]))
    points = replace(housing.points, columns=np.ascontiguousarray(housing.points.columns[:, :, columns]))
    return HousingSound(housing.box, housing.body, modes, mean, points)


def over_modes(store: Store) -> list[dict[str, Any]]:
    """Levels of the structure with some of the modes, with and without static correction."""
    fleet = fleet_of(7.5)
    housing = housing_sound(fleet, store)[0]
    assert housing is not None
    natural = np.arange(len(housing.modes.frequency_hz)) < housing.modes.natural
    rows = []
    for reach in REACHES:
        below = natural & (housing.modes.frequency_hz <= reach * HIGHEST_HZ * (1.0 + 1e-9))
        for corrected in (True, False):
            if corrected and reach != REACHES[-1]:
                continue  # the correction stands for what lies beyond the last reach, and for nothing nearer
            found = levels_of(fleet, with_modes(housing, below | ~natural if corrected else below))
            rows.append(
                {"reach": reach, "modes": int(below.sum()), "corrected": corrected, "structure": found["structure"]}
            )
    return rows


def beside_direct(store: Store) -> list[dict[str, Any]]:
    """Every line of the structure at 4 m, by vectors and by a solution for it alone on the same grid."""
    fleet = fleet_of(7.5)
    housing = housing_sound(fleet, store)[0]
    assert housing is not None
    model, body = DriveModel(fleet, housing=housing), housing.body
    rows = []
    for condition in model.conditions:
        for source in model.field.structure_sources(model.gears(condition).forces):
            surface = body.surface(grid_hz_for(source.frequency_hz, HIGHEST_HZ))
            velocity = panel_velocities(housing.modes, surface, body.position_m) @ source.velocities
            wave = body.wave_number_rad_m(source.frequency_hz)
            rule = SphereRule(4.0, 2 * degree_for(wave, body.radius_m))
            pressures = ExteriorProblem(surface, wave, body.impedance_pa_s_m).transfer(rule.points_m, velocity[:, None])
            direct = 10.0 * float(np.log10(0.5 * rule.mean_square(pressures[:, 0]) / 4e-10))
            level = source.sound_power_level_db + float(model.field.transfer_db(source, [model.field.surface])[0])
            rows.append(
                {"condition": condition.name, "frequency_hz": source.frequency_hz, "db": level, "direct": direct}
            )
    return rows


def main() -> None:
    """Compute and write the record."""
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--store", type=Path)
    options = asked.parse_args()

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, check=True, cwd=HERE).stdout.strip()

    with tempfile.TemporaryDirectory() as empty:
        store = Store(options.store or empty)
        found = {
            "schema": "tdacoustic-sound-study/1",
            "commit": git("rev-parse", "HEAD"),
            "modified": bool(git("status", "--porcelain", "--", *map(str, source_files()))),
            "versions": {"python": platform.python_version()}
            | {name: version(name) for name in ("numpy", "scipy", "numba", "ngsolve")},
            "sources_sha256": sources(),
            "elements": over_elements(store),
            "modes": over_modes(store),
            "direct": beside_direct(store),
        }
    RECORD.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(tables(found))


def tables(found: dict[str, Any]) -> str:
    """Return the figures in words."""
    lines = []
    finest = found["elements"][-1]
    for row in found["elements"][:-1]:
        apart = {path: largest(row[path], finest[path]) for path in PATHS}
        circle = np.abs(np.array(row["circle"]) - np.array(finest["circle"])).max()
        name, panels = f"{row['elements_per_wavelength']:g}", row["panels_to_1_khz"]
        lines.append(f"| {name} | {panels} | {apart['structure']:.2f} | {apart['motor']:.2f} | {circle:.2f} |")
    kept = next(row for row in found["modes"] if row["corrected"])
    for row in found["modes"]:
        if not row["corrected"]:
            lines.append(f"| {row['reach']:g} | {row['modes']} | {largest(row['structure'], kept['structure']):.2f} |")
    worst = max(abs(row["db"] - row["direct"]) for row in found["direct"])
    lines.append(f"{len(found['direct'])} lines beside direct solutions: {worst:.3f} dB at most")
    return "\n".join(lines)


def largest(one: list[float | None], other: list[float | None]) -> float:
    """Largest difference of levels; silence against silence is none."""
    pairs = [(a, b) for a, b in zip(one, other, strict=True) if a is not None and b is not None]
    return max(abs(a - b) for a, b in pairs)


if __name__ == "__main__":
    main()
