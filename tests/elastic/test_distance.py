"""The distance under transformations: jit, vmap, grad, jvp; float64; and against other software."""

import json
import subprocess
import sys
import textwrap

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.shapes import certified, fourier, rotation, warps, x64

from curvematch_jax.elastic import Aligner, Stage, align, alignment_distance, elastic_distance

N = 40
RIGID = Aligner.rigid()
LEAN = Aligner(grid=24, seeds=4, slope=2, stages=(Stage(1, 8, 48),), table=24, chunk=8)


def distance(curve1, curve2):
    return elastic_distance(curve1, curve2, LEAN)


@pytest.fixture(name="pair", scope="module")
def fixture_pair():
    return tuple(jnp.asarray(fourier(s, 3, n=N, modes=2), jnp.float32) for s in (0, 100))


@pytest.fixture(name="pulled", scope="module")
def fixture_pulled():
    """Distances and both gradients of one compilation, of three pairs: two apart, and one of equal curves."""
    return jax.jit(jax.vmap(jax.value_and_grad(distance, argnums=(0, 1))))


def test_it_is_the_distance_of_the_alignment(pair):
    np.testing.assert_array_equal(elastic_distance(*pair, RIGID), align(*pair, RIGID).distance)
    assert elastic_distance(pair[0][0], pair[1], RIGID).shape == (3,)


def test_jit_and_vmap_change_nothing(pair):
    plain = elastic_distance(*pair, RIGID)
    fixed = lambda a, b: elastic_distance(a, b, RIGID)  # noqa: E731
    np.testing.assert_allclose(jax.jit(fixed)(*pair), plain, atol=1e-5)
    np.testing.assert_allclose(jax.vmap(fixed)(*pair), plain, atol=1e-5)
    table = jax.jit(jax.vmap(jax.vmap(fixed, (None, 0)), (0, None)))(*pair)
    np.testing.assert_allclose(jnp.diagonal(table), plain, atol=1e-5)


def test_gradients_are_finite_and_zero_at_distance_zero(pulled, pair):
    same = pair[0][0]
    one, other = (jnp.stack([c[0], c[1], same]) for c in pair)
    values, gradients = pulled(one, other)
    assert np.isfinite(values).all()
    assert all(np.isfinite(g).all() for g in gradients)
    assert float(jnp.abs(gradients[0][:2]).max()) > 1e-4
    values, gradients = pulled(one, one)
    assert float(values.max()) < 0.05
    assert all(np.isfinite(g).all() for g in gradients)


@pytest.mark.slow
def test_gradients_are_those_with_rotation_and_warp_held(pulled):
    """Of gentle curves that are near: they have one best alignment, which traced and untraced searches both find."""
    one = jnp.asarray(fourier(0, 3, n=N, modes=2, decay=3), jnp.float32)
    other = one + 0.1 * jnp.asarray(fourier(100, 3, n=N, modes=2, decay=3), jnp.float32)
    _, gradients = pulled(one, other)
    found = align(one, other, LEAN)
    held = lambda a, b: alignment_distance(a, b, found.rotation, found.warp).sum()  # noqa: E731
    for ours, expected in zip(gradients, jax.grad(held, argnums=(0, 1))(one, other), strict=True):
        np.testing.assert_allclose(ours, expected, atol=0.02 * float(jnp.abs(expected).max()))


def test_gradients_know_what_the_distance_forgets(pulled, pair):
    """Translation and scale of either curve: no derivative at all. Rotation: none, for the rotation is optimal."""
    _, gradients = pulled(*pair)
    skew = jnp.asarray(rotation(1) - rotation(1).T, jnp.float32)
    for curve, gradient in zip(pair, gradients, strict=True):
        size = float(jnp.abs(gradient).sum(axis=(1, 2)).max())
        np.testing.assert_allclose(gradient.sum(axis=-1), 0, atol=1e-4 * size)
        np.testing.assert_allclose(jnp.sum(gradient * curve, axis=(1, 2)), 0, atol=1e-4 * size)
        turned = jnp.einsum("ij,bjn->bin", skew, curve)
        np.testing.assert_allclose(jnp.sum(gradient * turned, axis=(1, 2)), 0, atol=2e-3 * size)


