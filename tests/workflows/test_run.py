"""The main job as its user gets it: all of it where all can be done, and what can be done where not."""

import importlib.util
import json
import re
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace

import h5py
import pandas as pd
import pytest
from babel.messages.pofile import read_po, write_po
from plain_fleets import plain_campaign, plain_fleet
from small_campaigns import HEAD, MIC, files_of, fleet_campaign, run_table, small_campaign, table

import tdacoustic as td
from tdacoustic.fleet import fleet_toml, load_fleet
from tdacoustic.reporting.document import Details, FigureBlock, Notice, Paragraph, Section, Sentences, Table, walk
from tdacoustic.reporting.language import read_language, speaking
from tdacoustic.reporting.run_report import run_report
from tdacoustic.reporting.sections.run_answer import _verdict_line
from tdacoustic.results.campaign_calibration import settings_in_force

ROOT = Path(__file__).resolve().parents[2]
CHECKER = ROOT.parent / "shared" / "check_outputs.py"
DEMONSTRATION = plain_campaign("crrc-freight")
PRINTED = plain_campaign("crrc-freight-printed")
KINEMATICS_ALONE = 'schema = "tdacoustic-fleet/1"\n[train]\nwheel_diameter_mm = 1000\n[[gear_pair]]\nteeth = [20, 60]\n'


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return tmp_path_factory.mktemp("store")


@pytest.fixture
def tda(tmp_path, store, call_program, monkeypatch):
    """Run the program in this process with a stand-in for the report's page, which takes seconds to draw."""
    monkeypatch.setenv("TDACOUSTIC_STORE", str(store))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tdacoustic.reporting.html.render_html", lambda document: "<!doctype html>" + 2000 * " ")
    return call_program


def faults(folder):
    """What the checker of the contracts says against a folder of `run`."""
    if not CHECKER.is_file():
        pytest.skip("the checker of the contracts is not beside this checkout")
    spec = importlib.util.spec_from_file_location("check_outputs", CHECKER)
    checker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(checker)
    tables = {**checker.ANALYZE, **checker.PREDICT}
    return [*checker.table_faults(folder, tables), *checker.calibration_faults(folder)]


def manifest_of(folder):
    return json.loads((folder / "manifest.json").read_text(encoding="utf-8"))


def warnings_of(err):
    assert all(line.startswith("warning: ") for line in err.splitlines()), err
    return [line.removeprefix("warning: ") for line in err.splitlines()]


@pytest.fixture(scope="module")
def demonstration(store):
    return td.run(DEMONSTRATION, store)


# ---------------------------------------------------------------- all of it


def test_the_demonstration_has_all_its_files_and_the_contracts_hold(tda, tmp_path):
    code, out, err = tda("run", DEMONSTRATION, "-o", "out")
    assert code == 0
    assert faults(tmp_path / "out") == []
    lines = out.splitlines()
    assert [line.split(" (")[0] for line in lines[:5]] == [f"Condition {n}" for n in range(1, 6)]
    assert lines[5].startswith("Calibration: Masuda constant ") and " (it was 20)" in lines[5]
    assert lines[6].startswith("Prediction with the calibrated fleet: at 4 m (re 20 µPa) ")
    assert lines[7].startswith("What if (the model's level at 4 m): at 20 km/h 10 dB less from the motor takes ")
    assert "which are 6 to 16 % of the recorded sound energy: as long as the rest stays, the recorded" in lines[7]
    assert lines[8:] == [str(Path("out") / "report.html")]
    manifest = manifest_of(tmp_path / "out")
    assert (manifest["command"], manifest["fleet"]["name"]) == ("run", "CRRC freight locomotive")
    assert manifest["problems"] == warnings_of(err)
    assert "calibration.free" in manifest["settings"]
    assert {"gear-sweep/1"} < set(manifest["steps"])


def test_the_prediction_is_with_the_calibrated_fleet_where_the_campaign_was_and_beyond(demonstration):
    result = demonstration
    conditions = [state.condition.name for state in result.prediction.prediction.conditions]
    assert conditions == ["1", "2", "3", "4", "5", "6"]  # the campaign's five, then the fleet's sixth
    value = result.calibration.calibration.parameters[0].value
    assert result.prediction.fleet.number("masuda.constant_db") == pytest.approx(value)
    levels = result.prediction.tables["predictions"]
    assert set(levels["receiver"]) == {"4 m", "mic_left", "mic_right", "mic_motor", "mic_gearbox"}
    total = levels[(levels["path"] == "total") & (levels["receiver"] == "4 m") & (levels["weighting"] == "Z")]
    for fitted in result.calibration.calibration.levels:
        (level,) = total[total["condition"] == fitted.datum.condition.name]["level_db"]
        assert level == pytest.approx(fitted.predicted_db, abs=0.05)


