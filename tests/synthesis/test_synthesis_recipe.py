"""A wrong recipe is refused in one clear line that names key and file."""

import pytest

from tdacoustic.errors import MissingFileError, RecipeError
from tdacoustic.synthesis import load_recipe, parse_recipe


def set_line(content, **keys):
    content["condition"][0]["line"] = [keys]


CASES = [
    (lambda c: c.update(sample_rate=1), r"unknown key 'sample_rate'; the nearest known key is 'sample_rate_hz'"),
    (lambda c: c["kinematics"].update(speed_wandr=1), r"'kinematics\.speed_wandr'; .* 'speed_wander'"),
    (lambda c: c["channel"][2].update(distance=4), r"'channel\[mic\]\.distance'; .* 'distance_m'"),
    (lambda c: set_line(c, source="motor", ordr=3, level_db=1), r"'condition\[40\]\.line\[1\]\.ordr'; .* 'order'"),
    (lambda c: c.update(schema="x/1"), r'schema must be "tdacoustic-synthesis/1", got \'x/1\''),
    (lambda c: c.pop("duration_s"), r"key 'duration_s' is missing"),
    (lambda c: c.update(sample_rate_hz=-1), r"'sample_rate_hz': .* greater than 0, got -1"),
    (lambda c: c["channel"][0].pop("floor"), r"'channel\[motor_z\]': floor is missing"),
    (lambda c: c["channel"][0].update(floor=[[100, 1], [50, 1]]), r"frequencies of floor must rise"),
    (lambda c: c["channel"][0].update(unit="g"), r"must be 'm/s\^2', got 'g'"),
    (lambda c: c["channel"][3].pop("pulses_per_rev"), r"'channel\[tacho\]': pulses_per_rev is missing"),
    (lambda c: c["channel"].append(dict(c["channel"][0])), r"two channels are called 'motor_z'"),
    (lambda c: set_line(c, source="motor", order=3), r"exactly one of level_db and prominence_db"),
    (lambda c: set_line(c, source="motor", level_db=3), r"one of frequency_hz, carrier, order and mesh"),
    (lambda c: set_line(c, source="motor", carrier=2, level_db=3), r"condition has no carrier_hz"),
    (lambda c: set_line(c, source="motor", order=2, level_db={"mik": 3}), r"names 'mik'.*nearest is 'mic'"),
    (lambda c: set_line(c, source="bogie", mesh=1, gear_pair="b", level_db=3), r"gear_pair 'b' does not exist"),
    (lambda c: c.update(path=[{"from": "bogie", "to": "mic", "gain_db": -3}]), r"path\.from names 'bogie'"),
    (lambda c: c["condition"][0].update(line_fraction={"mic": 0.1}), r"whose level_db is not prescribed"),
    (
        lambda c: (c["channel"].pop(), c["condition"][0].update(train_speed_end_km_h=60)),
        r"changes its speed, but no tacho or speed channel",
    ),
]


@pytest.mark.parametrize(("spoil", "message"), CASES)
def test_a_wrong_recipe_says_what_is_wrong(base, spoil, message):
    spoil(base)
    with pytest.raises(RecipeError, match=message) as caught:
        parse_recipe(base, where="synthesis.toml")
    assert "synthesis.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_recipe_that_is_not_there_or_no_toml(tmp_path):
    with pytest.raises(MissingFileError, match=r"nowhere\.toml does not exist"):
        load_recipe(tmp_path / "nowhere.toml")
    (tmp_path / "bad.toml").write_text("schema = ")
    with pytest.raises(RecipeError, match=r"bad\.toml is not valid TOML"):
        load_recipe(tmp_path / "bad.toml")
    with pytest.raises(RecipeError, match=r"is a folder"):
        load_recipe(tmp_path)
