import numpy as np
from surface.shapes import moved, sphere

from benchmarks.baselines import d2, geodesic_d2
from curvematch_jax.surface import Mesh


def test_density_of_the_sphere_is_that_of_angles():
    found = geodesic_d2.describe(sphere(3))
    step = d2.REACH / (d2.KNOTS - 1)
    angles = step * np.arange(d2.KNOTS) * np.pi / 2  # the mean is pi/2, the density of the angle a is sin(a)/2
    exact = np.where(angles < np.pi, np.sin(angles) / 2, 0) * step * np.pi / 2
    assert np.abs(found - exact).sum() < 0.1


def tube(bend: float) -> Mesh:
    """A closed tube six long, its middle line bent into an arc of `bend` radians in all: nearly isometric."""
    ball = sphere(3).vertices
    along, around = 3 * ball[:, 2], 0.5 * ball[:, :2]
    angle = along * bend / 6
    radius = 6 / bend - around[:, 0]
    arc = np.stack([radius * np.sin(angle), around[:, 1], 6 / bend - radius * np.cos(angle)], axis=1)
    return Mesh(arc, sphere(3).faces, "tube")


def test_bending_and_scale_hardly_matter():
    straight, bent = tube(0.01), moved(tube(3.0), (1, 2, 3), 7.0)
    geodesic, euclidean = (
        method.compare([method.describe(straight)], [method.describe(bent)])[0, 0] for method in (geodesic_d2, d2)
    )
    assert geodesic < 0.08  # nearly isometric: exact distances give .073
    assert euclidean > 1.5 * geodesic
