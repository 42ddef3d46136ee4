"""Assumed and inferred numbers on docs/readings.md are those of the fleet files and of the geometry."""

import csv
import math
import tomllib

from guides import DOCS, ROOT

import tdacoustic as td
from tdacoustic.drive.gear_unit import gear_unit_of

WORDS = " ".join((DOCS / "readings.md").read_text(encoding="utf-8").split())


def fleet(name):
    return tomllib.loads((ROOT / "calibration" / name / "fleet.toml").read_text(encoding="utf-8"))


def test_what_the_reference_drive_assumes():
    held = fleet("reference-drive")
    gears, pair, housing = held["gear_dynamics"], held["gear_pair"][0], held["housing"]
    stiffness = [gears[f"{gear}_bearing_stiffness_n_per_m"] for gear in ("pinion", "wheel")]
    across = [f"{row[0]:.1e}".replace("e+0", "e") for row in stiffness]
    along = [f"{row[2]:.0e}".replace("e+0", "e") for row in stiffness]
    assert "{} and {} N/m across and {} and {} N/m along".format(*across, *along) in WORDS
    assert "{} and {} kg, {} and {} kg m²".format(*gears["mass_kg"], *gears["inertia_kg_m2"]) in WORDS
    assert gears["bearing_damping_ratio"] == gears["mesh_damping_ratio"] == 0.05
    assert "damping ratio 0.05 of bearings and mesh" in WORDS and f"backlash {pair['backlash_um']} µm" in WORDS
    assert f"| {pair['face_width_mm']} mm, **assumed** |" in WORDS
    assert f"with {pair['transmission_error_um'][0]} µm, **assumed**" in WORDS
    assert f"| {held['operation']['torque_n_m']} N m at all speeds" in WORDS
    assert "box of {} x {} x {} m, walls {} mm".format(*housing["size_m"], housing["wall_mm"]) in WORDS
    assert f"loss factor {housing['loss_factor']}, about 480 kg" in WORDS
    assert f"carrier {fleet('crrc-freight')['motor']['carrier_hz']} Hz" in WORDS


def test_the_geometry_that_is_inferred():
    pair = gear_unit_of(td.load_fleet(ROOT / "calibration" / "reference-drive" / "fleet.toml")).geometry
    assert f"operation, {math.degrees(pair.working_pressure_angle_rad):.2f}°" in WORDS
    assert f"| {math.degrees(pair.helix_angle_rad):.3f}°, from the centre distance" in WORDS
    assert f"Transverse contact ratio {pair.transverse_contact_ratio:.2f}" in WORDS


def test_the_centre_distances_of_the_helix_sweep():
    with (ROOT / "reports" / "example" / "helix.csv").open(encoding="utf-8", newline="") as stream:
        distances = [float(row["centre_distance_mm"]) for row in csv.DictReader(stream)]
    assert f"{min(distances):.1f} to {max(distances):.1f} mm" in WORDS
