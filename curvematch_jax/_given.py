"""Arguments of the right type, asked in one place."""

from __future__ import annotations


def require_type(name: str, value: object, kind: type | tuple[type, ...], remedy: str) -> None:
    """Refuse an argument of another type.

    Args:
        name: of the argument.
        kind: as in `isinstance`.
        remedy: what to give, the end of the sentence.

    Raises:
        ValueError: naming the argument, its type and the remedy.
    """
    if not isinstance(value, kind):
        raise wrong_type(name, value, remedy)


def wrong_type(name: str, value: object, remedy: str) -> ValueError:
    """The error of an argument of another type."""
    return ValueError(f"{name} is of type {type(value).__name__}: {remedy}")
