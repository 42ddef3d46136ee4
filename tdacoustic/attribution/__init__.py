"""Which source owns which noise line, and which dominates a condition."""

from tdacoustic.attribution.condition_lines import ConditionLine, lines_of_condition
from tdacoustic.attribution.dominance import Dominance, dominance_of_condition
from tdacoustic.attribution.sources import SourceLine, attribute

__all__ = ["ConditionLine", "Dominance", "SourceLine", "attribute", "dominance_of_condition", "lines_of_condition"]
