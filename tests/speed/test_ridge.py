"""Speed from lines: combs of known speed, what is none, and a real run-up without its speed channel."""

from pathlib import Path

import numpy as np
import pytest

from tdacoustic.errors import AnalysisError
from tdacoustic.speed import CombOrder, RidgeSearch, RidgeSettings, SpeedProfile, refusal, speed_from_lines
from tdacoustic.speed.comb import distinct_orders, line_evidence
from tdacoustic.speed.comb_path import find_path

PUT_IN = "known input: lines of a known speed"

SHARED = Path(__file__).resolve().parents[3] / "shared"
RATE = 4096.0
ORDERS = (23.0, 46.0, 69.0, 1.0, 2.0)
EXPECTED = tuple(CombOrder(f"order {order:g}", order) for order in ORDERS)


def settings(**changes):
    values = {"orders": EXPECTED, "lowest_hz": 3.0, "highest_hz": 30.0, "acceleration_hz_s": 3.0, **changes}
    return RidgeSettings(**values)


def signal(speed_hz, seed=0, rms=0.3, orders=ORDERS, channels=1):
    """Orders of one amplitude in white noise of rms 1; `speed_hz` a sample."""
    rng = np.random.default_rng(seed)
    turns = np.cumsum(speed_hz) / RATE
    lines = sum(rms * np.sqrt(2.0) * np.cos(2.0 * np.pi * order * turns + rng.uniform(0.0, 6.3)) for order in orders)
    return lines + rng.standard_normal((channels, speed_hz.size))


def seconds(length):
    return np.arange(int(length * RATE)) / RATE


def off(profile, t, speed):
    return profile.speed / np.interp(profile.times_s, t, speed) - 1.0


def test_a_run_up_is_read_from_its_lines(conformance):
    t = seconds(15.0)
    speed = 8.0 + 0.8 * t
    got = speed_from_lines("acc", signal(speed), RATE, settings())
    assert got.reason is None and got.profile.unknown == ()
    worst = float(np.max(np.abs(off(got.profile, t, speed))))
    conformance("run-up from its lines, largest speed error", 0.0, worst, 3e-4, "1", PUT_IN)
    rms = float(np.sqrt(np.mean(off(got.profile, t, speed) ** 2)))
    conformance("run-up from its lines, rms speed error", 0.0, rms, 1e-4, "1", PUT_IN)
    assert np.median(got.profile.confidence) > 0.95
    assert got.rival_probability > 1e-12  # lines may always be something else's: no reading is beyond doubt
    assert {"order 23", "order 46", "order 69"} <= {name for name, part in got.heard if part > 0.5}


def test_stated_errors_cover_the_real_ones():
    t = seconds(15.0)
    speed = 8.0 + 0.8 * t
    inside = []
    for seed in range(4):
        profile = speed_from_lines("acc", signal(speed, seed), RATE, settings()).profile
        inside.append(np.abs(off(profile, t, speed)) * profile.speed < 2.0 * profile.error)
    assert np.mean(np.concatenate(inside)) > 0.9  # 0.95 of normal scatter


def test_a_constant_speed_is_read_too(conformance):
    """Its lines are fixed in Hz, like a tone; several of them in the right ratios are the speed all the same."""
    t = seconds(15.0)
    speed = np.full(t.size, 12.3)
    got = speed_from_lines("acc", signal(speed), RATE, settings())
    error = float(np.max(np.abs(off(got.profile, t, speed))))
    conformance("constant speed from its lines, largest error", 0.0, error, 1e-3, "1", PUT_IN)
    assert got.profile.doubtful and "stand still in Hz" in got.profile.notes[0]


def test_one_series_that_stands_still_is_a_carriers_as_well():
    t = seconds(15.0)
    x = signal(np.full(t.size, 12.3), orders=(23.0, 46.0, 69.0))
    blind = speed_from_lines("acc", x, RATE, settings())
    assert blind.profile is None
    told = speed_from_lines("acc", x, RATE, settings(start_hz=12.0))
    assert np.max(np.abs(told.profile.speed - 12.3)) < 0.0123


@pytest.mark.parametrize("seed", range(4))
def test_noise_has_no_speed(seed):
    x = np.random.default_rng(seed).standard_normal((2, seconds(12.0).size))
    got = speed_from_lines("acc", x, RATE, settings())
    assert got.profile is None and got.reason.startswith("no speed in the lines")


