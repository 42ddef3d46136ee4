"""Several logs, one run: two synthetic recorders through the command's own way, and what is refused."""

import h5py
import numpy as np
import pytest
from small_campaigns import HEAD, table

from tdacoustic.errors import CampaignError, TdacousticError
from tdacoustic.workflows.analyze import analyze

RATES_HZ = 8192.0, 8000.0
SECONDS = 24.0
OFFSET_S, DRIFT = 0.37, 20e-6


def instants(log):
    if log == 0:
        return np.arange(round(SECONDS * RATES_HZ[0])) / RATES_HZ[0]
    return OFFSET_S + np.arange(round((SECONDS - 1.0) * RATES_HZ[1])) / (RATES_HZ[1] * (1.0 + DRIFT))


def shared(t):
    random = np.random.default_rng(11)
    tones = zip(np.exp(random.uniform(3.0, 8.0, 150)), random.uniform(0.0, 6.28, 150), strict=True)
    return sum(np.sin(2 * np.pi * hz * t + phase) for hz, phase in tones) / 12.0


def noise(seed, n):
    return np.random.default_rng(seed).standard_normal(n)


def turns(t):
    return 15.0 * t + 0.4 * t**2


def write(path, log, channels, start_time=None):
    with h5py.File(path, "w") as file:
        file.attrs["schema"] = "tdacoustic-log/1"
        if start_time is not None:
            file.attrs["start_time"] = start_time
        for name, (values, unit) in channels.items():
            dataset = file.create_dataset(name, data=np.asarray(values, dtype=np.float32), track_times=False)
            dataset.attrs["sample_rate_hz"], dataset.attrs["unit"] = RATES_HZ[log], unit


def campaign(folder, starts=(None, None), extra="", sync=True, **keys):
    """A microphone in one log, a tacho of a run-up and an accelerometer in the other, one noise in both."""
    one, two = instants(0), instants(1)
    logs = (
        {"mic": (0.2 * np.sin(2 * np.pi * 4.0 * turns(one)) + 0.01 * noise(1, one.size), "Pa")},
        {
            "tacho": (5.0 * (np.mod(turns(two), 1.0) < 0.5), "V"),
            "motor": (np.sin(2 * np.pi * 4.0 * turns(two)) + 0.05 * noise(2, two.size), "m/s^2"),
        },
    )
    if sync:
        logs[0]["sync"] = (shared(one) + 0.1 * noise(3, one.size), "V")
        logs[1]["sync"] = (-0.2 * (shared(two) + 0.1 * noise(4, two.size)), "V")
    for number, (name, channels) in enumerate(zip(("a.h5", "b.h5"), logs, strict=True)):
        write(folder / name, number, channels, starts[number])
    text = (
        table("channel", name="mic", role="receiver", quantity="sound_pressure", distance_m=4.0)
        + table("channel", name="tacho", shaft="motor", pulses_per_rev=1.0)
        + table("channel", name="motor", component="motor", quantity="acceleration")
        + extra
        + table("run", condition="up", logs=["a.h5", "b.h5"], **keys)
    )
    path = folder / "campaign.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return path


def order_levels(analysis):
    rows = analysis.tables["orders"]
    rows = rows[(rows["channel"] == "mic") & np.isclose(rows["order"], 4.0) & rows["level_db"].notna()]
    return dict(zip(rows["speed_rpm"], rows["level_db"], strict=True))


def test_two_recorders_are_put_on_one_axis(tmp_path, conformance):
    path = campaign(tmp_path, align_on=["sync"])
    path.write_text(path.read_text() + "[analysis]\norders = [4.0]\n")
    found = analyze(path, tmp_path / "store")
    (row,) = found.tables["clocks"].to_dict("records")
    assert (row["run"], row["log"], row["reference_log"], row["method"]) == ("up", "b.h5", "a.h5", "shared")
    source = "known input: one signal on two recorders of known clocks, in a made-up campaign"
    conformance("offset of a recorder, by the analysis", OFFSET_S, row["offset_s"], 0.05 / RATES_HZ[0], "s", source)
    conformance("drift of a recorder, by the analysis", 20.0, row["drift_ppm"], 0.5, "ppm", source)
    assert row["axis_error_samples"] < 0.1
    recording = found.runs[0].recording
    mic, motor = recording["mic"], recording["motor"]
    assert (mic.start_s, mic.sample_rate_hz) == (0.0, RATES_HZ[0])
    assert motor.start_s == row["offset_s"]
    assert motor.sample_rate_hz == pytest.approx(RATES_HZ[1] * (1.0 + DRIFT), rel=5e-7)
    assert "counts +20" in motor.scaling
    assert "b.h5" not in mic.scaling
    assert np.array_equal(recording.samples("motor"), h5py.File(tmp_path / "b.h5")["motor"][:].astype(float))
    quality = found.tables["quality"]
    (clock,) = quality[quality["check"] == "clock"].to_dict("records")
    assert "nothing is resampled" in clock["detail"]
    assert "one channel has the other's sign turned round" in clock["detail"]
    assert (clock["verdict"], row["inverted"]) == ("ok", True)  # known, and of no harm
    assert not row["doubt"] or row["doubt"] != row["doubt"]
    assert any(record.step == "clock" for _, record in found.records)
    # the tacho of one log serves the microphone of the other: order 4 of 0.2 Pa rms / sqrt(2) keeps its level
    levels = order_levels(found)
    assert levels
    truth = 20.0 * np.log10(0.2 / np.sqrt(2.0) / 20e-6)
    source = "known input: an order of known level, its tacho on another recorder"
    conformance("order by the tacho of another recorder", truth, np.median(list(levels.values())), 0.2, "dB", source)


