"""The periodic steady state as a scalar harmonic balance in δ.

Everything but the mesh force is linear, a housing that gives way included, so δ_k + H(kω) F_k[δ] = 0 for k ≠ 0 and
F_0 = T1/(r1 cos β_b) (physics.md section 2). While the teeth stay in contact F is linear in δ and one real system of
2N + 1 unknowns is the answer. With separation F_k comes from samples over one period (alternating frequency-time) and
Newton's method starts from the solution of teeth that cannot separate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tdacoustic.gears.system import GearSystem

__all__ = ["HarmonicSolution", "balance", "periodic_solution"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

FEWEST_HARMONICS: Final = 16
MOST_HARMONICS: Final = 768
TAIL: Final = 5e-5
"""Largest error of δ by the harmonics left out, over its peak to peak, as estimated, before more are taken."""

REACH: Final = 4
"""Harmonics up to REACH · N follow from the force of the first N."""

RESIDUAL: Final = 1e-10
"""Largest residual of a solution over the static compression and the transmission error."""

_NEWTON_STEPS: Final = 40
_HALVINGS: Final = 10
_SAMPLES_PER_HARMONIC: Final = 32
"""Of the mesh force where teeth separate: with 8 it is so coarse when they meet that δ is off by up to 4e-4 of its peak
to peak."""


@dataclass(frozen=True)
class HarmonicSolution:
    """Harmonics 0 to 4N of a periodic solution: x(t) = x_0 + 2 Re Σ x_k exp(ikωt).

    The balance is solved for harmonics 0 to N; N + 1 to 4N (`REACH`) are what the force of those makes of them.

    Parameters
    ----------
    mesh_hz : float
    displacement_m, force_n : ndarray of complex, shape (4N + 1,)
        Of δ and of the mesh force F.
    contact_part : float
        Part of the period in which teeth touch.
    residual : float
        Of the balance, over its scale.
    tail : float
        Estimated error of δ by the harmonics that the balance leaves out, over its peak to peak.
    """

    mesh_hz: float
    displacement_m: Complex
    force_n: Complex
    contact_part: float
    residual: float
    tail: float

    @property
    def n_harmonics(self) -> int:
        """N, to which the balance is solved."""
        return self.displacement_m.size // REACH

    @property
    def separates(self) -> bool:
        """Whether teeth leave each other."""
        return self.contact_part < 1.0

    def displacement_at(self, samples: int) -> Real:
        """Return δ at `samples` equally spaced times of one period, from 0; at least 8 N + 2 of them."""
        return np.asarray(np.fft.irfft(self.displacement_m, samples, norm="forward"))

    @property
    def dte_pp_m(self) -> float:
        """Peak to peak of δ, from the series at 32 and more points of each harmonic to N."""
        values = self.displacement_at(max(2048, 8 * self.displacement_m.size))
        return float(values.max() - values.min())


@lru_cache(maxsize=32)
def _differences(n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Places of harmonics k - m and k + m, k = 0..N, m = 1..N, in an array of harmonics -2N to 2N."""
    k, m = np.arange(n + 1)[:, None], np.arange(1, n + 1)[None, :]
    return k - m + 2 * n, k + m + 2 * n


def _two_sided(coefficients: Complex) -> Complex:
    return np.concatenate([coefficients[:0:-1].conj(), coefficients])