@pytest.mark.parametrize(
    ("leading", "confidence", "said"),
    [
        (None, None, "undecided, for none of the noise lines, which are 41 % of the sound energy, could be given to"),
        ("unassigned", 0.7, "undecided, for most of the energy of the noise lines, which are 41 % of the sound energy"),
        ("gearbox", 0.7, "undecided, the gearbox leads the noise lines (P\u00a00.70), which are 41 % of the sound"),
    ],
)
def test_an_undecided_condition_says_why(demonstration, leading, confidence, said):
    given = {"condition": "1", "dominant": "undecided", "line_fraction": 0.41}
    verdict = SimpleNamespace(**given, leading=leading, confidence=confidence)
    assert f"km/h, motor 341.9 rpm): {said}" in _verdict_line(demonstration.analysis, verdict)


def test_the_settings_name_the_parameters_that_were_fitted(demonstration):
    fitted = tuple(parameter.key for parameter in demonstration.calibration.calibration.parameters)
    own = {parameter.name for parameter in demonstration.campaign.calibration.parameter}
    assert demonstration.settings["calibration.free"] == [key for key in fitted if key not in own]
    other = SimpleNamespace(calibration=SimpleNamespace(parameters=[SimpleNamespace(key="model.structure_gain_db")]))
    campaign = demonstration.campaign
    freed = settings_in_force(campaign, other)["calibration.free"]
    stated = "free" in campaign.calibration.model_fields_set
    assert freed == (campaign.settings["calibration.free"] if stated else ("model.structure_gain_db",))
    assert settings_in_force(campaign, None) == campaign.settings


def test_one_report_with_three_parts_and_one_provenance(demonstration):
    document = run_report(demonstration)  # the document itself refuses two sections, tables or figures of one name
    assert [part.id for part in document.sections] == ["recordings", "calibration", "prediction", "provenance"]
    first = document.summary[0]
    assert isinstance(first, Sentences)
    verdicts = {verdict.condition: verdict for verdict in demonstration.analysis.dominance}
    for (name, verdict), said in zip(verdicts.items(), first.items, strict=False):  # a sentence a speed
        assert re.match(rf"Condition {name} \(\d+ km/h[^)]*\): the {verdict.dominant} dominates the noise lines", said)
        assert said.endswith(" re 20 µPa.")
    assert first.items[len(verdicts)].startswith("Calibration: ")
    assert first.items[len(verdicts) + 1].startswith("Prediction with the calibrated fleet: ")
    headings = [block.id for block in document.summary if isinstance(block, Section)]
    assert headings == ["answer-sources", "answer-fit", "answer-prediction", "answer-verdicts"]
    steps = {
        row[2]
        for block in walk(document.sections)
        if isinstance(block, Table) and block.name == "steps"
        for row in block.rows
    }
    assert {"gear-sweep", "measurement"} <= steps
    said = [block.text.rstrip(".").lower() for block in walk(document.summary) if isinstance(block, Notice)]
    for doubt in demonstration.doubts:
        assert said.count(doubt.rstrip(".").lower()) == 1, doubt
    assert any(isinstance(block, Details) for block in walk(document.sections))


def test_the_printed_levels_alone_are_calibrated_and_predicted(tda, tmp_path):
    code, out, _ = tda("run", PRINTED, "-o", "out")
    assert code == 0
    assert faults(tmp_path / "out") == []
    assert "Prediction with the calibrated fleet" in out
    assert list(pd.read_csv(tmp_path / "out" / "levels.csv")["level_db"]) == [88.3, 88.0]


def test_arrays_of_runs_and_model_in_one_file(tda, tmp_path):
    # A run that is called like the model's group gets another one.
    campaign = fleet_campaign(tmp_path / "ride", ("a", "prediction"))
    assert tda("run", campaign, "-o", "out", "--quiet")[0] == 0
    with h5py.File(tmp_path / "out" / "result.h5") as file:
        assert {name: group.attrs["name"] for name, group in file.items()} == {
            "a": "a",
            "prediction": "Reference drive",
            "prediction_": "prediction",
        }
        assert set(file["prediction"]) == {"mesh", "conditions"}
        assert "channels" in file["prediction_"]


def test_twice_the_same_bytes(tda, tmp_path):
    campaign = fleet_campaign(tmp_path / "ride")
    for name in ("one", "two"):
        assert tda("run", campaign, "-o", name, "--store", tmp_path / f"store of {name}", "--quiet")[0] == 0
    assert files_of(tmp_path / "one") == files_of(tmp_path / "two")


# ---------------------------------------------------------------- what can be done where not all can


