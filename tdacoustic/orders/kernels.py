"""Compiled loops of resampling in angle and of Vold-Kalman tracking.

This module imports numba; others import it where they use it. `times`, `turns`, `slopes` are the nodes of a
`tdacoustic.speed.angle.ShaftAngle` without breaks; all angles asked for must lie between its ends.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

__all__ = [
    "banded_inverse_diagonal",
    "gather_envelopes",
    "phasor_grid",
    "resample_rows",
    "times_on_grid",
    "turns_on_grid",
    "write_waveform",
]

PHASE_RUN = 64
"""Samples over which a phase is taken as a parabola; its phasor is turned by a recursion there."""


def _compiled(function: Any) -> Any:
    """Compile on first use, and keep the result where a place for it can be written."""
    try:
        return njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})(function)
    except RuntimeError:  # numba found no such place
        return njit(error_model="numpy", fastmath={"contract", "reassoc", "nsz"})(function)


@_compiled
def turns_on_grid(start_s, step_s, times, turns, slopes, out):  # type: ignore[no-untyped-def]
    """Write the turns at evenly spaced instants; beyond the ends, those of the nearest end's speed."""
    n, last = times.size, 0
    last = min(max(np.searchsorted(times, start_s, side="right") - 1, 0), n - 2)
    for index in range(out.size):
        t = start_s + index * step_s
        while last < n - 2 and t >= times[last + 1]:
            last += 1
        if t <= times[0]:
            out[index] = turns[0] + slopes[0] * (t - times[0])
        elif t >= times[n - 1]:
            out[index] = turns[n - 1] + slopes[n - 1] * (t - times[n - 1])
        else:
            h = times[last + 1] - times[last]
            s = (t - times[last]) / h
            q = 1.0 - s
            rise = turns[last + 1] - turns[last]
            bent = s * q * (q * slopes[last] - s * slopes[last + 1]) * h
            out[index] = turns[last] + rise * s * s * (3.0 - 2.0 * s) + bent


@_compiled
def times_on_grid(first, per_turn, times, turns, slopes, out_times, out_speeds):  # type: ignore[no-untyped-def]
    """Write instants and speeds at the turns (first + i) / per_turn: Newton's steps within a node interval."""
    n = times.size
    last = min(max(np.searchsorted(turns, first / per_turn, side="right") - 1, 0), n - 2)
    for index in range(out_times.size):
        wanted = (first + index) / per_turn
        while last < n - 2 and wanted >= turns[last + 1]:
            last += 1
        h, rise = times[last + 1] - times[last], turns[last + 1] - turns[last]
        a, b = slopes[last] * h, slopes[last + 1] * h
        target = wanted - turns[last]
        low, high, s = 0.0, 1.0, min(max(target / rise, 0.0), 1.0)
        slope = rise
        for _ in range(60):
            q = 1.0 - s
            over = rise * s * s * (3.0 - 2.0 * s) + s * q * (q * a - s * b) - target
            slope = 6.0 * rise * s * q + a * q * (1.0 - 3.0 * s) + b * s * (3.0 * s - 2.0)
            if over > 0.0:
                high = s
            else:
                low = s
            moved = s - over / slope if slope > 0.0 else 0.5 * (low + high)
            if not (moved >= low and moved <= high):
                moved = 0.5 * (low + high)
            step = abs(moved - s)
            s = moved
            if step < 1e-13:
                break
        out_times[index] = times[last] + s * h
        out_speeds[index] = max(slope, 0.0) / h


@_compiled
def resample_rows(data, positions, shares, heights, rises, fineness, half_width, out):  # type: ignore[no-untyped-def]
    """Write a low-passed signal at positions between its samples.

    Parameters
    ----------
    data : ndarray, shape (n_channels, n)
    positions : ndarray, shape (m,)
        In samples of `data`; each kernel must lie within.
    shares : ndarray, shape (m,)
        Density of the output over that of the input, at most 1: the kernel is as much wider.
    heights, rises : ndarray, shape (half_width · fineness + 2,)
        Kernel from its middle on at steps of 1 / fineness of the coarser spacing, and its rise to the next.
    fineness, half_width : int
    out : ndarray, shape (n_channels, m)
    """
    channels = data.shape[0]
    widest = int(2.0 * half_width / shares.min()) + 3
    weights = np.empty(widest)
    for index in range(positions.size):
        p, share = positions[index], shares[index]
        reach = half_width / share
        start, stop = int(np.ceil(p - reach)), int(np.floor(p + reach)) + 1
        scale = share * fineness
        count, first = np.int32(stop - start), (start - p) * scale
        for i in range(count):
            u = abs(first + i * scale)
            j = np.int32(u)
            weights[i] = heights[j] + (u - j) * rises[j]
        for channel in range(channels):
            total = 0.0
            row = data[channel, start:stop]
            for i in range(count):
                total += weights[i] * row[i]
            out[channel, index] = share * total


@_compiled
def phasor_grid(phase, count, out):  # type: ignore[no-untyped-def]
    """Write exp(2πi phase) over runs of samples, the phase a parabola in each.

    Parameters
    ----------
    phase : ndarray, shape (2 runs + 1,)
        Turns at the beginning and in the middle of each run of `PHASE_RUN` samples, and at the end.
    count : int
        Samples.
    out : ndarray of complex, shape (count,)
    """
    done, run, half = 0, 0, 0.5 * PHASE_RUN
    while done < count:
        first, middle, last = phase[2 * run], phase[2 * run + 1], phase[2 * run + 2]
        bend = (first - 2.0 * middle + last) / (half * half)  # second difference a sample
        rate = (last - first) / PHASE_RUN - 0.5 * bend * PHASE_RUN
        base = first - np.floor(first)
        now = np.exp(2j * np.pi * base)
        turn = np.exp(2j * np.pi * (rate + 0.5 * bend))
        twist = np.exp(2j * np.pi * bend)
        for index in range(done, min(done + PHASE_RUN, count)):
            out[index] = now
            now *= turn
            turn *= twist
        done += PHASE_RUN
        run += 1


