"""The same fields by ngsolve.bem: Galerkin's method, polynomials of higher order on large triangles.

With e^{-iωt}, and n the normal, W of two functions u, v is ∫∫ G (n × ∇u · n' × ∇v - k² n·n' u v)::

    (½ - K + βW) p = -(V + β(½ + K')) ∂p/∂n,  β = i/k

K' is K transposed. Quadrature as it comes, no multipoles; the pressures are conjugated at the end.
"""

from __future__ import annotations

from typing import Any

import ngsolve as ngs
import numpy as np
from netgen.meshing import MeshingStep
from netgen.occ import Box, OCCGeometry, Y
from ngsolve.bem import HelmholtzDL, HelmholtzSL
from numpy.typing import NDArray
from radiation_cases import BOX_M, IMPEDANCE_PA_S_M, plate
from scipy.linalg import lu_factor, lu_solve

NAME = "ngsolve.bem"

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def box_grid(size_m: float) -> Any:
    """Return the box in triangles no longer than `size_m`, the moving panel named."""
    box = Box(tuple(-0.5 * edge for edge in BOX_M), tuple(0.5 * edge for edge in BOX_M))
    box.faces.name = "rest"
    box.faces.Max(Y).name = "moving"
    return ngs.Mesh(OCCGeometry(box).GenerateMesh(maxh=size_m, perfstepsend=MeshingStep.MESHSURFACE))


class Body:
    """A grid at one wave number with its factored system."""

    def __init__(self, grid: Any, order: int, wave_number_rad_m: float) -> None:
        self.k, self.beta = wave_number_rad_m, 1j / wave_number_rad_m
        self.space, self.normal = ngs.H1(grid, order=order, complex=True), ngs.specialcf.normal(3)
        self.elements, self.unknowns = grid.GetNE(ngs.BND), self.space.ndof
        u, v = self.space.TnT()
        turned = [ngs.Cross(self.normal, ngs.grad(function).Trace()) for function in (u, v)]
        with ngs.TaskManager():
            self.double = _dense(HelmholtzDL(u * ngs.ds, self.k, use_fmm=False) * v * ngs.ds)
            second = _dense(HelmholtzSL(turned[0] * ngs.ds, self.k, use_fmm=False) * turned[1] * ngs.ds)
            flat = HelmholtzSL(u * self.normal * ngs.ds, self.k, use_fmm=False) * (v * self.normal) * ngs.ds
            second -= self.k**2 * _dense(flat)
        matrix = 0.5 * self._mass(".*") - self.double + self.beta * second
        self.factors = lu_factor(matrix, overwrite_a=True)

    def vibrating(self, half_waves: tuple[int, int], receivers_m: Real) -> Complex:
        """Return the pressures at receivers of half waves of 1 m/s on the moving panel."""
        u, v = self.space.TnT()
        with ngs.TaskManager():
            moving = HelmholtzSL(u * ngs.ds("moving"), self.k, use_fmm=False)
            single = _dense(moving * v * ngs.ds)
        slope = ngs.GridFunction(self.space)
        velocity = plate(ngs.x, ngs.z, half_waves, ngs.sin)
        slope.Set(1j * self.k * IMPEDANCE_PA_S_M * velocity, definedon=slope.space.mesh.Boundaries("moving"))
        values = slope.vec.FV().NumPy()
        right = single @ values + self.beta * (0.5 * self._mass("moving") @ values + self.double.T @ values)
        pressure = lu_solve(self.factors, -right)
        return np.array([np.conj(self._outside(receiver, pressure, values)) for receiver in receivers_m])

    def scattered(self, source_m: tuple[float, float, float], receivers_m: Real) -> Complex:
        """Return the scattered part of the field of a source of 1 Pa at 1 m beside the rigid body."""
        wave, slope = self._wave(source_m)
        incoming = 4.0 * np.pi * (wave + self.beta * slope)
        pressure = lu_solve(self.factors, self._tested(incoming, ".*"))
        silent = np.zeros(self.unknowns)
        return np.array([np.conj(self._outside(receiver, pressure, silent)) for receiver in receivers_m])

    def _outside(self, receiver_m: Any, pressure: Complex, slope: Complex) -> complex:
        wave, along = self._wave(receiver_m)
        sent = self._tested(wave, "moving") @ slope if slope.any() else 0.0
        return complex(self._tested(along, ".*") @ pressure - sent)

    def _wave(self, place_m: Any) -> tuple[Any, Any]:
        """Return e^{ikR} / 4πR from a place, and its slope along the surface's normal."""
        arm = ngs.CF((ngs.x - place_m[0], ngs.y - place_m[1], ngs.z - place_m[2]))
        distance = ngs.Norm(arm)
        wave = ngs.exp(1j * self.k * distance) / (4.0 * np.pi * distance)
        return wave, wave * (ngs.CF(1j * self.k) - 1.0 / distance) / distance * ngs.InnerProduct(arm, self.normal)

    def _tested(self, field: Any, part: str) -> Complex:
        form = ngs.LinearForm(self.space)
        form += field * self.space.TestFunction() * ngs.ds(part, bonus_intorder=4)
        return np.array(form.Assemble().vec.FV().NumPy())

    def _mass(self, part: str) -> Real:
        u, v = self.space.TnT()
        form = ngs.BilinearForm(u.Trace() * v.Trace() * ngs.ds(part))
        return np.asarray(_rows(form.Assemble().mat).real)


def _dense(operator: Any) -> Complex:
    return _rows(operator.mat)


def _rows(matrix: Any) -> Complex:
    """Return the matrix dense; without multipoles it is kept as a sparse one with all its entries."""
    rows, columns, values = (np.asarray(part) for part in matrix.COO())
    found = np.zeros((matrix.height, matrix.width), dtype=np.complex128)
    np.add.at(found, (rows, columns), values)
    return found
