"""Data: folders of recordings with their manifests, groups that belong together, training and test rows."""

from magsim.dataset.checking import index_differences
from magsim.dataset.folder import Dataset, files_of
from magsim.dataset.groups import Data, Group, flights_of, groups_of
from magsim.dataset.index import FlightInfo, split_rows
from magsim.dataset.manifest import MANIFEST, FileEntry, FlightEntry, Manifest, read_bounded, read_manifest
from magsim.dataset.one_by_one import OneByOne, open_training
from magsim.dataset.rows import JudgedPiece, Training, pick_sensor, pieces_to_judge, read_training, training_rows

__all__ = [
    "MANIFEST",
    "Data",
    "Dataset",
    "FileEntry",
    "FlightEntry",
    "FlightInfo",
    "Group",
    "JudgedPiece",
    "Manifest",
    "OneByOne",
    "Training",
    "files_of",
    "flights_of",
    "groups_of",
    "index_differences",
    "open_training",
    "pick_sensor",
    "pieces_to_judge",
    "read_bounded",
    "read_manifest",
    "read_training",
    "split_rows",
    "training_rows",
]
