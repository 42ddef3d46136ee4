"""The orders of a run: known amplitudes come back by cut and by filter, and what cannot be had has its reason."""

from dataclasses import replace

import numpy as np
import pytest
from array_recording import recording_of
from made_up_run_ups import RunUp

from tdacoustic.errors import AnalysisError
from tdacoustic.measured import orders_step
from tdacoustic.measured.orders_step import OrderSettings, run_orders
from tdacoustic.measured.results import RunSpeed
from tdacoustic.orders import FrequencyCurve, NamedOrder
from tdacoustic.speed import ShaftAngle, SpeedProfile

PUT_IN = "known input: orders of known level and phase over a made-up run-up"

RATIO = 31.0 / 104.0
RUN = RunUp(10.0, 30.0, 40.0)
MESH = NamedOrder("mesh x1", "mesh", 31.0, "motor")
WHEEL = NamedOrder("wheelset x3", "wheelset", 3.0 * RATIO, "wheelset", RATIO)
ORDERS = (MESH, NamedOrder("mesh x2", "mesh", 62.0, "motor"), WHEEL)
RMS = {"mesh x1": 1.0, "mesh x2": 0.3, "wheelset x3": 0.2, "order 17.4": 0.1}


class Log:
    path = None


def settings_of(recording, **changes):
    base = OrderSettings(
        channels=recording.channels,
        steady=False,
        teller="n",
        turns_per_unit=1.0,
        shaft="motor",
        counted=True,
        ratios=(("wheelset", RATIO),),
        orders=ORDERS,
        curves=(),
        carriers=("mesh x1",),
        spacings=(("motor shaft", 1.0), ("wheelset", RATIO)),
        bandwidth=0.5,
        highest_order=120.0,
        resolution_hz=8.0,
        vold_kalman=True,
    )
    return replace(base, **changes)


def orders_of(monkeypatch, recording, speed, **changes):
    monkeypatch.setattr(orders_step, "scan", lambda path: recording.logs[0])
    return run_orders(settings_of(recording, **changes), (Log(),), speed)


def speed_of(run, **keys):
    return RunSpeed((), (), (ShaftAngle(*run.nodes(), shaft="motor", channel="n", **keys),))


def signal(run=RUN, seed=1):
    wheel = run.order(3.0, RMS["wheelset x3"], ratio=RATIO)
    return (
        run.order(31.0, RMS["mesh x1"], 0.5)
        + run.order(62.0, RMS["mesh x2"])
        + wheel
        + run.order(17.4, RMS["order 17.4"])
        + run.noise(1e-6, seed)
    )


@pytest.fixture(scope="module")
def found():
    patch = pytest.MonkeyPatch()
    recording = recording_of(np.array([signal(), 0.5 * signal(seed=2)]), RUN.rate_hz, "acceleration")
    yield orders_of(patch, recording, speed_of(RUN))
    patch.undo()


def of(channel, name, method="cut"):
    return next(item for item in channel.levels if (item.order.name, item.method) == (name, method))


@pytest.mark.parametrize("name", RMS)
def test_levels_of_known_orders_come_back(found, name, conformance):
    for channel, gain in zip(found.channels, (1.0, 0.5), strict=True):
        levels = of(channel, name)
        inner = slice(1, -1)  # the first and the last class hold few frames
        error_db = 10.0 * np.log10(levels.mean_square[inner] / (gain * RMS[name]) ** 2)
        what = f"{name} over a run-up, {channel.channel}: worst error of {error_db.size} speeds"
        conformance(what, 0.0, np.abs(error_db).max(), 0.15, "dB", PUT_IN)
        assert levels.usable.all()
        assert set(levels.reasons) == {""}
    assert 10 <= levels.speeds_hz.size <= 40


def test_the_order_that_nobody_named_is_found_and_named_so(found):
    assert [(order.name, order.kind) for order in found.orders if order.kind == "found"] == [("order 17.4", "found")]
    assert found.shaft == "motor" and found.speed_source == "n"


def test_phases_come_back_where_they_are_steady(found, conformance):
    phases = of(found.channels[0], "mesh x1").phase_rad[1:-1]
    conformance("phase of an order over a run-up, worst", 0.5, phases[np.argmax(np.abs(phases - 0.5))], 0.03, "rad",
                PUT_IN)  # fmt: skip


