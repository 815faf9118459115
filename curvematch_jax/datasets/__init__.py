"""Labelled collections: folders of meshes, generated creatures, and composites of two models of either."""

from ._composites import Composite, composites
from ._creatures import CREATURES, Creature, creature, creatures
from ._folder import MESH_SUFFIXES, labelled_folder, match_labels, read_labels

__all__ = [
    "CREATURES",
    "MESH_SUFFIXES",
    "Composite",
    "Creature",
    "composites",
    "creature",
    "creatures",
    "labelled_folder",
    "match_labels",
    "read_labels",
]
