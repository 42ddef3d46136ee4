"""Synthetic campaigns from a recipe, with the truth about them.

Imports nothing of the analysis: what the recovery tests hold the analysis against is written from the physics alone.
"""

from tdacoustic.synthesis.campaign import SynthesisResult, synthesize
from tdacoustic.synthesis.recipe import Recipe
from tdacoustic.synthesis.recipe_file import load_recipe, parse_recipe
from tdacoustic.synthesis.run import SyntheticRun, make_run, plan_runs

__all__ = [
    "Recipe",
    "SynthesisResult",
    "SyntheticRun",
    "load_recipe",
    "make_run",
    "parse_recipe",
    "plan_runs",
    "synthesize",
]
