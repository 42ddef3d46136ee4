"""Transmission loss of a plate between a reverberant cavity and a free half space, by the coupled air and plate.

``python tests/evidence/cavity_study.py`` writes ``cavity_record.json``; a minute. With ``--figure FILE`` it draws the
curves too. The cavity has three sources, one after the other; the plate is its whole top, simply supported in a rigid
baffle, and radiates into the half space (its own integral over the radiated waves, below). A limp wall of the same mass
is held against the mass law, of a plate without end and of one of this size; 12 mm of steel against the infinite plate,
whose dip lies at the coincidence frequency.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
PACKAGE = HERE.parents[1] / "tdacoustic"
RECORD = HERE / "cavity_record.json"
sys.path.insert(0, str(HERE.parent / "cavity"))

from cavity_walls import DENSITY, IMPEDANCE, SOUND_SPEED, SupportedPlate, steel  # noqa: E402

from tdacoustic.cavity import WallModes, blocked_forces, box_cavity, box_interior, wall_impedance, with_source_at  # noqa: E402

SIZE_M = (1.3, 1.1, 1.7)
SOURCES_M = ((-0.5, -0.4, -0.7), (0.41, 0.33, -0.52), (-0.13, 0.45, 0.2))
THICKNESS_M, PLATE_LOSS, AIR_LOSS = 0.012, 0.02, 0.005
BANDS_HZ = tuple(1000.0 * 10.0 ** (number / 10.0) for number in range(-6, 4))
LIMP_BANDS = 7
"""Of these that the limp wall is computed in; beyond it takes too many functions."""
LINES = 32
"""Of each third octave."""

FIELD_DEG = 78.0


def source_files() -> list[Path]:
    """Modules that the figures come from."""
    names = ("box", "box_modes", "coupling", "mass_law", "modes")
    return [*(PACKAGE / "cavity" / f"{name}.py" for name in names), HERE / "cavity_study.py"]


def sources() -> str:
    """Return their stamp."""
    digest = hashlib.sha256()
    for path in source_files():
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()


def record() -> dict[str, Any]:
    """Return what is recorded."""
    return dict(json.loads(RECORD.read_text(encoding="utf-8")))


def coincidence_hz() -> float:
    """c²/(2π) √(m/D)."""
    mass, rigidity = steel(THICKNESS_M)
    return SOUND_SPEED**2 / (2.0 * math.pi) * math.sqrt(mass / rigidity)


def radiated_w(plate: SupportedPlate, velocities: np.ndarray, frequency_hz: float) -> float:
    """Power of a baffled plate: P = ρ c k² / (8π²) ∫|V(k sinθ cosφ, k sinθ sinφ)|² sinθ dθ dφ over the half space."""
    k = 2.0 * math.pi * frequency_hz / SOUND_SPEED
    ends, weights = np.polynomial.legendre.leggauss(40 + int(k))
    theta = 0.25 * math.pi * (ends + 1.0)
    phi = 2.0 * math.pi * np.arange(4 * len(theta)) / (4 * len(theta))
    a, b = plate.size_m[:2]
    kx, ky = k * np.outer(np.sin(theta), np.cos(phi)).ravel(), k * np.outer(np.sin(theta), np.sin(phi)).ravel()
    along, up = _transforms(kx, a, plate.numbers[:, 0].max()), _transforms(ky, b, plate.numbers[:, 1].max())
    table = np.zeros((along.shape[0], up.shape[0]), dtype=np.complex128)
    table[plate.numbers[:, 0] - 1, plate.numbers[:, 1] - 1] = velocities
    waves = ((table.T @ along) * up).sum(axis=0) * 2.0 / math.sqrt(plate.mass * a * b)
    solid = np.outer(0.25 * math.pi * weights * np.sin(theta), np.full(len(phi), 2.0 * math.pi / len(phi))).ravel()
    return float(IMPEDANCE * k**2 / (8.0 * math.pi**2) * (np.abs(waves) ** 2 @ solid))


def _transforms(k: np.ndarray, length_m: float, number: int) -> np.ndarray:
    """∫ sin(mπx/L) e^{jkx} dx over 0 to L, for m = 1, 2, ..., shape (number, len(k))."""
    m = np.arange(1, number + 1)[:, None] * math.pi / length_m
    ends = np.where(np.arange(1, number + 1)[:, None] % 2, -1.0, 1.0) * np.exp(1j * k * length_m)
    apart = m**2 - k**2
    near = np.abs(apart) < 1e-6 * m**2
    found = m * (1.0 - ends) / np.where(near, 1.0, apart)
    return np.where(near, 0.5j * length_m * np.sign(k), found)


def transmission_losses(limp: bool) -> list[float]:
    """R = 10 lg(p² S / (4ρc) / P) in third octaves: sums over lines and sources of incident and radiated power."""
    mass, rigidity = steel(THICKNESS_M)
    bands = BANDS_HZ[: LIMP_BANDS if limp else None]
    highest = bands[-1] * 10.0**0.05
    plate = SupportedPlate(SIZE_M, mass, rigidity, 1.3 * highest)
    if limp:  # the sines of another plate, up to twice the wave number of sound
        plate = SupportedPlate(SIZE_M, mass, mass, (4.0 * math.pi * highest / SOUND_SPEED) ** 2 / (2.0 * math.pi))
    walls = WallModes(plate.frequency_hz if not limp else np.full(len(plate.numbers), 1e-3), PLATE_LOSS)
    interior = box_interior(SIZE_M, plate.outward, plate.bending_rad_m, 2.0 * plate.bending_rad_m)
    first = box_cavity(interior, highest, SOURCES_M[0], SOUND_SPEED, DENSITY, kept=1.2)
    cavities = [first, *(with_source_at(interior, first, place) for place in SOURCES_M[1:])]
    print(f"{len(walls.frequency_hz)} wall modes, {len(first.wave_number_rad_m)} of the air", flush=True)
    found, surface = [], interior.surface_m2
    for band in bands:
        incident = radiated = 0.0
        for frequency in _lines(band):
            impedance = wall_impedance(first, float(frequency), AIR_LOSS) + np.diag(walls.impedance(float(frequency)))
            for cavity in cavities:
                moved = np.linalg.solve(impedance, blocked_forces(cavity, float(frequency), AIR_LOSS))
                square = cavity.squared_wave_number(float(frequency), AIR_LOSS)
                drive = 4.0 * math.pi * cavity.source - 2j * math.pi * frequency * DENSITY * (cavity.walls @ moved)
                parts = drive * cavity.responses(square) / cavity.volume_m3
                mean = 0.5 * float((np.abs(parts) ** 2).sum())
                mean /= 1.0 + surface * SOUND_SPEED / frequency / (
                    8.0 * first.volume_m3
                )  # away from walls (Waterhouse)
                incident += mean * SIZE_M[0] * SIZE_M[1] / (4.0 * IMPEDANCE)
                radiated += radiated_w(plate, moved, float(frequency))
        found.append(10.0 * math.log10(incident / radiated))
        print(f"{'limp' if limp else 'steel'} {band:7.1f} Hz: {found[-1]:.1f} dB", flush=True)
    return found


def infinite_plate_db(frequency_hz: float, limp: bool, highest_deg: float = FIELD_DEG) -> float:
    """Field-incidence transmission loss of an infinite thin plate, Cremer's wave impedance integrated over angles."""
    mass, _ = steel(THICKNESS_M)
    angle = np.linspace(0.0, math.radians(highest_deg), 20001)
    ratio = 0.0 if limp else (frequency_hz / coincidence_hz()) ** 2
    bending = 1.0 - ratio * (1.0 + 1j * PLATE_LOSS) * np.sin(angle) ** 4
    through = 1.0 / np.abs(1.0 + 1j * math.pi * frequency_hz * mass * np.cos(angle) / IMPEDANCE * bending) ** 2
    weight = np.sin(2.0 * angle)
    return float(-10.0 * np.log10((through * weight).sum() / weight.sum()))