def test_forward_derivatives_agree_with_reverse_ones():
    """And those at fixed rotation and warp, with finite differences: in float64."""
    with x64():
        one, other, direction = (jnp.asarray(fourier(s, 2, n=N)) for s in (0, 1, 2))
        turn = jnp.stack([jnp.asarray(rotation(s)) for s in (3, 4)])
        gamma = jnp.asarray(warps(5, 2, N).T)
        value = jax.jit(lambda a, b: alignment_distance(a, b, turn, gamma).sum())
        reverse = jax.grad(value, argnums=(0, 1))(one, other)
        for step, gradient in (((direction, 0 * direction), reverse[0]), ((0 * direction, direction), reverse[1])):
            forward = jax.jvp(value, (one, other), step)[1]
            np.testing.assert_allclose(jnp.sum(gradient * direction), forward, rtol=1e-8)
            ahead, behind = (value(one + s * step[0], other + s * step[1]) for s in (1e-6, -1e-6))
            np.testing.assert_allclose(forward, (ahead - behind) / 2e-6, rtol=1e-6)


@pytest.mark.parametrize("d", [2, 3, 4])
@pytest.mark.parametrize("m", [32, 64, 100, 512])
def test_the_certificate_follows_its_definition(d, m):
    """Any rotation and any warp, of fewer samples than the curves and of more, by sums of waves in numpy."""
    curves, others = (fourier(s, 3, n=64, d=d, modes=2) for s in (0, 1))
    turns = np.stack([rotation(s, d) for s in range(3)])
    gamma = warps(2, 3, m).T
    found = alignment_distance(*(jnp.asarray(x, jnp.float32) for x in (curves, others, turns, gamma)))
    nodes = -(-32 * 64 // m)
    expected = [certified(*case, nodes) for case in zip(curves, others, turns, gamma, strict=True)]
    np.testing.assert_allclose(found, expected, atol=1e-3)


def test_the_certificate_of_a_refined_warp_is_the_same():
    """A warp is linear between its samples: samples in between change nothing."""
    curve, other = (jnp.asarray(fourier(s, n=N), jnp.float32) for s in (0, 1))
    turn, gamma = jnp.asarray(rotation(3), jnp.float32), warps(4, 1, N)[:, 0]
    finer = np.interp(np.arange(6 * N + 1) / 6, np.arange(N + 1), gamma)
    plain, fine = (alignment_distance(curve, other, turn, jnp.asarray(g, jnp.float32)) for g in (gamma, finer))
    np.testing.assert_allclose(fine, plain, atol=2e-4)


def test_the_certificate_broadcasts():
    curve = fourier(0, n=N).astype(np.float32)
    turns = np.stack([rotation(s) for s in range(3)]).astype(np.float32)
    gamma = np.linspace(0, 1, N + 1, dtype=np.float32)[None].repeat(3, axis=0)
    found = alignment_distance(curve, curve, turns, gamma)
    assert found.shape == (3,)
    assert float(alignment_distance(curve, curve, np.eye(3, dtype=np.float32), gamma[0])) < 1e-3


def in_x64(code):
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", textwrap.dedent(code)],
        env={"JAX_ENABLE_X64": "1", "PYTHONPATH": ":".join(sys.path), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_float64_from_end_to_end():
    """Distances, alignments and matrices in float64. A copy comes below 3e-3; 1e-6 is wanted (see `test_align`)."""
    in_x64(
        """
        import numpy as np
        from elastic.shapes import fourier
        from curvematch_jax.elastic import Aligner, Stage, align, alignment_distance, distance_matrix, resample, to_srvf

        curves, others = fourier(0, 8), fourier(100, 8)
        found = align(curves, others)
        assert {str(x.dtype) for x in found} == {"float64"}
        own = alignment_distance(curves, others, found.rotation, found.warp)
        assert abs(own - found.distance).max() < 4e-3
        assert (align(others, curves).distance == found.distance).all()
        assert align(curves, curves + 1e-12).distance.max() < 3e-3
        assert np.linalg.norm(found.rotation @ found.rotation.swapaxes(1, 2) - np.eye(3)) < 1e-12
        assert distance_matrix(curves, aligner=Aligner.rigid()).dtype == np.float64
        assert to_srvf(curves).dtype == resample(curves, 50).dtype == np.float64
        """
    )


@pytest.mark.slow
def test_gradients_by_finite_differences_of_the_whole_search():
    """The envelope theorem in float64: the alignment is found again on either side. Smooth curves, accurate preset.

    The search is not exact, so its wavering is in the difference: half of the differences agree within six percent,
    and nine in ten within a quarter; the others meet another alignment on one side.
    """
    with x64():
        one, other = (jnp.asarray(fourier(s, 8, n=48, modes=2)) for s in (0, 100))
        value = jax.jit(lambda a: elastic_distance(a, other))
        gradient = jax.grad(lambda a: value(a).sum())(one)
        errors, sizes = [], []
        for seed in range(50, 54):
            step = 5e-3 * jnp.asarray(fourier(seed, 8, n=48, modes=2))
            difference = (value(one + step) - value(one - step)) / 2
            errors.append(difference - jnp.sum(gradient * step, axis=(1, 2)))
            sizes.append(difference)
        errors, sizes = np.abs(np.asarray(errors)), np.abs(np.asarray(sizes))
        assert np.median(errors) < 0.06 * np.median(sizes)
        assert np.mean(errors < 0.25 * sizes.max()) > 0.9


@pytest.mark.xfail(reason="the rigid distance is not minimal over warps: the envelope theorem does not hold")
@pytest.mark.slow
def test_rigid_gradients_by_finite_differences():
    with x64():
        one, other, direction = (jnp.asarray(fourier(s, 4, n=48, modes=2)) for s in (0, 100, 50))
        value = jax.jit(lambda a: elastic_distance(a, other, RIGID))
        slope = jnp.sum(jax.grad(lambda a: value(a).sum())(one) * direction, axis=(1, 2))
        difference = (value(one + 1e-3 * direction) - value(one - 1e-3 * direction)) / 2e-3
        np.testing.assert_allclose(slope, difference, atol=0.02)


def test_float64_in_a_context():
    """Chunks are computed in threads, which have to be told of it."""
    with x64():
        found = align(fourier(0, n=N), fourier(100, n=N), RIGID)
        assert found.rotation.dtype == jnp.float64
        np.testing.assert_allclose(found.rotation @ found.rotation.T, np.eye(3), atol=1e-12)


@pytest.mark.slow
def test_never_above_fdasrsf():
    """The reference implementation's distance of the same closed curves: ours is as small, up to a small tolerance."""
    code = """
    import json, sys, warnings
    warnings.simplefilter("ignore")
    import numpy as np
    import fdasrsf.curve_functions as cf
    from elastic.shapes import fourier

    curves, others = fourier(0, 3, n=100, modes=3), fourier(100, 3, n=100, modes=3)
    close = lambda c: np.concatenate([c, c[:, :1]], axis=1)
    out = []
    for one, other in zip(curves, others):
        q1, q2 = (cf.curve_to_q(cf.resamplecurve(close(c), 101, mode="C"), mode="C")[0] for c in (one, other))
        found = cf.find_rotation_and_seed_unique(q1, q2, True, True, 0.0)[0]
        cosine = cf.innerprod_q2(q1, found) / np.sqrt(cf.innerprod_q2(q1, q1) * cf.innerprod_q2(found, found))
        out.append(float(np.arccos(min(cosine, 1))))
    print(json.dumps(out))
    """
    pytest.importorskip("fdasrsf")
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)],
        env={"PYTHONPATH": ":".join(sys.path), "PATH": "/usr/bin:/bin", "MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    theirs = np.array(json.loads(done.stdout.strip().splitlines()[-1]))
    curves, others = (fourier(s, 3, n=100, modes=3).astype(np.float32) for s in (0, 100))
    ours = np.asarray(elastic_distance(curves, others))
    assert (ours <= theirs + 0.01).all(), (ours, theirs)
    assert (ours > 0.5 * theirs).all()