def test_the_strongest_are_tracked_jointly_and_agree(found, conformance):
    channel = found.channels[0]
    assert [track.order.name for track in channel.tracks] == ["mesh x1", "mesh x2", "wheelset x3"]
    assert of(channel, "wheelset x3", "vold_kalman").order.shaft == "wheelset"
    for name in ("mesh x1", "mesh x2"):
        levels = of(channel, name, "vold_kalman")
        good = np.array([reason == "" for reason in levels.reasons])
        error_db = 10.0 * np.log10(levels.mean_square[good] / RMS[name] ** 2)
        assert good.mean() > 0.8
        conformance(f"{name} by filter, worst", 0.0, np.abs(error_db).max(), 0.1, "dB", PUT_IN)
        assert levels.bandwidth == pytest.approx(2.0 * channel.tracks[0].bandwidth_hz / levels.speeds_hz)


def test_maps_have_the_orders_where_they_are(found):
    channel = found.channels[0]
    order_map, time_map = channel.map_over("speed", "order"), channel.map_over("time", "order")
    for item in (order_map, time_map):
        peak = item.axis[np.nanargmax(np.nanmean(item.mean_square, axis=0))]
        assert peak == pytest.approx(31.0, abs=item.resolution)
    assert np.all(np.diff(order_map.speeds_hz) > 0.0) and np.all(np.diff(time_map.times_s) > 0.0)
    frequency_map = channel.map_over("speed", "frequency")
    ridge = frequency_map.axis[np.nanargmax(frequency_map.mean_square, axis=1)]  # nothing beyond 0.4 of the rate
    assert np.abs(ridge - 31.0 * frequency_map.speeds_hz).max() < 12.0  # a class is 0.2 turns/s wide


def test_the_result_goes_through_the_store(found, tmp_path):
    from tdacoustic.steps.codec import decode, encode

    arrays = []
    back = decode(encode(found, arrays), arrays)
    assert back.channels[1].levels[0].reasons == found.channels[1].levels[0].reasons


def test_a_line_of_the_inverter_in_the_band_is_stated(monkeypatch):
    """600 Hz meets mesh x1 at 19.35 turns/s; the levels there are doubtful, and no others."""
    recording = recording_of(signal() + np.sin(2.0 * np.pi * 600.0 * RUN.times), RUN.rate_hz, "acceleration")
    curve = FrequencyCurve("fan", "motor", np.array([9.0, 31.0]), np.array([600.0, 600.0]))
    result = orders_of(monkeypatch, recording, speed_of(RUN), curves=(curve,), vold_kalman=False)
    levels = of(result.channels[0], "mesh x1")
    assert levels.disturbed.any()
    assert np.abs(levels.speeds_hz[levels.disturbed] - 600.0 / 31.0).max() < 0.6  # classes are 0.5 turns/s wide
    assert {reason for reason in levels.reasons if "fan" in reason} == {"fan within the band"}
    (line,) = result.channels[0].fixed
    assert line.kind == "line" and line.frequency_hz == pytest.approx(600.0, abs=1.0)


def test_a_resonance_is_told_from_the_orders(monkeypatch):
    def gain(order):
        return lambda t: 0.1 + 0.5 / np.sqrt(1.0 + ((order * RUN.speed(t) - 700.0) / 20.0) ** 2)

    held = tuple(NamedOrder(f"order {k}", "asked", float(k), "motor") for k in (26, 31, 40, 52, 60))
    x = sum(RUN.order(order.order, gain(order.order)) for order in held) + RUN.noise(1e-7)
    recording = recording_of(x, RUN.rate_hz, "acceleration")
    result = orders_of(monkeypatch, recording, speed_of(RUN), orders=held, vold_kalman=False)
    (resonance,) = result.channels[0].fixed
    assert resonance.kind == "resonance"
    assert resonance.frequency_hz == pytest.approx(700.0, rel=0.01)


def test_an_order_beyond_the_sampling_rate_has_its_reason(monkeypatch):
    far = NamedOrder("order 150", "asked", 150.0, "motor")
    recording = recording_of(signal(), RUN.rate_hz, "acceleration")
    result = orders_of(monkeypatch, recording, speed_of(RUN), orders=(MESH, far), highest_order=160.0)
    levels = of(result.channels[0], "order 150")  # 0.4 x 8192 Hz / 150 = 21.8 turns/s
    missing = ~np.isfinite(levels.mean_square)
    assert missing.any() and not missing.all()
    assert levels.speeds_hz[missing].min() > 21.0 and levels.speeds_hz[~missing].max() < 22.0
    assert all(
        ("no value: beyond order" in reason) == gone for reason, gone in zip(levels.reasons, missing, strict=True)
    )
    result = orders_of(monkeypatch, recording, speed_of(RUN), orders=(MESH, far), highest_order=100.0)
    levels = of(result.channels[0], "order 150")
    assert levels.reasons == ("no value: beyond order 100, up to which the run's orders were looked for",)


