"""The answer of the main job in a few lines of text."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tdacoustic.results import Analysis

__all__ = ["summary_lines"]


def summary_lines(analysis: Analysis) -> tuple[str, ...]:
    """Return the sentences of the report's summary, one a condition."""
    from tdacoustic.reporting.document import Sentences
    from tdacoustic.reporting.sections.answer import answer

    return tuple(item for block in answer(analysis) if isinstance(block, Sentences) for item in block.items)
