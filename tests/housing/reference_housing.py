"""The reference housing of physics.md section 8, a small box for quick tests, and figures of the reference.

``python tests/housing/reference_housing.py`` prints, in some minutes: mass, modes and times; the first 50 modes and the
count below 3 kHz of a finer grid, of another order and of other elements.
"""

import time

import numpy as np

from tdacoustic.housing import Box, Seat, horizontal_centres


def reference_box(**changes):
    pinion, wheel = horizontal_centres(0.495)
    seats = (Seat("pinion", pinion, 0.14), Seat("wheel", wheel, 0.20))
    return Box(
        **(
            {"size_m": (0.45, 1.0, 0.9), "wall_m": 0.012, "bearing_panel_m": 0.014, "top_bottom_m": 0.010}
            | {"seats": seats}
            | changes
        )
    )


def small_box(**changes):
    """A box with few modes: the proportions of the reference, thicker walls."""
    seats = (Seat("pinion", (-0.11, 0.02), 0.06, 0.03), Seat("wheel", (0.1, -0.01), 0.09, 0.03))
    return Box(
        **(
            {"size_m": (0.2, 0.45, 0.4), "wall_m": 0.010, "bearing_panel_m": 0.012, "top_bottom_m": 0.008}
            | {"seats": seats, "hanger_radius_m": 0.03}
            | changes
        )
    )


def _frequencies(box, highest_hz, edge_m, order, faces):
    from tdacoustic.housing.box_modes import box_structure, expected_modes
    from tdacoustic.housing.eigenmodes import natural_modes
    from tdacoustic.housing.solid_grid import box_grid

    start = time.perf_counter()
    structure = box_structure(box, box_grid(box, edge_m, faces), order)
    found, _ = natural_modes(structure, highest_hz, expected_modes(box, highest_hz))
    return found, structure.unknowns, time.perf_counter() - start


def main():
    from tdacoustic.housing import housing_modes
    from tdacoustic.housing.box_modes import MODES_BEYOND, edge_for

    box = reference_box()
    start = time.perf_counter()
    modes = housing_modes(box, 3000.0)
    taken = time.perf_counter() - start
    kept = modes.frequency_hz[: modes.natural]
    print(
        f"mass {modes.mass_kg:.1f} kg, {(kept < 3000.0).sum()} modes below 3 kHz, {modes.natural} kept, {taken:.0f} s"
    )
    print("first modes in Hz:", np.round(kept[:16], 1))
    edge = edge_for(box, MODES_BEYOND * modes.highest_hz)
    for what, edge_m, order, faces in (
        ("edges times 0.7", 0.7 * edge, 4, "triangles"),
        ("order 5", 1.3 * edge, 5, "triangles"),
        ("quadrilaterals", edge, 4, "quadrilaterals"),
        ("edges times 1.3", 1.3 * edge, 4, "triangles"),
    ):
        found, unknowns, taken = _frequencies(box, 3100.0, edge_m, order, faces)
        off = kept[: len(found)] / found[: len(kept)] - 1.0
        count = (found < 3000.0).sum()
        print(
            f"{what}: {unknowns} unknowns, {taken:.0f} s; ours over theirs: "
            f"first 50 {100 * np.abs(off[:50]).max():.2f} %, up to 3 kHz {100 * np.abs(off[:count]).max():.2f} %; "
            f"{count} modes below 3 kHz",
            flush=True,
        )


if __name__ == "__main__":
    main()
