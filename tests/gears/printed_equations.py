"""The equations of motion as physics.md section 2 prints them, term by term: the truth the gear tests hold against.

Only the input fields of a `GearSystem` are read; none of its methods, matrices or vectors.
"""

import itertools
import math

import numpy as np
from scipy.integrate import solve_ivp

ROTATIONS = (3, 7)


def direction(system):
    """V of equation (2): x1 y1 z1 theta1 x2 y2 z2 theta2."""
    s, c = math.sin(system.pressure_angle_rad), math.cos(system.pressure_angle_rad)
    sb, cb = math.sin(system.base_helix_angle_rad), math.cos(system.base_helix_angle_rad)
    r1, r2 = system.base_radii_m
    return np.array([cb * s, cb * c, sb, r1 * cb, -cb * s, -cb * c, -sb, r2 * cb])


def matrices(system):
    """M, C and K, shape (8, 8) each, of the bearings alone."""
    (m1, m2), (j1, j2) = system.masses_kg, system.inertias_kg_m2
    k1x, k1y, k1z, k2x, k2y, k2z = system.bearing_stiffness_n_per_m
    c1x, c1y, c1z, c2x, c2y, c2z = system.bearing_damping_n_s_per_m
    return (
        np.diag([m1, m1, m1, j1, m2, m2, m2, j2]),
        np.diag([c1x, c1y, c1z, 0.0, c2x, c2y, c2z, 0.0]),
        np.diag([k1x, k1y, k1z, 0.0, k2x, k2y, k2z, 0.0]),
    )


def mesh_damping(system):
    (j1, j2), (r1, r2) = system.inertias_kg_m2, system.base_radii_m
    equivalent = j1 * j2 / (j2 * r1**2 + j1 * r2**2)
    return 2.0 * system.mesh_damping_ratio * math.sqrt(system.mesh_stiffness_n_per_m * equivalent)


def trapezoid(t, alpha, beta):
    """Equation (5), its four cases in turn."""
    short, long = min(alpha, beta), max(alpha, beta)
    if t < 0.0 or t >= alpha + beta:
        return 0.0
    if t < short:
        return t / short
    if t < long:
        return 1.0
    return 1.0 - (t - long) / short


def line_length(t, alpha, beta):
    """Total length over its mean: every pair of teeth that can be in contact at t, in mesh periods; equation (6)."""
    # The area of one trapezoid is max(alpha, beta): that is the mean of the sum.
    first = math.ceil(t - alpha - beta) - 1
    return sum(trapezoid(t - n, alpha, beta) for n in range(first, math.floor(t) + 1)) / max(alpha, beta)


def breaks(alpha, beta):
    """Times in a mesh period at which the total length has a kink or a jump, with both ends."""
    inside = {round(math.fmod(value, 1.0), 14) for value in (alpha, beta, alpha + beta)}
    return [0.0, *sorted(inside - {0.0, 1.0}), 1.0]


def stiffness(system, t):
    lines = system.contact_lines
    return system.mesh_stiffness_n_per_m * line_length(t, lines.transverse_contact_ratio, lines.overlap_ratio)


def transmission_error(system, t):
    return sum(size * math.sin(2.0 * math.pi * n * t) for n, size in enumerate(system.transmission_error_m, 1))


def rates(system, mesh_hz, torque_n_m):
    """Right side of the eight equations as sixteen of first order; time in s."""
    s, c = math.sin(system.pressure_angle_rad), math.cos(system.pressure_angle_rad)
    sb, cb = math.sin(system.base_helix_angle_rad), math.cos(system.base_helix_angle_rad)
    (r1, r2), (m1, m2), (j1, j2) = system.base_radii_m, system.masses_kg, system.inertias_kg_m2
    k1x, k1y, k1z, k2x, k2y, k2z = system.bearing_stiffness_n_per_m
    c1x, c1y, c1z, c2x, c2y, c2z = system.bearing_damping_n_s_per_m
    c_m, b = mesh_damping(system), system.half_backlash_m
    t1, t2 = torque_n_m, torque_n_m * r2 / r1

    def right(time, state):
        x1, y1, z1, a1, x2, y2, z2, a2, vx1, vy1, vz1, w1, vx2, vy2, vz2, w2 = state
        delta = cb * s * (x1 - x2) + cb * c * (y1 - y2) + sb * (z1 - z2) + cb * (r1 * a1 + r2 * a2)
        speed = cb * s * (vx1 - vx2) + cb * c * (vy1 - vy2) + sb * (vz1 - vz2) + cb * (r1 * w1 + r2 * w2)
        q = delta - transmission_error(system, time * mesh_hz)
        tau = q - b if q > b else q + b if q < -b else 0.0
        force = stiffness(system, time * mesh_hz) * tau
        if system.mesh_damping == "always" or tau != 0.0:
            force += c_m * speed
        return [
            vx1, vy1, vz1, w1, vx2, vy2, vz2, w2,
            (-c1x * vx1 - k1x * x1 - force * cb * s) / m1,
            (-c1y * vy1 - k1y * y1 - force * cb * c) / m1,
            (-c1z * vz1 - k1z * z1 - force * sb) / m1,
            (t1 - force * r1 * cb) / j1,
            (-c2x * vx2 - k2x * x2 + force * cb * s) / m2,
            (-c2y * vy2 - k2y * y2 + force * cb * c) / m2,
            (-c2z * vz2 - k2z * z2 + force * sb) / m2,
            (t2 - force * r2 * cb) / j2,
        ]  # fmt: skip

    return right


