"""What is in the signals, looked at with plain numpy: lines, floors, levels, cross-talk, motion."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from tdacoustic.errors import RecipeError
from tdacoustic.synthesis import make_run, parse_recipe, plan_runs

RATE = 8192.0
ASKED = "known input: what the recipe of a synthetic log asks for, read from its samples by plain numpy"
MOTOR_HZ_AT_40 = 40 / 3.6 / (np.pi * 1.05112) * 104 / 31  # physics.md, section 1: n = V / (pi D) z2/z1


def one_run(content, seed=5, index=0):
    recipe = parse_recipe(content)
    return recipe, make_run(recipe, plan_runs(recipe)[index], seed)


def db(ratio):
    return 20 * np.log10(ratio)


def quiet(content):
    for channel in content["channel"]:
        if "floor" in channel:
            channel["floor"] = [[100, -100]]
    return content


def test_speeds_and_mesh_are_those_of_table_1(base):
    # paper, Table 1: rounding of the last printed digit; 1015.90 is a misprint of 1015.94 (physics.md, section 1)
    speeds = {20: (338.65, 174.97), 30: (507.97, 262.45), 40: (677.30, 349.94), 50: (846.61, 437.42)}
    base["condition"] = [{"name": str(v), "train_speed_km_h": v} for v in speeds]
    recipe = parse_recipe(base)
    for plan, (rpm, mesh_hz) in zip(plan_runs(recipe), speeds.values(), strict=True):
        motion = make_run(recipe, plan, 1).motion
        assert 60 * motion.motor_speed_hz.mean() == pytest.approx(rpm, abs=0.02)
        assert motion.motor_speed_hz.mean() * motion.mesh_order() == pytest.approx(mesh_hz, abs=0.01)


@pytest.mark.parametrize("level_db", [40.0, 94.0])
def test_a_line_has_its_rms_within_a_hundredth_of_a_decibel(base, level_db, conformance):
    base["condition"][0]["line"] = [{"source": "motor", "frequency_hz": 926.3, "level_db": {"mic": level_db}}]
    _, run = one_run(quiet(base))
    spectrum = np.fft.rfft(run.channels["mic"].signal)
    peak_hz = np.argmax(np.abs(spectrum)) * RATE / run.motion.time_s.size
    assert peak_hz == pytest.approx(926.3, abs=RATE / run.motion.time_s.size)
    rms = np.sqrt(np.mean(run.channels["mic"].signal ** 2))
    conformance(f"synthetic line of {level_db:g} dB", level_db, db(rms / 20e-6), 0.01, "dB", ASKED)


def test_lines_of_every_kind_stand_at_their_frequency(base):
    base["condition"][0] |= {
        "carrier_hz": 463.0,
        "line": [
            {"source": "motor", "carrier": 2, "level_db": 120},
            {"source": "motor", "carrier": 2, "order": 4, "level_db": 110},
            {"source": "gearbox", "mesh": 2, "level_db": 115},
            {"source": "wheelset", "order": 30, "shaft": "wheelset", "level_db": {"gearbox_z": 105}},
        ],
    }
    _, run = one_run(base)
    window = np.hanning(run.motion.time_s.size)

    def level_at(channel, frequency_hz):
        spectrum = np.abs(np.fft.rfft(run.channels[channel].signal * window)) * 2 / window.sum() / np.sqrt(2)
        index = round(frequency_hz * run.motion.time_s.size / RATE)
        # energy of the main lobe, divided by the Hann window's noise bandwidth of 1.5 bins
        return db(np.sqrt(np.sum(spectrum[index - 4 : index + 5] ** 2) / 1.5) / 1e-6)

    # 0.05 dB: the floor within nine bins of 1/8 Hz lies 40 dB and more below
    assert level_at("motor_z", 926.0) == pytest.approx(120, abs=0.05)
    assert level_at("motor_z", 926.0 + 4 * MOTOR_HZ_AT_40) == pytest.approx(110, abs=0.05)
    assert level_at("gearbox_z", 2 * 31 * MOTOR_HZ_AT_40) == pytest.approx(115, abs=0.05)
    assert level_at("gearbox_z", 30 * MOTOR_HZ_AT_40 * 31 / 104) == pytest.approx(105, abs=0.05)


def test_the_second_of_two_pairs_in_series_turns_with_the_first_ones_wheel(base):
    base["kinematics"]["gear_pair"] = [{"name": "a", "teeth": [20, 60]}, {"name": "b", "teeth": [25, 50]}]
    _, run = one_run(base)
    wheel_hz = 40 / 3.6 / (np.pi * 1.05112)
    assert run.motion.motor_speed_hz.mean() == pytest.approx(6 * wheel_hz)
    assert run.motion.mesh_order("a") == 20
    assert run.motion.mesh_order("b") == pytest.approx(25 / 3)


def test_floor_density_is_the_prescribed_one(base, conformance):
    base["duration_s"] = 60.0
    _, run = one_run(base)
    n = run.motion.time_s.size
    density = 2 * np.abs(np.fft.rfft(run.channels["motor_z"].signal)) ** 2 / (RATE * n)
    frequency = np.fft.rfftfreq(n, 1 / RATE)
    for low, high in [(20, 40), (90, 110), (500, 800), (2000, 3000)]:
        inside = (frequency >= low) & (frequency < high)
        level = np.interp(np.log(frequency[inside]), np.log([10, 100, 4096]), [60, 70, 50])
        expected = 1e-12 * 10 ** (level / 10)
        # mean of m exponential ratios: standard deviation 1/sqrt(m); 4.5 of them hold for 99.999 %
        tolerance, ratio = 4.5 / np.sqrt(inside.sum()), np.mean(density[inside] / expected)
        note = "four and a half times the scatter of so few lines" if tolerance > 0.1 else ""
        what = f"floor of a synthetic log, {low} to {high} Hz, over that asked for"
        conformance(what, 1.0, ratio, tolerance, "1", ASKED, note)


def test_a_hump_stands_on_the_floor_at_its_height(base):
    base["duration_s"] = 60.0
    base["channel"][1]["hump"] = [{"frequency_hz": 1000, "width_hz": 200, "height_db": 10}]
    _, run = one_run(base)
    n = run.motion.time_s.size
    density = 2 * np.abs(np.fft.rfft(run.channels["gearbox_z"].signal)) ** 2 / (RATE * n)
    frequency = np.fft.rfftfreq(n, 1 / RATE)
    top = density[np.abs(frequency - 1000) < 10].mean()
    half = density[np.abs(np.abs(frequency - 1000) - 100) < 5].mean()
    # 1200 bins each: 4.5 standard deviations are 13 %, 0.6 dB
    assert 10 * np.log10(top / 1e-12) == pytest.approx(70.0, abs=0.6)
    assert (half - 1e-6) / (top - 1e-6) == pytest.approx(0.5, rel=0.2)


@pytest.mark.parametrize("fraction", [None, 0.3])
def test_the_overall_level_is_hit_exactly(base, fraction, conformance):
    condition = base["condition"][0]
    condition["line"] = [
        {"source": "motor", "frequency_hz": 926, "level_db": {"mic": 75}},
        {"source": "motor", "frequency_hz": 300, "prominence_db": {"mic": 15}},
    ]
    condition["level_db"] = {"receiver": 88.3}
    if fraction is not None:
        condition["line_fraction"] = {"receiver": fraction}
    _, run = one_run(base)
    signal = run.channels["mic"].signal
    spectrum = np.fft.rfft(signal)
    frequency = np.fft.rfftfreq(signal.size, 1 / RATE)
    inside = (frequency >= 20) & (frequency <= 0.4 * RATE)
    rms = np.sqrt(2 * np.sum(np.abs(spectrum[inside]) ** 2)) / signal.size
    what = "overall level of a synthetic log" + (f", lines of {fraction:g} of it" if fraction else "")
    conformance(what, 88.3, db(rms / 20e-6), 1e-6, "dB", ASKED)
    if fraction is not None:
        lines = run.channels["mic"].lines_rms
        assert (lines / rms) ** 2 == pytest.approx(fraction, rel=1e-9)


def test_prominence_is_over_the_floor_in_one_noise_bandwidth(base, fitted_rms):
    base["prominence_bandwidth_hz"] = 2.0
    base["condition"][0]["line"] = [{"source": "decoy", "frequency_hz": 400, "prominence_db": 20}]
    _, run = one_run(base)
    rms = fitted_rms(run.channels["mic"].signal, 400.0 * run.motion.time_s)
    expected = 45 + 10 * np.log10(2.0) + 20
    # the floor in one bin of 1/8 Hz lies 32 dB under the line: 4 standard deviations are 0.7 dB at worst
    assert db(rms / 20e-6) == pytest.approx(expected, abs=0.7)
    assert all(not channel.lines for name, channel in run.channels.items() if name != "mic")


def test_a_level_that_the_lines_exceed_is_refused(base):
    base["condition"][0] |= {
        "line": [{"source": "motor", "frequency_hz": 926, "level_db": {"mic": 95}}],
        "level_db": {"mic": 88.0},
    }
    with pytest.raises(RecipeError, match=r"level_db = 88\.00 of channel 'mic' .* lines alone give 95\.00 dB"):
        one_run(base)


@pytest.mark.parametrize("gain_db", [-26.0, -6.0])
def test_cross_talk_of_lines_has_its_level_and_broadband_its_coherence(base, gain_db, fitted_rms, conformance):
    base["duration_s"] = 60.0
    base["channel"][0]["floor"] = [[100, 80]]
    base["channel"][1]["floor"] = [[100, -40]]
    base["path"] = [
        {
            "from": "motor",
            "to": "gearbox",
            "gain_db": gain_db,
            "broadband_gain_db": gain_db - 3,
            "delay_s": 0.002,
            "coherence": 0.6,
        }
    ]
    base["condition"][0]["line"] = [{"source": "motor", "frequency_hz": 926, "level_db": 140}]
    _, run = one_run(base)
    source, target = run.channels["motor_z"].signal, run.channels["gearbox_z"].signal
    held = {line.line: line for line in run.channels["gearbox_z"].lines}["motor Hz 926"]
    assert held.via == "path from motor"
    assert db(held.rms / 1e-6) == pytest.approx(140 + gain_db, abs=0.01)
    # the coherent part alone stands still: 0.6 of the energy, the rest within 0.5 Hz of the line
    steady = fitted_rms(target, 926.0 * run.motion.time_s)
    assert steady**2 / held.rms**2 == pytest.approx(0.6, abs=0.02)

    blocks = 120
    spectra_source = np.fft.rfft(source.reshape(blocks, -1) * np.hanning(source.size // blocks), axis=1)
    spectra_target = np.fft.rfft(target.reshape(blocks, -1) * np.hanning(source.size // blocks), axis=1)
    frequency = np.fft.rfftfreq(source.size // blocks, 1 / RATE)
    inside = (frequency > 1200) & (frequency < 3000)
    cross = np.mean(np.conj(spectra_source) * spectra_target, axis=0)[inside]
    power_source = np.mean(np.abs(spectra_source) ** 2, axis=0)[inside]
    power_target = np.mean(np.abs(spectra_target) ** 2, axis=0)[inside]
    gain = 10 * np.log10(power_target.mean() / power_source.mean())
    conformance(f"broadband cross-talk of {gain_db - 3:g} dB in a synthetic log", gain_db - 3, gain, 0.1, "dB", ASKED)
    # bias of the estimate at 120 blocks: (1 - 0.6)²/120; a delay of 2 ms of a 500 ms block takes below 1 %
    coherence = np.mean(np.abs(cross) ** 2 / (power_source * power_target))
    conformance(f"coherence of cross-talk of {gain_db - 3:g} dB in a synthetic log", 0.6, coherence, 0.02, "1", ASKED)
    slope = np.polyfit(frequency[inside], np.unwrap(np.angle(cross)), 1)[0]
    assert -slope / (2 * np.pi) == pytest.approx(0.002, rel=0.01)


def test_a_channel_that_the_line_names_gets_nothing_by_path(base):
    base["path"] = [{"from": "motor", "to": "gearbox", "gain_db": -10}]
    base["condition"][0]["line"] = [
        {"source": "motor", "frequency_hz": 926, "level_db": {"motor": 120, "gearbox_z": 90}}
    ]
    _, run = one_run(base)
    (held,) = run.channels["gearbox_z"].lines
    assert held.via == "recipe"
    assert db(held.rms / 1e-6) == pytest.approx(90, abs=0.01)


def test_a_more_sensitive_sensor_reads_everything_higher(base):
    base["path"] = [{"from": "motor", "to": "gearbox", "gain_db": -10}]
    base["condition"][0]["line"] = [
        {"source": "motor", "frequency_hz": 926, "level_db": 120},
        {"source": "gearbox", "mesh": 1, "level_db": 115},
    ]
    _, plain = one_run(base)
    base["channel"][1]["gain_db"] = 20.0
    _, gained = one_run(base)
    np.testing.assert_allclose(gained.channels["gearbox_z"].signal, 10 * plain.channels["gearbox_z"].signal)
    np.testing.assert_allclose(gained.channels["motor_z"].signal, plain.channels["motor_z"].signal)


def test_wander_has_its_rms_and_moving_lines_follow_the_angle(base, fitted_rms):
    base["kinematics"] |= {"speed_wander": 0.005, "mesh_excess": 0.01}
    base["condition"][0]["line"] = [
        {"source": "gearbox", "mesh": 3, "level_db": 120},
        {"source": "gearbox", "frequency_hz": 1500, "level_db": 110},
    ]
    _, run = one_run(base)
    speed = run.motion.motor_speed_hz
    assert np.std(speed) / speed.mean() == pytest.approx(0.005, rel=1e-9)
    assert speed.mean() == pytest.approx(1.01 * MOTOR_HZ_AT_40, rel=1e-12)
    changes = np.abs(np.fft.rfft(speed - speed.mean())) ** 2
    frequency = np.fft.rfftfreq(speed.size, 1 / RATE)
    assert changes[frequency > 0.51].sum() < 1e-9 * changes.sum()
    signal = run.channels["gearbox_z"].signal
    assert db(
        fitted_rms(signal, 93 * cumulative_trapezoid(speed, run.motion.time_s, initial=0.0)) / 1e-6
    ) == pytest.approx(120, abs=0.02)
    assert db(fitted_rms(signal, 1500 * run.motion.time_s) / 1e-6) == pytest.approx(110, abs=0.1)
    # the moving line does not stand still: at one frequency only part of it is found
    assert db(fitted_rms(signal, 93 * speed.mean() * run.motion.time_s) / 1e-6) < 117


@pytest.mark.parametrize("profile", ["linear", "smooth"])
def test_a_run_up_goes_from_one_speed_to_the_other(base, profile, fitted_rms):
    base["condition"][0] |= {"train_speed_km_h": 20, "train_speed_end_km_h": 60, "speed_profile": profile}
    base["condition"][0]["line"] = [{"source": "gearbox", "mesh": 2, "level_db": 120}]
    _, run = one_run(base)
    assert run.motion.nominal_km_h[[0, -1]] == pytest.approx([20, 60])
    assert run.motion.nominal_km_h.mean() == pytest.approx(40, abs=1e-9)
    assert run.motion.motor_turns[-1] == pytest.approx(8 * MOTOR_HZ_AT_40, rel=1e-4)
    turns = cumulative_trapezoid(run.motion.motor_speed_hz, run.motion.time_s, initial=0.0)
    assert db(fitted_rms(run.channels["gearbox_z"].signal, 62 * turns) / 1e-6) == pytest.approx(120, abs=0.02)


def test_a_line_beyond_half_the_rate_is_refused(base):
    base["condition"][0] |= {"train_speed_end_km_h": 120.0, "line": [{"source": "gearbox", "mesh": 4, "level_db": 90}]}
    with pytest.raises(RecipeError, match=r"'gearbox mesh 4' runs from 1399.* it must stay within"):
        one_run(base)


def test_repeats_scatter_and_keep_their_energy_mean(base):
    base["condition"][0] |= {
        "runs": 6,
        "repeat_sigma_db": 1.5,
        "level_db": {"mic": 84.0},
        "line": [{"source": "motor", "frequency_hz": 926, "level_db": 120}],
    }
    recipe = parse_recipe(base)
    plans = plan_runs(recipe)
    assert [plan.name for plan in plans] == [f"40#{k}" for k in range(1, 7)]
    runs = [make_run(recipe, plan, 5) for plan in plans]
    for channel, reference, level in [("mic", 20e-6, 84.0), ("motor_z", 1e-6, 120.0)]:
        signal = [run.channels[channel] for run in runs]
        rms = np.array([s.overall_rms if channel == "mic" else s.lines[0].rms for s in signal])
        assert db(np.sqrt(np.mean(rms**2)) / reference) == pytest.approx(level, abs=0.01)
        assert 0.4 < np.std(db(rms)) < 3.5
    assert np.corrcoef(runs[0].channels["mic"].signal, runs[1].channels["mic"].signal)[0, 1] < 0.1


def test_background_holds_the_mains_alone_and_lower_floors(base):
    base["line"] = [
        {"source": "mains", "frequency_hz": 50, "level_db": {"mic": 70}},
        {"source": "motor", "frequency_hz": 926, "level_db": 120},
    ]
    base["background"] = {"floor_gain_db": -12}
    _, test = one_run(base)
    _, rest = one_run(base, index=1)
    assert rest.plan.kind == "background"
    assert [line.line for line in rest.channels["mic"].lines] == ["mains Hz 50"]
    assert not rest.channels["motor_z"].lines
    assert db(rest.channels["gearbox_z"].floor_gain) == pytest.approx(-12)
    ratio = rest.channels["gearbox_z"].broadband_rms / test.channels["gearbox_z"].broadband_rms
    assert db(ratio) == pytest.approx(-12, abs=0.2)
    assert np.all(rest.tachos["tacho"].voltage_v == 0)


def test_a_further_line_leaves_all_else_as_it_was(base):
    _, before = one_run(base)
    base["condition"][0]["line"] = [{"source": "motor", "frequency_hz": 926, "level_db": 120}]
    _, after = one_run(base)
    np.testing.assert_array_equal(before.channels["gearbox_z"].signal, after.channels["gearbox_z"].signal)
    added = after.channels["motor_z"].signal - before.channels["motor_z"].signal
    assert db(np.sqrt(np.mean(added**2)) / 1e-6) == pytest.approx(120, abs=0.01)


def test_a_path_turns_a_moving_line_by_its_delay(base):
    base["path"] = [{"from": "motor", "to": "gearbox", "gain_db": -6, "delay_s": 0.003}]
    base["condition"][0] |= {"train_speed_km_h": 20, "train_speed_end_km_h": 60}
    base["condition"][0]["line"] = [{"source": "motor", "order": 40, "level_db": 120}]
    _, run = one_run(quiet(base))
    turns = 40 * cumulative_trapezoid(run.motion.motor_speed_hz, run.motion.time_s, initial=0.0)
    frequency, phases = [], []
    for block in np.array_split(np.arange(run.motion.time_s.size), 64):
        carrier = np.exp(-2j * np.pi * turns[block]) * np.hanning(block.size)
        source, target = (np.sum(run.channels[name].signal[block] * carrier) for name in ("motor_z", "gearbox_z"))
        frequency.append(40 * run.motion.motor_speed_hz[block].mean())
        phases.append(np.angle(target / source))
    slope = np.polyfit(frequency, np.unwrap(phases), 1)[0]
    assert -slope / (2 * np.pi) == pytest.approx(0.003, rel=1e-3)


def test_a_resonance_lifts_a_line_that_passes_it(base):
    """By `height_db` at its top and by half the power of the lifted part at half its width, measured over the speed."""
    base["channel"][1]["resonance"] = [{"frequency_hz": 400.0, "width_hz": 40.0, "height_db": 14.0}]
    base["condition"][0] |= {"train_speed_end_km_h": 60, "duration_s": 60.0}
    base["condition"][0]["line"] = [{"source": "gearbox", "mesh": 1, "level_db": {"gearbox_z": 120.0}}]
    _, run = one_run(quiet(base))
    (line,) = run.lines
    envelope = 2.0 * np.abs(np.convolve(run.channels["gearbox_z"].signal * np.exp(-2j * np.pi * line.turns), WINDOW))
    envelope = envelope[WINDOW.size // 2 :][: line.turns.size] / np.sqrt(2.0) / 1e-6
    for frequency, gain in ((400.0, 5.0118723), (390.0, abs(1 + 4.0118723 * 15600j / (160000 - 152100 + 15600j)))):
        at = int(np.argmin(np.abs(line.frequency_hz - frequency)))
        # A sweep of 3 Hz/s through 40 Hz: the top of a linear resonance is lower and later by far less than 0.1 dB.
        assert db(envelope[at]) == pytest.approx(120.0 + db(gain), abs=0.1)


WINDOW = np.hanning(1025) / np.hanning(1025).sum()


def test_a_slip_is_seen_by_the_shaft_and_not_by_the_train(base):
    base["channel"] += [
        {"name": "shaft", "quantity": "speed", "component": "shaft"},
        {"name": "train", "quantity": "speed", "component": "shaft", "shaft": "train"},
    ]
    base["condition"][0]["slip"] = [{"from_s": 2.0, "to_s": 4.0, "peak": 0.1}]
    recipe, run = one_run(base)
    channels = {channel.name: channel for channel in recipe.channel}
    assert channels["train"].stored_unit == "km/h"
    train, shaft = run.samples(recipe, channels["train"]), run.samples(recipe, channels["shaft"]) / 60.0
    assert np.allclose(train, 40.0)
    slip = shaft / MOTOR_HZ_AT_40 - 1.0
    assert slip[int(3.0 * RATE)] == pytest.approx(0.1, abs=1e-9)
    assert np.abs(slip[: int(2.0 * RATE)]).max() < 1e-9 and np.abs(slip[int(4.0 * RATE) + 1 :]).max() < 1e-9
    assert run.motion.motor_turns[-1] - 8.0 * MOTOR_HZ_AT_40 == pytest.approx(0.1 * MOTOR_HZ_AT_40, rel=2e-3)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"channel": {"resonance": [{"frequency_hz": 1, "width_hz": 1, "height_db": 3}]}}, "hump, resonance and gain"),
        ({"channel": {"shaft": "train"}}, "shaft = 'train' is of a speed channel, not of a tacho channel"),
        ({"slip": [{"from_s": 2.0, "to_s": 2.0, "peak": 0.1}]}, "to_s must lie after from_s"),
    ],
)
def test_what_makes_no_sense_is_refused(base, changed, words):
    base["channel"][3] |= changed.pop("channel", {})
    base["condition"][0] |= changed
    with pytest.raises(RecipeError, match=words):
        parse_recipe(base)
