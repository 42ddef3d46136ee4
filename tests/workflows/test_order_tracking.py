"""Orders of a campaign's runs: tables, arrays, and words on what could not be had."""

import dataclasses
import shutil
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from level_campaigns import Made, mic, pascal, run_of
from small_campaigns import HEAD, RATE_HZ, small_campaign, table, write_log

from tdacoustic import analyze
from tdacoustic.campaign import load_campaign
from tdacoustic.errors import CampaignError
from tdacoustic.fleet import load_fleet
from tdacoustic.reporting.document import Details, FigureBlock, Paragraph, Sentences, Table, walk
from tdacoustic.reporting.measured_report import measured_report
from tdacoustic.reporting.sections.orders import orders as order_section
from tdacoustic.workflows.order_tracking import expected_orders

PUT_IN = "known input: orders of known level in a made-up campaign"

SPEED = table("channel", name="n", quantity="speed", shaft="motor", unit="rpm")
TACHO = table("channel", name="n", quantity="tacho", shaft="motor", pulses_per_rev=8)
SECONDS = 20.0
T = np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ


def level_of(rpm):
    return 75.0 + 6.0 * np.sin(2.0 * np.pi * (rpm - 600.0) / 1200.0)


def run_up(first_hz=10.0, last_hz=30.0, extra=None, seed=1, level_of=level_of):
    """Microphone with the mesh order of the reference drive (31) by plain integration of its phase, and speed."""
    turns_hz = first_hz + (last_hz - first_hz) * T / SECONDS
    phase = 2.0 * np.pi * np.cumsum(turns_hz) / RATE_HZ
    sound = np.sqrt(2.0) * pascal(level_of(60.0 * turns_hz)) * np.sin(31.0 * phase)
    sound += pascal(50.0) * np.random.default_rng(seed).standard_normal(T.size)
    return {"m": (sound + (0.0 if extra is None else extra), "Pa"), "n": (60.0 * turns_hz, "rpm")}


def steady(turns_hz=20.0):
    """At one speed: the mesh order at 0.1 Pa, a line that does not turn, and the pulses of a tacho."""
    phase = 2.0 * np.pi * turns_hz * T
    sound = 0.1 * np.sqrt(2.0) * np.sin(31.0 * phase) + 0.1 * np.sin(2.0 * np.pi * 777.7 * T)
    sound += 1e-3 * np.random.default_rng(3).standard_normal(T.size)
    return {"m": (sound, "Pa"), "n": (5.0 * (np.sin(8.0 * phase) > 0.0), "V")}


def made(folder, logs, speed=SPEED, text="", fleet=True):
    runs = [run_of(name, name, train_speed_km_h=None).replace("train_speed_km_h = null\n", "") for name in logs]
    held = Made(folder, mic("m", distance_m=4.0) + speed, runs, logs, text)
    if fleet:
        return held.analysis
    path = folder / "campaign.toml"
    path.write_text(path.read_text().replace('fleet = "fleet.toml"\n', ""))
    return analyze(load_campaign(path), held.store, jobs=1)


@pytest.fixture(scope="module")
def with_fleet(tmp_path_factory):
    """A run-up; a fan at 600 Hz meets its mesh order at 1161 rpm, the fleet does not know of it."""
    fan = np.sqrt(2.0) * pascal(75.0) * np.sin(2.0 * np.pi * 600.0 * T)
    return made(tmp_path_factory.mktemp("orders"), {"up": run_up(extra=fan)})


def missing_without_reason(frame, columns):
    return frame[frame[columns].isna().any(axis=1) & frame["reason"].fillna("").eq("")]


def test_the_mesh_order_over_speed(with_fleet, conformance):
    frame = with_fleet.tables["orders"]
    held = frame[(frame["name"] == "mesh x1") & (frame["method"] == "cut")]
    assert 8 <= len(held) <= 40 and set(held["order"]) == {31.0} and set(held["shaft"]) == {"motor"}
    clean = held[(held["speed_rpm"] - 600.0 * 60.0 / 31.0).abs() > 60.0].iloc[1:-1]
    worst = (clean["level_db"] - level_of(clean["speed_rpm"])).abs().max()
    conformance("mesh order of a campaign's run-up in orders.csv", 0.0, worst, 0.3, "dB", PUT_IN)
    assert held["bandwidth_orders"].tolist() == [0.5] * len(held) == held["requested_bandwidth"].tolist()
    assert (clean["level_error_db"] < 1.0).all() and (clean["floor_db"] < clean["level_db"] - 10.0).all()


