"""Labelled collections: folders of meshes, and generated creatures. Imports `surface` for its `Mesh`."""

from ._creatures import CREATURES, Creature, creature, creatures
from ._folder import MESH_SUFFIXES, labelled_folder, match_labels, read_labels

__all__ = [
    "CREATURES",
    "MESH_SUFFIXES",
    "Creature",
    "creature",
    "creatures",
    "labelled_folder",
    "match_labels",
    "read_labels",
]