def test_a_tacho_that_falls_silent_and_gaps_in_the_log_leave_the_rest(monkeypatch, conformance):
    times, turns = RUN.nodes()
    kept = (times < 15.0) | (times > 22.0)
    breaks = ((float(times[times < 15.0][-1]), float(times[times > 22.0][0])),)
    angle = ShaftAngle(times[kept], turns[kept], "motor", None, breaks, (), "n")
    x = signal()
    x[round(30.0 * RUN.rate_hz) : round(30.5 * RUN.rate_hz)] = np.nan
    recording = recording_of(x, RUN.rate_hz, "acceleration")
    result = orders_of(monkeypatch, recording, RunSpeed((), (), (angle,)))
    levels = of(result.channels[0], "mesh x1")
    good = np.isfinite(levels.mean_square)
    silent = (levels.speeds_hz > 18.0) & (levels.speeds_hz < 20.7)  # 15 to 22 s are 17.5 to 21 turns/s
    assert not silent.any() and good.mean() > 0.9
    worst = np.abs(10.0 * np.log10(levels.mean_square[good])).max()
    conformance("mesh x1 beside a silent tacho and a gap", 0.0, worst, 0.2, "dB", PUT_IN)
    track = of(result.channels[0], "mesh x1", "vold_kalman")
    assert all(reason or np.isfinite(value) for reason, value in zip(track.reasons, track.mean_square, strict=True))


def test_a_phase_that_is_not_steady_is_not_stated(monkeypatch):
    """The phase swings by ±4 rad twice a second: levels hold, mean phases over a class mean nothing."""
    x = RUN.order(31.0, 1.0, lambda t: 4.0 * np.sin(4.0 * np.pi * t)) + RUN.noise(1e-6)
    recording = recording_of(x, RUN.rate_hz, "acceleration")
    result = orders_of(monkeypatch, recording, speed_of(RUN), orders=(MESH,), vold_kalman=(31.0,), bandwidth=4.0)
    for method in ("cut", "vold_kalman"):
        levels = of(result.channels[0], "mesh x1", method)
        lost = ~np.isfinite(levels.phase_rad)
        assert lost.mean() > 0.5
        assert all("phase" in reason or "dB above" in reason or "end" in reason or "no value" in reason
                   for reason, gone in zip(levels.reasons, lost, strict=True) if gone)  # fmt: skip


def test_a_train_speed_will_do_and_a_shaft_that_hardly_turns_will_not(monkeypatch):
    recording = recording_of(signal(), RUN.rate_hz, "acceleration")
    profile = SpeedProfile("v", None, "m/s", RUN.times[::400], 0.5 * RUN.speed(RUN.times[::400]))
    result = orders_of(monkeypatch, recording, RunSpeed((profile,)), teller="v", turns_per_unit=2.0, counted=False)
    assert np.abs(10.0 * np.log10(of(result.channels[0], "mesh x1").mean_square[1:-1])).max() < 0.3
    short = SpeedProfile("v", None, "m/s", np.array([0.0, 0.5, 1.0]), np.full(3, 5.0))
    with pytest.raises(AnalysisError, match=r"the motor turns .* times while its angle is known \(channel 'v'"):
        orders_of(monkeypatch, recording, RunSpeed((short,)), teller="v", turns_per_unit=2.0)
    with pytest.raises(AnalysisError, match="channel 'x' gives no speed"):
        orders_of(monkeypatch, recording, RunSpeed((profile,)), teller="x")


# ------------------------------------------------------------ constant speed

STEADY = RunUp(20.0, 20.0, 30.0)


@pytest.fixture(scope="module")
def steady():
    """Mesh with an amplitude modulation of 0.3 by the motor shaft, a line that does not turn with it, and noise."""
    patch = pytest.MonkeyPatch()
    turning = 1.0 + 0.3 * np.cos(2.0 * np.pi * STEADY.turns(STEADY.times))
    x = STEADY.order(31.0, 1.0) * turning + 0.7 * np.sin(2.0 * np.pi * 333.3 * STEADY.times) + STEADY.noise(1e-6)
    recording = recording_of(x, STEADY.rate_hz, "acceleration")
    yield orders_of(patch, recording, speed_of(STEADY), steady=True)
    patch.undo()


def test_a_steady_run_has_one_class_of_speed_and_no_maps(steady):
    (channel,) = steady.channels
    levels = of(channel, "mesh x1")
    assert levels.speeds_hz == pytest.approx([20.0], abs=1e-6)
    assert 10.0 * np.log10(levels.mean_square) == pytest.approx([0.0], abs=0.05)
    assert (channel.maps, channel.fixed, channel.tracks) == ((), (), ())


