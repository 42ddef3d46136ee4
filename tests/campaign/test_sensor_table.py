"""The sensor database as a file from outside: what is read, chosen and refused."""

from datetime import date

import pytest

from tdacoustic.campaign import SCHEMA, load_campaign
from tdacoustic.campaign.sensor_table import MAX_BYTES, MAX_ROWS, read_sensor_table
from tdacoustic.errors import CampaignError, MissingFileError
from tdacoustic.sensors import SensorEntry, choose_entry, entries_of

HEAD = f'schema = "{SCHEMA}"\norigin = "measured"\nsensors = "sensors.csv"\n'
RUN = '[[run]]\ncondition = "1"\nlogs = ["a.h5"]\n'
MIC = '[[channel]]\nname = "mic"\nsensor = "{}"\n'


@pytest.fixture
def read(tmp_path):
    def made(text):
        (tmp_path / "sensors.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_sensor_table(tmp_path / "sensors.csv")

    return made


@pytest.fixture
def load(tmp_path):
    def loaded(text, table="serial,sensitivity\nSN 12,50 mV/Pa\n", head=HEAD):
        (tmp_path / "sensors.csv").write_text(table, encoding="utf-8")
        (tmp_path / "campaign.toml").write_text(head + text + RUN, encoding="utf-8")
        return load_campaign(tmp_path / "campaign.toml")

    return loaded


def test_rows_are_calibrations(read):
    rows = read(
        b"\xef\xbb\xbfSerial Number;Sensitivity;Unit;Calibration_Date;Due;Manufacturer;Note\r\n"
        b"1234;47.1;mV/Pa;2024-03-01;2025-03-01;X;first\r\n\r\nA-7;10.2 mV/(m/s^2);;;;Y;\r\n"
    )
    first, second = rows
    assert (first.serial, first.sensitivity, first.quantity) == ("1234", "47.1 mV/Pa", "sound_pressure")
    assert (first.date, first.due, first.note, first.line) == (date(2024, 3, 1), date(2025, 3, 1), "first", 2)
    assert (second.sensitivity, second.quantity, second.date) == ("10.2 mV/(m/s^2)", "acceleration", None)


@pytest.mark.parametrize(
    "header",
    [
        "Serial,Sensitivity [mV/Pa],Date,Due",
        "SERIAL NUMBER , sensitivity [ mV/Pa ] ,Calibration Date,Calibration_Due",
        "Serial No.,Sensitivity (mV/Pa),cal_date,cal due",
        "S/N,Sens. [mV/Pa],Calibration-Date,Due Date (YYYY-MM-DD)",
        "serial_nr,SENSITIVITY[mV/Pa],Calibrated on,calibration due date",
    ],
)
def test_headers_as_laboratories_spell_them(read, header):
    (row,) = read(f"{header}\n7,47.3,2024-03-01,2025-03-01\n")
    assert (row.serial, row.sensitivity, row.quantity) == ("7", "47.3 mV/Pa", "sound_pressure")
    assert (row.date, row.due) == (date(2024, 3, 1), date(2025, 3, 1))


def test_a_cell_that_states_its_unit_needs_none_of_the_header(read):
    table = "serial,Sensitivity [mV/Pa],Unit,Quantity\n1,50 mV/Pa,,Sound Pressure\n2,10,mV/g,\n3,48,,\n"
    assert [row.sensitivity for row in read(table)] == ["50 mV/Pa", "10 mV/g", "48 mV/Pa"]
    (row,) = read("serial,Sensitivity (mV/(m/s^2))\n1,10.2\n")
    assert (row.sensitivity, row.quantity) == ("10.2 mV/(m/s^2)", "acceleration")


def test_a_further_column_that_only_sounds_like_one_is_left_alone(read):
    (row,) = read("serial,s/n,date,calibrated,sensitivity,Sensitivity (free field)\n7,8,2024-01-01,yes,50 mV/Pa,x\n")
    assert (row.serial, row.date, row.sensitivity) == ("7", date(2024, 1, 1), "50 mV/Pa")


@pytest.mark.parametrize(
    ("table", "match"),
    [
        ("", "no sensor in it"),
        ("serial,Sensitivity [furlong]\n1,50\n", r"column 'Sensitivity \[furlong\]': .*furlong"),
        ("serial,Sensitivity [dB]\n1,50\n", r"column 'Sensitivity \[dB\]'"),
        ("serial,sensitivity,cal due,due date\n1,50 mV/Pa,,\n", "column 'due' stands twice"),
        ("serial,sensitivity,date,due\n1,50 mV/Pa,2025-01-01,2024-01-01\n", "due on 2024-01-01, before the calibr"),
        ("serial,sensitivity\n", "no sensor in it"),
        ("serial,sensitivty\n1,50 mV/Pa\n", "column 'sensitivity' is missing; there are"),
        ("serial,sensitivity,duee\n1,50 mV/Pa,x\n", "column 'duee': the nearest known column is 'due'"),
        ("serial,sensitivity,date,date\n1,50 mV/Pa,,\n", "column 'date' stands twice"),
        ("serial,sensitivity\n1\n", "line 2 has 1 cells, the header 2"),
        ("serial,sensitivity\n1,10,2 mV/g\n", "line 2 has 3 cells, the header 2; a decimal comma has to be a point"),
        ("serial;sensitivity\n1;10,2 mV/g\n", "line 2: sensitivity '10,2 mV/g' has a decimal comma"),
        ("serial;sensitivity;unit\n1;10,2;mV/g\n", "line 2: sensitivity '10,2' has a decimal comma"),
        ("serial,sensitivity\n,50 mV/Pa\n", "line 2: serial is empty"),
        ("serial,sensitivity\n1,\n", "line 2: sensitivity is empty"),
        ("serial,sensitivity\n1,50\n", "sensitivity '50' has no unit"),
        ("serial,sensitivity\n1,50 mV\n", "is not of the form '50 mV/Pa'"),
        ("serial,sensitivity\n1,-50 mV/Pa\n", "is a formula of a spreadsheet"),
        ("serial,sensitivity\n1,50 Pa/mV\n", "is no electrical unit"),
        ("serial,sensitivity\n1,1e400 mV/Pa\n", "must be positive"),
        ('serial,sensitivity,note\n1,50 mV/Pa,"=HYPERLINK(""http://x"")"\n', "note is a formula of a spreadsheet"),
        ("serial,sensitivity\n@SUM(A1),50 mV/Pa\n", "serial is a formula"),
        ("serial,sensitivity,date\n1,50 mV/Pa,01.03.2024\n", "date must be a day as 2026-05-04, got '01.03.2024'"),
        ("serial,sensitivity,quantity\n1,50 mV/Pa,noise\n", "quantity must be one of"),
        ("serial,sensitivity,quantity\n1,50 mV/Pa,acceleration\n", "does not fit quantity 'acceleration'"),
        ("serial,sensitivity\n1,50 mV/Pa\n1,51 mV/Pa\n", "lines 2 and 3: sensor '1' stands twice with no date"),
        ("serial,sensitivity,date\n1,50 mV/Pa,\n1,10 mV/g,2024-01-01\n", "measures two quantities"),
        (b"serial,sensitivity\n\xff,50 mV/Pa\n", r"is not UTF-8 \(byte 19\)"),
        ("serial,sensitivity\n1,50 mV/Pa\n".encode("utf-16"), "is not UTF-8"),
        (b"serial,sensitivity\n1\x00,50 mV/Pa\n", "is no text"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "is not UTF-8|is no text"),
        ('serial,sensitivity\n"1,50 mV/Pa\n', "line|no sensor"),
        ("serial,sensitivity\n1,50 mV/Pa\x1b[2J\n", "control characters"),
        ("serial,sensitivity\n" + "9" * 501 + ",50 mV/Pa\n", "serial is too long"),
        (b"serial,sensitivity\n" + b"x" * (MAX_BYTES + 1), "allowed for a sensor database are"),
    ],
)
def test_faults_say_file_and_line(read, table, match):
    with pytest.raises(CampaignError, match=match) as told:
        read(table)
    assert "sensors.csv" in str(told.value) and len(str(told.value)) < 600


def test_too_many_rows(read):
    with pytest.raises(CampaignError, match="has more than"):
        read("serial,sensitivity\n" + "".join(f"{n},50 mV/Pa\n" for n in range(MAX_ROWS + 1)))


def test_a_missing_table(tmp_path):
    with pytest.raises(MissingFileError, match=r"sensors\.csv: no such file \(sensors = "):
        read_sensor_table(tmp_path / "sensors.csv")


ROWS = (
    SensorEntry("SN 12", "50 mV/Pa", date(2022, 1, 1), date(2024, 1, 1)),
    SensorEntry("SN 12", "49 mV/Pa", date(2025, 1, 1), date(2026, 1, 1)),
)


@pytest.mark.parametrize(
    ("on", "sensitivity", "words"),
    [
        (date(2023, 6, 1), "50 mV/Pa", ""),
        (date(2024, 6, 1), "50 mV/Pa", "due on 2024-01-01, before the run of 2024-06-01"),
        (date(2025, 1, 1), "49 mV/Pa", ""),
        (date(2026, 6, 1), "49 mV/Pa", "due on 2026-01-01"),
        (date(2020, 1, 1), "50 mV/Pa", "calibrated on 2022-01-01, after the run of 2020-01-01"),
        (None, "49 mV/Pa", "date of the run is not known; of 2 calibrations the newest, of 2025-01-01"),
    ],
)
def test_the_calibration_that_holds_at_a_date(on, sensitivity, words):
    chosen = choose_entry(ROWS, on)
    assert chosen.entry.sensitivity == sensitivity
    assert words in "; ".join(chosen.doubts) and bool(words) == bool(chosen.doubts)


def test_serial_numbers_are_found_loosely_but_not_guessed():
    assert entries_of(ROWS, "sn-12") == ROWS and entries_of(ROWS, "12") == ROWS
    with pytest.raises(CampaignError, match=r"sensor 'SN 13' is not in the sensor database; the nearest are 'SN 12'"):
        entries_of(ROWS, "SN 13")
    with pytest.raises(CampaignError, match="could be any of 'SN 12', '12'"):
        entries_of((*ROWS, SensorEntry("12", "1 mV/Pa")), "S/N 12")


def test_a_channel_takes_its_quantity_from_its_sensor(load):
    (mic,) = load(MIC.format("12")).channels
    assert (mic.quantity, mic.component, mic.sensitivity) == ("sound_pressure", "air", None)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        (MIC.format("77"), r"channel 'mic': sensor '77' is not in the sensor database; .* \(sensors\.csv\)"),
        (MIC.format("12") + 'quantity = "acceleration"\n', "is a acceleration, but sensor '12' of sensors.csv is for"),
        (MIC.format("12") + "pulses_per_rev = 60\n", "is a tacho, but sensor"),
    ],
)
def test_sensors_that_do_not_fit(load, text, match):
    with pytest.raises(CampaignError, match=match):
        load(text)


