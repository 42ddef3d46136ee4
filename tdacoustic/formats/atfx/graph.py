"""How the instances of an ATFX file are related, from whichever side the file says it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

from tdacoustic.errors import FormatError
from tdacoustic.formats.atfx.document import Document, Instance

__all__ = ["Graph"]


class Graph:
    """The instances by base element, and their relations.

    Writers often state a relation on one side only, so both are looked at.

    Parameters
    ----------
    path : Path
        For messages.
    document : Document
    """

    def __init__(self, path: Path, document: Document) -> None:
        self.path = path
        self.document = document
        self._by_id = {(instance.element, instance.id): instance for instance in document.instances}
        self._sources: dict[tuple[str, str, str], list[Instance]] = {}
        for instance in document.instances:
            for name, relation in instance.relations.items():
                for identifier in relation.ids:
                    self._sources.setdefault((relation.element, identifier, name), []).append(instance)

    def of(self, base: str) -> list[Instance]:
        """Return the instances of a base element."""
        return [instance for instance in self.document.instances if instance.base == base]

    def related(self, instance: Instance, relation: str, base: str, inverse: str) -> list[Instance]:
        """Return the instances of a base element that an instance names, or that name it, each once."""
        forward = instance.relations.get(relation)
        found: list[Instance | None] = []
        if forward is not None:
            found += [self._by_id.get((forward.element, identifier)) for identifier in forward.ids]
        found += self._sources.get((instance.element, instance.id, inverse), [])
        return list(_each_once(item for item in found if item is not None and item.base == base))

    def only(self, instance: Instance, relation: str, base: str, inverse: str) -> Instance | None:
        """Return the one related instance, None where there is none.

        Raises
        ------
        FormatError
            There are several.
        """
        found = self.related(instance, relation, base, inverse)
        if len(found) > 1:
            raise FormatError(
                f"{self.path}: {label_of(instance)} has several {relation.replace('_', ' ')}: "
                f"{', '.join(repr(item.id[:20]) for item in found[:4])}"
            )
        return found[0] if found else None

    def count(self, instance: Instance, attribute: str, default: int | None = None) -> int:
        """Return a whole number >= 0 that an instance states.

        Raises
        ------
        FormatError
            It is none, or is absent and there is no default.
        """
        return count_of(self.path, label_of(instance), attribute, instance.attributes.get(attribute), default)

    def number(self, instance: Instance, attribute: str) -> float | None:
        """Return a number that an instance states, None where it states none or it is not finite."""
        try:
            value = float(instance.attributes.get(attribute, ""))
        except ValueError:
            return None
        return value if math.isfinite(value) else None


def _each_once(instances: Iterable[Instance]) -> Iterable[Instance]:
    seen: set[int] = set()
    for instance in instances:
        if id(instance) not in seen:
            seen.add(id(instance))
            yield instance


def label_of(instance: Instance) -> str:
    """Return what messages call an instance."""
    return f"{instance.element[:40]} {instance.attributes.get('name', '')[:60]!r} (id {instance.id[:20]})"


def count_of(path: Path, label: str, key: str, text: str | None, default: int | None = None) -> int:
    """Read a whole number >= 0.

    Raises
    ------
    FormatError
        It is none, or is absent and there is no default.
    """
    if not text and default is not None:
        return default
    if text is None or not text.isascii() or not text.isdigit() or len(text) > 18:
        said = "is not stated" if not text else f"must be a whole number >= 0, got {text[:40]!r}"
        raise FormatError(f"{path}: {label}: {key} {said}")
    return int(text)
