"""Length of the contact lines over the mesh: paper, equations (4) to (6), and its exact Fourier series."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tdacoustic.errors import GearError

__all__ = ["ContactLines"]


@dataclass(frozen=True)
class ContactLines:
    """The contact lines of a pair, by its contact ratios; time is in mesh periods throughout.

    On one pair of teeth the line's length is a trapezoid: it grows, stays, shrinks, and is gone after εα + εβ periods.
    The trapezoid is the convolution of two boxes of lengths εα and εβ. A pair of teeth begins at each whole period.

    Parameters
    ----------
    transverse_contact_ratio : float
        εα, above zero.
    overlap_ratio : float
        εβ, zero for spur gears.

    Raises
    ------
    GearError
        A ratio that is out of range, or both together below 1.

    Examples
    --------
    >>> ContactLines(2.0, 0.4).relative([0.0, 0.3])
    array([1., 1.])
    >>> [round(size, 4) for size in abs(ContactLines(1.5, 0.0).fourier(2)).tolist()]
    [1.0, 0.2122, 0.0]
    """

    transverse_contact_ratio: float
    overlap_ratio: float

    def __post_init__(self) -> None:
        alpha, beta = self.transverse_contact_ratio, self.overlap_ratio
        if not (math.isfinite(alpha) and math.isfinite(beta) and alpha > 0.0 and beta >= 0.0 and alpha + beta >= 1.0):
            raise GearError(
                f"contact ratios must be > 0 (transverse) and >= 0 (overlap), together >= 1, got {alpha!r} and {beta!r}"
            )

    @property
    def contact_ratio(self) -> float:
        """ε = εα + εβ."""
        return self.transverse_contact_ratio + self.overlap_ratio

    @property
    def is_constant(self) -> bool:
        """Whether the total length does not change: either ratio is a whole number above zero."""
        return any(
            ratio > 0.5 and abs(ratio - round(ratio)) < 1e-12
            for ratio in (self.transverse_contact_ratio, self.overlap_ratio)
        )

    def on_one_pair(self, time: ArrayLike) -> NDArray[np.float64]:
        """Return γ, the line's length on one pair of teeth over its maximum: equation (5).

        Parameters
        ----------
        time : array_like
            In mesh periods since the pair's contact began.
        """
        t = np.asarray(time, dtype=np.float64)
        short, long = sorted((self.transverse_contact_ratio, self.overlap_ratio))
        if short <= 0.0:
            return np.where((t >= 0.0) & (t < long), 1.0, 0.0)
        return np.asarray(np.clip(np.minimum(t, self.contact_ratio - t) / short, 0.0, 1.0))

    def relative(self, time: ArrayLike) -> NDArray[np.float64]:
        """Return the total length over its mean: equation (6).

        Parameters
        ----------
        time : array_like
            In mesh periods; a pair begins its contact at 0.
        """
        t = np.mod(np.asarray(time, dtype=np.float64), 1.0)
        total = np.zeros_like(t)
        for started in range(math.ceil(self.contact_ratio)):
            total = total + self.on_one_pair(t + started)
        return np.asarray(total / max(self.transverse_contact_ratio, self.overlap_ratio))

    def fourier(self, highest: int) -> NDArray[np.complex128]:
        """Return the complex Fourier coefficients of `relative` for harmonics 0 to `highest`.

        Exactly sinc(k εα) sinc(k εβ) exp(-iπ k (εα + εβ)) with sinc x = sin(πx)/(πx) (physics.md section 2).
        """
        k = np.arange(highest + 1)
        size = np.sinc(k * self.transverse_contact_ratio) * np.sinc(k * self.overlap_ratio)
        return np.asarray(size * np.exp(-1j * np.pi * k * self.contact_ratio))

    def length_m(self, time: ArrayLike, face_width_m: float, base_helix_angle_rad: float) -> NDArray[np.float64]:
        """Return the total length of the contact lines in m: equation (4) summed as in (6).

        The longest line on one pair is b sec β_b where εβ <= εα, and L_CD csc β_b where the overlap is larger; both
        are b sec β_b min(εα, εβ)/εβ.

        Parameters
        ----------
        time : array_like
            In mesh periods.
        face_width_m, base_helix_angle_rad : float
        """
        mean = face_width_m * self.transverse_contact_ratio / math.cos(base_helix_angle_rad)
        return np.asarray(mean * self.relative(time))
