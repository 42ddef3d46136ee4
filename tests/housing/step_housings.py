"""STEP files of housings by script: examples that the program takes, and files that it refuses.

``python tests/housing/step_housings.py FOLDER`` writes them all into a folder. Made with OpenCASCADE through NGSolve
(extra ``housing``); coordinates in metres, files in millimetres unless they say otherwise. Axes as the program wants
them: x along travel, y to the left along the shafts, z up.
"""

import re
import sys
from pathlib import Path

MM = 1e3


def closed_box(size_m, walls_m, middle_m=(0.0, 0.0, 0.0)):
    """A closed box of plates; sizes and walls along x, y, z."""
    from netgen.occ import Box, Pnt

    low = [m - 0.5 * s for m, s in zip(middle_m, size_m, strict=True)]
    high = [m + 0.5 * s for m, s in zip(middle_m, size_m, strict=True)]
    inner = [[v + w for v, w in zip(low, walls_m, strict=True)], [v - w for v, w in zip(high, walls_m, strict=True)]]
    return Box(Pnt(*low), Pnt(*high)) - Box(Pnt(*inner[0]), Pnt(*inner[1]))


def along_y(x, z, from_y, to_y, radius_m):
    """A cylinder along y."""
    from netgen.occ import Cylinder, Pnt, Vec

    return Cylinder(Pnt(x, from_y, z), Vec(0.0, to_y - from_y, 0.0), r=radius_m, h=abs(to_y - from_y))


def parametric(box):
    """The housing that the program makes of sizes alone, as a solid: plates and thick discs as seats."""
    solid = closed_box(box.extent_m, box.thickness_m)
    half = 0.5 * box.extent_m[1]
    for seat in box.seats:
        for side in (1.0, -1.0):
            x, z = seat.centre_m
            solid = solid + along_y(x, z, side * half, side * (half - seat.thickness_m), seat.radius_m)
    return solid


PINION_XZ, WHEEL_XZ = (-0.11, 0.0), (0.09, 0.0)
BORES = ((PINION_XZ, 0.035), (WHEEL_XZ, 0.05))


def ribbed(
    size_m=(0.45, 0.2, 0.36),
    wall_m=0.01,
    rounding_m=0.03,
    bores=True,
    ribs_at_m=(-0.16, -0.01, 0.15),
    rib_m=0.008,
    boss_m=0.012,
    seats=BORES,
):
    """A rounded casting: upright edges rounded, bosses with bearing bores, ribs outside, no wall like another."""
    from netgen.occ import Axes, Box, Pnt, WorkPlane, X, Z

    x, y, z = (0.5 * edge for edge in size_m)

    def rounded(less):
        profile = WorkPlane(Axes(Pnt(0, 0, -z + less), n=Z, h=X))
        face = profile.RectangleC(2 * (x - less), 2 * (y - less)).Face()
        solid = face.Extrude(2 * (z - less))
        return solid.MakeFillet([e for e in solid.edges if abs(e.start.z - e.end.z) > z], rounding_m - less)

    solid = rounded(0.0) - rounded(wall_m)
    for (at_x, at_z), radius in seats:
        for side in (1.0, -1.0):
            boss = along_y(at_x, at_z, side * (y + boss_m), side * (y - wall_m - boss_m), radius + 0.02)
            solid = solid + boss
    for at_x in ribs_at_m:
        for side in (1.0, -1.0):
            ends = sorted((side * (y - 0.5 * wall_m), side * (y + 0.02)))
            solid = solid + Box(Pnt(at_x - 0.5 * rib_m, ends[0], -0.7 * z), Pnt(at_x + 0.5 * rib_m, ends[1], 0.8 * z))
    if bores:
        for (at_x, at_z), radius in seats:
            solid = solid - along_y(at_x, at_z, -2 * y, 2 * y, radius)
    return solid


def plain_casting():
    """The same kind of casting with thick walls and one rib a side: its modes take half a minute."""
    return ribbed(wall_m=0.018, rounding_m=0.06, ribs_at_m=(-0.01,), rib_m=0.018)


def reference_casting():
    """A casting for the reference drive: as long, wide and high as its box, rounded, with bores and ribs."""
    from reference_housing import reference_box

    box = reference_box()
    bores = tuple((seat.centre_m, seat.radius_m) for seat in box.seats)
    ribs = (-0.3, 0.0, 0.42)
    return ribbed(box.extent_m, 0.016, 0.1, ribs_at_m=ribs, rib_m=0.016, boss_m=0.02, seats=bores)


def fleet_with(step_file, highest_hz):
    """The text of the reference drive's fleet with a STEP file for its box."""
    text = (Path(__file__).parents[2] / "calibration" / "reference-drive" / "fleet.toml").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith(("size_m", "wall_mm", "bearing_p", "top_b"))]
    lines.insert(lines.index("[housing]") + 1, f'step_file = "{step_file}"')
    lines = [f"max_frequency_hz = {highest_hz:g}" if line.startswith("max_freq") else line for line in lines]
    return "\n".join(lines) + "\n"


def in_unit(text, unit):
    """The text of a file in millimetres with the same numbers in another unit."""
    length = re.search(r"#(\d+) = \( LENGTH_UNIT\(\) NAMED_UNIT\(\*\) SI_UNIT\(\.MILLI\.,\.METRE\.\) \);", text)
    if unit == "metre":
        return text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT($,.METRE.)")
    assert unit == "inch"
    mm = f"#{length[1]}"
    top = 1 + max(int(number) for number in re.findall(r"^#(\d+) =", text, flags=re.MULTILINE))
    added = (
        f"#{top} = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );\n"
        f"#{top + 1} = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#{top});\n"
        f"#{top + 2} = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n"
    )
    inch = f"{mm} = ( CONVERSION_BASED_UNIT('INCH',#{top + 1}) LENGTH_UNIT() NAMED_UNIT(#{top + 2}) );"
    return text.replace(length[0], added + inch)