def left_out(folder):
    """Which parts a folder lacks."""
    marks = {"calibration": "calibration.json", "prediction": "predictions.csv", "levels": "levels.csv"}
    return {name for name, file in marks.items() if not (folder / file).is_file()}


def test_without_a_fleet_the_measured_side_is_done_and_the_rest_is_said(tda, tmp_path):
    campaign = small_campaign(tmp_path / "ride", conditions="a")
    code, _, err = tda("run", campaign, "-o", "out")
    assert code == 0
    assert warnings_of(err) == ["nothing is calibrated and nothing is predicted: there is no fleet"]
    assert left_out(tmp_path / "out") == {"calibration", "prediction"}
    assert manifest_of(tmp_path / "out")["problems"] == warnings_of(err)


def test_a_fleet_file_that_is_not_there(tda, tmp_path):
    campaign = fleet_campaign(tmp_path / "ride", "a")
    (tmp_path / "ride" / "fleet.toml").unlink()
    code, _, err = tda("run", campaign, "-o", "out")
    assert code == 0
    assert "fleet.toml: no such file" in err
    assert "nothing is calibrated and nothing is predicted: there is no fleet" in err
    assert left_out(tmp_path / "out") == {"calibration", "prediction"}


def test_a_fleet_without_gear_parameters_names_its_sources_and_what_is_missing(tda, tmp_path):
    campaign = fleet_campaign(tmp_path / "ride", "a", KINEMATICS_ALONE + "[operation]\ntorque_n_m = 900\n")
    code, out, err = tda("run", campaign, "-o", "out")
    assert code == 0
    unfitted, unpredicted = warnings_of(err)
    assert unfitted.startswith("the fleet is not calibrated: fleet.toml: [gear_dynamics]: ")
    assert unpredicted.startswith("nothing is predicted: fleet.toml: [[gear_pair]]: normal_module_mm is missing")
    assert str(tmp_path) not in err
    assert out.startswith("Condition a (30 km/h")
    assert left_out(tmp_path / "out") == {"calibration", "prediction"}


@pytest.mark.parametrize(
    ("channels", "place"),
    [
        (MIC.replace("distance_m = 4.0", "distance_m = 7.5"), {"4 m", "mic"}),
        (MIC.replace("distance_m = 4.0\n", ""), {"4 m"}),
    ],
    ids=["at 7.5 m", "nowhere"],
)
def test_without_a_receiver_at_4_m_the_prediction_is_made_with_the_fleet_as_it_is(tda, tmp_path, channels, place):
    campaign = fleet_campaign(tmp_path / "ride", "a", channels=channels)
    code, out, err = tda("run", campaign, "-o", "out")
    assert code == 0
    why = "the fleet is not calibrated, the prediction is made with it as it is: no level to calibrate with"
    assert sum(line.startswith(why) for line in warnings_of(err)) == 1
    assert "Prediction with the fleet as it is: at 4 m " in out
    assert "Calibration: " not in out
    assert left_out(tmp_path / "out") == {"calibration"}
    assert set(pd.read_csv(tmp_path / "out" / "predictions.csv")["receiver"]) == place
    result = td.run(campaign)
    assert any(
        why in block.text.replace("The fleet", "the fleet")
        for block in walk(run_report(result).summary)
        if isinstance(block, Notice)
    )


def test_known_levels_alone(tda, tmp_path):
    campaign = fleet_campaign(tmp_path / "ride", "")
    campaign.write_text(
        campaign.read_text(encoding="utf-8") + table("level", condition="1", distance_m=4.0, level_db=80.0)
    )
    code, out, _ = tda("run", campaign, "-o", "out")
    assert code == 0
    assert left_out(tmp_path / "out") == set()
    assert out.splitlines()[0].startswith("Condition 1: 80.0 dB")
    assert [
        state["condition"] for state in json.loads((tmp_path / "out/calibration.json").read_text())["residuals"]
    ] == ["1"]


def test_where_all_logs_fail_the_prediction_is_still_made(tda, tmp_path):
    campaign = fleet_campaign(tmp_path / "ride", ("a", "b"))
    (tmp_path / "ride" / "a.h5").write_bytes(b"no log")
    (tmp_path / "ride" / "b.h5").unlink()
    code, _, err = tda("run", campaign, "-o", "out")
    assert code == 0
    said = warnings_of(err)
    assert said[0].startswith("run 'a' is left out: ")
    assert said[1] == "run 'b' is left out: b.h5: no such file"
    assert "microphone" not in err
    assert left_out(tmp_path / "out") == {"calibration"}
    conditions = list(pd.read_csv(tmp_path / "out" / "conditions.csv")["condition"])
    assert conditions == ["a", "b", "1", "2"]
    quality = pd.read_csv(tmp_path / "out" / "quality.csv")
    assert list(quality["verdict"]) == ["bad", "bad"]


