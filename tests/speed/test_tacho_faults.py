"""A fault at a time in a tacho of known speed: what is said of it, and the error of the speed that comes of it."""

import numpy as np
import pytest

from tdacoustic.errors import AnalysisError
from tdacoustic.speed import EdgeFinder, LevelFinder, edge_directions, read_tacho, signed_reading

PUT_IN = "known input: tacho pulses of a known run-up"

RATE, PULSES, DURATION = 25600.0, 20, 12.0
T = np.arange(int(DURATION * RATE)) / RATE


def run_up(t):
    """Turns and turns/s: 5 to 17 turns/s at 1 turn/s²."""
    return 5.0 * t + 0.5 * t**2, 5.0 + t


def shaped(turns, per_rev=PULSES, rise=0.05, fall=0.05, duty=0.5, teeth=None):
    """Trapezoids in angle, 0 to 5 V; `teeth` moves each tooth by a part of a turn."""
    places = turns * per_rev
    if teeth is not None:  # the wheel's own angle, at which tooth k passes at k/N + teeth[k]
        whole = int(turns.max()) + 2
        knots = np.arange(-per_rev, whole * per_rev) / per_rev + np.tile(teeth, whole + 1)
        places = np.interp(turns, knots, np.arange(knots.size))
    phase = np.mod(places, 1.0)
    return 5.0 * np.clip(np.minimum(phase / rise, (duty + fall - phase) / fall), 0.0, 1.0)


def edges_of(x, rate=RATE):
    levels = LevelFinder(round(rate))
    levels.take(x)
    found = []
    for falling in (False, True):
        finder = EdgeFinder(*levels.result(), rate, falling)
        finder.take(x)
        found.append(finder.result())
    return found


def read(x, per_rev=PULSES, rate=RATE, **options):
    return read_tacho("t", *edges_of(x, rate), per_rev, rate, x.size / rate, **options)


def rms_error(reading, truth, inside=slice(1, -1)):
    """Relative rms error of the speed, without the first and the last value."""
    exact = truth(reading.times_s[inside])[1]
    return float(np.sqrt(np.mean((reading.speed[inside] / exact - 1.0) ** 2)))


def instants(per_rev=PULSES, duration=DURATION):
    """Exact instants of the run-up's pulses."""
    count = int(run_up(duration)[0] * per_rev)
    return -5.0 + np.sqrt(25.0 + 2.0 * np.arange(1, count) / per_rev)


def said(reading, words):
    return any(words in note for note in reading.notes)


def test_a_tacho_in_order_has_nothing_to_say(conformance):
    reading = read(shaped(run_up(T)[0]))
    assert (reading.missing, reading.double, reading.breaks, reading.pattern, reading.bandwidth_hz) == (
        0,
        0,
        (),
        None,
        None,
    )
    assert reading.direction == "rising" and not reading.doubtful and len(reading.notes) == 1
    conformance("tacho in order, rms speed error", 0.0, rms_error(reading, run_up), 1e-5, "1", PUT_IN)


@pytest.mark.parametrize("scatter_s", [2e-5, 1e-4, 2e-4])
def test_jitter_is_estimated_and_smoothed_away(scatter_s, conformance):
    """Of the pulse interval, 10 ms at the start and 3 ms at the end, up to 7 %."""
    exact = instants()
    errors, bare, stated = [], [], []
    for seed in range(8):
        edges = exact + np.random.default_rng(seed).normal(0.0, scatter_s, exact.size)
        reading = read_tacho("t", edges, None, PULSES, RATE, DURATION)
        assert reading.jitter_s == pytest.approx(scatter_s, rel=0.2)  # of 2600 edges: 3 % by chance
        errors.append(rms_error(reading, run_up, slice(5, -5)))
        stated.append(np.median(reading.error / reading.speed))
        plain = np.diff(np.interp(np.arange(0.0, 11.9, 0.05), edges, np.arange(edges.size) / PULSES)) / 0.05
        exact_speed = run_up(np.arange(0.025, 11.85, 0.05))[1]
        bare.append(np.sqrt(np.mean((plain / exact_speed - 1.0)[5:-5] ** 2)))
    what = f"jitter of {1e6 * scatter_s:.0f} us, rms speed error"
    conformance(what, 0.0, float(np.mean(errors)), 6e-4, "1", PUT_IN)
    assert np.mean(errors) < 1.1 * np.mean(bare)
    assert np.mean(stated) == pytest.approx(
        np.mean(errors), rel=0.4
    )  # one interval stands for those of the whole run-up
    assert said(reading, "smoothed to")