def test_what_repeats_every_turn_and_what_is_left(steady, conformance):
    motor, wheelset = steady.channels[0].averages
    assert (motor.shaft, wheelset.shaft) == ("motor", "wheelset")
    lines = np.abs(motor.amplitudes)
    conformance("mesh in the synchronous average", 1.0, lines[31], 0.005, "1", PUT_IN)
    conformance(
        "sidebands of the mesh in the synchronous average", 0.15, 0.5 * (lines[30] + lines[32]), 0.005, "1", PUT_IN
    )
    # The average of N turns keeps 1/N of what does not repeat: 600 turns, so 0.25 % of 0.7²/2 at most.
    conformance(
        "residual of the synchronous average: mean square of a line fixed in Hz",
        0.245,
        motor.residual_mean_square,
        0.01,
        "1",
        PUT_IN,
    )
    assert np.abs(wheelset.amplitudes)[104] == pytest.approx(1.0, abs=0.01)
    assert motor.periods == pytest.approx(600, abs=2)


def test_sidebands_tell_the_modulation(steady, conformance):
    families = {item.spacing: item.family for item in steady.channels[0].sidebands}
    conformance("amplitude modulation by the motor shaft", 0.3, families["motor shaft"].amplitude_depth[0], 0.01, "1",
                PUT_IN)  # fmt: skip
    assert families["motor shaft"].pairs[0] == 1 and families["wheelset"].pairs[0] == 0


def test_without_a_tacho_nothing_is_averaged_over_turns(monkeypatch):
    recording = recording_of(STEADY.order(31.0) + STEADY.noise(1e-6), STEADY.rate_hz, "acceleration")
    result = orders_of(monkeypatch, recording, speed_of(STEADY), steady=True, counted=False)
    assert result.channels[0].averages == ()


def test_a_thinned_track_holds_no_more_than_it_keeps():
    """A view of what the filter returns would hold all of it: memory would grow with the record."""
    from tdacoustic.measured.order_tracks import TrackSums
    from tdacoustic.orders import NamedOrder, OrderTrack, TrackedOrder
    from tdacoustic.speed import ShaftAngle

    angle = ShaftAngle([0.0, 1.0, 2.0], [0.0, 10.0, 20.0])
    sums = TrackSums(NamedOrder("o", "asked", 2.0, ""), (), (5.0, 15.0), 1, 100_000, 1.0)
    nodes = np.ones((1, 1000))
    piece = (np.linspace(0.0, 2.0, 1000), np.full(1000, 10.0), nodes.astype(complex), nodes, nodes.astype(np.int8))
    sums.take(OrderTrack(TrackedOrder(angle, 2.0, 1.0, "o"), *piece))
    (kept,) = sums._kept
    arrays = (kept.times_s, kept.speeds_hz, kept.amplitude, kept.error, kept.reason)
    assert all(array.base is None and array.shape[-1] == 20 for array in arrays)


def test_stretches_of_a_long_run_are_left_as_they_end(monkeypatch):
    """Whatever the blocks: a stretch that has ended before the log does is put away, and stops nothing."""
    recording = recording_of(signal(), RUN.rate_hz, "acceleration")
    breaks = ((8.0, 8.5), (30.0, 30.5))
    times, turns = RUN.nodes()
    known = ~np.any([(times > first + 1e-9) & (times < last - 1e-9) for first, last in breaks], axis=0)
    speed = RunSpeed((), (), (ShaftAngle(times[known], turns[known], shaft="motor", channel="n", breaks=breaks),))
    whole = orders_of(monkeypatch, recording, speed, vold_kalman=False)
    monkeypatch.setattr(orders_step, "BLOCK_BYTES", 8 * 8192)
    cut = orders_of(monkeypatch, recording, speed, vold_kalman=False)
    for one, other in zip(whole.channels[0].levels, cut.channels[0].levels, strict=True):
        np.testing.assert_allclose(other.mean_square, one.mean_square, rtol=1e-9)
    mesh = cut.channels[0].levels[0]
    assert np.nanmax(np.abs(10.0 * np.log10(mesh.mean_square))) < 0.2


def test_orders_that_four_digits_do_not_tell_apart_have_names_of_their_own():
    settings = orders_step.OrderSettings(
        channels=(), steady=False, teller="n", turns_per_unit=1.0, shaft="motor", counted=True, ratios=(), orders=(),
        curves=(), carriers=(), spacings=(), bandwidth=0.05, highest_order=2000.0, resolution_hz=8.0, vold_kalman=False,
    )  # fmt: skip
    names = [order.name for order in orders_step._named((17.4, 300.06, 300.12), settings)]
    assert names == ["order 17.4", "order 300.1", "order 300.12"]
