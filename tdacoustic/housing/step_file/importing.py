"""From a STEP file to one solid in metres, healed where little is wrong, refused with the reason where much is."""

from __future__ import annotations

import math
import shutil
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tdacoustic.housing.box import HousingError
from tdacoustic.housing.step_file.text import MOST_PARTS, too_many_parts

__all__ = ["Imported", "NamedPlace", "imported"]

Triple = tuple[float, float, float]

SEWN_MM: Final = 0.1
"""Gaps between faces up to here are closed [assumed]: what translators leave, and far below any wall."""

LEAST_EXTENT_M: Final = 0.05
MOST_EXTENT_M: Final = 5.0
"""Largest dimension that a gearbox housing of a vehicle may have [assumed]."""

_EMPTY: Final = 1e30
"""OpenCASCADE bounds nothing by 1e100."""


@dataclass(frozen=True)
class NamedPlace:
    """A face or a solid with a name, by its bounds in metres."""

    name: str
    low_m: Triple
    high_m: Triple
    kind: str

    @property
    def middle_m(self) -> Triple:
        """Of the bounds."""
        x, y, z = (0.5 * (low + high) for low, high in zip(self.low_m, self.high_m, strict=True))
        return x, y, z


@dataclass(frozen=True)
class Imported:
    """One solid.

    Parameters
    ----------
    solid : netgen.occ.TopoDS_Shape
        In metres.
    named : tuple of NamedPlace
    notes : tuple of str
    """

    solid: Any
    named: tuple[NamedPlace, ...]
    notes: tuple[str, ...]


def imported(path: Path) -> Imported:
    """Read a file whose text `check_text` has passed.

    Raises
    ------
    HousingError
        No solid can be made of it, or none that can be a housing.
    """
    from netgen.meshing import NgException
    from netgen.occ import OCCException, OCCGeometry, Pnt

    try:
        with tempfile.TemporaryDirectory(prefix="tdacoustic-") as folder:
            plain = Path(folder, "housing.step")  # Netgen goes by the suffix, in small letters
            shutil.copyfile(path, plain)
            shape = OCCGeometry(str(plain)).shape
    except (NgException, OCCException, RuntimeError) as error:
        raise HousingError(f"OpenCASCADE cannot read it: {' '.join(str(error).split())}; export it anew") from None
    if shape is None or not shape.faces:
        raise HousingError(
            "it holds no surfaces that OpenCASCADE can read (a file of triangles or of curves alone holds no solid): "
            "export the housing as a solid"
        )
    solids, notes = list(shape.solids), []
    if len(solids) > MOST_PARTS:
        raise too_many_parts([solid.name for solid in solids])
    _check_size(_bounds(shape))
    named = _named(shape)
    if not solids:
        solids = _sewn(shape)
        notes.append(f"Its {len(shape.faces)} faces were no solid; sewn together they make {_count(solids)}.")
    solids = _without_inner_copies(solids)
    one = solids[0]
    if len(solids) > 1:
        one = _fused(solids)
        notes.append(f"Its {len(solids)} parts were made one solid.")
    if not one.mass > 0.0:
        raise HousingError("its solid is inside out or empty: heal it in the CAD program, or export it anew")
    edges = free_edges_of(one.faces)
    if edges:
        raise HousingError(_open_words(edges, len(one.faces)))
    return Imported(one.Scale(Pnt(0.0, 0.0, 0.0), 1e-3), named, tuple(notes))


def _bounds(shape: Any) -> tuple[Triple, Triple]:
    """Return the ends along x, y, z in metres."""
    low, high = shape.bounding_box
    return tuple(1e-3 * value for value in low), tuple(1e-3 * value for value in high)


def _check_size(bounds: tuple[Triple, Triple]) -> None:
    extent = [high - low for low, high in zip(*bounds, strict=True)]
    if not all(math.isfinite(edge) and edge < _EMPTY for edge in extent):
        raise HousingError("its geometry has no bounds: it is damaged; export it anew")
    if not LEAST_EXTENT_M <= max(extent) <= MOST_EXTENT_M:
        large = max(extent) > MOST_EXTENT_M
        guess = "millimetres called metres" if large else "metres called millimetres"
        raise HousingError(
            f"it is {extent[0]:.4g} x {extent[1]:.4g} x {extent[2]:.4g} m in size (x, y, z), and a gearbox housing is "
            f"{LEAST_EXTENT_M:g} to {MOST_EXTENT_M:g} m: probably {guess}; see the unit it was exported with"
        )