def test_a_bandwidth_that_is_asked_for_is_kept(conformance):
    """A speed that swings at 1 Hz: a Gaussian of 2 Hz half power passes 2^(-1/8) of it."""
    t = np.arange(0.0, 20.0, 1e-4)
    turns = 10.0 * t + 0.2 / (2.0 * np.pi) * (1.0 - np.cos(2.0 * np.pi * t))
    edges = np.interp(np.arange(1, int(turns[-1] * 60)) / 60, turns, t)
    reading = read_tacho("t", edges, None, 60, RATE, 20.0, bandwidth_hz=2.0)
    wave = np.exp(-2j * np.pi * reading.times_s)
    inside = (reading.times_s > 2.0) & (reading.times_s < 18.0)
    swing = 2.0 * np.abs(np.mean(((reading.speed - 10.0) * wave)[inside]))
    conformance(
        "swing of the speed of 0.2 turns/s after smoothing to 2 Hz",
        0.2 * 2.0**-0.125,
        float(swing),
        2e-3,
        "1/s",
        "analytic: Gaussian of 2 Hz half power",
    )
    assert said(reading, "smoothed to 2 Hz")


@pytest.mark.parametrize("part", [0.01, 0.05, 0.2])
def test_uneven_teeth_are_found_and_taken_off(part, conformance):
    rng = np.random.default_rng(7)
    teeth = part / PULSES * rng.standard_normal(PULSES)
    teeth -= teeth.mean()
    x = shaped(run_up(T)[0], teeth=teeth)
    reading = read(x)
    assert said(reading, "uneven teeth") and reading.pattern.turns > 100
    found = reading.pattern.deviation_turns
    first = int(np.argmin([np.sum((np.roll(teeth, -shift) - found) ** 2) for shift in range(PULSES)]))
    assert np.max(np.abs(found - np.roll(teeth, -first))) < 0.1 * part / PULSES  # flanks follow the pitch too
    error = rms_error(reading, run_up)
    conformance(f"uneven teeth, {100 * part:g} % of a pitch, rms speed error", 0.0, error, 3e-4, "1", PUT_IN)
    rising = edges_of(x)[0]
    plain = read_tacho("t", rising, None, PULSES + 0.5, RATE, DURATION)  # no whole number: nothing is taken off
    unmended = np.sqrt(np.mean((plain.speed * (PULSES + 0.5) / PULSES / run_up(plain.times_s)[1] - 1.0)[1:-1] ** 2))
    assert error < 0.5 * unmended or part == 0.01


def test_scatter_is_not_taken_for_uneven_teeth():
    for seed in range(10):
        exact = instants()
        edges = exact + np.random.default_rng(seed).normal(0.0, 2e-4, exact.size)
        assert read_tacho("t", edges, None, PULSES, RATE, DURATION).pattern is None


@pytest.mark.parametrize("pulses_per_rev", [60, 58])
def test_a_wheel_with_missing_teeth_is_recognised(pulses_per_rev, conformance):
    edges = instants(60)
    kept = edges[np.arange(edges.size) % 60 < 58]
    reading = read_tacho("t", kept, None, pulses_per_rev, RATE, DURATION)
    assert (reading.wheel.positions, reading.wheel.missing) == (60, 2)
    assert (reading.missing, reading.double, reading.doubtful, reading.pulses_per_rev) == (0, 0, False, 60)
    assert said(reading, "2 of every 60 teeth are missing by design")
    assert said(reading, "counts the teeth, 60 are taken") == (pulses_per_rev == 58)
    conformance(f"wheel 60-2 as {pulses_per_rev}, rms speed error", 0.0, rms_error(reading, run_up), 1e-4, "1", PUT_IN)


def test_a_gap_that_does_not_fit_is_doubted_and_random_gaps_are_no_wheel():
    edges = instants(60)
    reading = read_tacho("t", edges[np.arange(edges.size) % 60 < 58], None, 50, RATE, DURATION)
    assert reading.doubtful and said(reading, "which pulses_per_rev = 50 does not fit")
    lost = np.random.default_rng(1).choice(edges.size, 200, replace=False)
    reading = read_tacho("t", np.delete(edges, lost), None, 60, RATE, DURATION)
    assert reading.wheel is None and reading.missing > 150 and reading.doubtful


def test_the_sharper_edges_are_taken(conformance):
    """Rising flanks a third of a tooth long with noise on them, falling ones sharp."""
    noise = 0.2 * np.random.default_rng(2).standard_normal(T.size)
    reading = read(shaped(run_up(T)[0], rise=0.35, fall=0.01, duty=0.6) + noise)
    assert reading.direction == "falling" and said(reading, "falling edges taken")
    conformance("blunt rising edges, rms speed error", 0.0, rms_error(reading, run_up), 2e-4, "1", PUT_IN)
    reading = read(shaped(run_up(T)[0], rise=0.01, fall=0.35) + noise)
    assert reading.direction == "rising"


