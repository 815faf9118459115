"""Principal components of closed curves in the tangent space of their mean (Srivastava and Klassen 2016, ch. 9)."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import ArrayLike

from ..elastic import Aligner
from ..elastic._geodesic import joined, straighten
from ..elastic._preshape import parallel_transport, project_tangent
from ._check import as_between, as_reals, as_unmirrored, as_whole
from ._laying import onto
from ._mean import Mean, as_mean
from ._sample import as_sample
from ._tangent import STEPS, curves_of, shapes_at, vertices

_LEAST_SIZE = 1e-4
_ROUNDING = 32  # in units of the dtype's, below which deviations are none


@dataclass(frozen=True, eq=False)
class TangentPCA:
    """Principal components at a mean: `q = exp_mu(sum_k s_k e_k)`.

    The components are those of the tangent vectors `log_mu(q_i)` in the L2 metric, about 0, where their mean is. Signs
    are such that the scores have no negative third moment.

    Attributes:
        base: `(d, N)`, SRVF of the mean.
        components: `(c, d, N)`, orthonormal, tangent at the base.
        growth: `(c,)`, what a unit of each score adds to the logarithm of length; 0 unless sizes are analysed.
        deviations: `(c,)`, standard deviations of the scores, in radians: falling.
        total: the variance of all components, also of those that were not kept.
        length: of the mean.
        size: weight of the logarithm of length, as one more coordinate; 0 for shape alone.
        samples: of the curves that are given back.
    """

    base: np.ndarray
    components: np.ndarray
    growth: np.ndarray
    deviations: np.ndarray
    total: float
    length: float
    size: float
    samples: int

    @classmethod
    def fit(cls, mean: Mean, components: int | None = None, size: float = 0.0) -> TangentPCA:
        """Of the curves of a mean `karcher_mean(curves)`, one group.

        Args:
            mean: with its tangent vectors.
            components: how many are kept; all that are above rounding unless given.
            size: radians to a unit of the logarithm of length, which is one more coordinate of the curves; 0 for
                shape alone.

        Raises:
            ValueError: for a mean of several groups, curves that do not vary, and fewer components than asked for.
        """
        as_mean("mean", mean)
        size = as_size(size)
        length = _mean_length(mean)
        vectors = _rows(mean.tangents, np.log(mean.lengths / length), size)
        _, deviations, axes = np.linalg.svd(vectors * np.sqrt(mean.weights)[:, None], full_matrices=False)
        rounding = _ROUNDING * np.finfo(mean.srvf.dtype).eps
        rank = int(np.sum(deviations > rounding))
        if not rank:
            raise ValueError("the curves do not vary: they are copies of one shape, which has no components.")
        kept = rank if components is None else as_whole("components", components, 1)
        if kept > rank:
            raise ValueError(f"components = {components}: these curves have 1 to {rank}.")
        axes = axes[:kept]
        moment = mean.weights @ (vectors @ axes.T) ** 3
        axes = axes * np.where(moment < 0, -1, 1)[:, None]
        width = mean.srvf.size
        fields = (axes[:, :width] * np.sqrt(mean.srvf.shape[-1])).reshape(kept, *mean.srvf.shape)
        return cls(
            base=mean.srvf,
            components=fields.astype(mean.srvf.dtype),
            growth=axes[:, width] / size if size else np.zeros(kept),
            deviations=deviations[:kept],
            total=float(np.sum(deviations**2)),
            length=length,
            size=size,
            samples=mean.curve.shape[-1],
        )

    @property
    def explained(self) -> np.ndarray:
        """Shares of the variance, `(c,)`."""
        return self.deviations**2 / self.total

    def scores(self, mean: Mean) -> np.ndarray:
        """Scores `(k, c)`, in radians, of the curves of the mean at which the components are.

        Raises `ValueError` for another mean."""
        if not np.array_equal(as_mean("mean", mean).srvf, self.base):
            raise ValueError("the components are at another mean: give curves to `transform`, or use `transported`.")
        return self._scores(mean.tangents, mean.lengths)

    def _scores(self, tangents: np.ndarray, lengths: np.ndarray) -> np.ndarray:
        axes = _rows(self.components, self.growth, self.size)
        return _rows(tangents, np.log(lengths / self.length), self.size) @ axes.T

    def transform(self, curves: ArrayLike | Sequence, aligner: Aligner | None = None) -> np.ndarray:
        """Scores `(k, c)` of other closed curves `(k, d, n)`, aligned to the mean. Raises `ValueError` as `align`."""
        laid, sample = onto(self.base, as_sample(curves), as_unmirrored(aligner, Aligner.accurate))
        return self._scores(laid.v, sample.lengths)

    def srvfs(self, scores: ArrayLike | Sequence) -> np.ndarray:
        """SRVFs `(*b, d, N)` of the shapes at scores `(*b, c' <= c)`; further scores are 0. Closed to rounding."""
        found = self._checked(scores)
        return shapes_at(self.base, np.tensordot(found, self.components[: found.shape[-1]].astype(float), axes=1))

    def _checked(self, scores: ArrayLike | Sequence) -> np.ndarray:
        found = as_reals("scores", scores)
        if found.ndim < 1 or found.shape[-1] > len(self.components):
            raise ValueError(f"scores has shape {found.shape}: give {len(self.components)} or fewer of each shape.")
        return found

    def inverse_transform(self, scores: ArrayLike | Sequence) -> np.ndarray:
        """The closed curves `(*b, d, n)` at scores `(*b, c' <= c)`, centred, of the mean's length or, with sizes, their
        own. Raises `ValueError` for other scores, and for those of sizes that the dtype cannot hold."""
        found = self._checked(scores)
        with np.errstate(over="ignore"):
            lengths = self.length * np.exp(found @ self.growth[: found.shape[-1]])
        limits = np.finfo(self.base.dtype)
        if np.any((lengths < limits.tiny) | (lengths > limits.max)):
            raise ValueError(f"scores are of sizes that {self.base.dtype} cannot hold: give smaller ones.")
        return curves_of(self.srvfs(found), self.samples, lengths)

    def sample(self, key: jax.Array, n: int) -> np.ndarray:
        """`n` curves `(n, d, samples)` whose scores are normal, with the deviations found; the key is one of
        `jax.random.key`."""
        n = as_whole("n", n, 0)
        if not isinstance(key, jax.Array):
            raise ValueError("key is none of JAX: give jax.random.key(0), or of another number.")
        draws = np.asarray(jax.random.normal(key, (n, len(self.deviations))), float)
        return self.inverse_transform(draws * self.deviations)

    def along(self, component: int, deviations: ArrayLike | Sequence = (-2, -1, 0, 1, 2)) -> np.ndarray:
        """Curves `(s, d, n)` at so many standard deviations of one component."""
        component, places = as_whole("component", component, 0), as_reals("deviations", deviations)
        if component >= len(self.deviations) or places.ndim != 1:
            raise ValueError(
                f"component = {component}, deviations of shape {places.shape}: there are {len(self.deviations)} "
                "components, the first is 0; give a list of deviations."
            )
        scores = np.zeros((len(places), component + 1))
        scores[:, component] = places * self.deviations[component]
        return self.inverse_transform(scores)

    def transported(self, mean: Mean) -> TangentPCA:
        """The same components at another mean: laid onto it with their own mean, and carried along the geodesic."""
        laid, _ = onto(as_mean("mean", mean).srvf, np.asarray(vertices(self.base))[None], Aligner.accurate())
        fields = laid.rotation[0] @ _along(self.components, laid.warp[0])
        path = straighten(joined(jnp.asarray(laid.q[0]), jnp.asarray(mean.srvf), STEPS)).path
        fields = jnp.asarray(fields, path.dtype)
        fields = project_tangent(jnp.broadcast_to(path[0], fields.shape), fields)
        moved = np.asarray(parallel_transport(path, fields))
        return dataclasses.replace(self, base=mean.srvf, components=moved, length=_mean_length(mean))


def as_size(size: float) -> float:
    """The weight of the logarithm of length: 0, or within what leaves digits to shape. `ValueError` for others."""
    return as_between("size", size, _LEAST_SIZE, 1 / _LEAST_SIZE) if size != 0 else 0.0


def _along(fields: np.ndarray, warp: np.ndarray) -> np.ndarray:
    """Fields `(c, d, N)` along a warp, `v(gamma) sqrt(gamma')`: the isometry by which SRVFs are reparametrised."""
    n = fields.shape[-1]
    middle = np.floor((warp[1:] + warp[:-1]) / 2 * n).astype(int) % n
    return fields[..., middle] * np.sqrt(np.maximum(np.diff(warp), 0) * (len(warp) - 1)).astype(fields.dtype)


def _mean_length(mean: Mean) -> float:
    return float(np.exp(np.sum(mean.weights * np.log(mean.lengths.astype(float)))))


def _rows(fields: np.ndarray, growths: np.ndarray, size: float) -> np.ndarray:
    """Tangent vectors `(k, d, N)` as rows whose products are those of L2, and sizes behind, where they count."""
    rows = fields.reshape(len(fields), -1).astype(float) / np.sqrt(fields.shape[-1])
    return np.concatenate([rows, size * growths[:, None]], axis=1) if size else rows
