"""Many small synthetic campaigns for the study of scale: those of `random_campaigns.py`, shorter, some sharing logs."""

from __future__ import annotations

import os
import re
from pathlib import Path

import h5py
from random_campaigns import RandomCampaign, random_campaign, write_campaign

FIRST_SEED = 5000
EVERY_SHARING = 5
"""Each fifth campaign has the logs of the one before it, under other settings; the logs of the one after it are
stored without compression, so that a byte of them is a byte of a sample.
"""


def small(seed: int) -> RandomCampaign:
    """Return a random campaign of two or three conditions and 3 to 5 s."""
    drawn = random_campaign(seed)
    n_conditions = 2 + seed % 2
    drawn.recipe["condition"] = drawn.recipe["condition"][:n_conditions]
    drawn.recipe["duration_s"] = 3.0 + seed % 3
    return drawn


def make_campaigns(folder: Path, n: int) -> list[Path]:
    """Make campaigns in folders ``c00000``, ``c00001``, ... and return these; what is there already stays."""
    made = []
    for number in range(n):
        place = folder / f"c{number:05d}"
        made.append(place)
        if (place / "campaign.toml").exists():
            continue
        if number % EVERY_SHARING == EVERY_SHARING - 1:
            share(made[-2], place)
        else:
            write_campaign(small(FIRST_SEED + number), place)
            for log in logs_of(place) if has_plain_logs(place) else ():
                store_plainly(log)
    return made


def has_plain_logs(campaign: Path) -> bool:
    """Whether a campaign's logs are stored without compression; no other campaign has them."""
    return int(campaign.name[1:]) % EVERY_SHARING == 0


def store_plainly(log: Path) -> None:
    """Store the samples of a log as they are."""
    temporary = log.with_suffix(".partial")
    with h5py.File(log) as old, h5py.File(temporary, "w") as new:
        new.attrs.update(old.attrs)
        for name, channel in old.items():
            new.create_dataset(name, data=channel[:], track_times=False).attrs.update(channel.attrs)
    temporary.replace(log)


def change_a_sample(log: Path) -> None:
    """Change the lowest bit of one sample of a microphone, and no other byte of the file."""
    with h5py.File(log) as held:
        channel = next(held[name] for name in held if name.startswith("mic"))
        place = channel.id.get_offset() + channel.dtype.itemsize * (channel.size // 2)
    content = bytearray(log.read_bytes())
    content[place] ^= 1
    log.write_bytes(content)


def share(other: Path, place: Path) -> None:
    """Make a campaign of another one's logs and fleet that wants its lines more prominent."""
    text = (other / "campaign.toml").read_text(encoding="utf-8")
    text = re.sub(r'"([^"/]+\.(?:h5|toml))"', rf'"../{other.name}/\1"', text)
    found = re.search(r'(?m)^name = "(.*)"$', text)
    assert found is not None
    text = text.replace(found[0], f'name = "{found[1]}, again"', 1)
    assert "[analysis]" not in text
    text += "\n[analysis]\nline_prominence_db = 8.0\n"
    place.mkdir(parents=True)
    temporary = place / "campaign.toml.partial"
    temporary.write_text(text, encoding="utf-8")
    os.replace(temporary, place / "campaign.toml")  # noqa: PTH105 - the file is what says that it is made


def logs_of(campaign: Path) -> list[Path]:
    """Return the logs in a campaign's own folder."""
    return sorted(campaign.glob("*.h5"))
