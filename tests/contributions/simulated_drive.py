"""A simulated drive whose contributions are known: sources, cross-talk between their sensors, paths to a microphone.

Imports numpy alone and nothing of the package. Spectra of whole records are multiplied and transformed back; truth is
the power of each source's own sound at the receiver, summed over the record's exact spectrum.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

RATE = 2048.0
KINDS = ("one way", "both ways", "both ways, in phase")


@dataclass(frozen=True)
class Drive:
    """Cross-talk amplitudes [to sensor, from source] with delays in s, paths to the receiver, noise."""

    gains: np.ndarray
    delays_s: np.ndarray
    path_gains: np.ndarray
    path_delays_s: np.ndarray
    sensor_noise: np.ndarray
    receiver_noise: float
    sensors_each: int = 1


def mixing(drive: Drive, frequencies: np.ndarray) -> np.ndarray:
    """(sensors, sources, lines); the diagonal is one."""
    turn = np.exp(-2j * np.pi * frequencies * drive.delays_s[..., None])
    return drive.gains[..., None] * turn


def paths(drive: Drive, frequencies: np.ndarray) -> np.ndarray:
    """(sources, lines), each with a resonance."""
    own = np.array([250.0, 410.0, 560.0])[: len(drive.path_gains), None]
    resonance = 1.0 / (1.0 - (frequencies / own) ** 2 + 0.4j * frequencies / own)
    return drive.path_gains[:, None] * resonance * np.exp(-2j * np.pi * frequencies * drive.path_delays_s[:, None])


def true_coherence(drive: Drive, source_power: np.ndarray, frequencies: np.ndarray) -> float:
    """Mean squared coherence of the first two sensors."""
    c = mixing(drive, frequencies)
    cross = np.einsum("jf,j,jf->f", c[0], source_power, c[1].conj())
    own = [np.einsum("jf,j->f", np.abs(c[i]) ** 2, source_power) + drive.sensor_noise[i] for i in (0, 1)]
    return float(np.mean(np.abs(cross) ** 2 / (own[0] * own[1])))


@dataclass
class Record:
    """One state's signals (sensors first, then the receiver) and each source's sound at the receiver, as a spectrum."""

    samples: np.ndarray
    parts: np.ndarray
    frequencies: np.ndarray
    tones_hz: tuple[float, ...] = field(default=())

    def true_power(self, source: int, low_hz: float, high_hz: float) -> float:
        inside = (self.frequencies >= low_hz) & (self.frequencies < high_hz)
        n = self.samples.shape[1]
        return float(2.0 * np.sum(np.abs(self.parts[source, inside]) ** 2) / n**2)


def record(drive: Drive, source_power, seconds: float, rng: np.random.Generator, tones=()) -> Record:
    """`tones`: (source, frequency in Hz, rms); broadband sources are white of the given density-like power."""
    n = int(seconds * RATE)
    count = len(source_power)
    sources = rng.standard_normal((count, n)) * np.sqrt(np.asarray(source_power, dtype=float))[:, None]
    time = np.arange(n) / RATE
    for source, frequency, rms in tones:
        sources[source] += np.sqrt(2.0) * rms * np.cos(2.0 * np.pi * (frequency * time + rng.random()))
    spectra = np.fft.rfft(sources, axis=1)
    frequencies = np.fft.rfftfreq(n, 1.0 / RATE)
    sensed = np.fft.irfft(np.einsum("ijf,jf->if", mixing(drive, frequencies), spectra), n, axis=1)
    sensed += rng.standard_normal(sensed.shape) * np.sqrt(drive.sensor_noise)[:, None]
    parts = paths(drive, frequencies) * spectra
    heard = np.fft.irfft(parts.sum(axis=0), n) + np.sqrt(drive.receiver_noise) * rng.standard_normal(n)
    return Record(np.vstack((sensed, heard)), parts, frequencies, tuple(tone[1] for tone in tones))


def random_drive(kind: str, coherence: float, rng: np.random.Generator, frequencies: np.ndarray) -> Drive:
    """Two sources; cross-talk scaled until the sensors' mean coherence is the one asked for, as far as it can be.

    `both ways`: delays of its own each way, one way at most as strong as the other, and that one no stronger than the
    sensor's own source, which bounds the coherence; `in phase`: no delay and equal, which adds up; `one way`: the
    second source in the first sensor. Paths' levels within ±6 dB, sensors' noise 25 to 40 dB down, the receiver's 5 to
    20 dB.
    """

    def made(c: float) -> Drive:
        back = {"one way": 0.0, "both ways": ratio, "both ways, in phase": 1.0}[kind] * c
        gains = np.array([[1.0, c], [back, 1.0]])
        held = np.zeros((2, 2)) if kind == "both ways, in phase" else delays
        return Drive(gains, held, path_gains, path_delays, noise, receiver_noise)

    ratio = rng.uniform(0.2, 1.0)
    delays = rng.uniform(0.0, 0.003, (2, 2)) * (1.0 - np.eye(2))
    path_gains = 10.0 ** (rng.uniform(-6.0, 6.0, 2) / 20.0)
    path_delays = rng.uniform(0.0, 0.005, 2)
    noise = 10.0 ** (-rng.uniform(25.0, 40.0, 2) / 10.0)
    receiver_noise = 10.0 ** (-rng.uniform(5.0, 20.0) / 10.0)
    low, high = 0.0, 30.0
    if kind != "one way":
        high = 0.98 if kind == "both ways, in phase" else 1.0  # no stronger than the sensor's own source
    for _ in range(50):
        middle = 0.5 * (low + high)
        if true_coherence(made(middle), np.ones(2), frequencies) < coherence:
            low = middle
        else:
            high = middle
    return made(0.5 * (low + high))
