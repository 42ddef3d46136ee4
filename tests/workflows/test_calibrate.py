"""The calibration as its user gets it: printed levels alone, and what is refused."""

import importlib.util
import json
from pathlib import Path

import pytest
from plain_fleets import plain_campaign, plain_fleet

from tdacoustic.fleet import load_fleet

ROOT = Path(__file__).resolve().parents[2]
CHECKER = ROOT.parent / "shared" / "check_outputs.py"
PRINTED = plain_campaign("crrc-freight-printed")
HEAD = 'schema = "tdacoustic-campaign/1"\nname = "Made"\norigin = "printed"\n'
FLEET = f'fleet = "{plain_fleet("reference-drive").as_posix()}"\n'
LEVEL = '[[level]]\ncondition = "{}"\ndistance_m = 4.0\nlevel_db = {}\nsigma_db = 0.5\n'


@pytest.fixture
def tda(tmp_path, call_program, monkeypatch):
    """Run the program in this process, in a folder of its own; returns exit code, stdout, stderr."""
    monkeypatch.setenv("TDACOUSTIC_STORE", str(tmp_path / "store"))
    monkeypatch.chdir(tmp_path)
    return call_program


def test_the_printed_levels_alone(tda, tmp_path):
    code, out, err = tda("calibrate", PRINTED, "-o", "out")
    assert (code, out.strip()) == (0, str(Path("out") / "report.html"))
    found = json.loads((tmp_path / "out" / "calibration.json").read_text(encoding="utf-8"))
    assert [item["condition"] for item in found["residuals"]] == ["3", "5"]
    assert {item["origin"] for item in found["residuals"]} == {"printed"}
    assert found["doubts"]  # two levels for two parameters: it cannot be sure
    assert all(f"warning: {doubt}" in err for doubt in found["doubts"])
    calibrated = load_fleet(tmp_path / "out" / "fleet.calibrated.toml")
    value = calibrated.get("masuda.constant_db")
    assert value.value == pytest.approx(found["parameters"]["masuda.constant_db"]["value"])
    assert value.origin == "calibrated to Freight locomotive, printed levels"
    if CHECKER.is_file():
        spec = importlib.util.spec_from_file_location("check_outputs", CHECKER)
        checker = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(checker)
        assert list(checker.calibration_faults(tmp_path / "out")) == []


def test_a_constant_alone_is_found_exactly(tda, tmp_path):
    # One free parameter that shifts all levels alike: the mean of measured less model, weighted alike.
    campaign = tmp_path / "campaign.toml"
    text = HEAD + FLEET + LEVEL.format("5", 87.0) + LEVEL.format("6", 96.0)
    campaign.write_text(text + '[calibration]\nfree = ["masuda.constant_db"]\nmodel_sigma_db = 1.0\n')
    assert tda("calibrate", campaign, "-o", "out", "--quiet")[0] == 0
    found = json.loads((tmp_path / "out" / "calibration.json").read_text(encoding="utf-8"))
    before = [item["before_db"] for item in found["residuals"]]
    expected = 20.0 + ((87.0 - before[0]) + (96.0 - before[1])) / 2.0
    parameter = found["parameters"]["masuda.constant_db"]
    assert parameter["value"] == pytest.approx(expected, abs=1e-6)
    sigma = (0.5**2 + 1.0**2) ** 0.5 / 2**0.5
    assert parameter["stderr"] == pytest.approx(sigma, rel=1e-6)
    low, high = parameter["ci95"]
    assert (low, high) == (
        pytest.approx(expected - 1.96 * sigma, abs=0.01),
        pytest.approx(expected + 1.96 * sigma, abs=0.01),
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD + LEVEL.format("5", 87.0), "fleet is missing, and a calibration needs it"),
        (HEAD + FLEET + LEVEL.format("9", 87.0), "no level to calibrate with"),
        (HEAD + FLEET + LEVEL.format("5", 87.0) + '[calibration]\nfree = ["masuda.constnt_db"]\n', "constant_db"),
        (HEAD + FLEET + LEVEL.format("5", 87.0) + '[calibration]\nfree = ["masuda.placement"]\n', "no single number"),
    ],
)
def test_what_cannot_be_calibrated_is_one_line(tda, tmp_path, text, message):
    campaign = tmp_path / "campaign.toml"
    campaign.write_text(text)
    code, out, err = tda("calibrate", campaign, "-o", "out")
    assert (code, out) == (1, "")
    assert len(err.splitlines()) == 1
    assert message in err
    assert not (tmp_path / "out").exists()


