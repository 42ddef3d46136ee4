"""Time of our order map and Vold-Kalman filter beside rota-order's, at equal resolution, with the errors of both.

``python tests/benchmarks/bench_orders.py [seconds] [repeats]`` (one core: ``taskset -c 0``). The signal is a run-up
with five orders of two shafts (ratio 31/104) and noise; both programs read the same array and are told the same speed.
Errors are against the formulas that made it: level of the orders in the map, complex amplitude by the filter, both away
from the ends. rota-order is GPL: it is run here and never imported by the package.

The last table is the budget: the survey of a run with third octaves, and its orders as the program has them (maps, cuts
of a fleet's orders, sidebands, resonances, Vold-Kalman filter of the strongest), within a hundredth of the record's
duration for each channel of 51.2 kHz.
"""

# ruff: noqa: E402 - threads are limited before numpy is imported

from __future__ import annotations

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import platform
import statistics
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS / "recording")]

from array_recording import recording_of
from figures import note
from made_up_run_ups import RunUp, db

from tdacoustic.fleet import Kinematics, load_fleet
from tdacoustic.measured import RunSpeed, orders_step, survey_recording
from tdacoustic.measured.orders_step import OrderSettings, run_orders
from tdacoustic.orders import (
    AngleResampler,
    CutMeter,
    EachFrame,
    Frames,
    MapMeter,
    OrderMap,
    OrderTrack,
    SpeedRows,
    TrackedOrder,
    VoldKalman,
    plan_line_frames,
)
from tdacoustic.speed import ShaftAngle
from tdacoustic.workflows.order_tracking import expected_orders

RATIO = 31.0 / 104.0
ORDERS = (
    (2.0, 1.0, 0.3, 1.0),
    (31.0, 0.5, -1.0, 1.0),
    (30.0, 0.1, 0.7, 1.0),
    (97.0, 0.2, 1.5, RATIO),
    (17.4, 0.3, 2.0, 1.0),
)
"""Order, rms, phase, ratio of its shaft."""
BANDWIDTH_HZ, RESOLUTION, HIGHEST, PER_TURN = 2.0, 0.1, 40.0, 100


def signal_of(run: RunUp) -> np.ndarray:
    return sum(run.order(*order) for order in ORDERS) + run.noise(1e-7)


def our_map(run: RunUp, samples: np.ndarray, meters: str = "map") -> OrderMap | None:
    """Order map, and with ``cuts`` the cuts of all orders by speed too, block by block."""
    angle = ShaftAngle(*run.nodes())
    resampler = AngleResampler(angle, run.rate_hz, HIGHEST, samples_per_turn=PER_TURN)
    plan = plan_line_frames(PER_TURN, RESOLUTION, overlap=0.75)
    rows = EachFrame(20000) if meters == "map" else SpeedRows.even(run.first_hz, run.last_hz, 60)
    readers: list[Any] = [MapMeter(plan, rows, len(samples), "order", HIGHEST, run.rate_hz)]
    if meters == "cuts":
        readers.append(CutMeter(plan, [2.0, 17.4, 30.0, 31.0], rows, len(samples), run.rate_hz))
    frames = Frames(plan, readers)
    for start in range(0, samples.shape[1], 1 << 18):
        frames.take(resampler.take(samples[:, start : start + (1 << 18)]))
    return readers[0].result()


def our_tracks(run: RunUp, samples: np.ndarray) -> tuple[OrderTrack, ...]:
    angle = ShaftAngle(*run.nodes())
    wheel = angle.at_ratio(RATIO, "wheelset")
    orders = [TrackedOrder(angle if ratio == 1.0 else wheel, order, BANDWIDTH_HZ) for order, _, _, ratio in ORDERS]
    return VoldKalman(orders, run.rate_hz, len(samples)).whole(samples)


def our_waveforms(run: RunUp, samples: np.ndarray) -> None:
    for track in our_tracks(run, samples):
        track.waveform(run.times)