@_compiled
def gather_envelopes(data, weights, phasors, first, per_node, moments):  # type: ignore[no-untyped-def]
    """Add 2 x conj(phasor) times each cubic B-spline to the moments of its node.

    Parameters
    ----------
    data : ndarray, shape (n_channels, n)
    weights : ndarray, shape (per_node, 4)
        The four splines over a node interval, at its samples.
    phasors : ndarray of complex, shape (n,)
    first : int
        Number of the first sample; sample s lies in the node interval s // per_node, whose splines are those of the
        nodes s // per_node to s // per_node + 3.
    per_node : int
    moments : ndarray of complex, shape (nodes, n_channels)
    """
    n = phasors.size
    for channel in range(data.shape[0]):
        row = data[channel]
        start = 0
        while start < n:
            node = (first + start) // per_node
            inside = (first + start) - node * per_node
            stop = min(n, start + per_node - inside)
            r0 = r1 = r2 = r3 = i0 = i1 = i2 = i3 = 0.0
            for index in range(start, stop):
                w = inside + index - start
                real, imag = row[index] * phasors[index].real, row[index] * phasors[index].imag
                r0 += weights[w, 0] * real
                i0 += weights[w, 0] * imag
                r1 += weights[w, 1] * real
                i1 += weights[w, 1] * imag
                r2 += weights[w, 2] * real
                i2 += weights[w, 2] * imag
                r3 += weights[w, 3] * real
                i3 += weights[w, 3] * imag
            moments[node, channel] += complex(2.0 * r0, -2.0 * i0)
            moments[node + 1, channel] += complex(2.0 * r1, -2.0 * i1)
            moments[node + 2, channel] += complex(2.0 * r2, -2.0 * i2)
            moments[node + 3, channel] += complex(2.0 * r3, -2.0 * i3)
            start = stop


@_compiled
def write_waveform(times, order, angle_times, turns, slopes, nodes, values, rates, out):  # type: ignore[no-untyped-def]
    """Write Re{√2 envelope exp(2πi order turns)} at instants within the nodes; the envelope is a cubic of Hermite.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Best in order, as the search begins where the last one ended.
    order : float
    angle_times, turns, slopes : ndarray
        Nodes of the angle.
    nodes : ndarray, shape (m,)
        Evenly spaced instants of the envelope.
    values, rates : ndarray of complex, shape (m,)
        Envelope and its time derivative there.
    out : ndarray, shape (n,)
    """
    n, m, at = angle_times.size, nodes.size, 0
    step = (nodes[m - 1] - nodes[0]) / (m - 1)
    for index in range(times.size):
        t = times[index]
        while at < n - 2 and t >= angle_times[at + 1]:
            at += 1
        while at > 0 and t < angle_times[at]:
            at -= 1
        h = angle_times[at + 1] - angle_times[at]
        s = (t - angle_times[at]) / h
        q = 1.0 - s
        rise = turns[at + 1] - turns[at]
        angle = turns[at] + rise * s * s * (3.0 - 2.0 * s) + s * q * (q * slopes[at] - s * slopes[at + 1]) * h
        cycles = order * angle
        phase = 2.0 * np.pi * (cycles - np.floor(cycles))
        node = min(max(int((t - nodes[0]) / step), 0), m - 2)
        u = (t - nodes[node]) / step
        v = 1.0 - u
        envelope = values[node] + (values[node + 1] - values[node]) * (u * u * (3.0 - 2.0 * u))
        envelope += (v * rates[node] - u * rates[node + 1]) * (u * v * step)
        out[index] = np.sqrt(2.0) * (envelope.real * np.cos(phase) - envelope.imag * np.sin(phase))


@_compiled
def banded_inverse_diagonal(factor):  # type: ignore[no-untyped-def]
    """Return the diagonal of (L Lᴴ)⁻¹ from the banded factor (K. Takahashi, J. Fagan, M.-S. Chin, PICA 1973).

    Parameters
    ----------
    factor : ndarray of complex, shape (n, bands)
        ``factor[j, d]`` is L[j + d, j].

    Returns
    -------
    ndarray, shape (n,)
    """
    n, bands = factor.shape
    result = np.empty(n)
    # Z holds the inverse among the last columns: Z[i % bands, j % bands] for i, j within `bands` of each other.
    z = np.zeros((bands, bands), dtype=np.complex128)
    row = np.empty(bands, dtype=np.complex128)
    for j in range(n - 1, -1, -1):
        reach = min(bands - 1, n - 1 - j)
        scale = 1.0 / factor[j, 0].real
        for d in range(1, reach + 1):  # Z[j + d, j] = -Σ_e Z[j + d, j + e] L[j + e, j] / L[j, j]
            total = 0.0 + 0.0j
            at = (j + d) % bands
            for e in range(1, reach + 1):
                total += z[at, (j + e) % bands] * factor[j, e]
            row[d] = -total * scale
        own = scale
        for e in range(1, reach + 1):  # Z[j, j] = (1 / L[j, j] - Σ_e conj(Z[j + e, j]) L[j + e, j]) / L[j, j]
            own -= (np.conj(row[e]) * factor[j, e]).real
        own *= scale
        here = j % bands
        for d in range(1, reach + 1):
            at = (j + d) % bands
            z[at, here] = row[d]
            z[here, at] = np.conj(row[d])
        z[here, here] = own
        result[j] = own
    return result
