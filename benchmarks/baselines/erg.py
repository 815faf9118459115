"""ERG-style: graphs of how a surface splits along a geodesic function, compared by their common subgraph.

After Biasotti, Marini, Spagnuolo, Falcidieno: Sub-part correspondence by structural descriptors of 3D shapes,
Computer-Aided Design 38(9), 2006, with the function of Hilaga, Shinagawa, Kohmura, Kunii: Topology matching for fully
automatic similarity estimation of 3D shapes, SIGGRAPH, 2001. Neither text fixes everything that a program needs, so
this is a graph of that kind, not theirs: slices, merging and the attributes of nodes are chosen here.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import shortest_path

from curvematch_jax.surface import Mesh
from curvematch_jax.surface._topology import label_components

from .descriptors import geodesics_between
from .reeb import Regions, slices

SOURCES = 128
SLICES = 32
LEAST_AREA = 0.005  # of the whole; what is smaller is no part of its own
SEEDS = 4  # pairs of nodes from which a common subgraph is grown


@dataclass(frozen=True, eq=False)
class Graph:
    """Limbs up to their tips, and the places where they meet, as nodes.

    Attributes:
        area: `(n,)` shares of the surface, which sum up to 1.
        spread: `(n, 2)` the least and the greatest mean distance on each, in square roots of the area.
        above: `(n, n)` bool: whether ways that only go up lead from the row's node to the column's. Edges alone would
            not do: where limbs part at nearly the same height, a trifle decides which does so first.
    """

    area: np.ndarray
    spread: np.ndarray
    above: np.ndarray


def describe(mesh: Mesh) -> Graph:
    """The graph of the mean distance to the surface, which is least in the middle and greatest at tips."""
    distances, areas = geodesics_between(mesh, SOURCES)
    return graph(mesh, distances.mean(axis=0) / np.sqrt(areas.sum()))


def graph(mesh: Mesh, values: np.ndarray) -> Graph:
    """The graph of a positive function `(v,)` on the surface."""
    regions = slices(mesh, values, SLICES)
    regions = regions.united(without_small(regions))
    regions = regions.united(chains(regions))
    steps = shortest_path(regions.upwards, unweighted=True)
    return Graph(regions.area, regions.spread, np.isfinite(steps) & (steps > 0))


def without_small(regions: Regions) -> np.ndarray:
    """Labels that merge regions below `LEAST_AREA`, the smallest first, into their smallest neighbour.

    So the slices of a finger come together before the hand takes any of them.
    """
    area, joined, label = regions.area.copy(), regions.joined, np.arange(len(regions.area))
    while area[least := int(np.argmin(area))] < LEAST_AREA:
        into = int(np.argmin(np.where(joined[least], area, np.inf)))
        label[label == least] = into
        area[into] += area[least]
        joined[into] |= joined[least]
        joined[:, into] = joined[into]
        joined[least] = joined[:, least] = joined[into, into] = False
        area[least] = np.inf
    return label


def chains(regions: Regions) -> np.ndarray:
    """Labels that join regions with at most one neighbour above and at most one below."""
    passing = (regions.upwards.sum(axis=0) <= 1) & (regions.upwards.sum(axis=1) <= 1)
    return label_components(len(passing), np.argwhere(regions.joined & passing & passing[:, None]))[1]


def compare(queries: Sequence[Graph], objects: Sequence[Graph]) -> np.ndarray:
    """The share of the surfaces that their common subgraph leaves out, `(Q, M)` in `[0, 1]`."""
    return np.array([[1 - common_share(query, other) for other in objects] for query in queries])


def common_share(first: Graph, second: Graph) -> float:
    """How much a connected common subgraph covers of both surfaces: the best of some that are grown greedily."""
    worth = np.minimum(first.area[:, None], second.area) * likeness(first, second)
    seeds = np.argsort(worth, axis=None)[::-1][:SEEDS]
    return max(grown(first, second, worth, int(seed)) for seed in seeds)


def likeness(first: Graph, second: Graph) -> np.ndarray:
    """How alike the values of the function are on two nodes: from 1 when equal down to 0."""
    a, b = first.spread[:, None], second.spread
    return ((np.minimum(a, b) / np.maximum(a, b)) ** 2).prod(axis=2)


def grown(first: Graph, second: Graph, worth: np.ndarray, seed: int) -> float:
    """The worth of a common subgraph: a pair of nodes, and while there is one, the best pair that continues another.

    One pair continues another when both its nodes are above those, or both below.
    """
    total, worth, reached = 0.0, worth.copy(), np.zeros(worth.shape, dtype=bool)
    i, j = divmod(seed, worth.shape[1])
    while True:
        total += worth[i, j]
        worth[i], worth[:, j] = 0, 0
        reached |= np.outer(first.above[i], second.above[j]) | np.outer(first.above[:, i], second.above[:, j])
        i, j = divmod(int(np.argmax(worth * reached)), worth.shape[1])
        if not worth[i, j] * reached[i, j]:
            return float(total)