def test_no_value_is_missing_without_a_reason(with_fleet):
    frame = with_fleet.tables["orders"]
    assert missing_without_reason(frame, ["level_db", "floor_db", "phase_deg"]).empty
    assert frame[["order", "speed_rpm", "name", "shaft", "method"]].notna().all().all()
    assert missing_without_reason(with_fleet.tables["sidebands"], ["sidebands_db", "amplitude_depth"]).empty
    assert (frame.groupby(["channel", "name", "method"]).size() <= 40).all()
    assert {"wheelset x4", "motor shaft x1", "mesh x2"} <= set(frame["name"])


def test_the_filter_is_in_the_table_beside_the_cut(with_fleet):
    frame = with_fleet.tables["orders"]
    tracked = frame[frame["method"] == "vold_kalman"]
    assert set(tracked["name"]) == {"mesh x1"}
    good = tracked[tracked["reason"].fillna("").eq("")]
    away = good[(good["speed_rpm"] - 1161.0).abs() > 150.0]
    assert len(away) >= 8
    assert (away["level_db"] - level_of(away["speed_rpm"])).abs().max() < 0.5


def test_a_line_that_stays_in_hz_is_told_from_the_orders(with_fleet):
    (line,) = with_fleet.tables["resonances"].to_dict("records")
    assert (line["kind"], round(line["frequency_hz"])) == ("line", 600)
    assert np.isnan(line["width_hz"]) and "a line has no loss factor" in line["detail"]


def test_arrays_of_the_orders(with_fleet, tmp_path):
    from tdacoustic.tables.result_file import write_result_file

    path = tmp_path / "result.h5"
    write_result_file(path, "x", "measured", with_fleet.runs, orders=with_fleet.orders)
    with h5py.File(path) as file:
        group = file["up/orders/m"]
        assert file["up/orders"].attrs["shaft"] == "motor"
        held = group["order_map_over_speed"]
        assert held["mean_square"].shape == (held["speed_hz"].size, held["axis"].size)
        assert held["axis"].attrs["unit"] == "1" and group["frequency_map_over_speed/axis"].attrs["unit"] == "Hz"
        track = group["track_1"]
        assert track.attrs["order"] == 31.0 and track["real"].shape == track["time_s"].shape


def test_what_the_report_says(with_fleet):
    section = order_section(with_fleet)
    blocks = list(walk([section]))
    words = " ".join(item for block in blocks if isinstance(block, Sentences) for item in block.items)
    assert "m: mesh x1 (order 31) is the strongest order from" in words
    assert "A line at 600.0 Hz stays where it is while the speed changes, in m" in words
    titles = [block.figure.title for block in blocks if isinstance(block, FigureBlock)]
    assert titles == [
        "m, run up: level over frequency and speed",
        "m, run up: level over order and speed",
        "m, run up: orders over speed",
    ]
    (cuts,) = [
        block.figure for block in blocks if isinstance(block, FigureBlock) and "over speed" in block.figure.title
    ]
    assert cuts.caption.endswith("its orders jointly.") and "0.5 orders, as asked for" in cuts.caption
    named = [label for block in blocks if isinstance(block, FigureBlock) for element in block.figure.elements
             for label in getattr(element, "labels", ())]  # fmt: skip
    assert {"mesh x1", "mesh x2", "wheelset x1", "motor shaft x1"} <= set(named)
    assert any(isinstance(block, Paragraph) and "0.5 orders wide" in block.text for block in blocks)
    assert "Orders" in [item.title for item in measured_report(with_fleet).sections]


def test_without_a_fleet_what_is_asked_for_and_what_is_found(tmp_path):
    text = "[analysis]\norders = [31, 200]\nvold_kalman = [31]\nhighest_order = 100\norder_bandwidth = 1.0\n"
    phase = 2.0 * np.pi * np.cumsum(10.0 + T) / RATE_HZ
    analysis = made(tmp_path, {"up": run_up(extra=pascal(70.0) * np.sin(7.0 * phase))}, text=text, fleet=False)
    frame = analysis.tables["orders"]
    assert set(frame["name"]) == {"order 7", "order 31", "order 200"}
    assert dict(zip(frame["name"], frame["kind"], strict=True)) == {
        "order 7": "found", "order 31": "asked", "order 200": "asked"
    }  # fmt: skip
    (far,) = frame[frame["name"] == "order 200"].to_dict("records")
    assert far["reason"].startswith("no value: beyond order 100") and np.isnan(far["level_db"])
    assert set(frame[frame["method"] == "vold_kalman"]["name"]) == {"order 31"}
    assert not [problem for problem in analysis.problems if "order" in problem]
    assert {"analysis.order_bandwidth", "analysis.highest_order", "analysis.vold_kalman"} <= set(analysis.settings)