def eight_of_seven(system, state):
    """The sixteen states of fourteen reduced ones: x y z of both, p = r1 theta1 + r2 theta2, put into theta1."""
    found = np.zeros(16)
    for half in (0, 1):
        reduced = state[7 * half : 7 * half + 7]
        found[8 * half : 8 * half + 3] = reduced[:3]
        found[8 * half + 3] = reduced[6] / system.base_radii_m[0]
        found[8 * half + 4 : 8 * half + 7] = reduced[3:6]
    return found


def motion(system, mesh_hz, torque_n_m, state, times):
    """The sixteen states at times in s from fourteen reduced ones at the first, which begins a mesh period."""
    found = solve_ivp(
        rates(system, mesh_hz, torque_n_m), (0.0, times[-1]), eight_of_seven(system, state), "DOP853", times,
        rtol=1e-10, atol=1e-16, max_step=0.02 / mesh_hz,
    )  # fmt: skip
    assert found.success
    return found.y


class BondedTeeth:
    """Teeth that always touch: linear equations with a periodic stiffness, in seven coordinates, solved without series.

    The rates are integrated from kink to kink of the stiffness, all columns of the monodromy matrix with them.
    """

    def __init__(self, system, mesh_hz, torque_n_m):
        self.system, self.mesh_hz, self.torque_n_m = system, mesh_hz, torque_n_m
        keep = [0, 1, 2, 4, 5, 6]
        mass, damping, spring = (np.diag(matrix)[keep] for matrix in matrices(system))
        (j1, j2), (r1, r2) = system.inertias_kg_m2, system.base_radii_m
        self.mass = np.append(mass, j1 * j2 / (j2 * r1**2 + j1 * r2**2))
        self.damping, self.spring = np.append(damping, 0.0), np.append(spring, 0.0)
        self.direction = np.append(direction(system)[keep], math.cos(system.base_helix_angle_rad))
        self.drive = np.append(np.zeros(6), torque_n_m / r1)
        self.side = math.copysign(system.half_backlash_m, torque_n_m)

    def matrix(self, mesh_stiffness):
        """A of z' = A z + g at a mesh stiffness, shape (14, 14)."""
        outer = np.outer(self.direction, self.direction)
        spring = np.diag(self.spring) + mesh_stiffness * outer
        damping = np.diag(self.damping) + mesh_damping(self.system) * outer
        below = -np.hstack([spring, damping]) / self.mass[:, None]
        return np.vstack([np.hstack([np.zeros((7, 7)), np.eye(7)]), below])

    def _rates(self, phase, columns):
        k = stiffness(self.system, phase)
        columns = columns.reshape(14, -1)
        found = self.matrix(k) @ columns
        held = k * (self.side + transmission_error(self.system, phase))
        found[7:, -1] += (self.drive + self.direction * held) / self.mass
        return (found / self.mesh_hz).ravel()

    def _integrate(self, columns, phases):
        """Columns at ascending phases of a period from those at its start; the last column feels the forcing."""
        lines = self.system.contact_lines
        found = []
        at = breaks(lines.transverse_contact_ratio, lines.overlap_ratio)
        for start, end in itertools.pairwise(at):
            # A hair inside of each piece: at its end a spur pair's stiffness has already jumped.
            inside = [phase for phase in phases if start <= phase < end]
            piece = solve_ivp(
                lambda phase, z, start=start, end=end: self._rates(min(max(phase, start + 1e-13), end - 1e-13), z),
                (start, end), columns.ravel(), method="DOP853", rtol=1e-12, atol=1e-18, t_eval=[*inside, end],
            )  # fmt: skip
            found += [state.reshape(14, -1) for state in piece.y.T[:-1]]
            columns = piece.y[:, -1].reshape(14, -1)
        return columns, found

    def monodromy(self):
        """Its last column is where the forced motion from rest at zero ends, shape (14, 15)."""
        return self._integrate(np.hstack([np.eye(14), np.zeros((14, 1))]), [])[0]

    def periodic(self, phases):
        """State and displacement along the line of action of the periodic motion, at phases in [0, 1)."""
        whole = self.monodromy()
        start = np.linalg.solve(np.eye(14) - whole[:, :14], whole[:, 14])
        _, states = self._integrate(start[:, None], phases)
        states = np.array(states)[:, :, 0]
        return states, states[:, :7] @ self.direction