@pytest.mark.parametrize("tones", [(283.0,), (400.0, 800.0, 1200.0)])
def test_tones_fixed_in_hz_do_not_hold_a_run_up(tones):
    t = seconds(15.0)
    speed = 8.0 + 0.8 * t
    x = signal(speed) + sum(2.0 * np.cos(2.0 * np.pi * tone * t) for tone in tones)  # 20 dB above the orders
    got = speed_from_lines("acc", x, RATE, settings())
    assert np.mean(np.abs(off(got.profile, t, speed)) < 0.01) > 0.97


def test_resonances_fixed_in_hz_do_not_hold_a_run_up():
    """Four humps of the floor, 20 dB high and ten bins wide, at orders of 12 turns/s: a comb that stands still."""
    t = seconds(15.0)
    speed = 8.0 + 0.8 * t
    rng = np.random.default_rng(5)
    f = np.fft.rfftfreq(t.size, 1.0 / RATE)
    shape = 1.0 + sum(9.0 / (1.0 + ((f - 12.0 * order) / 12.0) ** 2) for order in (23.0, 46.0, 69.0, 92.0))
    x = signal(speed, rms=0.5)
    x = x + np.fft.irfft(np.fft.rfft(rng.standard_normal(t.size)) * (shape - 1.0), t.size)
    got = speed_from_lines("acc", x, RATE, settings(orders=(*EXPECTED, CombOrder("order 92", 92.0))))
    assert np.mean(np.abs(off(got.profile, t, speed)) < 0.01) > 0.97


def test_the_floor_of_a_resonance_is_no_line():
    """Noise alone, 20 dB up around 300 Hz: its evidence is that of floor everywhere, and a tone's little."""
    from tdacoustic.speed.comb import FIXED_NATS, Comb
    from tdacoustic.speed.comb_spectra import CombSpectra

    t = seconds(20.0)
    f = np.fft.rfftfreq(t.size, 1.0 / RATE)
    shape = 1.0 + 9.0 / (1.0 + ((f - 300.0) / 15.0) ** 2)
    x = np.fft.irfft(np.fft.rfft(np.random.default_rng(1).standard_normal(t.size)) * shape, t.size)
    x = x + np.cos(2.0 * np.pi * 700.0 * t)
    spectra = CombSpectra(0.4, RATE, t.size, 1, 1500.0)
    spectra.take(x[None])
    comb = Comb(spectra.over_floor(), spectra.bin_hz, 10.0, 1500.0, 0.1)
    at = comb.scores([CombOrder("a", 10.0)], np.array([30.0, 50.0, 70.0])).mean(axis=0)
    assert at[0] < 0.0 and at[1] < 0.0
    assert at[2] == pytest.approx(FIXED_NATS, abs=0.1)


def test_loud_lines_that_smear_in_long_frames_are_read_in_shorter_ones():
    """20 dB above the floor and 55 Hz/s fast: in 0.8 s they light what strange orders look at too."""
    t = seconds(12.0)
    speed = 8.0 + 0.8 * t
    x = signal(speed, rms=2.0)
    refused = RidgeSearch(settings(), RATE, t.size, 1, (0.8,))
    refused.take(x)
    assert "stand out no better than strange orders do" in refusal(refused.result())
    got = speed_from_lines("acc", x, RATE, settings())
    assert np.max(np.abs(off(got.profile, t, speed))) < 0.01


def test_one_line_alone_is_not_taken_for_a_speed():
    """It might be any of the orders."""
    t = seconds(15.0)
    got = speed_from_lines("acc", signal(8.0 + 0.8 * t, orders=(23.0,)), RATE, settings())
    assert got.profile is None and "stand out no better than strange orders do" in got.reason


def test_two_readings_that_fit_alike_are_told_apart_by_a_known_start():
    """Lines at 20 and 40 of a shaft whose orders 10, 20, 40 and 80 are expected alike."""
    orders = tuple(CombOrder(f"order {order:g}", order) for order in (10.0, 20.0, 40.0, 80.0))
    t = seconds(15.0)
    speed = 8.0 + 0.5 * t
    x = signal(speed, orders=(20.0, 40.0))
    blind = speed_from_lines("acc", x, RATE, settings(orders=orders, lowest_hz=3.0))
    assert blind.profile is None
    assert "times the speed as well" in blind.reason and blind.rival_probability > 0.2
    told = speed_from_lines("acc", x, RATE, settings(orders=orders, lowest_hz=3.0, start_hz=8.1))
    assert np.max(np.abs(off(told.profile, t, speed))) < 0.01


