"""``[railway]`` and the keys of channels and runs that belong to it: read, refused, and silent where absent."""

import pytest

from tdacoustic.campaign import load_campaign
from tdacoustic.errors import CampaignError

HEAD = 'schema = "tdacoustic-campaign/1"\nname = "x"\norigin = "measured"\n'
WAYSIDE = '[[channel]]\nname = "w"\nquantity = "sound_pressure"\nplace = "wayside"\n'
SEAT = '[[channel]]\nname = "s"\nquantity = "sound_pressure"\nplace = "interior"\n'
RUN = '[[run]]\ncondition = "1"\nlogs = ["1.h5"]\n'
PASS = RUN + 'test = "pass-by"\n'


@pytest.fixture
def load(tmp_path):
    def loaded(text):
        path = tmp_path / "campaign.toml"
        path.write_text(HEAD + text, encoding="utf-8")
        return load_campaign(path)

    return loaded


def test_all_keys_are_read(load):
    campaign = load(
        WAYSIDE + "distance_m = 7.5\nheight_above_rail_m = 1.2\nstands_for_m = 12.0\n"
        + SEAT + "height_above_floor_m = 1.6\n"
        + PASS + "front_s = 4.0\nmiddle_s = 6.0\nrear_s = 8.1\n"
        + '[railway]\nstandards = ["ISO 3381:2021", "ISO 3095:2025"]\nunit_length_m = 72\nreference_track = false\n'
    )  # fmt: skip
    assert (campaign.channel("w").place, campaign.channel("w").stands_for_m) == ("wayside", 12.0)
    assert campaign.channel("s").height_above_floor_m == 1.6
    run = campaign.run("1")
    assert (run.test, run.front_s, run.middle_s, run.rear_s) == ("pass-by", 4.0, 6.0, 8.1)
    assert campaign.railway.unit_length_m == 72.0 and campaign.railway.reference_track is False
    assert campaign.settings["railway.standards"] == ("ISO 3381:2021", "ISO 3095:2025")
    assert campaign.asks_for_railway


def test_without_any_of_these_keys_nothing_is_asked(load):
    campaign = load('[[channel]]\nname = "m"\nrole = "receiver"\n' + RUN)
    assert campaign.railway is None and not campaign.asks_for_railway
    assert not [key for key in campaign.settings if key.startswith("railway")]


@pytest.mark.parametrize("text", [WAYSIDE + RUN, '[[channel]]\nname = "m"\n' + PASS, "[railway]\n"])
def test_one_key_is_enough_to_ask(load, text):
    if text == "[railway]\n":
        text = '[[channel]]\nname = "m"\n' + RUN + text
    campaign = load(text)
    assert campaign.asks_for_railway
    assert campaign.settings["railway.standards"] == ("ISO 3095:2013", "ISO 3381:2021")


@pytest.mark.parametrize(
    ("text", "match"),
    [
        (
            WAYSIDE + RUN + 'tset = "pass-by"',
            r"run 1 \(condition '1'\): unknown key 'tset' .*nearest known key is 'test'",
        ),
        (WAYSIDE + RUN + "[railway]\nunit_lenght_m = 3", r"\[railway\]: unknown key .*'unit_length_m'"),
        (WAYSIDE + RUN + "[railway]\nplace = 3", r"unknown key 'place' in \[railway\]; it belongs in \[\[channel\]\]"),
        (WAYSIDE.replace("wayside", "roof") + RUN, r"place must be one of wayside, vehicle, interior, got 'roof'"),
        (WAYSIDE + RUN + 'test = "passby"', r"test must be one of pass-by, stationary, .*, got 'passby'"),
        (
            WAYSIDE + RUN + '[railway]\nstandards = ["ISO 3095"]',
            r"standards, entry 1, must be one of ISO 3095:2013, .*, got 'ISO 3095'",
        ),
        (WAYSIDE + RUN + "[railway]\nstandards = []", r"standards must have at least 1 entry"),
        (WAYSIDE + RUN + "[railway]\nunit_length_m = 0", r"unit_length_m must be > 0, got 0"),
        (
            '[[channel]]\nname = "a"\nquantity = "acceleration"\nplace = "vehicle"\n' + RUN,
            r"channel 'a': place = 'vehicle' is of a microphone, but quantity is 'acceleration'",
        ),
        (
            WAYSIDE + "height_above_floor_m = 1.2\n" + RUN,
            r"channel 'w': height_above_floor_m is of place = 'interior', but place is 'wayside'",
        ),
        (SEAT + "stands_for_m = 1.2\n" + RUN, r"channel 's': stands_for_m is of place = 'wayside', but .* 'interior'"),
        (WAYSIDE + RUN + "front_s = 3.0", r"front_s is of test = 'pass-by', but test is missing"),
        (
            WAYSIDE + RUN + 'test = "stationary"\nrear_s = 3.0',
            r"rear_s is of test = 'pass-by', but test is 'stationary'",
        ),
        (WAYSIDE + PASS + "front_s = 3.0\nrear_s = 3.0", r"rear_s must be > front_s = 3, got 3"),
        (
            WAYSIDE + PASS + "front_s = 3.0\nmiddle_s = 4.0\nrear_s = 9.0",
            r"middle_s = 4 does not lie midway between front_s = 3 and rear_s = 9, which is 6",
        ),
        (WAYSIDE + PASS + "front_s = 3.0\nstart_s = 3.5", r"front_s = 3 lies before start_s = 3.5, which cuts it off"),
        (WAYSIDE + PASS + "rear_s = 3.0\nend_s = 2.5", r"rear_s = 3 lies behind end_s = 2.5, which cuts it off"),
        (
            WAYSIDE + RUN + 'test = "stationary"\ntrain_speed_km_h = 30',
            r"test = 'stationary' contradicts train_speed_km_h = 30",
        ),
        (WAYSIDE + PASS + "motor_speed_rpm = 0", r"test = 'pass-by' contradicts motor_speed_rpm = 0"),
        (
            WAYSIDE + RUN + '[[run]]\nkind = "background"\nlogs = ["b.h5"]\ntest = "starting"',
            r"test = 'starting' is of a run of kind 'test', but kind is 'background'",
        ),
        (
            SEAT + PASS + '[railway]\nstandards = ["ISO 3381:2021"]',
            r"run '1': test = 'pass-by' is of ISO 3095, but \[railway\] standards names ISO 3381:2021 alone",
        ),
        (
            WAYSIDE + RUN + 'test = "constant-speed"\n[railway]\nstandards = ["ISO 3095:2013"]',
            r"run '1': test = 'constant-speed' is of ISO 3381",
        ),
        (
            SEAT + RUN + '[railway]\nstandards = ["ISO 3095:2013"]',
            r"channel 's': place = 'interior' is of ISO 3381, but \[railway\] standards names ISO 3095:2013 alone",
        ),
        (
            WAYSIDE + RUN + '[railway]\nstandards = ["ISO 3381:2021"]',
            r"channel 'w': place = 'wayside' is of ISO 3095",
        ),
    ],
)
def test_a_contradiction_is_one_clear_error_that_names_the_key(load, text, match):
    with pytest.raises(CampaignError, match=match) as caught:
        load(text)
    assert "\n" not in str(caught.value)