def test_what_repeats_with_every_turn_of_a_steady_run(tmp_path, conformance):
    analysis = made(tmp_path, {"even": steady()}, TACHO)
    frame = analysis.tables["synchronous"]
    first = frame[(frame["shaft"] == "motor") & (frame["name"] == "mesh x1")].to_dict("records")[0]
    conformance("mesh in the synchronous average of a run", 20.0 * np.log10(0.1 / 20e-6), first["level_db"], 0.05, "dB",
                PUT_IN)  # fmt: skip
    rest = 20.0 * np.log10(0.1 / np.sqrt(2.0) / 20e-6)
    conformance("what does not repeat with the turns of a run", rest, first["residual_db"], 0.1, "dB", PUT_IN)
    assert first["harmonic"] == 31.0 and first["turns"] > 390
    orders = analysis.tables["orders"]
    (mesh,) = orders[orders["name"] == "mesh x1"].to_dict("records")
    assert mesh["speed_rpm"] == pytest.approx(1200.0, abs=0.5) and "resonances" not in analysis.tables
    blocks = list(walk([order_section(analysis)]))
    assert any(isinstance(b, Table) and b.name == "synchronous" for b in blocks)
    assert any(isinstance(b, Details) and "synchronous" in b.summary for b in blocks)
    words = " ".join(block.text for block in blocks if isinstance(block, Paragraph))
    assert "67 %" in words  # 0.1² of 0.1² + 0.1²/2


def test_runs_without_a_speed_over_time_say_so(tmp_path):
    path = small_campaign(tmp_path, conditions=("a", "b"), text="[analysis]\norders = [2, 31]\n")
    analysis = analyze(path, tmp_path / "store", jobs=1)
    assert "orders 2, 31 are not cut in runs a, b: its speed is not known over time" in analysis.problems
    assert "orders" not in analysis.tables and analysis.orders == {} and order_section(analysis) is None


def test_a_standstill_and_a_speed_that_is_constant_say_so(tmp_path):
    still, even = run_up(0.001, 0.001), run_up(20.0, 20.0)
    text = "[analysis]\norders = [31]\n"
    analysis = made(tmp_path, {"still": still, "even": even, "up": run_up()}, text=text)
    problems = " | ".join(analysis.problems)
    assert "orders 31 are not cut in run still: nothing turns in it" in problems
    assert "orders 31 are not cut in run even: its speed is constant and no tacho counts the turns" in problems
    assert set(analysis.tables["orders"]["run"]) == {"up"}


def test_a_reversal_is_a_break_and_is_stated(tmp_path, conformance):
    """From -30 to 30 turns/s: both ways give the same levels, the standstill between gives none."""
    log = run_up(-30.0, 30.0, level_of=lambda rpm: 75.0 + 0.0 * rpm)
    analysis = made(tmp_path, {"turn": log})
    frame = analysis.tables["orders"]
    held = frame[(frame["name"] == "mesh x1") & (frame["method"] == "cut") & frame["level_db"].notna()]
    fast = held[held["speed_rpm"] > 300.0]
    assert len(fast) >= 8 and fast["speed_rpm"].max() > 1600.0
    conformance("mesh order over a reversal, highest", 75.0, fast["level_db"].max(), 0.2, "dB", PUT_IN)
    conformance("mesh order over a reversal, lowest", 75.0, fast["level_db"].min(), 0.2, "dB", PUT_IN)
    words = " ".join(i for b in walk([order_section(analysis)]) if isinstance(b, Sentences) for i in b.items)
    assert "turns backwards from" in words and "turning round" in words


def test_a_check_cuts_no_orders(tmp_path):
    write_log(tmp_path / "up.h5", run_up())
    run = run_of("up", "up", train_speed_km_h=None).replace("train_speed_km_h = null\n", "")
    (tmp_path / "campaign.toml").write_text(HEAD + mic("m", distance_m=4.0) + SPEED + run)
    assert "orders" not in analyze(tmp_path / "campaign.toml", tmp_path / "store", jobs=1, deeper=False).tables


@pytest.mark.parametrize(
    ("line", "match"),
    [
        ("order_bandwidth = 0", "order_bandwidth"),
        ("highest_order = -3", "highest_order"),
        ("vold_kalman = [0.0]", "vold_kalman"),
        ('vold_kalman = "yes"', "vold_kalman"),
        ("order_bandwith = 0.5", "order_bandwidth"),
    ],
)
def test_bad_keys_are_named(tmp_path, line, match):
    path = small_campaign(tmp_path, conditions=("a",), text=f"[analysis]\n{line}\n")
    with pytest.raises(CampaignError, match=match):
        load_campaign(path)


