"""Settings as plain values, and the one place where they are compared."""

from __future__ import annotations

import dataclasses
import json
import reprlib
from collections.abc import Mapping, Sequence
from typing import Any

from ..surface import Extraction
from ._matching import Matching, presets


def run_settings(extraction: Extraction, matching: Matching) -> dict[str, Any]:
    """Everything that a result depends on."""
    return {"extraction": dataclasses.asdict(extraction), "matching": dataclasses.asdict(matching)}


def first_difference(one: object, other: object) -> tuple[str, Any, Any] | None:
    """The first setting in which two differ, and its values; each is a settings object or what JSON has kept of one.

    Settings within a setting are told as `aligner.grid`.
    """
    left, right = _plain(one), _plain(other)
    name = next((name for name in {**left, **right} if left.get(name) != right.get(name)), None)
    if name is None:
        return None
    first, second = left.get(name), right.get(name)
    within = isinstance(first, dict) and isinstance(second, dict) and first.keys() == second.keys()
    if within and (inner := first_difference(first, second)):
        return f"{name}.{inner[0]}", *inner[1:]
    return name, first, second


def require_same(one: object, other: object, what: tuple[str, str], remedy: str) -> None:
    """Refuse what differs in a setting.

    Args:
        one, other: as in `first_difference`.
        what: of each the words before "with", in one sentence that ends with the remedy.

    Raises:
        ValueError: naming the presets of the two, or the first setting that differs and both its values.
    """
    if different := first_difference(one, other):
        first, second = preset_of(one), preset_of(other)
        if first and second:
            raise ValueError(f"{what[0]} with the preset {first}, {what[1]} with the preset {second}: {remedy}")
        name, first, second = different[0], *map(reprlib.repr, different[1:])
        raise ValueError(f"{what[0]} with {name} = {first}, {what[1]} with {name} = {second}: {remedy}")


def preset_of(matching: object) -> str | None:
    """The name of the preset that settings are those of; None for others."""
    return next((name for name, preset in presets().items() if first_difference(matching, preset) is None), None)


def require_same_extraction(extracted: Sequence[tuple[str, Extraction]]) -> None:
    """Refuse parts that can't be compared, given the settings of each object with its name.

    Raises:
        ValueError: when two were extracted with different settings, naming the first setting that differs.
    """
    for name, settings in extracted[1:]:
        first, expected = extracted[0]
        what = (f"parts of {name or 'an object'} were extracted", f"those of {first or 'the first'}")
        require_same(settings, expected, what, "extract both with the same settings")


def _plain(settings: Any) -> Mapping[str, Any]:
    if dataclasses.is_dataclass(settings) and not isinstance(settings, type):
        settings = dataclasses.asdict(settings)
    return json.loads(json.dumps(settings))
