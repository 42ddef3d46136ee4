"""Compiled: integrals of the free field over panels, and the matrices made of them.

With e^{+jωt} and R the distance from y on a panel to the point x, G = e^{-jkR} / (4πR). For a point with a direction
n_x and a coupling b (in m), a panel with normal n_y gives two numbers:

    the weight of its pressure  A = -∫ ∂G/∂n_y + jb ∂²G/∂n_x∂n_y,   the weight of -∂p/∂n  B = ∫ G - jb ∂G/∂n_x

Burton and Miller's equation is then (½ + A) p = -(B - jb/2) ∂p/∂n; the representation of the field outside is b = 0.

Panels are stored in blocks of `BLOCK`, one row of a block for each of the numbers named by `_X` ... `_NEAR`: all
offsets in the inner loop are then constants, and the compiler makes vector instructions of it.

This module imports numba; others import it where they use it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, prange

__all__ = ["BLOCK", "ROWS", "assemble", "nearest_and_angle"]

BLOCK = 64
"""Panels of a block."""

ROWS = 8
"""Numbers of a panel: its centre, normal, area, and the square of the distance up to which it is integrated finely."""

_X, _Y, _Z, _NX, _NY, _NZ, _AREA, _NEAR = (row * BLOCK for row in range(ROWS))
_TURN = 1.0 / (2.0 * math.pi)
_QUARTER_PI = 1.0 / (4.0 * math.pi)

_GAUSS = np.polynomial.legendre.leggauss(3)
_NODES, _WEIGHTS = 0.5 + 0.5 * _GAUSS[0], 0.5 * _GAUSS[1]
_ARC = np.polynomial.legendre.leggauss(12)
_ARC_NODES, _ARC_WEIGHTS = 0.5 + 0.5 * _ARC[0], 0.5 * _ARC[1]

_SPLIT = 0.7
"""A piece of a panel is integrated by 3 x 3 points if its diameter is below this part of its distance, else split: the
error of 1/R³ over a square is then below 1e-3 (Gauss' remainder)."""

_DEEPEST = 24
"""Splits after which a piece is integrated as it is: the point is on the panel."""


def _compiled(**options: Any) -> Any:
    """Compile on first use, and keep the result where a place for it can be written."""

    def decorate(function: Any) -> Any:
        try:
            return njit(cache=True, error_model="numpy", **options)(function)
        except RuntimeError:  # numba found no such place
            return njit(error_model="numpy", **options)(function)

    return decorate


_FAST = {"contract", "reassoc", "arcp", "nsz"}


@_compiled(fastmath=_FAST)
def _far(panels, base, x, n, k, b, out):  # type: ignore[no-untyped-def]
    """Write A (real, imaginary), B (real, imaginary) and R² of a block's panels by one point each.

    With the pressure known at the centres, one point is the midpoint rule for pressure and G together. That halves the
    error of the levels at 7.5 panels a wavelength against G integrated exactly over panels of constant pressure, whose
    means over waves along the surface are too small by (k side)² / 24 (measured on the reference housing).
    """
    x0, x1, x2, n0, n1, n2 = x[0], x[1], x[2], n[0], n[1], n[2]
    turns = k * _TURN
    for j in range(BLOCK):
        r0 = x0 - panels[base + _X + j]
        r1 = x1 - panels[base + _Y + j]
        r2 = x2 - panels[base + _Z + j]
        square = r0 * r0 + r1 * r1 + r2 * r2 + 1e-30
        inverse = 1.0 / math.sqrt(square)
        y0, y1, y2 = panels[base + _NX + j], panels[base + _NY + j], panels[base + _NZ + j]
        cx = (r0 * n0 + r1 * n1 + r2 * n2) * inverse
        cy = (r0 * y0 + r1 * y1 + r2 * y2) * inverse
        nn = n0 * y0 + n1 * y1 + n2 * y2
        # the half of the phase, in -π/2 to π/2, by Taylor's series: 6e-12 at the ends
        part = square * inverse * turns
        part = (part - math.floor(part + 0.5)) * math.pi
        t = part * part
        s = part * (1.0 + t * (-1.0 / 6 + t * (1.0 / 120 + t * (-1.0 / 5040 + t * (1.0 / 362880 + t * (
            -1.0 / 39916800 + t * (1.0 / 6227020800.0 + t * (-1.0 / 1307674368000.0))))))))  # fmt: skip
        c = 1.0 + t * (-1.0 / 2 + t * (1.0 / 24 + t * (-1.0 / 720 + t * (1.0 / 40320 + t * (-1.0 / 3628800 + t * (
            1.0 / 479001600 + t * (-1.0 / 87178291200.0 + t * (1.0 / 20922789888000.0))))))))  # fmt: skip
        weight = panels[base + _AREA + j] * inverse * _QUARTER_PI
        g_re = weight * (1.0 - 2.0 * s * s)
        g_im = -2.0 * weight * s * c
        h_re = (k * k - 3.0 * inverse * inverse) * cx * cy + nn * inverse * inverse
        h_im = (nn - 3.0 * cx * cy) * k * inverse
        a_re = -cy * inverse - b * h_im
        a_im = b * h_re - k * cy
        b_re = 1.0 - b * k * cx
        b_im = b * cx * inverse
        out[j] = g_re * a_re - g_im * a_im
        out[BLOCK + j] = g_re * a_im + g_im * a_re
        out[2 * BLOCK + j] = g_re * b_re - g_im * b_im
        out[3 * BLOCK + j] = g_re * b_im + g_im * b_re
        out[4 * BLOCK + j] = square


@_compiled(fastmath=_FAST)
def _near(corners, normal, x, n, k, b, stack):  # type: ignore[no-untyped-def]
    """Return A and B of one panel, split towards the point until its pieces are small against their distance."""
    nn = n[0] * normal[0] + n[1] * normal[1] + n[2] * normal[2]
    total_a, total_b = 0.0j, 0.0j
    stack[0, 0], stack[0, 1], stack[0, 2] = 0.0, 0.0, 1.0
    filled = 1
    while filled > 0:
        filled -= 1
        low_u, low_v, side = stack[filled, 0], stack[filled, 1], stack[filled, 2]
        distance, along, across = 0.0, 0.0, 0.0
        u, v = low_u + 0.5 * side, low_v + 0.5 * side
        for i in range(3):
            du = (corners[1, i] - corners[0, i]) * (1.0 - v) + (corners[2, i] - corners[3, i]) * v
            dv = (corners[3, i] - corners[0, i]) * (1.0 - u) + (corners[2, i] - corners[1, i]) * u
            middle = (corners[0, i] * (1.0 - u) + corners[1, i] * u) * (1.0 - v) + (
                corners[3, i] * (1.0 - u) + corners[2, i] * u
            ) * v
            distance += (x[i] - middle) ** 2
            along += du * du
            across += dv * dv
        size = (along + across) * side * side
        if size > _SPLIT * _SPLIT * distance and side > 2.0**-_DEEPEST:
            half = 0.5 * side
            for piece in range(4):
                stack[filled, 0] = low_u + half * (piece % 2)
                stack[filled, 1] = low_v + half * (piece // 2)
                stack[filled, 2] = half
                filled += 1
            continue
        for p in range(3):
            u = low_u + side * _NODES[p]
            for q in range(3):
                v = low_v + side * _NODES[q]
                r0, r1, r2, square = 0.0, 0.0, 0.0, 0.0
                d0, d1, d2, e0, e1, e2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for i in range(3):
                    r = x[i] - (
                        (corners[0, i] * (1.0 - u) + corners[1, i] * u) * (1.0 - v)
                        + (corners[3, i] * (1.0 - u) + corners[2, i] * u) * v
                    )
                    du = (corners[1, i] - corners[0, i]) * (1.0 - v) + (corners[2, i] - corners[3, i]) * v
                    dv = (corners[3, i] - corners[0, i]) * (1.0 - u) + (corners[2, i] - corners[1, i]) * u
                    square += r * r
                    if i == 0:
                        r0, d0, e0 = r, du, dv
                    elif i == 1:
                        r1, d1, e1 = r, du, dv
                    else:
                        r2, d2, e2 = r, du, dv
                area = (
                    (d1 * e2 - d2 * e1) * normal[0] + (d2 * e0 - d0 * e2) * normal[1] + (d0 * e1 - d1 * e0) * normal[2]
                )
                distance = math.sqrt(square)
                inverse = 1.0 / distance
                cx = (r0 * n[0] + r1 * n[1] + r2 * n[2]) * inverse
                cy = (r0 * normal[0] + r1 * normal[1] + r2 * normal[2]) * inverse
                weight = area * side * side * _WEIGHTS[p] * _WEIGHTS[q] * inverse * _QUARTER_PI
                g = complex(weight * math.cos(k * distance), -weight * math.sin(k * distance))
                slope = complex(inverse, k)
                second = complex(k * k - 3.0 * inverse * inverse, -3.0 * k * inverse) * (cx * cy)
                total_a += g * (-slope * cy + complex(0.0, b) * (second + slope * (inverse * nn)))
                total_b += g * (1.0 + complex(0.0, b) * slope * cx)
    return total_a, total_b


@_compiled()
def _self(corners, centre, normal, k, b):  # type: ignore[no-untyped-def]
    """Return A and B of a flat panel at its own centre, both as integrals over the angle around it.

    ∫G = ∮ (1 - e^{-jkR(θ)}) dθ / (4πjk), and the finite part of ∫∂²G/∂n² = -∮ G(R(θ)) dθ - jk/2: on the panel's plane
    the second derivative is -G'(R)/R, and R dR dθ integrates it to the panel's edge.
    """
    single, around = 0.0j, 0.0j
    for edge in range(4):
        square = 0.0
        for i in range(3):
            square += (corners[(edge + 1) % 4, i] - corners[edge, i]) ** 2
        if square == 0.0:
            continue
        length = math.sqrt(square)
        start, end, height = 0.0, 0.0, 0.0
        for i in range(3):
            unit = (corners[(edge + 1) % 4, i] - corners[edge, i]) / length
            one, two = (i + 1) % 3, (i + 2) % 3
            unit_one = (corners[(edge + 1) % 4, one] - corners[edge, one]) / length
            unit_two = (corners[(edge + 1) % 4, two] - corners[edge, two]) / length
            start += (corners[edge, i] - centre[i]) * unit
            end += (corners[(edge + 1) % 4, i] - centre[i]) * unit
            # the edge's distance: (arm x edge) along the normal
            height += (
                (corners[edge, one] - centre[one]) * unit_two - (corners[edge, two] - centre[two]) * unit_one
            ) * normal[i]
        first, last = math.atan2(start, height), math.atan2(end, height)
        for p in range(_ARC_NODES.size):
            distance = height / math.cos(first + (last - first) * _ARC_NODES[p])
            weight = (last - first) * _ARC_WEIGHTS[p] * _QUARTER_PI
            wave = complex(math.cos(k * distance), -math.sin(k * distance))
            single += weight * (1.0 - wave) / complex(0.0, k)
            around += weight * wave / distance
    return complex(0.0, b) * (-around - complex(0.0, 0.5 * k)), single


@_compiled(parallel=True)
def assemble(  # type: ignore[no-untyped-def]
    panels, corners, normals, points, directions, group, parities, k, b, on_panels, pressure, velocity
):
    """Write A and B of all points and panels, for each parity of the field.

    Parameters
    ----------
    panels : (blocks * ROWS * BLOCK,)
        The given part's panels, filled up with such of no area.
    corners, normals : (n, 4, 3), (n, 3)
    points, directions : (images, m, 3)
        Of m points each image, instead of the panels': reflections and, of rigid ground, their images.
    group : (images,) of int
        Which reflection the image belongs to.
    parities : (parities, reflections)
    on_panels : bool
        Point i is the centre of panel i.
    pressure, velocity : (parities, m, n, 2) float
        Written: A and B, real and imaginary.
    """
    n, m, count = normals.shape[0], points.shape[1], parities.shape[0]
    for i in prange(m):
        out = np.empty(5 * BLOCK)
        sums = np.empty((count, 4 * BLOCK))
        stack = np.empty((4 * _DEEPEST + 8, 3))
        row = np.empty(4 * BLOCK)
        for block in range((n + BLOCK - 1) // BLOCK):
            first = block * BLOCK
            filled = min(BLOCK, n - first)
            base = first * ROWS
            sums[:] = 0.0
            for image in range(points.shape[0]):
                x, d = points[image, i], directions[image, i]
                _far(panels, base, x, d, k, b, out)
                for j in range(filled):
                    if out[4 * BLOCK + j] < panels[base + _NEAR + j]:
                        if on_panels and image == 0 and first + j == i:
                            a, s = _self(corners[i], x, normals[i], k, b)
                        else:
                            a, s = _near(corners[first + j], normals[first + j], x, d, k, b, stack)
                        out[j], out[BLOCK + j] = a.real, a.imag
                        out[2 * BLOCK + j], out[3 * BLOCK + j] = s.real, s.imag
                total = sums[group[image]]
                for j in range(4 * BLOCK):
                    total[j] += out[j]
            for parity in range(count):
                row[:] = 0.0
                for reflection in range(count):
                    sign = parities[parity, reflection]
                    total = sums[reflection]
                    for j in range(4 * BLOCK):
                        row[j] += sign * total[j]
                for j in range(filled):
                    pressure[parity, i, first + j, 0] = row[j]
                    pressure[parity, i, first + j, 1] = row[BLOCK + j]
                    velocity[parity, i, first + j, 0] = row[2 * BLOCK + j]
                    velocity[parity, i, first + j, 1] = row[3 * BLOCK + j]


@_compiled(parallel=True)
def nearest_and_angle(triangles, centres, diameters, points, nearest, angle):  # type: ignore[no-untyped-def]
    """Write how near points come to a surface, and the solid angle it fills for them: 4π inside, 0 outside.

    Parameters
    ----------
    triangles, centres, diameters : (n, 2, 3, 3), (n, 3), (n,)
        Of the panels.
    points : (m, 3)
    nearest, angle : (m,)
        Written: the least distance to a panel's centre, in diameters of that panel; and the angle in steradians.
    """
    for i in prange(points.shape[0]):
        best, total = np.inf, 0.0
        for j in range(triangles.shape[0]):
            arm = centres[j] - points[i]
            best = min(best, math.sqrt(arm @ arm) / diameters[j])
            for part in range(2):
                a, b, c = (
                    triangles[j, part, 0] - points[i],
                    triangles[j, part, 1] - points[i],
                    triangles[j, part, 2] - points[i],
                )
                la, lb, lc = math.sqrt(a @ a), math.sqrt(b @ b), math.sqrt(c @ c)
                volume = a @ np.cross(b, c)
                if abs(volume) > 1e-9 * la * lb * lc:  # else the point is on the triangle's plane, which fills no angle
                    # van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983) 125
                    total += 2.0 * math.atan2(volume, la * lb * lc + (a @ b) * lc + (a @ c) * lb + (b @ c) * la)
        nearest[i], angle[i] = best, total
