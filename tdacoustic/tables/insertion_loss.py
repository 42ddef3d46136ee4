"""The insertion loss as rows, and as arrays in ``result.h5``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from tdacoustic.drive.insertion_loss import InsertionLoss
from tdacoustic.tables.frames import Row
from tdacoustic.tables.hdf5_groups import put

if TYPE_CHECKING:
    import h5py

__all__ = ["insertion_loss_rows", "write_insertion_loss"]


def insertion_loss_rows(held: InsertionLoss) -> Iterator[Row]:
    """Yield a row for each line, each third octave and each condition's mesh frequency, told apart by ``kind``.

    Parameters
    ----------
    held : InsertionLoss
    """
    lines = zip(held.frequency_hz.tolist(), held.loss_db.tolist(), held.mass_law_db.tolist(), strict=True)
    for frequency, loss, law in lines:
        yield {"kind": "line", "frequency_hz": frequency, "insertion_loss_db": loss, "mass_law_db": law}
    for middle, mean in zip(held.band_hz.tolist(), held.band_db.tolist(), strict=True):
        yield {"kind": "third_octave", "frequency_hz": middle, "insertion_loss_db": mean}
    for mesh in held.at_mesh:
        half, double = mesh.of_air_db or (None, None)
        low, high = mesh.beside_db or (None, None)
        yield {
            "kind": "mesh",
            "frequency_hz": mesh.frequency_hz,
            "insertion_loss_db": mesh.loss_db,
            "mass_law_db": mesh.mass_law_db,
            "condition": mesh.condition,
            "half_air_loss_db": half,
            "double_air_loss_db": double,
            "beside_low_db": low,
            "beside_high_db": high,
        }


def write_insertion_loss(group: h5py.Group, held: InsertionLoss) -> None:
    """Write an insertion loss into a group: ``frequency``, ``insertion_loss``, ``mass_law``, and the third octaves.

    Parameters
    ----------
    group : h5py.Group
    held : InsertionLoss
    """
    group.attrs["source_m"] = np.asarray(held.source_m)
    put(group, "frequency", held.frequency_hz, "Hz")
    put(group, "insertion_loss", held.loss_db, "dB")
    put(group, "mass_law", held.mass_law_db, "dB")
    put(group, "third_octave_frequency", held.band_hz, "Hz")
    put(group, "third_octave_insertion_loss", held.band_db, "dB")