def write(shape, path, unit="millimetre"):
    """Write a shape in metres as a STEP file in a unit."""
    from netgen.occ import Pnt

    per_metre = {"millimetre": MM, "metre": 1.0, "inch": MM / 25.4}[unit]
    shape.Scale(Pnt(0.0, 0.0, 0.0), per_metre).WriteStep(str(path))
    text = re.sub(r"'\d{4}-\d\d-\d\dT[\d:]+'", "'2000-01-01T00:00:00'", path.read_text(encoding="ascii"), count=1)
    path.write_text(text if unit == "millimetre" else in_unit(text, unit), encoding="ascii")  # alike whenever written
    return path


def many_parts(count=200):
    """A housing among a great many small parts."""
    from netgen.occ import Box, Compound, Pnt

    parts = [closed_box((0.4, 0.2, 0.3), (0.01, 0.01, 0.01))]
    parts[0].name = "gear case"
    for number in range(count - 1):
        x, z = -0.19 + 0.02 * (number % 20), 0.16 + 0.02 * (number // 20)
        parts.append(Box(Pnt(x, 0, z), Pnt(x + 0.01, 0.01, z + 0.01)))
        parts[-1].name = f"bolt M10 {number + 1}"
    return Compound(parts)


def open_shell():
    """Six faces of a box but one: no solid."""
    from netgen.occ import Box, Compound, Pnt

    faces = list(Box(Pnt(-0.2, -0.1, -0.15), Pnt(0.2, 0.1, 0.15)).faces)
    top = max(faces, key=lambda face: face.center.z)
    return Compound([face for face in faces if face is not top])


def with_opening():
    """The ribbed housing without bores, and a hand hole of 80 mm in its top."""
    from netgen.occ import Cylinder, Pnt, Z

    return ribbed(bores=False) - Cylinder(Pnt(0.1, 0.0, 0.1), Z, r=0.04, h=0.2)


def block():
    """A solid block."""
    from netgen.occ import Box, Pnt

    return Box(Pnt(-0.2, -0.1, -0.15), Pnt(0.2, 0.1, 0.15))


def small():
    """The smallest box that has modes worth computing: thick walls, so that it takes seconds."""
    from tdacoustic.housing import Box, Seat

    seats = (Seat("pinion", (-0.07, 0.01), 0.03, 0.025), Seat("wheel", (0.06, -0.01), 0.05, 0.025))
    return Box((0.16, 0.3, 0.24), 0.012, 0.012, 0.012, seats, hanger_radius_m=0.032)


def named_seats():
    """A box with its seats' circles drawn on the bearing panels and named, and a named place for the hanger."""
    box = small()
    solid = closed_box(box.extent_m, box.thickness_m)
    for seat in box.seats:
        for side, name in ((1.0, "left"), (-1.0, "right")):
            x, z = seat.centre_m
            pad = along_y(x, z, side * 0.0795, side * 0.0815, seat.radius_m)
            solid = solid + pad
            for face in solid.faces:
                at, spot = face.center, (x, side * 0.0815, z)
                if max(abs(a - b) for a, b in zip((at.x, at.y, at.z), spot, strict=True)) < 1e-6:
                    face.name = f"Seat_{seat.shaft} {name}"
    for face in solid.faces:
        if abs(face.center.z - 0.12) < 1e-6:
            face.name = "hanger"
    return solid


def in_two_parts():
    """A lower half and a lid, as a split housing is drawn; they touch."""
    from netgen.occ import Box, Compound, Pnt

    whole = parametric(small())
    lid = whole * Box(Pnt(-1.0, -1.0, 0.05), Pnt(1.0, 1.0, 1.0))
    lower = whole - Box(Pnt(-1.0, -1.0, 0.05), Pnt(1.0, 1.0, 1.0))
    lid.name, lower.name = "lid", "lower half"
    return Compound([lid, lower])


def faces_apart():
    """The faces of the small box, not joined to a solid, as some translators leave them."""
    from netgen.occ import Compound

    return Compound(list(parametric(small()).faces))


def write_all(folder):
    """Write every example; return the paths by name."""
    from reference_housing import reference_box, small_box

    folder.mkdir(parents=True, exist_ok=True)
    made = {
        "reference_box": parametric(reference_box()),
        "small_box": parametric(small_box()),
        "small": parametric(small()),
        "named_seats": named_seats(),
        "two_parts": in_two_parts(),
        "faces_apart": faces_apart(),
        "ribbed": ribbed(),
        "casting": plain_casting(),
        "reference_casting": reference_casting(),
        "open_shell": open_shell(),
        "parts_200": many_parts(),
        "hand_hole": with_opening(),
        "block": block(),
    }
    paths = {name: write(shape, folder / f"{name}.step") for name, shape in made.items()}
    for unit in ("inch", "metre"):
        paths[unit] = write(made["small"], folder / f"small_in_{unit}.step", unit)
    wrong = folder / "millimetres_called_metres.step"
    text = paths["small"].read_text(encoding="ascii")
    wrong.write_text(in_unit(text, "metre"), encoding="ascii")
    paths["wrong_unit"] = wrong
    paths["fleet"] = folder / "reference_casting.toml"
    paths["fleet"].write_text(fleet_with("reference_casting.step", 700.0), encoding="utf-8")
    return paths


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))
    for name, path in write_all(Path(sys.argv[1])).items():
        print(f"{name}: {path}")
