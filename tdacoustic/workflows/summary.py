"""The answer of the main job in a few lines of text."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tdacoustic.results import Analysis, CampaignResult

__all__ = ["run_lines", "summary_lines"]


def summary_lines(analysis: Analysis) -> tuple[str, ...]:
    """Return the sentences of the report's summary, one a condition."""
    from tdacoustic.reporting.document import Sentences
    from tdacoustic.reporting.sections.answer import answer

    return tuple(item for block in answer(analysis) if isinstance(block, Sentences) for item in block.items)


def run_lines(result: CampaignResult) -> tuple[str, ...]:
    """Return the sentences of `summary_lines`, then a line each on calibration, prediction and what was asked of it."""
    from tdacoustic.reporting.sections.run_answer import calibration_line, model_lines, prediction_line

    modelled = (calibration_line(result), prediction_line(result), *model_lines(result))
    return (*summary_lines(result.analysis), *(line for line in modelled if line))
