"""The calibration as its user gets it: printed levels alone, and what is refused."""

import importlib.util
import json
from pathlib import Path

import pytest

from tdacoustic.fleet import load_fleet

ROOT = Path(__file__).resolve().parents[2]
CHECKER = ROOT.parent / "shared" / "check_outputs.py"
PRINTED = ROOT / "recordings" / "crrc-freight-printed"
HEAD = 'schema = "tdacoustic-campaign/1"\nname = "Made"\norigin = "printed"\n'
FLEET = f'fleet = "{(ROOT / "calibration" / "reference-drive" / "fleet.toml").as_posix()}"\n'
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