def _lines(band_hz: float) -> np.ndarray:
    return band_hz * 10.0 ** (0.1 * ((np.arange(LINES) + 0.5) / LINES - 0.5))


def infinite_band_db(band_hz: float, limp: bool) -> float:
    """The same over the lines of a third octave."""
    return float(
        -10.0 * np.log10(np.mean([10.0 ** (-0.1 * infinite_plate_db(float(f), limp)) for f in _lines(band_hz)]))
    )


def finite_limp_db(frequency_hz: float) -> float:
    """That of a limp wall of the plate's size in a baffle, in a diffuse field.

    Each plane wave moves it as one without end, and it radiates with its own size.
    """
    mass, _ = steel(THICKNESS_M)
    k, (a, b) = 2.0 * math.pi * frequency_hz / SOUND_SPEED, SIZE_M[:2]
    ends, weights = np.polynomial.legendre.leggauss(24 + int(k))
    theta = 0.25 * math.pi * (ends + 1.0)
    phi = 2.0 * math.pi * (np.arange(2 * len(theta)) + 0.5) / (2 * len(theta))
    x, y = (k * np.outer(np.sin(theta), turn(phi)).ravel() for turn in (np.cos, np.sin))
    solid = np.outer(weights * np.sin(theta), np.full(len(phi), 2.0 * math.pi / len(phi))).ravel() * 0.25 * math.pi
    cosine = np.repeat(np.cos(theta), len(phi))
    radiated = 0.0
    for kx, ky, share in zip(x, y, solid, strict=True):
        window = a * b * np.sinc((x - kx) * a / (2.0 * math.pi)) * np.sinc((y - ky) * b / (2.0 * math.pi))
        radiated += share * float(solid @ window**2)
    radiated *= IMPEDANCE * k**2 / (8.0 * math.pi**2) * (2.0 / (2.0 * math.pi * frequency_hz * mass)) ** 2
    return 10.0 * math.log10(float(solid @ cosine) * a * b / (2.0 * IMPEDANCE) / radiated)


