import tomllib
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tdacoustic.campaign import load_campaign
from tdacoustic.errors import CampaignError, MissingFileError
from tdacoustic.ingest import bind_run
from tdacoustic.recording import Log, LogChannel, Raster
from tdacoustic.workflows.init import campaign_text, make_campaign, toml_string

RECORDINGS = Path(__file__).resolve().parents[3] / "shared" / "recordings"


@dataclass
class NoReader:
    def blocks(self, columns, start, stop, block_size):
        return iter(())


def made_log(path, *channels, rate=100.0, **keys):
    raster = Raster(rate, 1000)
    return Log(Path(path), "audio", tuple(LogChannel(raster=raster, **c) for c in channels), NoReader(), **keys)


def loaded(result, folder):
    (folder / "campaign.toml").write_text(result.text, encoding="utf-8")
    return load_campaign(folder)


def bound(campaign, logs):
    return [bind_run(campaign.channels, run, [log]) for run, log in zip(campaign.runs, logs, strict=True)]


MIC = {"name": "mic", "unit": "Pa"}
RPM = {"name": "n", "unit": "rpm", "quantity": "speed"}


def test_logs_with_the_same_channels_are_runs(tmp_path):
    logs = [made_log(tmp_path / "logs" / f"up_{v}kmh.h5", MIC, {"name": "a", "unit": "g"}) for v in (20, 40)]
    result = campaign_text(logs, tmp_path)
    campaign = loaded(result, tmp_path)
    assert [(run.name, run.condition, run.train_speed_km_h) for run in campaign.runs] == [
        ("up_20kmh", "up_20kmh", 20.0),
        ("up_40kmh", "up_40kmh", 40.0),
    ]
    assert [log.text for run in campaign.runs for log in run.logs] == ["logs/up_20kmh.h5", "logs/up_40kmh.h5"]
    assert [(c.quantity, c.unit, c.component) for c in campaign.channels] == [
        ("sound_pressure", "Pa", "air"),
        ("acceleration", "g", None),
    ]
    assert all(not b.refused and not b.warnings for b in bound(campaign, logs))
    assert result.missing == ("channel 'mic': role and distance_m", "channel 'a': component")


def test_every_missing_key_is_marked_in_the_text(tmp_path):
    log = made_log(
        tmp_path / "x.wav",
        {"name": "pcm", "full_scale": 1.0},
        {"name": "volts", "unit": "V", "quantity": "voltage"},
        {"name": "bare"},
        {"name": "odd", "unit": 'fur\n"long'},
        {"name": "pulses", "quantity": "tacho"},
        rate=None,
    )
    result = campaign_text([log], tmp_path)
    campaign = loaded(result, tmp_path)
    (found,) = bound(campaign, [log])
    reasons = {refusal.channel: refusal.reason for refusal in found.refused}
    assert "add full_scale = " in reasons["pcm"]
    assert "add unit = " in reasons["bare"]
    assert "add unit = " in reasons["odd"]
    assert "add pulses_per_rev" in reasons["pulses"]
    assert "add sample_rate_hz" in reasons["volts"]
    for key in ("full_scale", "sensitivity", "unit", "pulses_per_rev", "sample_rate_hz", "shaft", "component"):
        assert any(line.startswith(f"# {key} = ") and "MISSING" in line for line in result.text.splitlines()), key
        assert any(key in line for line in result.missing), key
    assert any("run 'x': sample_rate_hz" in line for line in result.missing)


@pytest.mark.parametrize(
    ("stem", "speed"),
    [
        ("run_40kmh", 40.0),
        ("40 km-h left", 40.0),
        ("run_114.455km_h", 114.455),
        ("run3-60KMH", 60.0),
        ("run_40kmh_60kmh", None),
        ("run3.40kmh", None),
        ("run40kmh", None),
        ("run_40kmhx", None),
        ("run_40", None),
        ("run_0kmh", None),
    ],
)
def test_a_speed_is_taken_from_a_name_only_where_it_is_plain(tmp_path, stem, speed):
    result = campaign_text([made_log(tmp_path / f"{stem}.wav", MIC)], tmp_path)
    assert loaded(result, tmp_path).runs[0].train_speed_km_h == speed
    assert any("train_speed_km_h" in line for line in result.missing) == (speed is None)
    assert ("# train_speed_km_h =   # MISSING" in result.text) == (speed is None)


def test_a_speed_channel_makes_the_speed_no_miss(tmp_path):
    result = campaign_text([made_log(tmp_path / "x.wav", MIC, RPM)], tmp_path)
    assert "# train_speed_km_h =   # a channel says it" in result.text
    assert not any("train_speed_km_h" in line for line in result.missing)


def test_logs_with_other_channels_are_said_to_be(tmp_path):
    logs = [made_log(tmp_path / "a.wav", MIC), made_log(tmp_path / "b.csv", RPM)]
    result = campaign_text(logs, tmp_path)
    assert [c.name for c in loaded(result, tmp_path).channels] == ["mic", "n"]
    assert "# MISSING: the logs have different channels" in result.text
    assert any("different channels" in line for line in result.missing)