@pytest.mark.parametrize("duty", [0.05, 0.9])
def test_inverted_pulses_of_any_duty_cycle(duty, conformance):
    reading = read(5.0 - shaped(run_up(T)[0], rise=0.01, fall=0.01, duty=duty))
    assert reading.missing == reading.double == 0
    what = f"inverted pulses, duty {duty:g}, rms speed error"
    conformance(what, 0.0, rms_error(reading, run_up), 2e-4, "1", PUT_IN)


@pytest.mark.parametrize("samples", [3.0, 5.0])
def test_pulses_as_fast_as_the_samples_are_refused(samples, conformance):
    """17 turns/s at the end; with `samples` a pulse there."""
    rate = 17.0 * PULSES * samples
    t = np.arange(int(DURATION * rate)) / rate
    x = shaped(run_up(t)[0], rise=1e-6, fall=1e-6)
    if samples < 4.0:
        with pytest.raises(
            AnalysisError, match=r"tacho 't': 3(\.\d)? samples a pulse at .*; it takes at least 4, that is"
        ):
            read(x, rate=rate)
        return
    error = rms_error(read(x, rate=rate), run_up)
    # An edge is known to a sample: 0.29 samples rms, and of two of them 0.41 over 50 ms.
    conformance("five samples a pulse, rms speed error", 0.0, error, 0.41 / (0.05 * rate), "1", PUT_IN)


def test_pulses_that_stop_halfway_end_the_speed():
    x = shaped(run_up(T)[0])
    x[T > 7.0] = 0.0
    reading = read(x)
    assert reading.times_s[-1] < 7.0 and rms_error(reading, run_up) < 1e-4
    assert reading.doubtful and said(reading, "no pulses after 7.00 s: the speed is not known there")
    ((first, last, _),) = reading.unknown
    assert first == pytest.approx(7.0, abs=0.01) and last == DURATION


def test_a_signal_lost_inside_is_not_bridged():
    x = shaped(run_up(T)[0])
    x[(T > 4.0) & (T < 6.0)] = 0.0
    reading = read(x)
    assert said(reading, "no pulses from 3.99 s to 6.00 s") or said(reading, "no pulses from 4.00 s to 6.0")
    assert not np.any((reading.times_s > 4.01) & (reading.times_s < 5.99))
    assert rms_error(reading, run_up) < 1e-4
    assert reading.missing == 0 and reading.doubtful


def stop_and_go(t, way=1.0):
    """Brakes from 4 turns/s at 1 turn/s², stands from 4 s to 7 s, starts again (`way` -1: backwards)."""
    early, late = np.minimum(t, 4.0), np.maximum(t - 7.0, 0.0)
    return 4.0 * early - 0.5 * early**2 + way * 0.5 * late**2, np.where(t < 4.0, 4.0 - t, way * late)


def test_a_standstill_inside_is_speed_zero():
    reading = read(shaped(stop_and_go(T)[0]))
    assert said(reading, "stands from") and not reading.doubtful and reading.unknown == ()
    assert said(reading, "one tacho cannot tell in which direction it turns afterwards")
    inside = (reading.times_s > 4.2) & (reading.times_s < 6.8)
    assert inside.sum() > 20 and np.all(reading.speed[inside] == 0.0)
    away = ~((reading.times_s > 3.4) & (reading.times_s < 7.6))
    exact = stop_and_go(reading.times_s)[1]
    assert np.max(np.abs(reading.speed - exact)[away]) < 0.02  # a bend within an interval of 50 ms or four pulses
    assert np.max(np.abs(reading.speed - exact)) < 0.5  # the last tooth takes 0.3 s, and so do its neighbours together


def test_a_standstill_at_both_ends():
    t = np.clip(T - 3.0, 0.0, 6.0)
    turns = 1.5 * t - 9.0 / (2.0 * np.pi) * np.sin(2.0 * np.pi * t / 6.0) / 1.0  # 1.5 (1 - cos): from rest to rest
    reading = read(shaped(turns + 0.3))
    assert said(reading, "stands before") and said(reading, "stands after") and reading.unknown == ()
    assert np.all(reading.speed[(reading.times_s < 2.9) | (reading.times_s > 9.1)] == 0.0)