class _Balance:
    """The balance at one speed and load with N harmonics, in the unknowns δ_0, Re δ_k, Im δ_k.

    Its residual is δ_k + H_k F_k for k >= 1 and (F_0 - T1/(r1 cos β_b)) / k̄ for k = 0, in m.
    """

    def __init__(self, system: GearSystem, mesh_hz: float, mean_force_n: float, n: int) -> None:
        self.system, self.mesh_hz, self.mean_force_n, self.n = system, mesh_hz, mean_force_n, n
        harmonics = np.arange(1, n + 1)
        self.omega = 2.0 * np.pi * mesh_hz * harmonics
        self.receptance = system.receptance_m_per_n(mesh_hz * harmonics)
        self.weight = np.concatenate([[1.0 / system.mesh_stiffness_n_per_m + 0j], self.receptance])
        self.stiffness = system.mesh_stiffness_n_per_m * system.contact_lines.fourier((REACH + 1) * n)
        self.error = system.transmission_error_fourier(n)
        self.damping = system.mesh_damping_n_s_per_m
        self.needs_contact = system.mesh_damping == "contact"
        self.static_m = abs(mean_force_n) / system.mesh_stiffness_n_per_m
        self.scale_m = max(self.static_m, system.transmission_error_pp_m, 1e-12)

    # -------------------------------------------------------------- teeth that cannot separate

    def bonded(self) -> HarmonicSolution:
        """Solve for teeth that stay on the flank that the torque presses; whether they do is told in the result."""
        side = math.copysign(self.system.half_backlash_m, self.mean_force_n)
        matrix = self._jacobian(self.stiffness[: 2 * self.n + 1], self.damping)
        right = self.weight * self._product(self.error, self.n)
        right[0] += self.mean_force_n / self.system.mesh_stiffness_n_per_m
        compressed = self._solve(matrix, right)
        displacement = compressed.copy()
        displacement[0] += side
        compression = compressed - self.error
        force = self._product(compression, REACH * self.n)
        residual = np.abs(self._residual_of(displacement, force[: self.n + 1], self.damping)).max() / self.scale_m
        samples = np.fft.irfft(compression, _sampling(self.n), norm="forward")
        touching = math.copysign(1.0, self.mean_force_n) * samples
        contact = 1.0 if touching.min() >= 0.0 else float(np.mean(touching > 0.0))
        return self._result(displacement, force, self.damping, contact, float(residual))

    def _product(self, compression: Complex, highest: int) -> Complex:
        """Harmonics 0 to `highest` of k_m(t) times a series of N harmonics."""
        whole = np.convolve(_two_sided(self.stiffness[: highest + self.n + 1]), _two_sided(compression))
        middle = (whole.size - 1) // 2
        return np.asarray(whole[middle : middle + highest + 1])

    # -------------------------------------------------------------- Newton's method

    def newton(self, start: Complex) -> HarmonicSolution | None:
        """Return the solution that Newton's method reaches from a start, or None where it reaches none."""
        samples = _sampling(self.n)
        stiffness = np.fft.irfft(self.stiffness[: min(self.stiffness.size, samples // 2)], samples, norm="forward")
        error = self.system.transmission_error_at(np.arange(samples) / samples)
        always = 0.0 if self.needs_contact else self.damping
        displacement = start
        force, touching = self._force(displacement, stiffness, error)
        residual = self._residual_of(displacement, force[: self.n + 1], always)
        for _ in range(_NEWTON_STEPS):
            size = float(np.abs(residual).max())
            if size <= RESIDUAL * self.scale_m:
                return self._result(displacement, force, always, float(touching.mean()), size / self.scale_m)
            active = np.fft.rfft(stiffness * touching, norm="forward")[: 2 * self.n + 1]
            contact = np.fft.rfft(touching, norm="forward")[: 2 * self.n + 1] if self.needs_contact else None
            try:
                step = self._solve(self._jacobian(active, always, contact), -residual)
            except np.linalg.LinAlgError:
                return None
            norm, part = float(np.linalg.norm(residual)), 1.0
            for _ in range(_HALVINGS):
                trial = displacement + part * step
                force, touching = self._force(trial, stiffness, error)
                residual = self._residual_of(trial, force[: self.n + 1], always)
                if np.linalg.norm(residual) < (1.0 - 1e-3 * part) * norm:
                    break
                part *= 0.5
            else:
                return None
            displacement = trial
        return None

    def _force(self, displacement: Complex, stiffness: Real, error: Real) -> tuple[Complex, NDArray[np.bool_]]:
        """Harmonics 0 to 4N of the mesh force, without the damping that always acts, and where teeth touch."""
        samples = stiffness.size
        gap = np.fft.irfft(displacement, samples, norm="forward") - error
        half = self.system.half_backlash_m
        compression = gap - np.clip(gap, -half, half)
        touching = compression != 0.0
        force = stiffness * compression
        if self.needs_contact:
            velocity = np.concatenate([[0.0], 1j * self.omega * displacement[1:]])
            speed = np.fft.irfft(velocity, samples, norm="forward")
            force += self.damping * speed * touching
        return np.fft.rfft(force, norm="forward")[: REACH * self.n + 1], touching

    # -------------------------------------------------------------- residual, Jacobian, result

    def _residual_of(self, displacement: Complex, force: Complex, always: float) -> Complex:
        """Residual for a displacement, the force it causes, and the damping that acts always."""
        residual = self.weight * force
        residual[1:] += displacement[1:] * self._with_damper(always)
        residual[0] = (force[0] - self.mean_force_n) / self.system.mesh_stiffness_n_per_m
        return residual

    def _with_damper(self, always: float) -> Complex:
        """1 + H iω c for each harmonic from 1: what stands before δ_k where a damper acts always."""
        return np.asarray(1.0 + self.receptance * 1j * self.omega * always)

    def _jacobian(self, stiffness: Complex, always: float, contact: Complex | None = None) -> Real:
        """Derivative of the residual by the unknowns.

        For harmonics 0 to 2N of a stiffness and, where damping needs contact, of where teeth touch.
        """
        n = self.n
        minus, plus = _differences(n)
        two_sided = _two_sided(stiffness)
        below, above = two_sided[minus], two_sided[plus]
        by_real, by_imaginary = below + above, 1j * (below - above)
        if contact is not None:
            two_sided, speed = self.damping * _two_sided(contact), 1j * self.omega
            below, above = speed * two_sided[minus], speed * two_sided[plus]
            by_real, by_imaginary = by_real + below - above, by_imaginary + 1j * (below + above)
        weight = self.weight[:, None]
        by_real, by_imaginary, by_mean = weight * by_real, weight * by_imaginary, self.weight * stiffness[: n + 1]
        own = self._with_damper(always)
        diagonal = np.arange(n)
        by_real[diagonal + 1, diagonal] += own
        by_imaginary[diagonal + 1, diagonal] += 1j * own
        matrix = np.empty((2 * n + 1, 2 * n + 1))
        matrix[: n + 1, 0], matrix[n + 1 :, 0] = by_mean.real, by_mean.imag[1:]
        matrix[: n + 1, 1 : n + 1], matrix[n + 1 :, 1 : n + 1] = by_real.real, by_real.imag[1:]
        matrix[: n + 1, n + 1 :], matrix[n + 1 :, n + 1 :] = by_imaginary.real, by_imaginary.imag[1:]
        return matrix

    def _solve(self, matrix: Real, right: Complex) -> Complex:
        found = np.linalg.solve(matrix, np.concatenate([right.real, right.imag[1:]]))
        solution = found[: self.n + 1].astype(np.complex128)
        solution[1:] += 1j * found[self.n + 1 :]
        return solution

    def _result(
        self, displacement: Complex, force: Complex, always: float, contact: float, residual: float
    ) -> HarmonicSolution:
        beyond = np.arange(self.n + 1, REACH * self.n + 1)
        receptance = self.system.receptance_m_per_n(self.mesh_hz * beyond)
        omega = 2.0 * np.pi * self.mesh_hz * np.arange(REACH * self.n + 1)
        damper = 1.0 + receptance * 1j * omega[self.n + 1 :] * always
        whole = np.concatenate([displacement, -receptance * force[self.n + 1 :] / damper])
        total = force + 1j * omega * always * whole
        # What the harmonics beyond N would do to δ if they were let back into the force: their size times the
        # stiffness' part in what answers a force there; or those beyond 4N, where they are more.
        largest = float(np.abs(displacement[1:]).max())
        feedback = np.abs(receptance) * self.system.mesh_stiffness_n_per_m
        part = np.clip(feedback, _left_out(self.system, self.n), 1.0)
        tail = float((np.abs(whole[self.n + 1 :]) * part).sum()) / largest if largest > 0.0 else 0.0
        return HarmonicSolution(self.mesh_hz, whole, total, contact, residual, tail)


def _left_out(system: GearSystem, n: int) -> float:
    """Return what harmonics beyond 4N add to δ over what N + 1 to 4N add.

    Those of δ fall with k³ where the stiffness steps (spur teeth), and with k⁴ where it has kinks (helical teeth, from
    the harmonic on whose period is no longer than the overlap).
    """
    order = 2 if n * system.contact_lines.overlap_ratio < 1.0 else 3
    return 1.0 / (REACH**order - 1.0)


def _sampling(n: int) -> int:
    """Samples of one period for N harmonics: a power of two."""
    return 1 << math.ceil(math.log2(_SAMPLES_PER_HARMONIC * n))


def balance(
    system: GearSystem, mesh_hz: float, mean_force_n: float, n_harmonics: int, start: Complex | None = None
) -> HarmonicSolution | None:
    """Return the periodic solution with a given number of harmonics, or None where Newton's method finds none.

    Parameters
    ----------
    system : GearSystem
    mesh_hz : float
        Above zero.
    mean_force_n : float
        F_0, not zero.
    n_harmonics : int
        N, at least the harmonics of the transmission error.
    start : ndarray of complex, optional
        Harmonics of δ from which Newton's method starts; more than N are cut, fewer are filled with zeros. Default:
        teeth that cannot separate, whose solution is returned at once where they do not.
    """
    held = _Balance(system, mesh_hz, mean_force_n, n_harmonics)
    if start is None:
        bonded = held.bonded()
        if not bonded.separates:
            return bonded
        start = bonded.displacement_m
    fitted = np.zeros(n_harmonics + 1, dtype=np.complex128)
    common = min(start.size, n_harmonics + 1)
    fitted[:common] = start[:common]
    return held.newton(fitted)


def periodic_solution(
    system: GearSystem, mesh_hz: float, mean_force_n: float, start: Complex | None = None
) -> HarmonicSolution | None:
    """Return the periodic solution with as many harmonics as it needs, or None where none is found.

    Their number is estimated from the stiffness series and doubled until the tail is small enough; a solution whose
    tail is not small with `MOST_HARMONICS` is not returned.

    Parameters
    ----------
    system, mesh_hz, mean_force_n, start
        As of `balance`.
    """
    n = _harmonics_needed(system, mesh_hz, mean_force_n)
    while n <= MOST_HARMONICS:
        found = balance(system, mesh_hz, mean_force_n, n, start)
        if found is None:
            return None
        if found.tail <= TAIL:
            return found
        start = found.displacement_m if found.separates or start is not None else None
        n *= 2
    return None


def _harmonics_needed(system: GearSystem, mesh_hz: float, mean_force_n: float) -> int:
    """Return how many harmonics the stiffness series under the mean force asks for.

    An estimate that spares a solution with too few; the tail of what is found decides.
    """
    k = np.arange(1, MOST_HARMONICS + 1)
    force = np.abs(mean_force_n * system.contact_lines.fourier(MOST_HARMONICS)[1:])
    receptance = np.abs(system.on_rigid_seats.receptance_m_per_n(mesh_hz * k))
    added = receptance * force
    least = _left_out(system, FEWEST_HARMONICS)
    feedback = np.clip(receptance * system.mesh_stiffness_n_per_m, least, 1.0)
    beyond = np.cumsum((added * feedback)[::-1])[::-1]
    swing = 0.25 * max(abs(mean_force_n) / system.mesh_stiffness_n_per_m, system.transmission_error_pp_m)
    too_much = np.flatnonzero(beyond > TAIL * swing)
    enough = int(too_much[-1]) + 2 if too_much.size else 1
    return min(max(FEWEST_HARMONICS, 2 * len(system.transmission_error_m), enough), MOST_HARMONICS)
