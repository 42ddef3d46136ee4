"""MAT-files of level 7.3: HDF5 with MATLAB's conventions.

A variable is a dataset, a structure a group; the attribute ``MATLAB_class`` says
what it is. HDF5 lists the dimensions in the opposite order, so that MATLAB's n x 2
matrix is a dataset of 2 x n. Cells, arrays of structures and MATLAB's own classes
are references to other places of the file (``#refs#``); no reference is followed.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from tdacoustic.errors import FormatError
from tdacoustic.formats.hdf5.attributes import Attributes
from tdacoustic.formats.hdf5.tree import read_tree, reason_to_skip
from tdacoustic.formats.matlab.workspace import LEFT_OUT, MAX_TEXT, Array, Struct, Workspace, reason_of_shape

__all__ = ["read_workspace"]

NUMERIC = frozenset(
    {"double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "logical"}
)
LIGHT_BYTES = 16 << 20
OWN_GROUPS = frozenset({"#refs#", "#subsystem#"})


def read_workspace(file: Any) -> Workspace:
    """Walk the variables of a level 7.3 file.

    Parameters
    ----------
    file : h5py.File

    Returns
    -------
    Workspace
        Whose arrays' keys are names of datasets.
    """
    walk = _Walk(file)
    tree = read_tree(file, walk.leave_out)
    walk.workspace.flags.extend(flag.replace("/", ".") for flag in tree.flags)
    for name in tree.datasets:
        walk.add(name)
    return walk.workspace


class _Walk:
    """One walk through a file: takes numbers and texts aside, and says why something can be no channel."""

    def __init__(self, file: Any) -> None:
        self.file = file
        self.workspace = Workspace()
        self._structs: dict[str, Struct] = {"": self.workspace.root}

    def _owner(self, name: str) -> tuple[Struct, str]:
        """The structure that a dataset is a field of, and the field's name."""
        above, _, own = name.rpartition("/")
        if above not in self._structs:
            owner, called = self._owner(above)
            struct = Struct(called, owner)
            owner.structs.append(struct)
            self._structs[above] = struct
        return self._structs[above], own

    def leave_out(self, name: str, item: Any) -> str | None:
        """See `tdacoustic.formats.hdf5.tree.read_tree`."""
        import h5py

        if name in OWN_GROUPS or not isinstance(item, h5py.Group | h5py.Dataset):
            return ""
        attributes = Attributes(item)
        kind = attributes.text("MATLAB_class") or ""
        if "MATLAB_sparse" in item.attrs:
            return LEFT_OUT["sparse"]
        if "MATLAB_object_decode" in item.attrs and kind not in ("char", "logical", "struct"):
            return LEFT_OUT.get(kind, LEFT_OUT["object"])
        if kind in LEFT_OUT:
            return LEFT_OUT[kind]
        if isinstance(item, h5py.Group):
            return None if kind in ("struct", "") else LEFT_OUT["object"]
        return self._leave_out_dataset(name, item, attributes, kind)

    def _leave_out_dataset(self, name: str, item: Any, attributes: Attributes, kind: str) -> str | None:
        import h5py

        if attributes.number("MATLAB_empty"):
            return ""  # holds the dimensions of what is empty
        if item.dtype.kind == "O":
            return LEFT_OUT["struct array"] if h5py.check_ref_dtype(item.dtype) else "are not numeric"
        if item.dtype.kind == "V":
            return LEFT_OUT["complex"]
        if kind and kind not in NUMERIC | {"char"}:
            return LEFT_OUT["object"]
        reason = reason_to_skip(item)
        n_values = math.prod(item.shape) if item.shape is not None else 0
        inside = not item.is_virtual and not item.external and _is_light(item)
        if kind == "char":
            if inside:
                self._take_text(name, item)
            return ""
        if n_values == 1 and item.dtype.kind in "iuf" and inside:
            self._take_number(name, item)
            return ""
        if reason is None or n_values == 0:
            return reason
        return reason_of_shape(item.shape) if item.ndim > 2 and not item.is_virtual and not item.external else reason

    def _take_number(self, name: str, item: Any) -> None:
        owner, own = self._owner(name)
        owner.numbers.append((own, float(np.asarray(item[()]).reshape(-1)[0])))

    def _take_text(self, name: str, item: Any) -> None:
        """A text, stored as UTF-16 codes; of several rows the first ones, on one line."""
        if item.dtype.kind != "u" or item.ndim != 2 or item.shape[0] > MAX_TEXT:
            return
        codes = np.asarray(item[:, : max(1, MAX_TEXT // max(1, item.shape[0]))])
        rows = [
            codes[:, row].astype("<u2").tobytes().decode("utf-16-le", errors="replace") for row in range(codes.shape[1])
        ]
        owner, own = self._owner(name)
        owner.texts.append((own, " ".join(row.strip("\0 \t\r\n") for row in rows)))

    def add(self, name: str) -> None:
        """Add a dataset that can be a channel."""
        dataset = self.file[name]
        owner, own = self._owner(name)
        attributes = Attributes(dataset)
        kind = attributes.text("MATLAB_class") or ""
        shape = dataset.shape[::-1] if dataset.ndim == 2 else (dataset.shape[0], 1)
        dtype = dataset.dtype.newbyteorder("=")

        def sample(index: int) -> float:
            at = (index,) if dataset.ndim == 1 else (index, 0) if dataset.shape[1] == 1 else (0, index)
            return float(dataset[at])

        owner.arrays.append(
            Array(
                own,
                (int(shape[0]), int(shape[1])),
                dtype,
                kind == "logical" or dtype.kind == "b",
                name,
                sample,
                attributes.storage_flags(),
            )
        )


def _is_light(dataset: Any) -> bool:
    """Whether reading a part of a dataset takes little memory, and no filter that HDF5 itself does not have."""
    import h5py

    layout = dataset.id.get_create_plist()
    available = all(h5py.h5z.filter_avail(layout.get_filter(index)[0]) for index in range(layout.get_nfilters()))
    return available and math.prod(dataset.chunks or (1,)) * dataset.dtype.itemsize <= LIGHT_BYTES


def checked_header(path: Path, head: bytes) -> str:
    """The text of a level 7.3 file's header.

    Raises
    ------
    FormatError
        The file ends within it.
    """
    if len(head) < 520:
        raise FormatError(
            f"{path}: truncated: a MAT-file 7.3 begins with 520 bytes of header, the file has {len(head)}"
        )
    return head[:116].split(b"\0")[0].decode("latin-1").strip()
