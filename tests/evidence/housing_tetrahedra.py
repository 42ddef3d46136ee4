"""The housing anew: unstructured tetrahedra on a solid of OpenCASCADE, eigenvalues by ARPACK.

Uses nothing of the program but the numbers of a box (duck-typed): geometry, grid, elements, springs and eigenvalues are
made here. Discs are true cylinders.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def solid(box: Any, joint_edge_m: float) -> Any:
    """OpenCASCADE's geometry of a box, its seats and its hanger's disc: named parts, edges inside with a finer grid."""
    from netgen.occ import Box, Cylinder, Glue, OCCGeometry, Pnt, Vec

    high = [0.5 * size for size in box.extent_m]
    clear = [half - wall for half, wall in zip(high, box.thickness_m, strict=True)]
    shell = Box(Pnt(*(-v for v in high)), Pnt(*high)) - Box(Pnt(*(-v for v in clear)), Pnt(*clear))
    parts = []
    for seat in box.seats:
        x, z = seat.centre_m
        for side, sign in (("left", 1.0), ("right", -1.0)):
            disc = Cylinder(Pnt(x, sign * high[1], z), Vec(0.0, -sign, 0.0), r=seat.radius_m, h=seat.thickness_m)
            disc.mat(f"{seat.shaft}_{side}")
            parts.append(disc)
    hanger = Cylinder(Pnt(-high[0], 0.0, 0.0), Vec(1.0, 0.0, 0.0), r=box.hanger_radius_m, h=box.wall_m)
    hanger.mat("hanger")
    parts.append(hanger)
    for part in parts:
        shell = shell - part
    shell.mat("shell")
    whole = Glue([shell, *parts])
    for edge in whole.edges:  # re-entrant: here the strain is unbounded
        if all(abs(a) <= c + 1e-4 for corner in edge.bounding_box for a, c in zip(corner, clear, strict=True)):
            edge.maxh = joint_edge_m
    return OCCGeometry(whole)


def matrices(box: Any, edge_m: float, joint_edge_m: float, order: int) -> tuple[Any, Any, Any, float]:
    """Space, K and M of NGSolve, and the mass in kg."""
    import ngsolve as ng

    ng.ngsglobals.msg_level = 0
    grid = ng.Mesh(solid(box, joint_edge_m).GenerateMesh(maxh=edge_m, grading=0.7))
    grid.Curve(order)
    space = ng.VectorH1(grid, order=order)
    u, v = space.TnT()
    shear = box.modulus_pa / (2.0 * (1.0 + box.poisson))
    bulk_like = box.modulus_pa * box.poisson / ((1.0 + box.poisson) * (1.0 - 2.0 * box.poisson))
    strain = 0.5 * (ng.Grad(u) + ng.Grad(u).trans)
    stress = 2.0 * shear * strain + bulk_like * ng.Trace(strain) * ng.Id(3)
    stiffness = ng.BilinearForm(space, symmetric=True)
    stiffness += ng.InnerProduct(stress, ng.Grad(v)) * ng.dx
    held = {f"{seat.shaft}_{side}": seat.stiffness_n_per_m for seat in box.seats for side in ("left", "right")}
    for name, springs in (held | {"hanger": box.hanger_stiffness_n_per_m}).items():
        volume = ng.Integrate(1.0, grid, definedon=grid.Materials(name))
        for axis, spring in enumerate(springs):
            stiffness += spring / volume * u[axis] * v[axis] * ng.dx(name)
    mass = ng.BilinearForm(space, symmetric=True)
    mass += box.density_kg_m3 * ng.InnerProduct(u, v) * ng.dx
    stiffness.Assemble()
    mass.Assemble()
    return space, stiffness.mat, mass.mat, float(box.density_kg_m3 * ng.Integrate(1.0, grid))


def frequencies_hz(
    box: Any, highest_hz: float, number: int, edge_m: float, joint_edge_m: float, order: int
) -> dict[str, Any]:
    """The `number` modes nearest to the middle of λ up to a frequency, those below it, and what they rest on."""
    from scipy.sparse.linalg import LinearOperator, eigsh

    space, stiffness, mass, mass_kg = matrices(box, edge_m, joint_edge_m, order)
    shift = 0.5 * (2.0 * math.pi * highest_hz) ** 2
    matrix = stiffness.CreateMatrix()
    matrix.AsVector().data = stiffness.AsVector() - shift * mass.AsVector()
    given, found = mass.CreateColVector(), mass.CreateColVector()

    def operator(applied: Any) -> Any:
        def apply(vector: Any) -> Any:
            given.FV().NumPy()[:] = vector.ravel()
            found.data = applied * given
            return found.FV().NumPy().copy()

        return LinearOperator((space.ndof, space.ndof), matvec=apply, dtype=float)

    inverse = matrix.Inverse(space.FreeDofs(), inverse="sparsecholesky")
    values = eigsh(
        operator(stiffness),
        number,
        operator(mass),
        sigma=shift,
        OPinv=operator(inverse),
        return_eigenvectors=False,
        ncv=math.ceil(1.5 * number) + 20,
        tol=1e-6,
        v0=np.random.default_rng(1).standard_normal(space.ndof),
    )
    if np.abs(values - shift).max() < shift:
        raise ValueError(f"{number} modes do not reach from 0 to {highest_hz:g} Hz")
    held = np.sqrt(np.sort(values[(values > 0.0) & (values < 2.0 * shift)])) / (2.0 * math.pi)
    return {"unknowns": int(space.ndof), "mass_kg": mass_kg, "frequency_hz": held.tolist()}
