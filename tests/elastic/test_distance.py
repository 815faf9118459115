"""The distance under transformations: jit, vmap, map, grad, several devices; float64; and against other software."""

import json
import re
import subprocess
import sys
import textwrap

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from elastic.aligners import LEAN, RIGID, StartOnly
from elastic.shapes import certified, fourier, lifts, rotation, x64
from jax import lax

from curvematch_jax.elastic import Aligner, align, alignment_distance, elastic_distance

N = 40
CHEAP = [pytest.param(RIGID, id="rigid"), pytest.param(StartOnly(), id="other")]
EACH = [
    pytest.param(RIGID, id="rigid", marks=pytest.mark.slow),
    pytest.param(StartOnly(), id="other"),
    pytest.param(LEAN, id="lean", marks=pytest.mark.slow),
]


def distance(curve1, curve2):
    return elastic_distance(curve1, curve2, LEAN)


@pytest.fixture(name="pair", scope="module")
def fixture_pair():
    return tuple(jnp.asarray(fourier(s, 3, n=N, modes=2), jnp.float32) for s in (0, 100))


@pytest.fixture(name="pulled", scope="module")
def fixture_pulled():
    """Distances and both gradients, in one compilation."""
    return jax.jit(
        lambda a, b: jax.value_and_grad(lambda *c: (lambda d: (d.sum(), d))(distance(*c)), (0, 1), has_aux=True)(a, b)
    )


def test_it_is_the_distance_of_the_alignment(pair):
    np.testing.assert_array_equal(elastic_distance(*pair, RIGID), align(*pair, RIGID).distance)
    assert elastic_distance(pair[0][0], pair[1], RIGID).shape == (3,)


def wavers(aligner):
    """How far compiled variants of one search are apart: few steps of refinement do not forget rounding."""
    return 2e-3 if aligner is LEAN else 1e-4


@pytest.mark.parametrize("aligner", EACH)
def test_jit_and_vmap_change_nothing(aligner, pair):
    plain = elastic_distance(*pair, aligner)
    fixed = lambda a, b: elastic_distance(a, b, aligner)  # noqa: E731
    np.testing.assert_allclose(jax.jit(jax.vmap(fixed))(*pair), plain, atol=wavers(aligner))


@pytest.mark.slow
@pytest.mark.parametrize("aligner", EACH)
def test_transformations_change_nothing(aligner, pair):
    """jit alone, vmap twice, map; and the core without any of them."""
    most = wavers(aligner)
    plain = elastic_distance(*pair, aligner)
    fixed = lambda a, b: elastic_distance(a, b, aligner)  # noqa: E731
    np.testing.assert_allclose(jax.jit(fixed)(*pair), plain, atol=most)
    np.testing.assert_allclose(jax.jit(lambda a, b: lax.map(lambda c: fixed(*c), (a, b)))(*pair), plain, atol=most)
    table = jax.jit(jax.vmap(jax.vmap(fixed, (None, 0)), (0, None)))(*pair)
    np.testing.assert_allclose(jnp.diagonal(table), plain, atol=most)
    tables = [aligner.tabulate(side) for side in pair]
    np.testing.assert_allclose(aligner.align(*tables).distance, plain, atol=most)


@pytest.mark.parametrize("aligner", CHEAP)
def test_derivatives_of_what_does_not_warp_are_refused(aligner, pair):
    """Its alignment is not the best of all paths."""
    message = "has no derivative: use an aligner that warps, Aligner.fast()"
    for metric in ("arc", "straightened"):
        value = lambda a, metric=metric: elastic_distance(a, pair[1], aligner, metric=metric).sum()  # noqa: E731
        with pytest.raises(ValueError, match=re.escape(message)):
            jax.grad(value)(pair[0])
        with pytest.raises(ValueError, match=re.escape(message)):
            jax.jvp(value, (pair[0],), (pair[0],))


def test_derivatives_of_alignments_and_second_ones_are_refused(pair):
    message = "alignments have no derivatives here, so distances have no second ones"
    with pytest.raises(ValueError, match=message):
        jax.jit(jax.grad(lambda a: align(a, pair[1], LEAN).warp1.sum()))(pair[0])
    with pytest.raises(ValueError, match=message):
        jax.jit(jax.hessian(lambda a: elastic_distance(a, pair[1][0], LEAN)))(pair[0][0])


def test_elastic_gradients_are_those_with_the_alignment_held(pulled, pair):
    (_, values), gradients = pulled(*pair)
    np.testing.assert_allclose(values, elastic_distance(*pair, LEAN), atol=1e-4)
    found = align(*pair, LEAN)
    held = lambda a, b: alignment_distance(a, b, *found[:3]).sum()  # noqa: E731
    for ours, expected in zip(gradients, jax.grad(held, argnums=(0, 1))(*pair), strict=True):
        np.testing.assert_allclose(ours, expected, atol=0.02 * float(jnp.abs(expected).max()))