CLOSE = '[calibration]\nfree = ["masuda.constant_db"]\nmodel_sigma_db = 0.5\n'


def campaign_of(folder, name, levels, more=CLOSE):
    """A campaign of stated levels in a folder of its own."""
    folder.mkdir()
    text = HEAD.replace('"Made"', f'"{name}"') + FLEET
    path = folder / "campaign.toml"
    path.write_text(text + "".join(LEVEL.format(*level) for level in levels) + more, encoding="utf-8")
    return path


def calibration_in(folder):
    return json.loads((folder / "calibration.json").read_text(encoding="utf-8"))


def test_two_campaigns_together(tda, tmp_path):
    # The second is 1 dB louder throughout: half a decibel of offset to either side, and the constant between both.
    campaign_of(tmp_path / "second", "Second", [("5", 88.0), ("6", 97.0)])
    more = f'{CLOSE}with_campaigns = ["../second"]\noffset_sigma_db = 5\n'
    first = campaign_of(tmp_path / "first", "First", [("5", 87.0), ("6", 96.0)], more)
    assert tda("calibrate", first, "-o", "out", "--quiet")[0] == 0
    found = calibration_in(tmp_path / "out")
    offsets = {key: held for key, held in found["parameters"].items() if key.startswith("level_offset_db")}
    assert set(offsets) == {"level_offset_db[First]", "level_offset_db[Second]"}
    apart = offsets["level_offset_db[Second]"]["value"] - offsets["level_offset_db[First]"]["value"]
    assert apart == pytest.approx(1.0, abs=0.05)
    assert {item["campaign"] for item in found["residuals"]} == {"First", "Second"}
    assert [item["file"] for item in found["inputs"]][-1] == "../second: campaign.toml"
    carried = load_fleet(tmp_path / "out" / "fleet.calibrated.toml").get("masuda.constant_db")
    assert carried.origin == "calibrated to First and Second"
    alone = campaign_of(tmp_path / "alone", "Alone", [("5", 87.5), ("6", 96.5)])
    assert tda("calibrate", alone, "-o", "one", "--quiet")[0] == 0
    expected = calibration_in(tmp_path / "one")["parameters"]["masuda.constant_db"]["value"]
    assert carried.value == pytest.approx(expected, abs=0.01)


def test_a_calibrated_fleet_is_the_prior_of_the_next(tda, tmp_path):
    first = campaign_of(tmp_path / "first", "First", [("5", 87.0), ("6", 96.0)])
    assert tda("calibrate", first, "-o", "earlier", "--quiet")[0] == 0
    earlier = calibration_in(tmp_path / "earlier")["parameters"]["masuda.constant_db"]
    more = f'{CLOSE}prior_fleet = "../earlier/fleet.calibrated.toml"\nprior_discount = 3\n'
    second = campaign_of(tmp_path / "second", "Second", [("5", 97.0)], more)
    assert tda("calibrate", second, "-o", "out", "--quiet")[0] == 0
    found = calibration_in(tmp_path / "out")
    parameter, (carried,) = found["parameters"]["masuda.constant_db"], found["transferred"]
    assert parameter["prior"] == {
        "mean": pytest.approx(earlier["value"]),
        "sigma": pytest.approx(3 * earlier["stderr"]),
    }
    # by hand: the prior and one level of 0.5 dB twice, weighted by their variances
    sigma = (0.5**2 + 0.5**2) ** 0.5
    weights = (3 * earlier["stderr"]) ** -2, sigma**-2
    expected = (weights[0] * earlier["value"] + weights[1] * carried["alone"]) / sum(weights)
    assert parameter["value"] == pytest.approx(expected, abs=1e-3)
    assert carried["difference"] == pytest.approx(
        (carried["alone"] - earlier["value"]) / (sigma**2 + (3 * earlier["stderr"]) ** 2) ** 0.5, rel=1e-3
    )
    assert "../earlier/fleet.calibrated.toml" in [item["file"] for item in found["inputs"]]


