"""Provenance: a walk over the records of a result and of all it rests on."""

from __future__ import annotations

from tdacoustic.steps.record import Record
from tdacoustic.steps.store import Store
from tdacoustic.steps.task import Task

__all__ = ["lineage"]


def lineage(task: Task, store: Store) -> tuple[tuple[str, Record], ...]:
    """Return key and record of a task and of all it rests on, upstream first."""
    found: dict[str, Record] = {}

    def walk(node: Task) -> None:
        if node.key in found:
            return
        for upstream in node.upstream:
            walk(upstream)
        found[node.key] = store.record(node.key)

    walk(task)
    return tuple(found.items())