def test_a_rough_speed_over_time_guides():
    """The train speed, 4 % off."""
    orders = tuple(CombOrder(f"order {order:g}", order) for order in (10.0, 20.0, 40.0, 80.0))
    t = seconds(15.0)
    speed = 8.0 + 0.5 * t
    guide = SpeedProfile("gps", "motor", "1/s", t[::4096], 0.96 * speed[::4096])
    told = speed_from_lines("acc", signal(speed, orders=(20.0, 40.0)), RATE, settings(orders=orders, guide=guide))
    assert np.max(np.abs(off(told.profile, t, speed))) < 0.01


def test_lines_that_fall_silent_leave_a_gap_that_is_said():
    t = seconds(20.0)
    speed = 8.0 + 0.5 * t
    x = signal(speed)
    silent = (t > 8.0) & (t < 13.0)
    x[:, silent] = np.random.default_rng(9).standard_normal(int(silent.sum()))
    profile = speed_from_lines("acc", x, RATE, settings()).profile
    assert np.mean(np.abs(off(profile, t, speed)) < 0.01) > 0.95
    gap = max(profile.unknown, key=lambda span: span[1] - span[0])
    assert 7.0 < gap[0] < 9.0 and 12.0 < gap[1] < 14.0 and gap[2] == "no line of the shaft stands out"
    assert np.isnan(profile.speed_at(10.5)) and profile.doubtful
    assert any("not known from" in note for note in profile.notes)


def test_blocks_of_any_size_give_the_same_path():
    t = seconds(8.0)
    x = signal(8.0 + 0.8 * t, channels=2)
    whole, pieces = (RidgeSearch(settings(), RATE, t.size, 2) for _ in range(2))
    whole.take(x)
    for piece in np.split(x, [700, 701, 9000, 20000], axis=1):
        pieces.take(piece)
    assert np.array_equal(whole.result().path.speeds_hz, pieces.result().path.speeds_hz)


def test_a_long_record_is_looked_at_less_often():
    """Memory stays within bounds: an hour at 4096 Hz, of which only the plan is made."""
    from tdacoustic.speed.comb_spectra import MOST_CELLS, CombSpectra

    spectra = CombSpectra(0.2, RATE, int(3600 * RATE), 1, 1800.0)
    frames = 3600 * RATE / spectra.hop
    assert frames * 1800.0 / spectra.bin_hz <= 1.1 * MOST_CELLS


def test_frames_that_lie_apart_do_not_depend_on_the_blocks(monkeypatch):
    from tdacoustic.speed import comb_spectra

    monkeypatch.setattr(comb_spectra, "MOST_CELLS", 5000)
    x = np.random.default_rng(2).standard_normal((1, 40000))
    whole, pieces = (comb_spectra.CombSpectra(0.2, RATE, 40000, 1, 1800.0) for _ in range(2))
    whole.take(x)
    for piece in np.split(x, [500, 900, 3000, 3001, 17000], axis=1):
        pieces.take(piece)
    assert whole.hop > 2 * whole.length
    assert np.array_equal(whole.over_floor()[0], pieces.over_floor()[0]) and whole.times_s.size == pieces.times_s.size


def test_gaps_of_the_log_are_silence_and_no_nan():
    t = seconds(10.0)
    speed = 8.0 + 0.8 * t
    x = signal(speed)
    x[:, 20000:20200] = np.nan
    profile = speed_from_lines("acc", x, RATE, settings()).profile
    assert np.isfinite(profile.speed).all() and np.isfinite(profile.error).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"orders": ()}, "at least one order"),
        ({"lowest_hz": 0.0}, "0 < lowest_hz < highest_hz"),
        ({"acceleration_hz_s": 0.0}, "acceleration_hz_s must be > 0"),
    ],
)
def test_bad_settings_are_refused(changes, message):
    with pytest.raises(AnalysisError, match=message):
        settings(**changes)


@pytest.mark.parametrize(
    ("order", "options", "message"),
    [(0.0, {}, "must be > 0"), (1.0, {"presence": 1.0}, "between 0 and 1"), (1.0, {"reach": 0.6}, "0 and 0.5")],
)
def test_bad_orders_are_refused(order, options, message):
    with pytest.raises(AnalysisError, match=message):
        CombOrder("a", order, **options)


