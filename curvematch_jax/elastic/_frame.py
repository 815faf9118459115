"""Curves of any size, anywhere: brought to the origin and to a size near 1, and back into their own units.

Squares of coordinates overflow float32 beyond 1e19, and far from the origin its digits go into the position. So curves
are brought to a common frame before anything is computed, and before they are cast to what JAX computes in.
"""

from types import ModuleType
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Float, Shaped

AnyArray = Array | np.ndarray  # Annotated as `Shaped` where it can be a longdouble, which is no `Float`.
A = TypeVar("A", bound=AnyArray)  # What comes of an array is one of the same kind.

_LOST = 1e-4  # of a curve's size, in the rounding of its samples: more, and its tangents are noise


def namespace(array: AnyArray) -> ModuleType:
    """`numpy` for its arrays, else `jax.numpy`: formulas that serve both ask it."""
    return np if isinstance(array, np.ndarray) else jnp


class Frame(NamedTuple):
    """Where curves lie in their own units: `curve = 2 (scale shape + half)`.

    Attributes:
        half: `(*b, d, 1)`, half the middle of the bounding box.
        scale: `(*b, 1, 1)`, the power of two above a quarter of its longest side, or above an eighth.
        dtype: what results are given in.
    """

    half: Shaped[AnyArray, "*b d 1"]
    scale: Shaped[AnyArray, "*b 1 1"]
    dtype: np.dtype

    def points(self, name: str, shape: Shaped[AnyArray, "*b d n"]) -> Float[Array, "*b d n"]:
        """The samples of shapes in the curves' units. `ValueError`, as `check`, unless its dtype can hold them."""
        if isinstance(shape, np.ndarray):
            self.check(name)
        return self._given(name, self.scale * shape + self.half)

    def offsets(self, name: str, shape: Shaped[AnyArray, "*b d n"]) -> Float[Array, "*b d n"]:
        """As `points`, but for the position, which is forgotten."""
        return self._given(name, self.scale * shape)

    def lengths(self, name: str, length: Shaped[AnyArray, "*b 1"]) -> Float[Array, "*b"]:
        """Lengths on shapes, in the curves' units."""
        return self._given(name, (self.scale[..., 0] * length).squeeze(-1))

    def check(self, name: str) -> None:
        """`ValueError` where rounding to the dtype would take the curves' shapes away, far from the origin."""
        away, size = np.abs(self.half).max(axis=(-2, -1)), self.scale[..., 0, 0]
        rounding = np.where(size > 0, float(jnp.finfo(self.dtype).eps) / 2 * (away / np.where(size > 0, size, 1)), 0)
        if self.half.dtype.itemsize > self.dtype.itemsize and np.any(rounding > _LOST):
            raise ValueError(
                f"{name} is so far from the origin that {self.dtype} cannot hold its shape: give centre({name}), or "
                "enable x64."
            )

    def _given(self, name: str, half: AnyArray) -> Array:
        """Twice the values, in the dtype. `ValueError` for concrete ones that are too large or too small for it."""
        if not isinstance(half, np.ndarray):
            return half + half
        limits = jnp.finfo(self.dtype)
        if half.size and float(abs(half).max()) > float(limits.max) / 2:
            raise ValueError(
                f"{name} is too large for {self.dtype}, which ends at {limits.max:.0e}: give a larger unit."
            )
        if self.scale.size and float(self.scale.min()) < float(limits.tiny):
            raise ValueError(
                f"{name} is too small for {self.dtype}, which begins at {limits.tiny:.0e}: give a smaller unit."
            )
        return to_jax(np.asarray(half + half, self.dtype))


def framed(curve: Shaped[AnyArray, "*b d n"]) -> tuple[Shaped[AnyArray, "*b d n"], Frame]:
    """Shapes of curves, and where they lie: the middle of the bounding box at 0, its longest side from 1 to 2.

    The scale is a power of two, so the difference to the middle is all that is rounded. No intermediate overflows, and
    a point stays one. Traced curves have derivatives with their frame held: those of all that is blind to it.
    """
    xp = namespace(curve)
    fixed = curve if xp is np else lax.stop_gradient(curve)
    half = fixed.min(axis=-1, keepdims=True) / 4 + fixed.max(axis=-1, keepdims=True) / 4
    from_middle = curve / 2 - half
    size = abs(fixed / 2 - half).max(axis=(-2, -1), keepdims=True)
    scale = size / xp.where(size > 0, xp.frexp(size)[0], 1)
    shape = from_middle / xp.where(scale > 0, scale, 1)
    return shape, Frame(half, scale, np.dtype(result_dtype(curve.dtype)))


def result_dtype(dtype) -> np.dtype:
    """What JAX computes in for samples of a floating dtype: float32 or, where x64 is enabled and they have it, 64."""
    return np.dtype(np.float32) if np.dtype(dtype).itemsize <= 4 else jax.dtypes.canonicalize_dtype(np.float64)


def to_jax(values: AnyArray) -> Array:
    """The array as one of JAX; unlike `jax.numpy.asarray`, without a compilation for each new shape."""
    return values if isinstance(values, jax.Array) else jax.device_put(np.array(values))