def test_units_that_differ_between_logs_are_left_to_the_logs(tmp_path):
    logs = [made_log(tmp_path / f"{u}.wav", {"name": "m", "unit": u}) for u in ("Pa", "g")]
    result = campaign_text(logs, tmp_path)
    assert '# unit = ""   # the logs differ: "Pa", "g"; each is read as it says' in result.text
    assert [b.recording["m"].si_symbol for b in bound(loaded(result, tmp_path), logs)] == ["Pa", "m/s^2"]


def test_names_that_stand_twice_become_numbers(tmp_path):
    log = made_log(tmp_path / "x.wav", MIC, {**MIC, "unit": "kPa"})
    campaign = loaded(campaign_text([log], tmp_path), tmp_path)
    assert [(c.name, c.source) for c in campaign.channels] == [("mic", 1), ("mic_2", 2)]
    (found,) = bound(campaign, [log])
    assert [c.gain for c in found.recording.channels] == [1.0, 1000.0]


def test_what_cannot_be_a_campaign(tmp_path):
    with pytest.raises(CampaignError, match="needs at least one log, got none"):
        make_campaign([], tmp_path)
    with pytest.raises(CampaignError, match=r"log 'x\.wav' is named twice"):
        campaign_text([made_log(tmp_path / "x.wav", MIC)] * 2, tmp_path)
    with pytest.raises(MissingFileError, match=r"nowhere\.wav: no such file"):
        make_campaign([tmp_path / "nowhere.wav"], tmp_path)
    with pytest.raises(CampaignError, match=r"is no valid Unicode"):
        campaign_text([made_log(tmp_path / "x\udcff.wav", MIC)], tmp_path)


@given(st.text(st.characters(exclude_categories=["Cs"])))
def test_a_toml_string_is_read_back(text):
    written = toml_string(text)
    assert "\n" not in written
    assert tomllib.loads(f"x = {written}   # {written}")["x"] == text


@given(
    names=st.lists(st.text(max_size=80), min_size=1, max_size=5),
    units=st.lists(st.none() | st.text(max_size=5) | st.sampled_from(["V", "Pa", "rpm", "A"]), min_size=5, max_size=5),
    quantities=st.lists(st.sampled_from([None, "tacho", "speed", "voltage", "force", "other"]), min_size=5, max_size=5),
    scales=st.lists(st.sampled_from([None, 1.0, 32768.0]), min_size=5, max_size=5),
    stem=st.text(st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="/\\"), min_size=1, max_size=80),
)
def test_whatever_logs_say_the_text_loads_and_refusals_name_a_key(
    tmp_path_factory, names, units, quantities, scales, stem
):
    folder = tmp_path_factory.getbasetemp()
    said = [
        {"name": name, "unit": units[k], "quantity": quantities[k], "full_scale": scales[k]}
        for k, name in enumerate(names)
    ]
    log = made_log(folder / f"{stem}.wav", *said)
    campaign = loaded(campaign_text([log], folder), folder)
    assert len(campaign.channels) == len(names)
    (found,) = bound(campaign, [log])
    assert all("add " in refusal.reason or "say " in refusal.reason for refusal in found.refused)


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="the shared recordings are not here")
@pytest.mark.parametrize(
    ("log", "symbols"),
    [
        ("ansys_accel_with_rpm/accel_with_rpm.wav", ["Pa", "1/s"]),
        ("mosqito_emotor_vibration/electric_motor_vibration_signal.uff", ["m/s^2"]),
    ],
)
def test_real_logs_go_through_without_an_edit(tmp_path, log, symbols):
    from tdacoustic.formats import scan

    result = make_campaign([RECORDINGS / log], tmp_path)
    campaign = loaded(result, tmp_path)
    (run,) = campaign.runs
    found = bind_run(campaign.channels, run, [scan(log.path) for log in run.logs])
    assert (found.refused, found.warnings) == ((), ())
    assert [channel.si_symbol for channel in found.recording.channels] == symbols


def test_a_file_named_after_a_calibrator_is_proposed_as_such(tmp_path):
    names = ("cal_mic.h5", "run_1.h5", "Kalibrierung nachher.h5", "vertical.h5")
    result = campaign_text([made_log(tmp_path / name, MIC) for name in names], tmp_path)
    runs = loaded(result, tmp_path).runs
    assert [run.kind for run in runs] == ["calibration_before", "test", "calibration_after", "test"]
    assert runs[0].calibrator is None and '# calibrator = "94 dB"   # MISSING' in result.text
    assert "run 'cal_mic': calibrator, what it gives (the file's name says that it is one)" in result.missing
    alone = loaded(campaign_text([made_log(tmp_path / "cal.h5", MIC)], tmp_path), tmp_path)
    assert alone.runs[0].kind == "test"  # a campaign has at least one