def test_all_that_a_parameter_can_be_given(tda, tmp_path):
    more = CLOSE.replace("model_sigma_db = 0.5", "model_sigma_db = 0.5\nfit_model_sigma = true\nloss = 'huber'") + (
        '[[calibration.parameter]]\nname = "gear_dynamics.mesh_damping_ratio"\nmin = 0.02\nmax = 0.2\n'
        "prior_mean = 0.05\nprior_sigma = 0.01\n"
        '[[calibration.parameter]]\nname = "gear_dynamics.bearing_damping_ratio"\n'
        'expression = "2 * gear_dynamics.mesh_damping_ratio"\n'
    )
    levels = [("2", 80.0), ("3", 83.0), ("4", 86.0), ("5", 89.0), ("6", 97.0)]
    assert tda("calibrate", campaign_of(tmp_path / "own", "Own", levels, more), "-o", "out", "--quiet")[0] == 0
    found = calibration_in(tmp_path / "out")
    mesh, bearing = (found["parameters"][f"gear_dynamics.{part}_damping_ratio"] for part in ("mesh", "bearing"))
    assert (mesh["min"], mesh["max"]) == (0.02, 0.2)
    assert mesh["prior"] == {"mean": pytest.approx(0.05), "sigma": pytest.approx(0.01)}
    assert bearing["value"] == pytest.approx(2 * mesh["value"])
    assert bearing["expression"] == "2 * gear_dynamics.mesh_damping_ratio"
    assert found["model_sigma_fitted"]
    assert load_fleet(tmp_path / "out" / "fleet.calibrated.toml").get("gear_dynamics.bearing_damping_ratio").stderr > 0


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ('with_campaigns = ["../nowhere"]\n', "nowhere"),
        ('prior_fleet = "nowhere.toml"\n', "nowhere.toml"),
        pytest.param(
            f"prior_fleet = {json.dumps(plain_fleet('reference-drive').as_posix())}\n",
            "stderr",
            id="prior_fleet that nobody calibrated",  # its path is another one in each process
        ),
        ('data = ["receivers"]\n', ""),
        ("prior_discount = 0.5\n", "prior_discount must be >= 1, got 0.5"),
        ('loss = "absolute"\n', "loss"),
        ('data = ["level"]\n', "data"),
        ('[[calibration.parameter]]\nname = "x"\nmin = 2\nmax = 1\n', "min must be below max"),
        ('[[calibration.parameter]]\nname = "x"\nprior_mean = 2\n', "prior_mean and prior_sigma belong together"),
        (
            '[[calibration.parameter]]\nname = "x"\nminimum = 2\n',
            "unknown key 'minimum' in [[calibration.parameter]]; the nearest known key is 'min'",
        ),
        ('[[calibration.parameter]]\nname = "x"\n', "x is no parameter of a fleet"),
        ('[[calibration.parameter]]\nname = "x.y"\n', "x.y"),
        ('[[calibration.parameter]]\nname = "masuda.constant_db"\nexpression = "1 +"\n', "masuda.constant_db"),
    ],
)
def test_settings_that_cannot_be_are_one_line(tda, tmp_path, more, message):
    campaign = campaign_of(tmp_path / "own", "Own", [("5", 87.0)], CLOSE + more)
    code, out, err = tda("calibrate", campaign, "-o", "out")
    if message:
        assert (code, out) == (1, "")
        assert len(err.splitlines()) == 1, err
        assert message in err
    else:  # levels that are stated are enough, whatever is asked of recordings that are not there
        assert code == 0


def test_the_same_name_twice_and_another_fleet_are_refused(tda, tmp_path):
    campaign_of(tmp_path / "second", "First", [("5", 88.0)])
    first = campaign_of(tmp_path / "first", "First", [("5", 87.0)], f'{CLOSE}with_campaigns = ["../second"]\n')
    code, _, err = tda("calibrate", first, "-o", "out")
    assert code == 1
    assert "has the name 'First' of another one" in err
    plain_fleet("crrc-freight")
    other = tmp_path / "second" / "campaign.toml"
    other.write_text(other.read_text().replace("reference-drive", "crrc-freight").replace('"First"', '"Second"'))
    code, _, err = tda("calibrate", first, "-o", "out")
    assert code == 1
    assert "is not of the same fleet" in err