def _named(shape: Any) -> tuple[NamedPlace, ...]:
    """Return what has a name; twins (faces of one name that touch the same axis) stay apart here."""
    found = []
    for kind, held in (("face", shape.faces), ("solid", shape.solids)):
        for one in held:
            if one.name:
                low, high = _bounds(one)
                found.append(NamedPlace(str(one.name), low, high, kind))
    return tuple(found)


def free_edges_of(faces: Any) -> list[Any]:
    """Return the edges that belong to one face alone; a seam stands twice in its own face, and a pole has no length."""
    times: Counter[int] = Counter()
    held: dict[int, Any] = {}
    for face in faces:
        for wire in face.wires:
            for edge in wire.edges:
                times[hash(edge)] += 1
                held[hash(edge)] = edge
    return [edge for key, edge in held.items() if times[key] == 1 and edge.mass > 1e-6]


def _open_words(edges: list[Any], faces: int) -> str:
    ends = [edge.bounding_box for edge in edges]
    low = [1e-3 * min(end[0][axis] for end in ends) for axis in range(3)]
    high = [1e-3 * max(end[1][axis] for end in ends) for axis in range(3)]
    where = ", ".join(f"{name} {a:.4g} to {b:.4g} m" for name, a, b in zip("xyz", low, high, strict=True))
    return (
        f"it is an open shell and no solid: {len(edges)} edges of its {faces} faces belong to one face alone, over "
        f"{where}: close it in the CAD program and export a solid"
    )


def _sewn(shape: Any) -> list[Any]:
    """Return the solids that the faces of a shape without solids make, once sewn."""
    from netgen.occ import OCCGeometry, Sew

    sewn = Sew(list(shape.faces), tolerance=SEWN_MM)
    edges = free_edges_of(sewn.faces)
    if edges:
        raise HousingError(_open_words(edges, len(shape.faces)))
    geometry = OCCGeometry(sewn)
    geometry.Heal(tolerance=SEWN_MM, fixsmalledges=True, fixspotstripfaces=False, sewfaces=True, makesolids=True)
    solids = list(geometry.shape.solids)
    if not solids:
        raise HousingError(f"its {len(shape.faces)} faces make no solid, even when sewn: export the housing as a solid")
    return _hollowed(solids)


def _hollowed(solids: list[Any]) -> list[Any]:
    """Return solids made of single closed shells with those that lie in others taken out as their voids."""
    ascending = sorted((s if s.mass > 0.0 else s.Reversed() for s in solids), key=lambda s: -s.mass)
    found: list[Any] = []
    for solid in ascending:
        around = next((n for n, outer in enumerate(found) if _within(solid, outer)), None)
        if around is None:
            found.append(solid)
        else:
            found[around] = found[around] - solid
    return found


def _within(inner: Any, outer: Any) -> bool:
    (low, high), (out_low, out_high) = inner.bounding_box, outer.bounding_box
    return all(low[k] > out_low[k] and high[k] < out_high[k] for k in range(3))


def _without_inner_copies(solids: list[Any]) -> list[Any]:
    """Return the solids without those that stand twice at one place (translators do this)."""
    kept: list[Any] = []
    for solid in solids:
        low, high = solid.bounding_box
        twin = any(
            abs(other.mass - solid.mass) <= 1e-9 * abs(solid.mass)
            and all(
                abs(a[k] - b[k]) < 1e-6 for a, b in zip(other.bounding_box, (low, high), strict=True) for k in range(3)
            )
            for other in kept
        )
        if not twin:
            kept.append(solid)
    return kept


def _fused(solids: list[Any]) -> Any:
    from netgen.occ import Fuse

    whole = Fuse(solids)
    pieces = list(whole.solids)
    if len(pieces) > 1:
        told = []
        for piece in sorted(pieces, key=lambda s: -s.mass)[:4]:
            low, high = _bounds(piece)
            told.append(", ".join(f"{n} {a:.3g} to {b:.3g}" for n, a, b in zip("xyz", low, high, strict=True)))
        raise HousingError(
            f"its {len(solids)} parts make {len(pieces)} solids that do not touch (m: {'; '.join(told)}"
            f"{'; ...' if len(pieces) > 4 else ''}): a housing is one piece; export it alone, without what lies in or "
            "beside it"
        )
    return pieces[0]


def _count(solids: list[Any]) -> str:
    return "one solid" if len(solids) == 1 else f"{len(solids)} solids"
