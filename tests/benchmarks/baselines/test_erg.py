import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from surface.shapes import limbed

from benchmarks.baselines import erg
from curvematch_jax.surface import Mesh

THREE = np.array([[1, 0, 0], [-0.5, 0.8, 0], [-0.5, -0.8, 0]])
FIVE = np.array([[1, 0, 0], [0.3, 1, 0], [0.3, -1, 0], [-1, 0.5, 0.3], [-1, -0.5, -0.3]])


def tips(graph: erg.Graph) -> int:
    return int((~graph.above.any(axis=1)).sum())


@pytest.mark.parametrize("directions", [THREE, FIVE])
def test_every_limb_is_a_leaf(directions):
    found = erg.describe(limbed(directions, subdivisions=4))
    assert tips(found) == len(directions)
    assert found.area.sum() == pytest.approx(1)


def test_place_turn_and_scale_do_not_matter():
    star = limbed(FIVE, subdivisions=3)
    turned = Rotation.from_euler("xyz", [1.0, 2.0, 3.0]).apply(3 * star.vertices)
    graphs = [erg.describe(star), erg.describe(Mesh(turned, star.faces)), erg.describe(limbed(THREE, subdivisions=3))]
    same, other = erg.compare(graphs[:1], graphs[1:])[0]
    assert same < 1e-3
    assert other > 0.1


def chain(area: list[float], spread: list[tuple[float, float]]) -> erg.Graph:
    """A limb: each node above those before."""
    return erg.Graph(np.array(area), np.array(spread), np.triu(np.ones((len(area), len(area)), dtype=bool), 1))


def test_common_subgraph_keeps_the_order():
    rising = chain([0.5, 0.3, 0.2], [(1, 2), (2, 3), (3, 4)])
    falling = erg.Graph(rising.area, rising.spread, rising.above.T)
    apart = erg.Graph(rising.area, rising.spread, np.zeros((3, 3), dtype=bool))
    found = erg.compare([rising], [rising, falling, apart])[0]
    np.testing.assert_allclose(found[[0, 2]], [0, 0.5], atol=1e-9)
    assert found[1] > 0.2


def test_areas_and_spreads_that_differ_cost():
    node = chain([1.0], [(1.0, 2.0)])
    others = [chain([1.0], [(1.0, 4.0)]), chain([0.75, 0.25], [(1.0, 2.0), (100.0, 200.0)])]
    np.testing.assert_allclose(erg.compare([node], others)[0], [0.75, 0.25])