def study() -> dict[str, Any]:
    """Return what is recorded."""
    return {
        "sources_sha256": sources(),
        "bands_hz": list(BANDS_HZ),
        "coincidence_hz": coincidence_hz(),
        "limp_db": transmission_losses(True),
        "limp_infinite_db": [infinite_band_db(band, True) for band in BANDS_HZ[:LIMP_BANDS]],
        "limp_finite_db": [finite_limp_db(band) for band in BANDS_HZ[:LIMP_BANDS]],
        "steel_db": transmission_losses(False),
        "steel_infinite_db": [infinite_band_db(band, False) for band in BANDS_HZ],
    }


def draw(held: dict[str, Any], path: Path) -> None:
    """Draw the curves."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7.0, 4.5))
    for name, style in (("limp", "C0"), ("steel", "C1")):
        bands = held["bands_hz"][: len(held[f"{name}_db"])]
        axes.semilogx(bands, held[f"{name}_db"], f"{style}o-", label=f"{name}, cavity and half space")
        axes.semilogx(bands, held[f"{name}_infinite_db"], f"{style}--", label=f"{name}, infinite plate")
    axes.semilogx(held["bands_hz"][:LIMP_BANDS], held["limp_finite_db"], "C0:", label="limp, finite plate, plane waves")
    axes.axvline(held["coincidence_hz"], color="0.5", lw=1)
    axes.set(xlabel="Frequency / Hz", ylabel="Transmission loss / dB")
    axes.legend()
    axes.grid(which="both", alpha=0.3)
    figure.savefig(path, dpi=120)


def main() -> None:
    """Compute and write."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--draw-only", action="store_true")
    given = parser.parse_args()
    if not given.draw_only:
        RECORD.write_text(json.dumps(study(), indent=1) + "\n", encoding="utf-8")
    if given.figure is not None:
        draw(record(), given.figure)


if __name__ == "__main__":
    main()
