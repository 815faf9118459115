"""Meshes in, parts out. Depends on numpy, scipy, trimesh and potpourri3d; never on JAX."""

from ._clean import clean
from ._load import load_mesh
from ._mesh import Mesh, MeshError
from ._parts import Extraction, Parts, extract_parts
from ._report import CleanReport

__all__ = ["CleanReport", "Extraction", "Mesh", "MeshError", "Parts", "clean", "extract_parts", "load_mesh"]
