"""Words on gears and paths in another language than English."""

import pytest
from plain_fleets import plain_fleet

from tdacoustic.fleet import load_fleet
from tdacoustic.reporting.language import Language, speaking
from tdacoustic.reporting.sections.gear_words import begun_small, gear_word, named_conditions, range_words, sentence
from tdacoustic.reporting.sections.model_parameters import assumed_words, named
from tdacoustic.reporting.sections.sound_paths import PATHS, path_word, total_words

GERMAN = Language(
    "de",
    {
        "pinion": "Ritzel",
        "{low} to {high}": "{low} bis {high}",
        "motor": "Motor",
        "the motor's tones": "die Töne des Motors",
        "The total is {path}": "Die Summe ist {path}",
        "Face width": "Zahnbreite",
    },
    {("condition {names}", "conditions {names}"): ("Zustand {names}", "Zustände {names}")},
)


def test_gears_paths_and_conditions_are_named_in_the_language_that_is_spoken():
    with speaking(GERMAN):
        assert gear_word("pinion") == "Ritzel"
        assert path_word("motor") == "Motor"
        assert range_words("0.5", "0.9") == "0.5 bis 0.9"
        assert named_conditions(["5"]) == "Zustand 5"
        assert named_conditions(["4", "5"]).startswith("Zustände 4")
        assert sentence("die Töne") == "Die Töne."
    assert (gear_word("pinion"), named_conditions(["4", "5"])) == ("pinion", "conditions 4 and 5")


def test_a_path_is_said_when_it_is_shown_and_not_when_the_module_is_read():
    fleet = load_fleet(plain_fleet("crrc-freight"))
    (motor,) = [path for path in PATHS if path.key == "motor"]
    with speaking(GERMAN):
        assert (motor.name, motor.phrase) == ("Motor", "die Töne des Motors")
        assert total_words(fleet, [motor]) == "Die Summe ist die Töne des Motors."
    assert (motor.name, motor.phrase) == ("motor", "the motor's tones")


@pytest.mark.parametrize(("language", "begun"), [(Language(), "zahnbreite"), (GERMAN, "Zahnbreite")])
def test_only_english_begins_a_name_small_within_a_sentence(language, begun):
    with speaking(language):
        assert begun_small("Zahnbreite") == begun


def test_parameters_are_named_in_the_language_that_is_spoken():
    fleet = load_fleet(plain_fleet("crrc-freight"))
    with speaking(GERMAN):
        assert named(fleet, "gear_pair.1.face_width_mm") == ("Zahnbreite", "mm")
        assert "Zahnbreite" in assumed_words(fleet)
    assert "face width" in assumed_words(fleet)