def test_orders_of_a_fleet(tmp_path):
    from plain_fleets import plain_fleet

    from tdacoustic.fleet import Kinematics

    drive = Kinematics.of(load_fleet(plain_fleet("reference-drive")))
    orders, curves = expected_orders(drive, (31.0, 5.5), "motor", (10.0, 30.0), 325.5, 4096.0)
    by_name = {order.name: order for order in orders}
    assert [by_name[f"mesh x{k}"].order for k in (1, 10)] == [31.0, 310.0]
    assert by_name["wheelset x4"].of_shaft == pytest.approx(4.0)
    assert by_name["order 5.5"].kind == "asked" and "order 31" not in by_name  # it is the mesh's
    assert "mesh x11" not in by_name
    assert all(np.isfinite(curve.frequencies_hz).any() for curve in curves)
    assert pd.Series([order.order for order in orders]).is_monotonic_increasing
    assert dataclasses.is_dataclass(orders[0])


def test_an_order_that_is_to_be_tracked_is_tracked_though_nobody_else_names_it(tmp_path):
    turns = 10.0 * T + (30.0 - 10.0) * T**2 / (2.0 * SECONDS)
    extra = 0.05 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 17.4 * turns)
    text = "[analysis]\nvold_kalman = [17.4, 5000]\n"
    frame = made(tmp_path, {"up": run_up(extra=extra)}, text=text).tables["orders"]
    assert set(frame[frame["method"] == "vold_kalman"]["name"]) == {"order 17.4"}
    (beyond,) = frame[frame["name"] == "order 5000"].to_dict("records")
    assert "beyond order" in beyond["reason"]


def test_a_speed_that_is_all_but_zero_is_a_standstill(tmp_path):
    """Four seconds at 1e-5 rpm before the start: mesh harmonics below any frequency there are without number."""
    log = run_up(0.0, 30.0)
    speed = np.where(T < 4.0, 1e-5, log["n"][0])
    (held,) = made(tmp_path, {"start": {**log, "n": (speed, "rpm")}}).orders.values()
    assert held.lowest_hz >= 0.5 and len(held.orders) < 40


def test_sensors_of_another_drive_are_named(tmp_path):
    log = run_up()
    log["z"] = (log["m"][0], "m/s^2")
    second = table("channel", name="z", component="motor", drive="2", quantity="acceleration")
    path = Made(tmp_path, mic("m", distance_m=4.0) + SPEED + second, [run_of("up", "up")], {"up": log}).campaign.path
    path.write_text(path.read_text().replace("train_speed_km_h = 30.0\n", ""))
    (problem,) = analyze(path, tmp_path / "store", jobs=1).problems
    assert problem == (
        "orders of z in run up are cut over the angle of n, a shaft of drive 1, "
        "which need not turn as fast as their own"
    )


def test_a_channel_that_starts_too_late_stops_no_other(tmp_path):
    """A second raster with a tenth of a second before the end: hardly a turn of the angle that is known."""
    log = run_up()
    path = Made(tmp_path, mic("m", distance_m=4.0) + SPEED, [run_of("up", "up")], {"up": log}).campaign.path
    with h5py.File(tmp_path / "up.h5", "a") as file:
        late = file.create_dataset("late", data=np.float32(log["m"][0][-400:]))
        late.attrs.update({"sample_rate_hz": RATE_HZ, "unit": "Pa", "start_s": SECONDS - 400 / RATE_HZ})
    path.write_text(path.read_text().replace("train_speed_km_h = 30.0\n", "") + mic("late"))
    analysis = analyze(path, tmp_path / "store", jobs=1)
    assert set(analysis.tables["orders"]["channel"]) == {"m"}
    (late,) = (held for held in analysis.orders["up"].channels if held.channel == "late")
    assert "no orders of late: the motor turns 1.26 times" in late.notes[0]
    assert "No orders of late" in " ".join(
        text for block in walk([order_section(analysis)]) if isinstance(block, Sentences) for text in block.items
    )


def test_a_run_up_of_one_frame_has_no_map_and_a_report(tmp_path):
    """Frames as long as the record: nothing to draw over time, and no reason to fail."""
    source = Path(__file__).parents[2] / "recordings" / "first-run"
    text = (source / "campaign.toml").read_text(encoding="utf-8")
    head, *runs = text.split("[[run]]")
    run_up = next(run for run in runs if '"run-up"' in run)
    shutil.copy(source / "condition-run-up.h5", tmp_path)
    keys = "\n[analysis]\nrun_up_resolution_hz = 0.13\nfrequency_resolution_hz = 0.13\n"
    (tmp_path / "campaign.toml").write_text(f"{head}[[run]]{run_up}{keys}", encoding="utf-8")
    analysis = analyze(tmp_path / "campaign.toml", tmp_path / "store", jobs=1)
    (result,) = [r for r in analysis.runs[0].measurement.channels if r.channel == "mic_left"]
    assert result.map is not None and result.map.times_s.size == 1
    assert measured_report(analysis).sections