def test_records_without_room_for_a_speed_are_refused():
    with pytest.raises(AnalysisError, match="too short for a speed from lines"):
        RidgeSearch(settings(), RATE, 1000, 1)
    with pytest.raises(AnalysisError, match="where none can be heard"):
        RidgeSearch(settings(orders=(CombOrder("a", 2000.0),)), RATE, 100000, 1)


def test_orders_that_draw_one_line_count_once():
    merged = distinct_orders([CombOrder("a x3", 60.0), CombOrder("b x2", 60.06), CombOrder("a x4", 80.0)])
    assert [item.name for item in merged] == ["a x3, b x2", "a x4"]
    assert merged[0].presence == pytest.approx(0.75)


def test_the_evidence_of_floor_alone_is_below_nought_on_average():
    """A likelihood ratio has the mean 1 under the null (its logarithm less); here it is cut off above."""
    power = np.random.default_rng(0).exponential(1.0, 200000).astype(np.float32)
    nats = line_evidence(power, 0.5)
    assert np.mean(nats) < -0.3
    assert 0.7 < np.mean(np.exp(nats)) <= 1.01
    assert nats.min() >= np.log(0.5) - 1e-6


@pytest.mark.parametrize("seed", range(20))
def test_the_path_is_the_likeliest_of_all(seed):
    """Against every path of a small grid, its moves weighted alike."""
    import itertools

    from tdacoustic.speed.comb_path import TEMPER, UNHEARD, moves

    scores = (3.0 * np.random.default_rng(seed).standard_normal((5, 7))).astype(np.float32)
    speeds = 1.0 + np.arange(7.0)
    got = find_path(scores, np.zeros((5, 7)), speeds, 1.0, 2.0)
    kernel = moves(2.0, 1.0, 7)
    half = kernel.size // 2
    paths = np.array(list(itertools.product(range(7), repeat=5)))
    steps = np.diff(paths, axis=1)
    paths, steps = (values[np.max(np.abs(steps), axis=1) <= half] for values in (paths, steps))
    heard = np.logaddexp(np.log1p(-UNHEARD) + TEMPER * scores, np.log(UNHEARD))
    value = heard[np.arange(5), paths].sum(axis=1) + kernel[steps + half].sum(axis=1)
    assert np.array_equal(got.speeds_hz, speeds[paths[np.argmax(value)]])
    assert got.log_evidence == pytest.approx(np.log(np.exp(value).sum() / 7.0), abs=1e-6)
    near = np.abs(speeds[paths] - got.speeds_hz) <= 1.5
    chance = (np.exp(value)[:, None] * near).sum(axis=0) / np.exp(value).sum()
    assert got.confidence == pytest.approx(chance, abs=1e-6)


def test_a_real_run_up_without_its_speed_channel(conformance):
    """A car's sound; orders 2, 4 and 6 of the crank are all that is known (4 cylinders, 4 strokes: assumed)."""
    soundfile = pytest.importorskip("soundfile")
    path = SHARED / "recordings" / "ansys_accel_with_rpm" / "accel_with_rpm.wav"
    if not path.exists():
        pytest.skip("no shared recordings here")
    x, rate = soundfile.read(path)
    crank = x[:, 1] * 4821.4287109375 / 60.0  # full scale in the file's LEA chunk
    orders = tuple(CombOrder(f"order {order}", float(order)) for order in (2, 4, 6))
    known = RidgeSettings(orders, 10.0, 100.0, 8.0, "crank")  # 600 to 6000 rpm, 8 turns/s²: stated for any car
    got = speed_from_lines("microphone", x[:, :1].T, rate, known)
    error = off(got.profile, np.arange(crank.size) / rate, crank)
    source, note = (
        "recording: Ansys, accel_with_rpm.wav, its own speed channel",
        "the worst instant of a real recording",
    )
    conformance("car run-up without its speed channel, rms", 0.0, float(np.sqrt(np.mean(error**2))), 0.006, "1", source)
    conformance(
        "car run-up without its speed channel, largest", 0.0, float(np.abs(error).max()), 0.02, "1", source, note
    )
    assert got.profile.times_s[0] < 2.0 and got.profile.times_s[-1] > 19.0
