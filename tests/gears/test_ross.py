"""Spur pairs in ROSS, a rotordynamics program: its coupling of two rotors by a gear mesh, and its tooth stiffness.

ROSS needs an environment of its own (it wants plotly below 6), whose Python the variable TDACOUSTIC_ROSS_PYTHON names;
without it these tests are skipped.

The spur limit is what can be compared. ROSS couples along (sin α, -cos α cos β', sin α sin β') with β' = β - π; the
axial part of a helical pair would be cos α sin β' for a unit vector, so helical pairs differ by more than a convention.
It has tilting of both gears, which the paper's equations leave out; a spur mesh does not excite it.
"""

import json
import math
import os
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from reference_drive import reference_system

from tdacoustic.gears import ContactLines, GearGeometry, bearing_forces, mesh_stiffness, steady_state

PYTHON = os.environ.get("TDACOUSTIC_ROSS_PYTHON")
pytestmark = pytest.mark.skipif(
    not PYTHON,
    reason="TDACOUSTIC_ROSS_PYTHON names no Python with ross-rotordynamics (it needs plotly below 6)",
)

FREQUENCIES_HZ = (120.0, 349.94, 524.9, 1001.3, 1900.0)
TOOTH_PAIRS = ((31, 104, 7.35e-3, 0.12), (62, 62, 2e-3, 0.02), (40, 40, 3e-3, 0.02), (25, 75, 4e-3, 0.03))

SCRIPT = r"""
import json, math, sys, warnings
warnings.filterwarnings("ignore")
import numpy as np, ross as rs
from importlib.metadata import version
from ross.gear_element import Mesh

given = json.load(sys.stdin)
light = rs.Material(name="light", rho=1e-3, E=1e14, G_s=4e13)  # a shaft without weight that does not bend

def rotor(gear, damped):
    shaft = [rs.ShaftElement(L=0.02, idl=0.0, odl=0.1, material=light) for _ in range(2)]
    disc = rs.GearElement(
        n=1, m=gear["mass"], Id=0.5 * gear["inertia"], Ip=gear["inertia"], n_teeth=gear["teeth"],
        base_diameter=2.0 * gear["base_radius"], pr_angle=given["pressure_angle"],
    )
    (kx, ky, kz), (cx, cy, cz) = 0.5 * np.array(gear["stiffness"]), 0.5 * damped * np.array(gear["damping"])
    bearings = [rs.BearingElement(n=n, kxx=kx, kyy=ky, kzz=kz, cxx=cx, cyy=cy, czz=cz) for n in (0, 2)]
    return rs.Rotor(shaft, [disc], bearings)

def coupled(damped):
    rotors = [rotor(gear, damped) for gear in given["gears"]]
    return rs.MultiRotor(*rotors, coupled_nodes=(1, 1), gear_mesh_stiffness=given["mesh_stiffness"])

result = {"version": version("ross-rotordynamics")}
result["natural_hz"] = (np.abs(coupled(0.0).run_modal(0.0, num_modes=24).wn) / (2.0 * np.pi)).tolist()

pair = coupled(1.0)
# A mesh error drives both gears along the line that the coupling matrix itself gives.
coupling = pair.coupling_matrix()
along = coupling[:, 1] / math.sqrt(coupling[1, 1])
mesh = pair.mesh
places = [*mesh.driving_gear.dof_global_index.values(), *mesh.driven_gear.dof_global_index.values()]
result["rank_one"] = float(np.abs(np.outer(along, along) - coupling).max())
M, C, K = pair.M(), pair.C(0.0), pair.K(0.0)
force = np.zeros(len(M))
force[places] = mesh.stiffness * along
result["bearing"] = []
for frequency in given["frequencies_hz"]:
    omega = 2.0 * np.pi * frequency
    x = np.linalg.solve(K - omega**2 * M + 1j * omega * C, force)
    row = []
    for first, gear in zip((0, 3), given["gears"]):
        for direction in range(2):
            spring = gear["stiffness"][direction] + 1j * omega * gear["damping"][direction]
            held = 0.5 * spring * (x[6 * first + direction] + x[6 * (first + 2) + direction])
            row.append([held.real, held.imag])
    result["bearing"].append(row)

result["teeth"] = []
for first, second, module, width in given["tooth_pairs"]:
    gears = [
        rs.GearElementTVMS(
            n=0, material=rs.materials.steel, width=width, bore_diameter=0.5 * module * teeth, module=module,
            n_teeth=teeth, pr_angle=math.radians(20.0),
        )
        for teeth in (first, second)
    ]
    teeth = Mesh(*gears)
    result["teeth"].append([teeth.contact_ratio, float(np.mean(teeth.stiffness_range))])
print("RESULT" + json.dumps(result))
"""