def test_the_report_says_how_the_logs_lie(tmp_path):
    from tdacoustic.reporting.sections.clocks import clocks

    found = analyze(campaign(tmp_path, align_on=["sync"]), tmp_path / "store", deeper=False)
    section = clocks(found)
    text = str(section)
    assert "b.h5 starts at 0.37" in text
    assert "20 ppm" in text
    assert "the sign turned round" in text


def test_a_channel_of_each_log_can_hold_the_signal(tmp_path):
    extra = table("channel", name="sync_a", source="sync", log=1, unit="V", quantity="voltage") + table(
        "channel", name="sync_b", source="sync", log=2, unit="V", quantity="voltage"
    )
    found = analyze(campaign(tmp_path, extra=extra, align_on=["sync_a", "sync_b"]), tmp_path / "store", deeper=False)
    assert found.tables["clocks"]["offset_s"][0] == pytest.approx(OFFSET_S, abs=1e-5)


def test_the_second_log_can_be_the_reference(tmp_path):
    found = analyze(campaign(tmp_path, align_on=["sync"], reference_log=2), tmp_path / "store", deeper=False)
    row = found.tables["clocks"].iloc[0]
    assert (row["log"], row["reference_log"]) == ("a.h5", "b.h5")
    assert row["offset_s"] == pytest.approx(-OFFSET_S, abs=2e-5)
    assert row["drift_ppm"] == pytest.approx(-20.0, abs=0.5)


def test_cuts_count_on_the_common_axis(tmp_path):
    found = analyze(campaign(tmp_path, align_on=["sync"], start_s=2.0, end_s=12.0), tmp_path / "store", deeper=False)
    for name in ("mic", "motor"):
        channel = found.runs[0].recording[name]
        assert channel.start_s == pytest.approx(2.0, abs=2e-4)
        assert channel.duration_s == pytest.approx(10.0, abs=2e-4)


def test_fine_zoned_stamps_align_without_being_asked(tmp_path):
    starts = "2026-05-01T10:00:00.000+02:00", "2026-05-01T08:00:00.370Z"
    found = analyze(campaign(tmp_path, starts, sync=False), tmp_path / "store", deeper=False)
    row = found.tables["clocks"].iloc[0]
    assert (row["method"], row["offset_s"]) == ("time_stamps", 0.37)
    assert "resolve 0.001 s" in row["doubt"]
    assert np.isnan(row["drift_ppm"])


def test_coarse_stamps_are_only_warned_of_unless_asked_for(tmp_path):
    starts = "2026-05-01T10:00:00Z", "2026-05-01T10:00:02Z"
    path = campaign(tmp_path, starts, sync=False)
    found = analyze(path, tmp_path / "store", deeper=False)
    assert found.tables["clocks"]["method"][0] == "start"
    assert found.tables["quality"]["detail"].str.contains("taken as started together").any()
    path.write_text(path.read_text().replace("[[run]]\n", '[[run]]\nalign = "time_stamps"\n'))
    assert analyze(path, tmp_path / "store", deeper=False).tables["clocks"]["offset_s"][0] == 2.0


def test_stamps_that_leave_no_overlap_are_refused(tmp_path):
    starts = "2026-05-01T10:00:00.5Z", "2026-05-01T11:00:00.5Z"
    with pytest.raises(TdacousticError, match=r'do not overlap: the latter starts 3600 s later.*align = "start"'):
        analyze(campaign(tmp_path, starts, sync=False), tmp_path / "store")


def test_what_cannot_be_aligned_is_refused_with_its_reason(tmp_path):
    path = campaign(tmp_path, sync=False, align_on=["mic", "motor"])
    b = tmp_path / "b.h5"
    with h5py.File(b, "r+") as file:
        file["motor"][:] = noise(9, file["motor"].size)
    with pytest.raises(TdacousticError, match=r"b\.h5 is not aligned to a\.h5 on mic, motor: no alignment stands out"):
        analyze(path, tmp_path / "store")
    path.write_text(path.read_text().replace('["mic", "motor"]', '["gps"]'))
    with pytest.raises(TdacousticError, match=r"align_on 'gps': source 'gps' is not in a\.h5"):
        analyze(path, tmp_path / "store")


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"align": "shared"}, "needs align_on"),
        ({"align": "start", "align_on": ["sync"]}, "align_on is for align = 'shared'"),
        ({"align_on": ["a", "b", "c"]}, "one channel, or one for each of the 2 logs"),
        ({"max_offset_s": 2.0}, "align_on is missing"),
        ({"align": "gps"}, "align must be one of start, time_stamps, shared, got 'gps'"),
        ({"align_on": ["sync"], "reference_log": 3}, "reference_log = 3, but there are 2 logs"),
    ],
)
def test_keys_that_contradict_each_other_are_refused(tmp_path, keys, said):
    with pytest.raises(CampaignError) as error:
        analyze(campaign(tmp_path, sync=False, **keys), tmp_path / "store")
    assert said in str(error.value)


def test_the_keys_may_be_columns(tmp_path):
    path = campaign(tmp_path)
    text = path.read_text()
    path.write_text(text[: text.index("[[run]]")].replace("[[channel]]", 'runs = "runs.csv"\n[[channel]]', 1))
    (tmp_path / "runs.csv").write_text("condition,logs,align_on,reference_log\nup,a.h5|b.h5,sync,2\n")
    found = analyze(path, tmp_path / "store", deeper=False)
    assert found.tables["clocks"]["reference_log"][0] == "b.h5"