def test_a_reversal_is_seen_by_two_tachos():
    turns, _ = stop_and_go(T, way=-1.0)
    first, second = shaped(turns), shaped(turns - 0.25 / PULSES)
    reading = read(first)
    assert np.all(reading.speed >= 0.0)
    signed = signed_reading("b", reading, edge_directions(reading.edges_s, *edges_of(second)))
    moving = np.abs(stop_and_go(signed.times_s, -1.0)[1]) > 0.5
    way = np.sign(signed.speed[0])  # which of both is forwards, nobody says
    assert np.allclose(way * signed.speed[moving], stop_and_go(signed.times_s, -1.0)[1][moving], atol=0.02)
    assert said(signed, "turns backwards from 7.") or said(signed, "turns forwards from 7.")
    assert not said(signed, "one tacho cannot tell")


def test_the_angle_and_the_profile_go_with_the_reading():
    """On the run's axis, 100 s later; uneven teeth off the angle, nothing across a break."""
    rng = np.random.default_rng(3)
    teeth = 0.1 / PULSES * rng.standard_normal(PULSES)
    x = shaped(run_up(T)[0], teeth=teeth - teeth.mean())
    x[(T > 4.0) & (T < 6.0)] = 0.0
    reading = read(x)
    angle, profile = reading.angle("motor", 100.0), reading.profile("t", "motor", 100.0)
    t = np.arange(6.5, 11.5, 0.01)
    turned = angle.turns_at(100.0 + t) - run_up(t)[0]
    # The flanks follow the pitch, and so does their threshold: 3.5 % of a deviation of up to 0.3 teeth.
    assert np.ptp(turned) < 0.02 / PULSES
    assert np.all(np.isnan(angle.turns_at([104.5, 105.5])) & np.isnan(profile.speed_at([104.5, 105.5])))
    assert profile.speed_at(108.0) == pytest.approx(13.0, rel=2e-3) and profile.error.shape == profile.speed.shape
    noisy = read_tacho("t", instants() + rng.normal(0.0, 1e-4, instants().size), None, PULSES, RATE, DURATION)
    smooth = noisy.angle("motor")
    bare = np.std((noisy.turns - run_up(noisy.edges_s)[0])[100:-100])
    assert np.std((smooth.turns - run_up(noisy.edges_s)[0] - 0.0)[100:-100]) <= bare


def test_two_tachos_that_do_not_belong_together_are_refused():
    reading = read(shaped(run_up(T)[0]))
    with pytest.raises(AnalysisError, match="tacho 'b': the direction changes at"):
        signed_reading("b", reading, edge_directions(reading.edges_s, *edges_of(shaped(1.37 * run_up(T)[0]))))


def test_missing_and_double_pulses_do_not_shift_the_teeth():
    """Uneven teeth and 1 % faults together."""
    rng = np.random.default_rng(5)
    teeth = 0.05 / PULSES * rng.standard_normal(PULSES)
    count = int(run_up(DURATION)[0] * PULSES)
    angle = np.arange(1, count) / PULSES + (teeth - teeth.mean())[np.arange(1, count) % PULSES]
    edges = -5.0 + np.sqrt(25.0 + 2.0 * angle)
    faults = rng.permutation(np.arange(5, edges.size - 5, 5))[:52]
    edges = np.sort(np.concatenate((np.delete(edges, faults[::2]), edges[faults[1::2]] + 0.002)))
    reading = read_tacho("t", edges, None, PULSES, RATE, DURATION)
    assert (reading.missing, reading.double) == (26, 26) and said(reading, "uneven teeth")
    assert rms_error(reading, run_up) < 1.5e-3


@pytest.mark.parametrize("bandwidth_hz", [2.0, 8.0])
def test_the_stated_error_of_a_smoothed_speed(bandwidth_hz, conformance):
    """A constant speed with independent jitter; 20 seeds of some 100 independent values each leave 2 %."""
    edges = np.arange(1, 4000) / (15.0 * PULSES)
    got, said_error = [], []
    for seed in range(20):
        jittered = edges + np.random.default_rng(seed).normal(0.0, 1e-4, edges.size)
        reading = read_tacho("t", jittered, None, PULSES + 0.5, RATE, 13.4, bandwidth_hz=bandwidth_hz)
        got.append(np.std((reading.speed / np.median(reading.speed))[10:-10]))
        said_error.append(np.median(reading.error / reading.speed))
    ratio = float(np.sqrt(np.mean(np.square(got))) / np.mean(said_error))
    conformance(
        f"scatter over stated error at {bandwidth_hz:g} Hz",
        1.0,
        ratio,
        0.1,
        "1",
        "known input: jitter of known size, 20 seeds",
    )
