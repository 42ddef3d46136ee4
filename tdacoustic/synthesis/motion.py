"""How the shafts turn during a run: speed with its wander, angle, and what follows from both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tdacoustic.errors import RecipeError
from tdacoustic.synthesis.recipe import Kinematics, LineRecipe, Slip

__all__ = ["Motion", "slow_noise"]


def slow_noise(rng: np.random.Generator, n_samples: int, sample_rate_hz: float, bandwidth_hz: float) -> NDArray:
    """Return complex Gaussian noise within +-bandwidth around 0 Hz, of mean square 1, of shape (n_samples,).

    It has no component at 0 Hz itself, so it averages to zero over the run.
    """
    n_lines = max(1, int(bandwidth_hz * n_samples / sample_rate_hz))
    spectrum = np.zeros(n_samples, dtype=complex)
    amplitudes = rng.standard_normal((2, 2 * n_lines))
    values = amplitudes[0] + 1j * amplitudes[1]
    spectrum[1 : n_lines + 1], spectrum[-n_lines:] = values[:n_lines], values[n_lines:]
    noise = np.fft.ifft(spectrum)
    return noise / np.sqrt(np.mean(np.abs(noise) ** 2))


@dataclass(frozen=True)
class Motion:
    """The motion of one run, sampled at the rate of the logs.

    Parameters
    ----------
    kinematics : Kinematics
    time_s : ndarray, shape (n,)
    nominal_km_h : ndarray, shape (n,)
        Train speed that the condition prescribes.
    motor_speed_hz : ndarray, shape (n,)
        Turns of the motor shaft per second, with wander and mesh excess.
    motor_turns : ndarray, shape (n,)
        Angle of the motor shaft in revolutions, the integral of its speed, from 0.
    mesh_excess : float
        Relative excess of the shafts' speed over the one that follows from the nominal train speed.
    """

    kinematics: Kinematics
    time_s: NDArray[np.float64]
    nominal_km_h: NDArray[np.float64]
    motor_speed_hz: NDArray[np.float64]
    motor_turns: NDArray[np.float64]
    mesh_excess: float

    @classmethod
    def build(
        cls,
        kinematics: Kinematics,
        *,
        n_samples: int,
        sample_rate_hz: float,
        start_km_h: float,
        end_km_h: float | None,
        profile: str,
        mesh_excess: float,
        slip: Sequence[Slip] = (),
        rng: np.random.Generator,
    ) -> Motion:
        """Make a motion of constant or running speed.

        The wander has exactly the relative rms that the recipe prescribes and averages to zero, so the mean speed of a
        steady run is the nominal one; a slip on top of it rises and falls as a squared sine. The angle is integrated by
        the trapezoidal rule, whose error is below 1e-6 revolutions for wander below 10 Hz.
        """
        time_s = np.arange(n_samples) / sample_rate_hz
        part = time_s * sample_rate_hz / max(n_samples - 1, 1)
        if profile == "smooth":
            part = 0.5 - 0.5 * np.cos(np.pi * part)
        nominal = start_km_h + ((start_km_h if end_km_h is None else end_km_h) - start_km_h) * part
        speed = nominal / 3.6 / (np.pi * 1e-3 * kinematics.wheel_diameter_mm) * kinematics.ratio * (1.0 + mesh_excess)
        if kinematics.speed_wander > 0.0:
            wander = slow_noise(rng, n_samples, sample_rate_hz, kinematics.wander_bandwidth_hz).real
            speed = speed * (1.0 + kinematics.speed_wander * wander / np.sqrt(np.mean(wander**2)))
        for event in slip:
            within = np.clip((time_s - event.from_s) / (event.to_s - event.from_s), 0.0, 1.0)
            speed = speed * (1.0 + event.peak * np.sin(np.pi * within) ** 2)
        turns = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / sample_rate_hz
        return cls(kinematics, time_s, nominal, speed, turns, mesh_excess)

    def shaft_ratio(self, shaft: str) -> float:
        """Turns of a shaft (``"motor"`` or ``"wheelset"``) per turn of the motor shaft."""
        return 1.0 if shaft == "motor" else 1.0 / self.kinematics.ratio

    def mesh_order(self, gear_pair: str | None = None) -> float:
        """Meshes of a gear pair (default: the first) per turn of the motor shaft; pairs stand in series."""
        turns = 1.0
        for pair in self.kinematics.gear_pair:
            if gear_pair in (None, pair.name):
                return turns * pair.teeth[0]
            turns *= pair.teeth[0] / pair.teeth[1]
        raise RecipeError(f"gear_pair {gear_pair!r} does not exist")

    def fixed_and_order(self, line: LineRecipe, carrier_hz: float | None) -> tuple[float, float]:
        """Split a line's frequency into its fixed part in Hz and its order of the motor shaft."""
        fixed = (line.frequency_hz or 0.0) + (line.carrier or 0.0) * (carrier_hz or 0.0)
        order = (line.order or 0.0) * self.shaft_ratio(line.shaft)
        if line.mesh is not None:
            order += line.mesh * self.mesh_order(line.gear_pair)
        return fixed, order