def test_a_sensor_needs_the_database(load):
    with pytest.raises(CampaignError, match=r"channel 'mic': sensor = '12' needs the sensor database, add sensors ="):
        load(MIC.format("12"), head=f'schema = "{SCHEMA}"\norigin = "measured"\n')


@pytest.mark.parametrize(
    ("keys", "match"),
    [
        ('kind = "test"\ncalibrator = "94 dB"\n', "calibrator is of a run of kind 'calibration_before' or"),
        ('kind = "calibration_before"\ncalibrator = "loud"\n', "calibrator 'loud' is not of the form"),
        ('kind = "calibration_after"\ncalibrated = ["mik"]\n', "calibrated names channel 'mik', .* nearest is 'mic'"),
        ('kind = "calibration_after"\ncalibrator_frequency_hz = 0\n', "calibrator_frequency_hz must be > 0"),
        ('kind = "calibration_after"\ndate = "4.5.2026"\n', "date must be a day as '2026-05-04'"),
    ],
)
def test_keys_of_calibrator_runs(load, keys, match):
    with pytest.raises(CampaignError, match=match):
        load(MIC.format("12") + f'[[run]]\ncondition = "c"\nlogs = ["c.h5"]\n{keys}')


def test_a_day_of_toml_and_calibrators_in_a_table_of_runs(load, tmp_path):
    table = "name,kind,logs,calibrator,calibrator_frequency_hz,calibrated,date,condition\n"
    table += "c,calibration_before,c.h5,94 dB,1000,mic,2026-05-04,\nt,test,t.h5,,,,,1\n"
    (tmp_path / "runs.csv").write_text(table)
    (tmp_path / "sensors.csv").write_text("serial,sensitivity\n12,50 mV/Pa\n")
    (tmp_path / "campaign.toml").write_text(HEAD + 'runs = "runs.csv"\n' + MIC.format("12"))
    first = load_campaign(tmp_path).runs[0]
    assert (first.calibrator, first.calibrator_frequency_hz, first.calibrated) == ("94 dB", 1000.0, ("mic",))
    assert first.date == "2026-05-04" and first.is_calibration
    dated = '[[run]]\ncondition = "d"\nlogs = ["d.h5"]\ndate = 2026-05-04\n'
    assert load(MIC.format("12") + dated).run("d").date == "2026-05-04"
