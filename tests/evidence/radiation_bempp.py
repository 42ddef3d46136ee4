"""The same fields by bempp-cl: Galerkin's method, linear pressures on triangles, Burton and Miller's equation.

bempp-cl has e^{-iωt} and e^{ikr}, its hypersingular operator W is minus the second derivative: with β = i/k

    (½ - K + βW) p = -(V + β(½ + K')) ∂p/∂n,   of a rigid body  (½ - K + βW) p = p_in + β ∂p_in/∂n

and the pressures are conjugated at the end. Its own assembler of numba, dense matrices, quadrature as it comes.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import bempp_cl.api as bempp
import numpy as np
from bempp_cl.api.operators.boundary import helmholtz, sparse
from bempp_cl.api.operators.potential import helmholtz as potentials
from numpy.typing import NDArray
from radiation_cases import BOX_M, IMPEDANCE_PA_S_M, RADIUS_M
from scipy.linalg import lu_factor, lu_solve

NAME = "bempp-cl"
MOVING, REST = 1, 0

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def box_grid(size_m: float, graded: float = 0.6) -> Any:
    """Return the box in triangles of about `size_m`, smaller at its edges, the moving panel named."""
    ticks = [_ticks(edge, size_m, graded) for edge in BOX_M]
    names: dict[tuple[float, ...], int] = {}
    triangles, domains = [], []
    for axis, side in itertools.product(range(3), (1, -1)):
        u, v = ticks[(axis + 1) % 3], ticks[(axis + 2) % 3]
        for i, j in itertools.product(range(len(u) - 1), range(len(v) - 1)):
            cell = []
            for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                point = np.roll([0.5 * side * BOX_M[axis], u[a], v[b]], axis)
                cell.append(names.setdefault(tuple(np.round(point, 9)), len(names)))
            cell = cell[::side]
            if (i + j) % 2:
                cell = cell[1:] + cell[:1]
            triangles += [[cell[0], cell[1], cell[2]], [cell[0], cell[2], cell[3]]]
            domains += 2 * [MOVING if (axis, side) == (1, 1) else REST]
    return bempp.Grid(np.array(list(names)).T.copy(), np.array(triangles).T.copy(), domains)


def _ticks(edge_m: float, size_m: float, graded: float) -> Real:
    place = np.linspace(-1.0, 1.0, 2 * round(0.5 * edge_m / size_m) + 1)
    return np.asarray(0.5 * edge_m * ((1.0 - graded) * place + graded * np.sin(0.5 * np.pi * place)))


def sphere_grid(level: int) -> Any:
    """Return bempp's sphere of 8 · 4^level triangles, of the sphere's volume, all of it moving."""
    grid = bempp.shapes.regular_sphere(level)
    corners = grid.vertices[:, grid.elements]
    volume = np.einsum("it,it->", corners[:, 0], np.cross(corners[:, 1].T, corners[:, 2].T).T) / 6.0
    scale = RADIUS_M * (4.0 / 3.0 * np.pi / volume) ** (1.0 / 3.0)
    return bempp.Grid(scale * grid.vertices, grid.elements, len(grid.elements.T) * [MOVING])


class Body:
    """A grid at one wave number with its factored system."""

    def __init__(self, grid: Any, wave_number_rad_m: float) -> None:
        self.k, self.grid, self.elements = wave_number_rad_m, grid, grid.number_of_elements
        self.linear = bempp.function_space(grid, "P", 1)
        self.beta, self.unknowns = 1j / wave_number_rad_m, self.linear.global_dof_count
        spaces = (self.linear, self.linear, self.linear)
        matrix = 0.5 * sparse.identity(*spaces).weak_form().to_sparse().toarray()
        matrix = matrix - helmholtz.double_layer(*spaces, self.k).weak_form().to_dense()
        matrix += self.beta * helmholtz.hypersingular(*spaces, self.k).weak_form().to_dense()
        self.factors = lu_factor(matrix, overwrite_a=True)

    def vibrating(self, velocity: Callable[[Real], Real], receivers_m: Real) -> Complex:
        """Return the pressures at receivers of a velocity (m/s) of the moving part, a function of places (n, 3)."""
        moving = bempp.function_space(self.grid, "DP", 1, segments=[MOVING])
        slope = self._function(moving, lambda x, n: 1j * self.k * IMPEDANCE_PA_S_M * velocity(x))
        spaces, values = (moving, self.linear, self.linear), slope.coefficients
        right = 0.5 * (sparse.identity(*spaces).weak_form().to_sparse() @ values)
        right = right + helmholtz.adjoint_double_layer(*spaces, self.k).weak_form().to_dense() @ values
        right = self.beta * right + helmholtz.single_layer(*spaces, self.k).weak_form().to_dense() @ values
        outside = potentials.single_layer(moving, receivers_m.T.copy(), self.k) * slope
        return np.asarray(np.conj(self._double_layer(-right, receivers_m) - outside[0]))

    def scattered(self, source_m: tuple[float, float, float], receivers_m: Real) -> Complex:
        """Return the scattered part of the field of a source of 1 Pa at 1 m beside the rigid body."""

        def incoming(x: Real, n: Real) -> Complex:
            arm = x - np.asarray(source_m)
            distance = np.linalg.norm(arm, axis=1)
            wave = np.exp(1j * self.k * distance) / distance
            along = np.einsum("ni,ni->n", arm, n) / distance
            return np.asarray(wave * (1.0 + self.beta * (1j * self.k - 1.0 / distance) * along))

        right = self._function(self.linear, incoming).projections(self.linear)
        return np.asarray(np.conj(self._double_layer(right, receivers_m)))

    def _double_layer(self, right: Complex, receivers_m: Real) -> Complex:
        pressure = bempp.GridFunction(self.linear, coefficients=lu_solve(self.factors, right))
        return np.asarray((potentials.double_layer(self.linear, receivers_m.T.copy(), self.k) * pressure)[0])

    def _function(self, space: Any, value: Callable[[Real, Real], Complex]) -> Any:
        """Return a function on the grid, by projection."""

        @bempp.callable(complex=True, vectorized=True)
        def wanted(x: Real, n: Real, domain: Any, result: Complex) -> None:
            result[0] = value(x.T, n.T)

        return bempp.GridFunction(space, fun=wanted, dual_space=space)
