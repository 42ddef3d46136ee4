"""Walls by formula: what closes a rectangular cavity in these tests."""

import math

import numpy as np

SOUND_SPEED, DENSITY = 343.0, 1.2
IMPEDANCE = SOUND_SPEED * DENSITY


class SupportedPlate:
    """A simply supported plate as the wall at +z of a box: sines, modal mass 1 kg.

    Parameters
    ----------
    size_m : (float, float, float)
        Of the cavity; the plate is its whole wall.
    mass_kg_m2, rigidity_n_m : float
    highest_hz : float
        Of its modes.
    """

    def __init__(self, size_m, mass_kg_m2, rigidity_n_m, highest_hz):
        self.size_m = size_m
        self.mass = mass_kg_m2
        largest = math.sqrt(2.0 * math.pi * highest_hz * math.sqrt(mass_kg_m2 / rigidity_n_m))
        count = [math.floor(largest * size / math.pi) for size in size_m[:2]]
        numbers = [(m, n) for m in range(1, count[0] + 1) for n in range(1, count[1] + 1)]
        waves = [(m * math.pi / size_m[0]) ** 2 + (n * math.pi / size_m[1]) ** 2 for m, n in numbers]
        kept = [pair for pair in sorted(zip(waves, numbers, strict=True)) if pair[0] <= largest**2]
        self.numbers = np.array([pair[1] for pair in kept])
        self.bending_rad_m = largest
        self.frequency_hz = np.array([pair[0] for pair in kept]) * math.sqrt(rigidity_n_m / mass_kg_m2) / (2 * math.pi)

    def shapes(self, x_m, y_m):
        """Displacement of the modes at places from the middle, shape (modes, n)."""
        a, b = self.size_m[:2]
        along = np.sin(np.outer(self.numbers[:, 0], math.pi * (np.asarray(x_m) / a + 0.5)))
        up = np.sin(np.outer(self.numbers[:, 1], math.pi * (np.asarray(y_m) / b + 0.5)))
        return 2.0 / math.sqrt(self.mass * a * b) * along * up

    def outward(self, points_m, normals):
        found = np.zeros((len(self.numbers), len(points_m)))
        here = normals[:, 2] > 0.5
        found[:, here] = self.shapes(points_m[here, 0], points_m[here, 1])
        return found


def steel(thickness_m):
    """Mass and rigidity of a steel plate."""
    return 7850.0 * thickness_m, 210e9 * thickness_m**3 / (12.0 * (1.0 - 0.3**2))
