"""Labelled collections: folders of meshes, generated creatures and leaves, and composites of two models."""

from ._composites import Composite, composites
from ._creatures import CREATURES, Creature, creature, creatures
from ._folder import MESH_SUFFIXES, labelled_folder, match_labels, read_labels
from ._leaves import Leaves, leaves

__all__ = [
    "CREATURES",
    "MESH_SUFFIXES",
    "Composite",
    "Creature",
    "Leaves",
    "composites",
    "creature",
    "creatures",
    "labelled_folder",
    "leaves",
    "match_labels",
    "read_labels",
]
