"""Generation of many flights: tasks flown in processes, and data sets with their recipes, manifests and descriptions.

``flying`` flies tasks and writes shards, for data sets and sweeps alike. A data set is a folder with a recipe, which
lists flights in files, and ``build`` flies it. Beside the recipe are a manifest with the checksums from one kind of
machine, samples that every other kind of machine must reproduce within tolerances, statistics, a card and Croissant
metadata; ``build(renew=True)`` writes all of these.
"""

from magsim.generation.builder import build
from magsim.generation.comparison import Agreement, check_folder, reference_of
from magsim.generation.recipe import LoadedRecipe, load_recipe

__all__ = ["Agreement", "LoadedRecipe", "build", "check_folder", "load_recipe", "reference_of"]
