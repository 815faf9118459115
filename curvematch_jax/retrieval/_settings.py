"""Settings as plain values, and the first one in which two results differ."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ..surface import Extraction, Parts
from ._matching import Matching


class Difference(NamedTuple):
    """A setting of two values."""

    name: str
    one: Any
    other: Any


def run_settings(extraction: Extraction, matching: Matching) -> dict[str, object]:
    """Everything that a result depends on."""
    return {"extraction": dataclasses.asdict(extraction), "matching": dataclasses.asdict(matching)}


def first_difference(one: object, other: object) -> Difference | None:
    """The first setting in which two differ, each a settings object or what JSON has kept of one."""
    left, right = _plain(one), _plain(other)
    for name in {**left, **right}:
        if left.get(name) != right.get(name):
            return Difference(name, left.get(name), right.get(name))
    return None


def require_same_extraction(collection: Sequence[Parts]) -> None:
    """Refuse parts that can't be compared.

    Raises:
        ValueError: when two were extracted with different settings, naming the first setting that differs.
    """
    for parts in collection[1:]:
        different = first_difference(collection[0].settings, parts.settings)
        if different:
            raise ValueError(
                f"parts of {parts.name or 'an object'} were extracted with {different.name} = {different.other!r}, "
                f"those of {collection[0].name or 'the first'} with {different.name} = {different.one!r}: extract both "
                "with the same settings"
            )


def _plain(settings: Any) -> Mapping[str, Any]:
    if dataclasses.is_dataclass(settings) and not isinstance(settings, type):
        settings = dataclasses.asdict(settings)
    return json.loads(json.dumps(settings))