def test_gradients_are_finite_and_zero_at_distance_zero(pulled, pair):
    (_, values), gradients = pulled(pair[0], pair[0])
    assert float(values.max()) < 1e-4
    assert all(np.isfinite(g).all() for g in gradients)
    assert max(float(jnp.abs(g).max()) for g in gradients) == 0


def test_gradients_know_what_the_distance_forgets(pulled, pair):
    """Translation and scale of either curve: no derivative at all. Rotation: none, for the rotation is optimal."""
    _, gradients = pulled(*pair)
    skew = jnp.asarray(rotation(1) - rotation(1).T, jnp.float32)
    for curve, gradient in zip(pair, gradients, strict=True):
        size = float(jnp.abs(gradient).sum(axis=(1, 2)).max())
        np.testing.assert_allclose(gradient.sum(axis=-1), 0, atol=1e-4 * size)
        np.testing.assert_allclose(jnp.sum(gradient * curve, axis=(1, 2)), 0, atol=1e-4 * size)
        turned = jnp.einsum("ij,bjn->bin", skew, curve)
        np.testing.assert_allclose(jnp.sum(gradient * turned, axis=(1, 2)), 0, atol=0.03 * size)


def test_forward_derivatives_agree_with_reverse_ones():
    """And those at a fixed path, with finite differences: in float64."""
    with x64():
        one, other, direction = (jnp.asarray(fourier(s, 2, n=N)) for s in (0, 1, 2))
        turn = jnp.stack([jnp.asarray(rotation(s)) for s in (3, 4)])
        warp1, warp2 = (jnp.asarray(w) for w in lifts(5, 2, N))
        value = jax.jit(lambda a, b: alignment_distance(a, b, turn, warp1, warp2).sum())
        reverse = jax.grad(value, argnums=(0, 1))(one, other)
        for step, gradient in (((direction, 0 * direction), reverse[0]), ((0 * direction, direction), reverse[1])):
            forward = jax.jvp(value, (one, other), step)[1]
            np.testing.assert_allclose(jnp.sum(gradient * direction), forward, rtol=1e-8)
            ahead, behind = (value(one + s * step[0], other + s * step[1]) for s in (1e-6, -1e-6))
            np.testing.assert_allclose(forward, (ahead - behind) / 2e-6, rtol=1e-6)


