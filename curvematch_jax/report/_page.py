"""The page: template, style, scripts and data in one file that needs no other."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from string import Template

# In the order in which they are run: each uses only those before it.
SCRIPTS = ("data.js", "raster.js", "view.js", "matrix.js", "rankings.js", "pair.js", "main.js")


def page(
    title: str,
    facts: str,
    measures: str,
    curve: str,
    limits: Sequence[str],
    settings: Mapping[str, object],
    data: Mapping[str, object],
) -> str:
    """The whole HTML file.

    Its content security policy forbids every request, and every script but its own, which it knows by their SHA-256.

    Args:
        measures, curve: HTML.
        limits: sentences on what the page leaves out.
        settings: of the matrix.
        data: what the scripts read.
    """
    style, script = _text("page.css"), "\n".join(_text(name) for name in SCRIPTS)
    return Template(_text("page.html")).substitute(
        policy=f"default-src 'none'; img-src data:; style-src '{_sha256(style)}'; script-src '{_sha256(script)}'",
        title=escape(title),
        facts=escape(facts),
        measures=measures,
        curve=curve,
        limits="".join(f"<li>{escape(sentence)}</li>" for sentence in limits),
        settings=_settings(settings),
        style=style,
        script=script,
        data=embedded(data),
    )


def embedded(data: Mapping[str, object]) -> str:
    """JSON that is harmless inside a `script` element: no text in it can end the element or begin another."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    for sign in "<>&":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return text


def _settings(settings: Mapping[str, object]) -> str:
    """A list of settings; those of a group are named after it."""
    rows = []
    for name, value in settings.items():
        group = value if isinstance(value, Mapping) else {"": value}
        for key, each in group.items():
            label = f"{name}.{key}" if key else name
            rows.append(f"<dt>{escape(label)}</dt><dd>{escape(json.dumps(each))}</dd>")
    return f"<dl>{''.join(rows)}</dl>"


def _text(name: str) -> str:
    return (files("curvematch_jax.report") / "page" / name).read_text(encoding="utf-8")


def _sha256(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
