"""Data sets: recipes, how they are built and described, and how a build is held against its manifest.

A data set is a folder with a recipe: a list of flights in files. ``build`` flies it. Beside the recipe lie a manifest
with the checksums that a machine of one kind gave, samples that every other machine must come close to, statistics,
a card and Croissant metadata; all but the recipe and its scenarios are written by ``build(renew=True)``.
"""

from magsim.generation.builder import build
from magsim.generation.comparison import Verdict, check_folder, reference_of
from magsim.generation.recipe import LoadedRecipe, load_recipe

__all__ = ["LoadedRecipe", "Verdict", "build", "check_folder", "load_recipe", "reference_of"]
