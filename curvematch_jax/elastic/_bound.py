"""What neither start point nor rotation changes in a curve: rigid distances bounded from below, without alignment.

Let `f_k` be the Fourier coefficients of a curve's unit tangents, vectors in `C^d`. A shift turns the phase of each, a
rotation turns all. As x runs through the periods, `Re(f_k e^{ix})` describes an ellipse, of semi-axes `a_k >= b_k`,
which are the singular values of the matrix `[Re f_k, Im f_k]`. By von Neumann's trace inequality

    <q1, R q2(. + s)> = sum_k w_k Re tr(...) <= sum_k w_k (a1_k a2_k + b1_k b2_k)

for all R and s, w counting the conjugate modes: the inner product of two signatures. High modes are kept as one
number, the norm of all of them: Cauchy and Schwarz bound their sum. Where the shift lies between two samples, the
alignment interpolates by a parabola, which amplifies no mode (the stability of the Lax-Wendroff scheme).
"""

import numpy as np

from ._aligner import Aligner
from ._rigid import Rigid
from ._tabulated import Tables

# Semi-axes kept one by one. With all 32 modes the bounds are 4 % higher.
_MODES = 8
# Added to a cosine: what float32 leaves of it, here and in the alignment.
_ROUNDING = 4e-6


def bounded(aligner: Aligner) -> bool:
    """Whether signatures bound the distances of this aligner."""
    return isinstance(aligner, Rigid) and not aligner.measured and not aligner.mirror


def signatures(tables: Tables) -> np.ndarray:
    """Signatures (C, S) of curves tabulated for `Rigid(measured=False)`, each of unit norm.

    Raises:
        ValueError: for another aligner: a warp can bring curves nearer than their signatures.
    """
    if not bounded(tables.aligner):
        raise ValueError(f"signatures bound the distances of Rigid(measured=False), not those of {tables.aligner}.")
    samples = tables.curves.tangents.shape[-1]
    modes = np.fft.rfft(tables.curves.tangents, axis=-1) / samples
    modes[..., 1 : (samples + 1) // 2] *= np.sqrt(2.0)
    square1, square2 = (modes.real**2).sum(axis=1), (modes.imag**2).sum(axis=1)
    product = (modes.real * modes.imag).sum(axis=1)
    half = (square1 + square2) / 2
    apart = np.sqrt((square1 - square2) ** 2 / 4 + product**2)
    long, short = np.sqrt(half + apart), np.sqrt(np.maximum(half - apart, 0.0))
    rest = np.sqrt((long[:, _MODES:] ** 2 + short[:, _MODES:] ** 2).sum(axis=1, keepdims=True))
    return np.concatenate([long[:, :_MODES], short[:, :_MODES], rest], axis=1).astype(np.float32)


def least_distance(products: np.ndarray) -> np.ndarray:
    """The least rigid distances, in radians, that curves with these inner products of signatures can have."""
    return np.arccos(np.minimum(products + np.float32(_ROUNDING), 1.0))
