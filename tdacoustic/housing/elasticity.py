"""Linear elasticity on a solid grid by NGSolve: stiffness, mass, loads, and what they do to vectors.

Elements. High-order H1 prisms and hexahedra of order 4 along the walls and 2 through them: a quadratic displacement
over the thickness is what bending needs for its transverse contraction. Order 3 along triangles still locks (1.6 % at
the 20th mode of a simply supported plate with edges of ten thicknesses); order 4 does not (0.2 %, with as many
unknowns), in line with Suri, Babuska and Schwab, Math. Comput. 64 (1995) 461. At welded edges and seats order 4 through
the walls and across the narrow bands takes another 0.5 to 1 %; faces along them need it on their cross-sections only.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.housing.plane_grid import missing_ngsolve
from tdacoustic.housing.solid_grid import SolidGrid

__all__ = ["ORDER", "THROUGH", "Structure", "assembled", "structure_of"]

ORDER: Final = 4
"""Polynomial order along the walls."""

THROUGH: Final = 2
"""Polynomial order through the walls."""

THROUGH_JOINTS: Final = 4
"""The same at welded edges and seats, and across the narrow bands there."""

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Structure:
    """The assembled matrices of a structure; lives in one process and is not kept.

    Parameters
    ----------
    grid : ngsolve.Mesh
    space : ngsolve.H1
    stiffness, mass : ngsolve.BaseMatrix
        Symmetric.
    scalar_mass : scipy.sparse.csr_matrix
        The mass of one direction of displacement; the three have the same, which makes products cheap.
    loads : ndarray, shape (3 * parts, unknowns)
        Of unit forces along x, y, z on each of the parts asked for, spread evenly over its volume: their product with a
        displacement is the part's mean displacement.
    mass_kg : float
    """

    grid: Any
    space: Any
    stiffness: Any
    mass: Any
    scalar_mass: Any
    loads: Real
    mass_kg: float

    @property
    def unknowns(self) -> int:
        """Number of unknowns."""
        return 3 * int(self.space.ndof)

    @cached_property
    def flexibility(self) -> Any:
        """K, factorised."""
        return self.shifted(0.0)

    def applied(self, matrix: Any, vectors: Real) -> Real:
        """Return a matrix, or a factorised one's inverse, times vectors; shape (k, unknowns) in and out."""
        result = np.empty_like(vectors)

        def some(rows: slice) -> None:
            given, found = self.mass.CreateColVector(), self.mass.CreateColVector()
            for row, out in zip(vectors[rows], result[rows], strict=True):
                given.FV().NumPy()[:] = row
                found.data = matrix * given
                out[:] = found.FV().NumPy()

        # one thread a share of the vectors: NGSolve's own threads would sum in another order each time
        workers = max(1, min(os.cpu_count() or 1, len(vectors)))
        ends = np.linspace(0, len(vectors), workers + 1).astype(int).tolist()
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(some, map(slice, ends[:-1], ends[1:])))
        return result

    def massed(self, vectors: Real) -> Real:
        """Return M times vectors; shape (k, unknowns) in and out."""
        columns = vectors.reshape(len(vectors), vectors.shape[1] // 3, 3).transpose(1, 0, 2)
        found = (self.scalar_mass @ columns.reshape(len(columns), 3 * len(vectors))).reshape(columns.shape)
        return np.ascontiguousarray(found.transpose(1, 0, 2)).reshape(vectors.shape)

    def shifted(self, shift: float) -> Any:
        """Return the factorised K - shift M."""
        import ngsolve

        matrix = self.stiffness.CreateMatrix()
        matrix.AsVector().data = self.stiffness.AsVector() - shift * self.mass.AsVector()
        with ngsolve.TaskManager():
            return matrix.Inverse(self.space.FreeDofs(), inverse="sparsecholesky")


def structure_of(
    grid: SolidGrid,
    modulus_pa: float,
    poisson: float,
    density_kg_m3: float,
    springs_n_per_m: Mapping[str, tuple[float, float, float]] | None = None,
    loaded: tuple[str, ...] = (),
    order: int = ORDER,
) -> Structure:
    """Return the matrices of a solid of one isotropic material.

    Parameters
    ----------
    grid : SolidGrid
    modulus_pa, poisson, density_kg_m3 : float
    springs_n_per_m : mapping, optional
        Of parts or faces, to ground along x, y, z, spread evenly over the part's volume or the faces' area; very stiff
        ones hold a face.
    loaded : tuple of str
        Parts that forces act on.
    order : int
        Along the walls; at least 2.

    Raises
    ------
    MissingPackageError
        NGSolve is not installed.
    """
    try:
        import ngsolve
    except ImportError:
        raise missing_ngsolve() from None
    ngsolve.ngsglobals.msg_level = 0
    solid = _ngsolve_grid(grid)
    spaces = (_space(solid, grid, order, 3), _space(solid, grid, order, 1))
    return assembled(solid, spaces, modulus_pa, poisson, density_kg_m3, springs_n_per_m or {}, loaded)


def assembled(
    solid: Any,
    spaces: tuple[Any, Any],
    modulus_pa: float,
    poisson: float,
    density_kg_m3: float,
    springs_n_per_m: Mapping[str, tuple[float, float, float]],
    loaded: tuple[str, ...] = (),
) -> Structure:
    """Return the matrices of a solid on a grid of NGSolve; parameters as of `structure_of`, where they are the same.

    Parameters
    ----------
    solid : ngsolve.Mesh
        Its materials and boundaries are the parts and faces.
    spaces : (ngsolve.H1, ngsolve.H1)
        Of the displacements, three directions, and of one direction of them, with the same orders.
    modulus_pa, poisson, density_kg_m3 : float
    springs_n_per_m : mapping
    loaded : tuple of str
    """
    import ngsolve

    space, scalar = spaces
    parts = frozenset(solid.GetMaterials())
    u, v = space.TnT()
    lame_2 = 0.5 * modulus_pa / (1.0 + poisson)
    lame_1 = 2.0 * lame_2 * poisson / (1.0 - 2.0 * poisson)
    strain_u, strain_v = ngsolve.Sym(ngsolve.Grad(u)), ngsolve.Sym(ngsolve.Grad(v))
    stiffness, mass = ngsolve.BilinearForm(space, symmetric=True), ngsolve.BilinearForm(space, symmetric=True)
    energy = 2.0 * lame_2 * ngsolve.InnerProduct(strain_u, strain_v)
    stiffness += (energy + lame_1 * ngsolve.Trace(strain_u) * ngsolve.Trace(strain_v)) * ngsolve.dx
    mass += density_kg_m3 * u * v * ngsolve.dx
    for name, springs in springs_n_per_m.items():
        region = (solid.Materials if name in parts else solid.Boundaries)(name)
        size = ngsolve.Integrate(1.0, solid, definedon=region)
        measure = (ngsolve.dx if name in parts else ngsolve.ds)(definedon=region)
        for axis, spring in enumerate(springs):
            stiffness += spring / size * u[axis] * v[axis] * measure
    loads = []
    with ngsolve.TaskManager():
        stiffness.Assemble()
        mass.Assemble()
        for part in loaded:
            volume = ngsolve.Integrate(1.0, solid, definedon=solid.Materials(part))
            for axis in range(3):
                load = ngsolve.LinearForm(space)
                load += v[axis] / volume * ngsolve.dx(part)
                load.Assemble()
                loads.append(load.vec.FV().NumPy().copy())
    return Structure(
        solid,
        space,
        stiffness.mat,
        mass.mat,
        _scalar_mass(scalar, density_kg_m3),
        np.array(loads).reshape(3 * len(loaded), 3 * space.ndof),
        float(density_kg_m3 * ngsolve.Integrate(1.0, solid)),
    )


def _ngsolve_grid(grid: SolidGrid) -> Any:
    import netgen.meshing as netgen
    import ngsolve

    made = netgen.Mesh(3)
    points = [made.Add(netgen.MeshPoint(netgen.Pnt(*map(float, point)))) for point in grid.points_m]
    for number in range(len(grid.face_names)):
        made.Add(netgen.FaceDescriptor(surfnr=number + 1, domin=1, domout=0, bc=number + 1))
    for part, corners in zip(grid.parts, grid.cells, strict=True):
        made.Add(netgen.Element3D(int(part) + 1, [points[corner] for corner in corners if corner >= 0]))
    for part, corners in zip(grid.face_parts, grid.faces, strict=True):
        made.Add(netgen.Element2D(int(part) + 1, [points[corner] for corner in corners if corner >= 0]))
    for number, name in enumerate(grid.part_names):
        made.SetMaterial(number + 1, name)
    for number, name in enumerate(grid.face_names):
        made.SetBCName(number, name)
    return ngsolve.Mesh(made)


def _scalar_mass(space: Any, density_kg_m3: float) -> Any:
    """Return the mass of one direction."""
    import ngsolve
    from scipy.sparse import csr_matrix

    u, v = space.TnT()
    mass = ngsolve.BilinearForm(space)
    mass += density_kg_m3 * u * v * ngsolve.dx
    with ngsolve.TaskManager():
        mass.Assemble()
    rows, columns, values = (np.asarray(part) for part in mass.mat.COO())
    return csr_matrix((values, (rows, columns)), shape=(space.ndof, space.ndof))


def _space(solid: Any, grid: SolidGrid, order: int, directions: int) -> Any:
    """Return the displacements: of the order along the walls, of a lower one through them and across narrow bands."""
    import ngsolve

    space = ngsolve.H1(solid, order=order, dim=directions)
    across = {frozenset(pair) for pair in grid.across.tolist()}
    lower: dict[Any, int] = {}
    for cell, joint in zip(solid.Elements(ngsolve.VOL), grid.joints, strict=True):
        across_it = THROUGH_JOINTS if joint else THROUGH
        short = {edge for edge in cell.edges if frozenset(corner.nr for corner in solid[edge].vertices) in across}
        for edge in short:
            lower[edge] = max(across_it, lower.get(edge, 0))
        for face in cell.faces:
            edges = set(solid[face].edges)
            if edges & short:
                wanted = across_it if edges <= short else THROUGH
                lower[face] = max(wanted, lower.get(face, 0))
        space.SetOrder(ngsolve.NodeId(ngsolve.CELL, cell.nr), 1)
    for node, wanted in lower.items():
        space.SetOrder(node, wanted)
    space.UpdateDofTables()
    return space