def test_where_all_logs_fail_and_nothing_can_be_predicted_that_is_an_error(tda, tmp_path):
    campaign = fleet_campaign(tmp_path / "ride", "a", KINEMATICS_ALONE)
    (tmp_path / "ride" / "a.h5").unlink()
    code, out, err = tda("run", campaign, "-o", "out")
    assert (code, out) == (1, "")
    assert err.splitlines() == [f"error: {tmp_path / 'ride' / 'a.h5'}: no such file"]
    assert not (tmp_path / "out").exists()


def test_a_campaign_file_that_contradicts_itself_is_an_error(tda, tmp_path):
    wrong = MIC.replace("distance_m = 4.0", "distance_m = 4.0\nheight_above_rail_m = 9.0")
    campaign = fleet_campaign(tmp_path / "ride", "a", channels=wrong)
    code, out, err = tda("run", campaign, "-o", "out")
    assert (code, out) == (1, "")
    assert "channel 'mic'" in err
    assert not (tmp_path / "out").exists()


def test_torques_of_the_runs_stand_in_for_a_law_that_the_fleet_lacks(tda, tmp_path):
    text = fleet_toml(load_fleet(plain_fleet("reference-drive")).replaced({}))
    operation = text[text.index("[operation]") : text.index("[masuda]")]
    campaign = fleet_campaign(tmp_path / "ride", "", text.replace(operation, ""))
    fleetless = run_table("a", logs=["a.h5"], torque_n_m=900.0)
    small_campaign(tmp_path / "ride", conditions="a")
    head = HEAD.replace("\n\n", '\nfleet = "fleet.toml"\n\n')
    campaign.write_text(head + MIC + fleetless, encoding="utf-8")
    code, _, err = tda("run", campaign, "-o", "out")
    assert code == 0
    assert any(line.startswith("no sweep of speed: [operation]: ") for line in warnings_of(err))
    assert list(pd.read_csv(tmp_path / "out" / "conditions.csv")["torque_n_m"]) == [900.0]
    assert not (tmp_path / "out" / "speed_sweep.csv").exists()
    overview = next(
        block for block in walk(run_report(td.run(campaign)).sections) if getattr(block, "id", "") == "model-conditions"
    )
    assert "+900 N m of one motor, as the runs state it" in overview.blocks[0].text


# ---------------------------------------------------------------- another language


UNITS = r"\b(dB|Hz|kHz|re|Pa|mm|km/h|rpm|µm|kW|kg|ms|SHA-256|pW)\b"
DATA = re.compile(r"\b(motor|gearbox|mic)_\w+|\b[a-z_]+\.[a-z_]+\b|\[model\] gear_path = \"\w+\"|" + UNITS)
"""Names of the demonstration's channels, keys of files, units."""


def texts_of(document):
    """Texts of a report, but not those of cells and lists, which hold data and doubts of the analysis."""
    for block in walk((*document.summary, *document.sections)):
        if isinstance(block, Section):
            yield block.title
        elif isinstance(block, Paragraph):
            yield block.text
        elif isinstance(block, Details):
            yield block.summary
        elif isinstance(block, Table):
            yield from (block.caption, *(column.title for column in block.columns))
        elif isinstance(block, FigureBlock):
            figure = block.figure
            yield from (figure.title, figure.caption, figure.x_axis.label, figure.y_axis.label)


def test_every_text_of_the_report_can_be_in_another_language(demonstration, tmp_path):
    """In a language that puts every text in brackets, what stands outside of them nobody could translate."""
    catalog = read_po(BytesIO((ROOT / "tdacoustic/reporting/languages/report.pot").read_bytes()), locale="de")
    for message in catalog:
        if message.id:
            plural = isinstance(message.id, tuple)
            message.string = tuple(f"⟦{text}⟧" for text in message.id) if plural else f"⟦{message.id}⟧"
    with (tmp_path / "brackets.po").open("wb") as stream:
        write_po(stream, catalog)
    with speaking(read_language(tmp_path / "brackets.po")):
        document = run_report(demonstration)
    held = list(texts_of(document))
    assert len(held) > 300
    forgotten = {}
    for text in held:
        outside = text
        if text.count("⟦") != text.count("⟧"):  # names that are cut at their comma lose a bracket
            outside = re.sub(r"⟦([^⟦⟧.]+), (?=⟦)", r"\1, ", text)
        while outside != (outside := re.sub(r"⟦[^⟦⟧]*⟧", " ", outside)):
            pass
        if left := re.findall(r"[^\W\d_]{3,}", DATA.sub(" ", outside)):
            forgotten[text] = left
    assert not forgotten, "\n".join(f"{text!r}: {left}" for text, left in forgotten.items())
