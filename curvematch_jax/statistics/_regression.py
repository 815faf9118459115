"""Regression of shape on numbers, in the tangent space of the mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import ArrayLike

from ._check import as_reals, as_whole
from ._mean import Mean, as_mean
from ._permutation import PermutationTest, p_value
from ._tangent import curves_of, shapes_at

_AT_ONCE = 512
_LARGEST = 1e100
_DIGITS = 1e-12  # of a column's largest number: what varies by less does not vary
_INDEPENDENT = 1e-9  # of a column's spread, what no other column explains


@dataclass(frozen=True, eq=False)
class ShapeRegression:
    """Shapes by numbers: `q(x) = exp_mu(a + sum_j b_j x_j)`, by least squares of the tangent vectors at the mean.

    Attributes:
        base: `(d, N)`, SRVF of the mean.
        intercept: `(d, N)`, a.
        slopes: `(p, d, N)`, b.
        r2: share of the variance that is explained.
        test: of the hypothesis that the numbers say nothing, by permuting them.
        length: of the curves that are predicted.
        samples: of these.
    """

    base: np.ndarray
    intercept: np.ndarray
    slopes: np.ndarray
    r2: float
    test: PermutationTest
    length: float
    samples: int

    @classmethod
    def fit(cls, mean: Mean, x: ArrayLike | Sequence, permutations: int = 999, seed: int = 0) -> ShapeRegression:
        """Of the curves of `karcher_mean(curves)` on numbers `(k,)` or `(k, p)`.

        Raises `ValueError` for numbers that do not fit the curves, do not vary, or repeat each other, and for curves
        that do not vary."""
        tangents = as_mean("mean", mean).tangents
        permutations, seed = as_whole("permutations", permutations, 1), as_whole("seed", seed, 0)
        rows, x = tangents.reshape(len(tangents), -1).astype(float), as_numbers(x, len(tangents))
        spread = _spread(x)
        centred, rows_about = (x - mean.weights @ x) / spread, rows - mean.weights @ rows
        root = np.sqrt(mean.weights)[:, None]
        basis, upper = np.linalg.qr(root * centred)
        if len(upper) < x.shape[1] or np.abs(np.diag(upper)).min() <= _INDEPENDENT:
            raise ValueError("x does not vary, or some of its columns follow from the others.")
        gram = (root * rows_about) @ (root * rows_about).T
        total = np.trace(gram)
        if total <= 1e-9 * rows.shape[1]:
            raise ValueError("the curves do not vary: they are copies of one shape.")
        slopes = np.linalg.solve(upper, basis.T @ (root * rows_about)) / spread[:, None]
        intercept = mean.weights @ rows - (mean.weights @ x) @ slopes
        shape = mean.srvf.shape
        return cls(
            base=mean.srvf,
            intercept=intercept.reshape(shape),
            slopes=slopes.reshape(-1, *shape),
            r2=float(np.trace(basis.T @ gram @ basis) / total),
            test=_permuted(root, centred, gram / total, permutations, seed),
            length=float(np.exp(np.sum(mean.weights * np.log(mean.lengths)))),
            samples=mean.curve.shape[-1],
        )

    def predict(self, x: ArrayLike | Sequence) -> np.ndarray:
        """The closed curves `(m, d, n)` of numbers `(m,)` or `(m, p)`."""
        x = as_numbers(x, None, len(self.slopes))
        q = shapes_at(self.base, self.intercept + np.tensordot(x, self.slopes, axes=1))
        return curves_of(q, self.samples, self.length)


def as_numbers(x: ArrayLike | Sequence, count: int | None, columns: int | None = None) -> np.ndarray:
    """Finite numbers `(k, p)`. `ValueError` for others, and for more or fewer than given."""
    found = as_reals("x", x)
    found = found[:, None] if found.ndim == 1 else found
    fits = found.ndim == 2 and count in (None, len(found)) and found.shape[1] == (columns or max(found.shape[1], 1))
    if not fits:
        wanted = f"({'m' if count is None else count}, {'p' if columns is None else columns})"
        raise ValueError(f"x has shape {np.shape(x)}: give numbers {wanted}, a row for each shape.")
    return found


def _spread(x: np.ndarray) -> np.ndarray:
    """How far apart the numbers of each column are, `(p,)`; infinite where that is rounding."""
    largest = np.abs(x).max(axis=0)
    if np.any((largest > _LARGEST) | ((largest > 0) & (largest < 1 / _LARGEST))):
        raise ValueError(f"x holds numbers above {_LARGEST:g}, or all below {1 / _LARGEST:g}: give another unit.")
    spread = np.ptp(x, axis=0)
    return np.where(spread > _DIGITS * largest, spread, np.inf)


def _permuted(root, centred, gram, permutations: int, seed: int) -> PermutationTest:
    """Shares that permuted numbers explain."""
    random = np.random.default_rng(seed)
    orders = [np.arange(len(centred)), *(random.permutation(len(centred)) for _ in range(permutations))]
    shares = []
    for start in range(0, len(orders), _AT_ONCE):
        basis = np.linalg.qr(root * centred[np.stack(orders[start : start + _AT_ONCE])])[0]
        shares.append(np.einsum("pik,ij,pjk->p", basis, gram, basis, optimize=True))
    values = np.concatenate(shares)
    return PermutationTest(float(values[0]), p_value(values[0], values[1:]), values[1:])
