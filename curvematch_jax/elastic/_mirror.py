"""Alignment of a curve with another or with its mirror image, whichever is nearer.

The mirror image of c is `M c(-t)`: reflected in the first coordinate and run through backwards, so that a planar
outline keeps its inside on the same side. Its SRVF is `-M q(-t)`. A path to it, of R and gamma2, is one to c itself, of
`R M` and `-gamma2`: the rotation reflects, the warp falls, and where a warp falls SRVFs change their sign.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from ._aligner import Alignment
from ._check import as_curves
from ._frame import A, AnyArray, namespace


class WithImage(NamedTuple):
    """What an aligner has to know of each curve, and of its mirror image."""

    own: Any
    image: Any


def with_images(tabulate: Callable[[Any], Any], curve: Float[AnyArray, "b d n"]) -> WithImage:
    return WithImage(tabulate(curve), tabulate(_image(curve)))


def mirror_image(curve: ArrayLike | Sequence) -> Float[Array, "*b d n"]:
    """The mirror images of closed curves `(*b, d, n)`: reflected in the first coordinate, `x` to `-x`, and run through
    backwards, so that planar outlines run round their inside as before.

    The first sample stays first. Twice is the curve again. Raises `ValueError` for what is no closed curve.
    """
    return _image(as_curves("curve", curve))


def _image(curve: Float[A, "*b d n"]) -> Float[A, "*b d n"]:
    return _reflected(namespace(curve).roll(curve[..., ::-1], 1, axis=-1), axis=-2)


def both(first: WithImage, second: WithImage) -> tuple[Any, Any]:
    """Twice as many pairs: curve1 and curve2, then curve1 and the image of curve2."""
    join = lambda x, y: jnp.concatenate([x, y])  # noqa: E731
    return jax.tree.map(join, first.own, first.own), jax.tree.map(join, second.own, second.image)


def chosen(mirrored: Bool[Array, " b"], second: WithImage) -> Any:
    pick = lambda x, y: jnp.where(mirrored.reshape(-1, *(1,) * (x.ndim - 1)), x, y)  # noqa: E731
    return jax.tree.map(pick, second.image, second.own)


def to_the_curve(found: Alignment, mirrored: Bool[Array, " b"]) -> Alignment:
    """Alignments with what was chosen as alignments with the curves themselves."""
    wide = mirrored[:, None]
    rotation = jnp.where(wide[..., None], _reflected(found.rotation, axis=-1), found.rotation)
    return found._replace(rotation=rotation, warp2=jnp.where(wide, -found.warp2, found.warp2))


def nearer(found: Alignment) -> Alignment:
    """Of alignments of `both`, those with the smaller distance."""
    mirrored, row = smaller(found.distance)
    return to_the_curve(Alignment(*(x[row] for x in found)), mirrored)


def smaller(values: Float[Array, " pairs"]) -> tuple[Bool[Array, " b"], Int[Array, " b"]]:
    """Of values of `both`, whether that of the image is smaller, and the number of the smaller one."""
    own, image = jnp.split(values, 2)
    number = jnp.arange(len(own), dtype=jnp.int32)
    return image < own, jnp.where(image < own, number + len(own), number)


def forwards(found: Alignment) -> Alignment:
    """The same paths, run through in the sense in which curve1 is."""
    falls = (found.warp1[:, -1] < found.warp1[:, 0])[:, None]
    turned = lambda warp: jnp.where(falls, warp[:, ::-1], warp)  # noqa: E731
    return found._replace(warp1=turned(found.warp1), warp2=turned(found.warp2))


def _reflected(x: Float[A, "..."], axis: int) -> Float[A, "..."]:
    """With the first entries on the axis negative: the product with M."""
    xp = namespace(x)
    first, others = xp.split(x, [1], axis=axis)
    return xp.concatenate([-first, others], axis=axis)