@pytest.mark.parametrize(("d", "m"), [(2, 32), (3, 100), (4, 512)])
def test_the_certificate_follows_its_definition(d, m):
    """Any rotation and any path, of fewer pieces than samples and of more, by sums of waves in numpy."""
    curves, others = (fourier(s, 3, n=64, d=d, modes=2) for s in (0, 1))
    turns = np.stack([rotation(s, d) for s in range(3)])
    path = turns, *lifts(2, 3, m)
    found = alignment_distance(*(jnp.asarray(x, jnp.float32) for x in (curves, others, *path)))
    nodes = -(-32 * 64 // m)
    expected = [certified(*case, nodes) for case in zip(curves, others, *path, strict=True)]
    np.testing.assert_allclose(found, expected, atol=1e-3)


def test_the_certificate_of_a_refined_path_is_the_same():
    """A warp is linear between its samples: samples in between change nothing."""
    curve, other = (jnp.asarray(fourier(s, n=N), jnp.float32) for s in (0, 1))
    turn, warps = jnp.asarray(rotation(3), jnp.float32), [w[0] for w in lifts(4, 1, N)]
    finer = [np.interp(np.arange(6 * N + 1) / 6, np.arange(N + 1), w) for w in warps]
    plain, fine = (
        alignment_distance(curve, other, turn, *(jnp.asarray(w, jnp.float32) for w in path)) for path in (warps, finer)
    )
    np.testing.assert_allclose(fine, plain, atol=2e-4)


def test_the_certificate_broadcasts_and_is_precise_near_zero():
    curve = fourier(0, n=N).astype(np.float32)
    turns = np.stack([rotation(s) for s in range(3)]).astype(np.float32)
    even = np.linspace(0, 1, N + 1, dtype=np.float32)
    found = alignment_distance(curve, curve, turns, even[None].repeat(3, axis=0), even)
    assert found.shape == (3,)
    assert float(alignment_distance(curve, curve, np.eye(3, dtype=np.float32), even, even)) < 1e-6


def run(code, **environment):
    """Python in a process of its own; what it prints."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", textwrap.dedent(code)],
        env={"PYTHONPATH": ":".join(sys.path), "PATH": "/usr/bin:/bin", **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("RIGID", id="rigid", marks=pytest.mark.slow),
        pytest.param("StartOnly()", id="other"),
        pytest.param("LEAN", id="lean", marks=pytest.mark.slow),
    ],
)
def test_pairs_are_shared_among_devices(name):
    """By `shard_map`, over two; and by the matrices' own driver."""
    run(
        f"""
        import jax
        jax.config.update("jax_num_cpu_devices", 2)
        import numpy as np
        from jax.sharding import Mesh, PartitionSpec as P
        from elastic import aligners
        from elastic.shapes import fourier
        from curvematch_jax.elastic import align, distance_matrix, elastic_distance

        aligner = aligners.{name}
        curves, others = (fourier(s, 4, n=40, modes=2).astype(np.float32) for s in (0, 100))
        mesh = Mesh(np.array(jax.devices()), ("pairs",))
        assert mesh.size == 2
        shared = jax.shard_map(
            lambda a, b: elastic_distance(a, b, aligner), mesh=mesh, in_specs=P("pairs"), out_specs=P("pairs")
        )
        found = jax.jit(shared)(curves, others)
        plain = elastic_distance(curves, others, aligner)
        assert len(found.sharding.device_set) == 2
        assert np.abs(found - plain).max() < 1e-4
        matrix = distance_matrix(np.tile(curves, (3, 1, 1)), others, aligner)
        assert np.abs(np.diag(matrix)[:4] - plain).max() < 1e-4
        tabulate = jax.shard_map(aligners.RIGID.tabulate, mesh=mesh, in_specs=P("pairs"), out_specs=P("pairs"))
        assert len(jax.jit(tabulate)(curves).tangents.sharding.device_set) == 2
        """
    )


def test_what_is_no_aligner_is_refused():
    """In a process where no types are checked."""
    printed = run(
        """
        from elastic.shapes import fourier
        from curvematch_jax.elastic import Aligner, align, distance_matrix, elastic_distance, geodesic, tabulate

        curves = fourier(0, 2).astype("float32")
        for aligner in ("fast", 3, Aligner.fast, object()):
            for function in (align, distance_matrix, elastic_distance):
                try:
                    function(curves, curves, aligner=aligner)
                except ValueError as error:
                    print(error)
            try:
                tabulate(curves, aligner)
            except ValueError as error:
                print(error)
        """
    )
    message = r"aligner = .+: give an aligner, such as Aligner.fast\(\) or Aligner.accurate\(\)\."
    assert len(re.findall(f"^{message}$", printed, flags=re.M)) == 16


@pytest.mark.slow
def test_float64_from_end_to_end():
    run(
        """
        import numpy as np
        from elastic.shapes import fourier
        from curvematch_jax.elastic import Aligner, align, alignment_distance, distance_matrix, resample, to_srvf

        curves, others = fourier(0, 8), fourier(100, 8)
        found = align(curves, others)
        assert {str(x.dtype) for x in found} == {"float64"}
        own = alignment_distance(curves, others, found.rotation, found.warp1, found.warp2)
        assert abs(own - found.distance).max() < 2e-3
        assert (align(others, curves).distance == found.distance).all()
        assert align(curves, curves + 1e-12).distance.max() < 1e-6
        assert np.linalg.norm(found.rotation @ found.rotation.swapaxes(1, 2) - np.eye(3)) < 1e-12
        assert distance_matrix(curves, aligner=Aligner.rigid()).dtype == np.float64
        assert to_srvf(curves).dtype == resample(curves, 50).dtype == np.float64
        """,
        JAX_ENABLE_X64="1",
    )


def differences(value, one, directions, size):
    """Central differences of all distances, the alignment found again on either side; and forward derivatives."""
    found = [(value(one + size * v) - value(one - size * v)) / (2 * size) for v in directions]
    slopes = [jax.jvp(value, (one,), (v,))[1] for v in directions]
    return np.asarray(found), np.asarray(slopes)


@pytest.mark.slow
@pytest.mark.parametrize("metric", ["arc", "projected", "straightened"])
@pytest.mark.parametrize("aligner", [Aligner.fast(), Aligner.accurate()], ids=["fast", "accurate"])
def test_derivatives_are_those_of_the_whole_search_by_finite_differences(aligner, metric):
    """The envelope theorem in float64: the alignment is found again on either side. Smooth curves that are near each
    other have one best alignment; what is left is how far the refinement is from its end."""
    with x64():
        one, far, *directions = (jnp.asarray(fourier(s, 4, n=48, modes=2, decay=2)) for s in (0, 100, 50, 51))
        other = one + 0.2 * far
        value = jax.jit(lambda a: elastic_distance(a, other, aligner, metric=metric))
        found, slopes = differences(value, one, directions, 1e-3)
        np.testing.assert_allclose(slopes, found, atol=0.03 * np.abs(found).max())


def test_float64_in_a_context():
    """Chunks are computed in threads, which have to be told of it."""
    with x64():
        found = align(fourier(0, n=N), fourier(100, n=N), StartOnly())
        assert {x.dtype for x in found} == {np.dtype(float)}
        np.testing.assert_allclose(found.warp2 - found.warp1, found.warp2[0], atol=1e-12)


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
    theirs = np.array(json.loads(run(code, MPLBACKEND="agg", PYTHONWARNINGS="ignore").strip().splitlines()[-1]))
    curves, others = (fourier(s, 3, n=100, modes=3).astype(np.float32) for s in (0, 100))
    ours = np.asarray(elastic_distance(curves, others))
    assert (ours <= theirs + 0.01).all(), (ours, theirs)
    assert (ours > 0.5 * theirs).all()
