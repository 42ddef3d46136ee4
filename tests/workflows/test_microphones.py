"""Places of microphones in the drive's frame, and places that cannot be."""

import math

import pytest
from plain_fleets import plain_fleet
from small_campaigns import HEAD, table

from tdacoustic.campaign import load_campaign
from tdacoustic.errors import CampaignError
from tdacoustic.fleet import load_fleet
from tdacoustic.workflows.microphones import microphone_doubts, microphones

REFERENCE = plain_fleet("reference-drive")
CENTRE_M = 0.5 * 1.05112


def campaign_of(folder, *channels):
    path = folder / "campaign.toml"
    text = "".join(table("channel", name=f"m{k}", **keys) for k, keys in enumerate(channels))
    level = table("level", condition="1", distance_m=4.0, level_db=80.0)
    path.write_text(HEAD + text + level, encoding="utf-8")
    return load_campaign(path)


def fleet_of(folder, space="free"):
    path = folder / "fleet.toml"
    path.write_text(REFERENCE.read_text(encoding="utf-8") + f'space = "{space}"\n', encoding="utf-8")
    return load_fleet(path)


def mic(**keys):
    return {"quantity": "sound_pressure", **keys}


def test_places(tmp_path):
    campaign = campaign_of(
        tmp_path,
        mic(position_m=[1.0, 2.0, 2.0]),
        mic(distance_m=5.0, height_above_rail_m=CENTRE_M + 3.0, side="left"),
        mic(distance_m=5.0, height_above_rail_m=CENTRE_M - 3.0, side=" Right"),
        mic(distance_m=7.5, height_above_rail_m=1.2),
        mic(distance_m=7.5),
        mic(),
        {"quantity": "acceleration", "position_m": [0.0, 0.4, 0.3]},
        {"role": "receiver", "distance_m": 4.0},
        {"distance_m": 4.0},  # what it measures only its log says
    )
    found = microphones(campaign, fleet_of(tmp_path))
    assert {name: (r.distance_m, r.position_m) for name, r in found.items() if r.position_m is None} == {
        **{"m3": (7.5, None), "m4": (7.5, None), "m7": (4.0, None), "m8": (4.0, None)},
    }
    assert (found["m0"].distance_m, found["m0"].position_m) == (3.0, (1.0, 2.0, 2.0))
    assert found["m1"].position_m == pytest.approx((0.0, 4.0, 3.0))
    assert found["m2"].position_m == pytest.approx((0.0, -4.0, -3.0))
    assert {found["m1"].distance_m, found["m2"].distance_m} == {5.0}
    assert set(found) == {"m0", "m1", "m2", "m3", "m4", "m7", "m8"}
    assert all(receiver.name == name for name, receiver in found.items())
    assert microphone_doubts(campaign, load_fleet(REFERENCE)) == ()


@pytest.mark.parametrize(
    ("keys", "space", "message"),
    [
        (
            {"distance_m": 4.0, "height_above_rail_m": 8.0, "side": "left"},
            "free",
            r"channel 'm0': height_above_rail_m = 8 is 7\.47 m above the drive's centre, and distance_m = 4 from there",
        ),
        (
            {"distance_m": 0.4, "height_above_rail_m": 0.05},
            "free",
            r"channel 'm0': height_above_rail_m = 0\.05 is 0\.476 m below the drive's centre",
        ),
        ({"position_m": [0.0, 0.0, 0.0]}, "free", "channel 'm0' is at the drive's centre itself"),
        ({"distance_m": 0.0}, "free", "channel 'm0' is at the drive's centre itself"),
        ({"position_m": [0.0, 1.0, -1.0]}, "half", r"channel 'm0' lies 0\.474 m below the rail, where \[radiation\]"),
    ],
)
def test_places_that_cannot_be(tmp_path, keys, space, message):
    with pytest.raises(CampaignError, match=message):
        microphones(campaign_of(tmp_path, mic(**keys)), fleet_of(tmp_path, space))


def test_below_the_rail_there_is_no_ground_in_free_space(tmp_path):
    campaign = campaign_of(tmp_path, mic(position_m=[0.0, 1.0, -1.0]))
    assert microphones(campaign, fleet_of(tmp_path))["m0"].distance_m == pytest.approx(math.sqrt(2.0))


def test_what_does_not_agree_is_said(tmp_path):
    campaign = campaign_of(
        tmp_path,
        mic(position_m=[0.0, 3.0, 0.0], distance_m=4.0),
        mic(position_m=[0.0, 3.9, 0.0], distance_m=4.0),
        mic(distance_m=4.0, height_above_rail_m=1.2, side="platform"),
    )
    first, second = microphone_doubts(campaign, load_fleet(REFERENCE))
    assert first == (
        "channel m0: position_m is 3 m from the drive's centre, distance_m says 4 m; its place in the model is the "
        "position"
    )
    assert (
        second == "channel m2: side 'platform' is neither left nor right; its place in the model is its distance alone"
    )
    assert microphones(campaign, fleet_of(tmp_path))["m2"].position_m is None