@pytest.fixture(scope="module")
def system():
    """The reference drive as a spur pair whose stiffness does not change, and without mesh damping: ROSS has none."""
    spur = reference_system(helix_angle_deg=0.0, mesh_damping_ratio=0.0)
    return replace(spur, contact_lines=ContactLines(2.0, 0.0))


@pytest.fixture(scope="module")
def ross(system, tmp_path_factory):
    gears = [
        {
            "mass": system.masses_kg[which],
            "inertia": system.inertias_kg_m2[which],
            "teeth": teeth,
            "base_radius": system.base_radii_m[which],
            "stiffness": system.bearing_stiffness_n_per_m[3 * which : 3 * which + 3],
            "damping": system.bearing_damping_n_s_per_m[3 * which : 3 * which + 3],
        }
        for which, teeth in enumerate((31, 104))
    ]
    given = {
        "gears": gears,
        "pressure_angle": system.pressure_angle_rad,
        "mesh_stiffness": system.mesh_stiffness_n_per_m,
        "frequencies_hz": FREQUENCIES_HZ,
        "tooth_pairs": TOOTH_PAIRS,
    }
    done = subprocess.run(
        [PYTHON, "-c", SCRIPT],
        input=json.dumps(given),
        capture_output=True,
        text=True,
        timeout=300,
        cwd=tmp_path_factory.mktemp("ross"),
    )
    assert done.returncode == 0, done.stderr[-2000:]
    result = json.loads(done.stdout.split("RESULT", 1)[1])
    return {**result, "source": f"program: ROSS {result['version']}"}


def test_natural_frequencies(conformance, system, ross):
    """Each of ours is one of ROSS's, whose others tilt the gears; its shafts bend and lower them by 2e-5 at most."""
    ours = system.natural_frequencies_hz()[1:]
    theirs = np.array(ross["natural_hz"])
    assert ross["rank_one"] < 1e-12
    for frequency in ours:
        nearest = theirs[np.abs(theirs - frequency).argmin()]
        conformance(
            f"natural frequency of the spur pair {frequency:.0f} Hz",
            nearest,
            frequency,
            1e-4 * frequency,
            "Hz",
            ross["source"],
        )


def test_bearing_forces_of_a_transmission_error(conformance, system, ross):
    """Constant stiffness, a sine of 5 um: the balance's first line and a linear solution of ROSS's matrices."""
    error = system.transmission_error_m[0]
    for frequency, row in zip(FREQUENCIES_HZ, ross["bearing"], strict=True):
        state = steady_state(system, frequency, 20000.0)
        assert not state.separates
        ours = bearing_forces(system, state).amplitude_n[:, :2, 0].ravel() / (-1j * error)
        theirs = np.array([complex(*value) for value in row])
        off = np.abs(ours - theirs).max() / np.abs(theirs).max()
        conformance(
            f"bearing forces per transmission error, spur, {frequency:g} Hz",
            0.0,
            off,
            1e-3,
            "of the largest",
            ross["source"],
        )


@pytest.mark.parametrize("which", range(len(TOOTH_PAIRS)))
def test_mesh_stiffness_of_integrated_teeth(conformance, ross, which):
    """ISO 6336's mean against ROSS's, integrated over teeth as cantilevers with Hertzian contact.

    Two theories; ISO says of its own that teeth were measured 20 % softer than its theory.
    """
    first, second, module, width = TOOTH_PAIRS[which]
    pair = GearGeometry((first, second), module, math.radians(20.0), 0.0, (0.0, 0.0), 1.0, 0.25, width)
    ratio, stiffness = ross["teeth"][which]
    name = f"{first}/{second} teeth of {1e3 * module:g} mm"
    conformance(f"contact ratio, {name}", ratio, pair.transverse_contact_ratio, 1e-9, "1", ross["source"])
    ours = mesh_stiffness(pair).normal_n_per_m
    note = "two theories; ISO 6336 says of its own that teeth were measured 20 % softer"
    conformance(f"mean mesh stiffness, {name}", stiffness, ours, 0.15 * stiffness, "N/m", ross["source"], note)