def their_map(run: RunUp, samples: np.ndarray) -> Any:
    from rota.maps import rpm_order_map

    return rpm_order_map(
        samples.T, run.rate_hz, 60.0 * run.speed(run.times), order_resolution=RESOLUTION, max_order=HIGHEST,
        samples_per_rev=PER_TURN, overlap=0.75,
    )  # fmt: skip


def their_tracks(run: RunUp, samples: np.ndarray) -> Any:
    from rota.extract import order_waveform

    rpm = 60.0 * run.speed(run.times)
    shafts = [0 if ratio == 1.0 else 1 for *_, ratio in ORDERS]
    return order_waveform(
        samples.T, run.rate_hz, np.column_stack((rpm, RATIO * rpm)), [order for order, *_ in ORDERS],
        bandwidth=BANDWIDTH_HZ, shafts=shafts,
    )  # fmt: skip


def map_errors(axis: np.ndarray, power: np.ndarray) -> float:
    """Largest error in dB of the orders that lie on a line, over frames away from the ends."""
    inner = slice(len(power) // 20, -len(power) // 20)
    on_lines = ((order, rms) for order, rms, _, ratio in ORDERS if ratio == 1.0)
    return max(
        float(np.max(np.abs(db(np.sqrt(power[inner, np.argmin(np.abs(axis - order))]) / rms))))
        for order, rms in on_lines
    )


def track_errors(times: np.ndarray, amplitudes: np.ndarray) -> float:
    """Rms over orders and time of the complex error, over the order's rms; a second and more from the ends."""
    inner = (times > 1.0) & (times < times[-1] - 1.0)
    errors = [
        np.mean(np.abs(amplitudes[index, inner] / (rms * np.exp(1j * phase)) - 1.0) ** 2)
        for index, (_, rms, phase, _) in enumerate(ORDERS)
    ]
    return float(np.sqrt(np.mean(errors)))


def print_errors(run: RunUp, samples: np.ndarray) -> None:
    ours, theirs = our_map(run, samples), their_map(run, samples)
    tracks, waves = our_tracks(run, samples), their_tracks(run, samples)
    print(f"order map, largest error on lines: ours {map_errors(ours.axis, ours.mean_square[0]):.4f} dB, ", end="")
    print(f"rota {map_errors(theirs.axis, np.abs(theirs.values[:, :, 0].T) ** 2):.4f} dB")
    own = track_errors(tracks[0].times_s, np.array([track.amplitude[0] for track in tracks]))
    other = track_errors(run.times, waves.envelopes[:, :, 0].T / np.sqrt(2.0))
    print(f"Vold-Kalman, rms error over the order's rms: ours {own:.2e}, rota {other:.2e}\n")


def main(seconds: float = 60.0, repeats: int = 5) -> None:
    """Time all contestants in turn, several times, and print medians and ratios."""
    for rate_hz, channels, length in ((8192.0, 1, seconds), (51200.0, 1, seconds), (51200.0, 4, seconds)):
        run = RunUp(10.0, 50.0, length, rate_hz)
        samples = np.repeat(signal_of(run)[None], channels, axis=0)
        contestants: dict[str, Callable[[], object]] = {
            "ours: order map": lambda r=run, s=samples: our_map(r, s),
            "rota: order map": lambda r=run, s=samples: their_map(r, s),
            "ours: map and cuts by speed": lambda r=run, s=samples: our_map(r, s, "cuts"),
            "ours: Vold-Kalman, 5 orders of 2 shafts": lambda r=run, s=samples: our_tracks(r, s),
            "ours: the same, and 5 waveforms": lambda r=run, s=samples: our_waveforms(r, s),
        }
        if rate_hz < 10000.0:
            contestants["rota: Vold-Kalman, waveforms"] = lambda r=run, s=samples: their_tracks(r, s)
        times: dict[str, list[float]] = {name: [] for name in contestants}
        for repeat in range(repeats + 1):
            for name, contestant in contestants.items():
                start = time.perf_counter()
                contestant()
                if repeat:  # the first round warms caches and compiles
                    times[name].append(time.perf_counter() - start)
        print(f"{channels} channels x {length:g} s at {rate_hz:g} Hz, 10 to 50 turns/s; median of {repeats} rounds")
        report(times, channels * length, f"{channels} channels at {run.rate_hz:g} Hz")
        if rate_hz < 10000.0:
            print_errors(run, samples)
    budget(seconds, repeats)
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba", "rota-order"))
    print(f"Python {platform.python_version()}, {libraries}; {platform.machine()}, {os.cpu_count()} cores")


def budget(seconds: float, repeats: int) -> None:
    """Time survey and orders of a run as the program makes them."""
    drive = Kinematics.of(load_fleet(TESTS.parent / "calibration" / "crrc-freight" / "fleet.toml"))
    for channels in (1, 4):
        run = RunUp(10.0, 50.0, seconds, 51200.0)
        recording = recording_of(np.repeat(signal_of(run)[None], channels, axis=0), run.rate_hz, "acceleration")
        orders, curves = expected_orders(drive, (), "motor", (10.0, 50.0), 325.5, 0.5 * run.rate_hz)
        settings = OrderSettings(
            channels=recording.channels, steady=False, teller="n", turns_per_unit=1.0, shaft="motor", counted=True,
            ratios=(("wheelset", drive.wheelset_order),), orders=orders, curves=curves,
            carriers=("mesh x1", "mesh x2", "mesh x3"),
            spacings=(("motor shaft", 1.0), ("wheelset", drive.wheelset_order)),
            bandwidth=0.5, highest_order=325.5, resolution_hz=8.0, vold_kalman=True,
        )  # fmt: skip
        speed = RunSpeed((), (), (ShaftAngle(*run.nodes(), shaft="motor", channel="n"),))
        times: dict[str, list[float]] = {"survey with bands": [], "orders": []}
        for repeat in range(repeats + 1):
            start = time.perf_counter()
            survey_recording(recording, 8.0)
            middle = time.perf_counter()
            orders_of(settings, recording, speed)
            end = time.perf_counter()
            if repeat:
                times["survey with bands"].append(middle - start)
                times["orders"].append(end - middle)
        times["both: the budget is 100"] = [sum(pair) for pair in zip(*times.values(), strict=True)]
        print(f"{channels} channels x {seconds:g} s at {run.rate_hz:g} Hz, {len(orders)} orders of a fleet")
        report(times, channels * seconds)
        both = channels * seconds / statistics.median(times["both: the budget is 100"])
        note(f"survey and orders of a run-up, {channels} channels at 51.2 kHz", both, "x real time", budget=100.0)


def orders_of(settings: OrderSettings, recording: Any, speed: RunSpeed) -> Any:
    """Run the step on a recording of an array."""

    class Log:
        path = None

    orders_step.scan = lambda path: recording.logs[0]  # type: ignore[assignment]
    return run_orders(settings, (Log(),), speed)  # type: ignore[arg-type]


def report(times: dict[str, list[float]], channel_seconds: float, noted: str = "") -> None:
    print(f"{'':42} {'s':>8} {'x real time a channel':>22} {'rota over ours':>15}")
    for name, values in times.items():
        median = statistics.median(values)
        rival = "rota: order map" if "map" in name else "rota: Vold-Kalman, waveforms"
        ratio = ""
        if name.startswith("ours") and rival in times and "cuts" not in name:
            ratios = [other / own for own, other in zip(values, times[rival], strict=True)]
            ratio = f"{statistics.median(ratios):.1f}"
            if noted:
                what = f"{name.removeprefix('ours: ')}, {noted}"
                note(what, median, "s", "rota-order", statistics.median(times[rival]), ratios)
        print(f"{name:42} {median:8.3f} {channel_seconds / median:22.0f} {ratio:>15}")
    print()


if __name__ == "__main__":
    main(*(kind(text) for kind, text in zip((float, int), sys.argv[1:], strict=False)))
