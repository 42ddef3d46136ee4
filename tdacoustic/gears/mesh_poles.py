"""Gears and housing in time: the line of action as a sum of decaying oscillations, with the mesh bonded.

With a foundation the equations in time hold the seven coordinates of `ReducedSystem` and one of each mode of the
structure. Teeth that are bonded at the mean stiffness k̄ and the damper c_m make them a linear system; what a real mesh
does differently, f = F - k̄ δ - c_m δ', is a scalar force on it. In the system's own vibrations that is

    z_j' = λ_j z_j + b_j f + t_j T1,     δ = Re Σ c_j z_j,     δ' = Re Σ c_j λ_j z_j.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from tdacoustic.gears.system import GearSystem

__all__ = ["MeshPoles"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

LEAST_PART: Final = 1e-4
"""Part of the mesh in a mode's potential energy below which multipliers take the mode as one that rings down by itself:
the mesh neither drives it nor feels it. For the paper's drive in the reference housing 32 of 130 modes stay; the poles
of these are off by 0.4 % at most, half of them by 0.003 %."""


@dataclass(frozen=True, eq=False)
class MeshPoles:
    """Vibrations of gears and structure with bonded teeth, as the mesh drives and feels them.

    Parameters
    ----------
    poles : ndarray of complex, shape (n,)
        λ of one of each conjugate pair and of each vibration without an oscillation, in 1/s.
    driven : ndarray of complex, shape (n,)
        b, in m/(N s) once times c.
    felt : ndarray of complex, shape (n,)
        c; twice where the pole stands for a pair.
    turned : ndarray of complex, shape (n,)
        t, by a torque on the pinion that the wheel's balances.
    is_pair : ndarray of bool, shape (n,)
    others : ndarray of complex
        Poles of what is left out, in pairs by approximation: they only decay.
    """

    poles: Complex
    driven: Complex
    felt: Complex
    turned: Complex
    is_pair: NDArray[np.bool_]
    others: Complex

    @classmethod
    def of(cls, system: GearSystem, least_part: float) -> MeshPoles:
        """Return the poles of gears on a foundation, whose damping is taken as viscous.

        Parameters
        ----------
        system : GearSystem
            With a foundation.
        least_part : float
            See `LEAST_PART`; 0 keeps all modes.
        """
        squared, damping, mesh, turning = _bonded_modes(system)
        part = system.mesh_stiffness_n_per_m * mesh**2 / squared
        kept = part >= least_part
        number = int(np.count_nonzero(kept))
        of_first_order = np.zeros((2 * number, 2 * number))
        of_first_order[:number, number:] = np.eye(number)
        of_first_order[number:, :number] = -np.diag(squared[kept])
        of_first_order[number:, number:] = -damping[np.ix_(kept, kept)]
        poles, right = np.linalg.eig(of_first_order)
        poles, right = poles.astype(np.complex128), right.astype(np.complex128)
        forces = np.zeros((2 * number, 2))
        forces[number:, 0], forces[number:, 1] = -mesh[kept], turning[kept] / system.base_radii_m[0]
        into = np.linalg.solve(right, forces.astype(np.complex128))
        held = poles.imag >= 0.0
        is_pair = poles[held].imag > 0.0
        felt = (mesh[kept] @ right[:number])[held] * np.where(is_pair, 2.0, 1.0)
        left = ~kept
        decay = -0.5 * np.diag(damping)[left]
        others = decay + 1j * np.sqrt(np.maximum(squared[left] - decay**2, 0.0))
        return cls(poles[held], into[held, 0], felt, into[held, 1], is_pair, np.concatenate([others, others.conj()]))

    @property
    def fastest_hz(self) -> float:
        """Largest of the poles over 2π."""
        return float(np.abs(self.poles).max() / (2.0 * np.pi))

    @property
    def size(self) -> int:
        """Number of real numbers in a state: 2 n."""
        return 2 * self.poles.size

    def at_rest(self, force_n: float, torque_n_m: float) -> Complex:
        """Return z under a constant f and a torque."""
        return np.asarray(-(self.driven * force_n + self.turned * torque_n_m) / self.poles)

    def response(self, forces: Complex, frequency_hz: Real) -> Complex:
        """Return z at the time 0 of a motion under f(t) = Σ Re(f_n exp(i 2π f_n t)).

        Parameters
        ----------
        forces : ndarray of complex, shape (lines,)
        frequency_hz : ndarray, shape (lines,)
            Above zero.
        """
        turn = 2j * np.pi * frequency_hz[:, None]
        ahead = forces[:, None] / (turn - self.poles)
        behind = forces.conj()[:, None] / (-turn - self.poles)
        return np.asarray(0.5 * self.driven * (ahead + behind).sum(axis=0))

    def monodromy(self, stiffness: Real, damping: Real, step_s: float) -> Real:
        """Return what one period does to the vibrations as real numbers: real parts, then imaginary parts of pairs.

        Each step is half a step of the bonded system, the impulse of the mesh's difference, and half a step again
        (Strang's splitting, of second order in the difference alone).

        Parameters
        ----------
        stiffness, damping : ndarray, shape (steps,)
            Of the mesh beyond k̄ and c_m: minus those while teeth are apart.
        step_s : float
        """
        by_speed = self.felt * self.poles
        rate_k, rate_c = float((self.felt @ self.driven).real), float((by_speed @ self.driven).real)
        growth = step_s * (stiffness * rate_k + damping * rate_c)
        size = step_s * np.where(np.abs(growth) > 1e-12, np.expm1(growth) / np.where(growth == 0.0, 1.0, growth), 1.0)
        felt = stiffness[:, None] * self.felt + damping[:, None] * by_speed
        driven, felt_real, felt_imaginary = self.driven[:, None], size[:, None] * felt.real, size[:, None] * felt.imag
        turned = np.exp(self.poles * step_s)[:, None]
        whole = np.hstack([np.eye(self.poles.size), 1j * np.eye(self.poles.size)[:, self.is_pair]])
        whole *= np.exp(0.5 * step_s * self.poles)[:, None]
        for real, imaginary in zip(felt_real, felt_imaginary, strict=True):
            whole += driven * (real @ whole.real - imaginary @ whole.imag)
            whole *= turned
        whole *= np.exp(-0.5 * step_s * self.poles)[:, None]
        return np.vstack([whole.real, whole.imag[self.is_pair]])

    def multipliers(self, stiffness: Real, damping: Real, step_s: float) -> Complex:
        """Return the multipliers of a motion, those of what is left out too; parameters as of `monodromy`."""
        own = np.linalg.eigvals(self.monodromy(stiffness, damping, step_s))
        return np.concatenate([own, np.exp(self.others * (step_s * stiffness.size))])


def _bonded_modes(system: GearSystem) -> tuple[Real, Real, Real, Real]:
    """Modes of gears and structure with bonded teeth: ω², damping, δ and the pinion's turn p of each."""
    foundation, reduced = system.foundation, system.reduced
    assert foundation is not None
    count = 7 + foundation.frequency_hz.size
    stretch = np.zeros((6, count))
    stretch[:, :6], stretch[:, 7:] = np.eye(6), -foundation.shapes.T
    direction, inertia = np.zeros(count), np.ones(count)
    direction[:7], inertia[:7] = reduced.direction, reduced.masses
    own, losses = np.zeros(count), np.zeros(count)
    own[7:] = foundation.natural_rad_s
    losses[7:] = foundation.loss_factors * foundation.natural_rad_s
    stiffness = (stretch.T * reduced.stiffness[:6]) @ stretch + np.diag(own**2)
    stiffness += system.mesh_stiffness_n_per_m * np.outer(direction, direction)
    damping = (stretch.T * reduced.damping[:6]) @ stretch + np.diag(losses)
    damping += system.mesh_damping_n_s_per_m * np.outer(direction, direction)
    root = 1.0 / np.sqrt(inertia)
    squared, vectors = np.linalg.eigh(root[:, None] * stiffness * root)
    shapes = root[:, None] * vectors
    return squared, shapes.T @ damping @ shapes, direction @ shapes, shapes[6]
