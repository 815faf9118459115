"""Measures as an HTML table, and precision against recall as an SVG picture."""

from __future__ import annotations

from html import escape

import numpy as np

from ..retrieval import Scores

_MEASURES = {
    "nn": ("NN", "nearest neighbour"),
    "ft": ("FT", "first tier"),
    "st": ("ST", "second tier"),
    "e": ("E", "E measure of the first 32"),
    "dcg": ("DCG", "normalised discounted cumulated gain"),
    "map": ("mAP", "mean average precision"),
}
_LEFT, _TOP, _WIDTH, _HEIGHT = 46, 12, 340, 250


def measures_table(scores: Scores) -> str:
    """A row for all queries, then one a class."""
    heads = "".join(f'<th scope="col"><abbr title="{title}">{short}</abbr></th>' for short, title in _MEASURES.values())
    rows = [_row("all queries", {name: getattr(scores, name) for name in _MEASURES}, "all")]
    rows += [_row(name, values, "") for name, values in scores.by_class().items()]
    return (
        '<table class="numbers"><caption>Means over the queries, from 0 to 1. E is below 1 at best.</caption>'
        f'<thead><tr><th scope="col">class</th>{heads}</tr></thead><tbody>{"".join(rows)}</tbody></table>'
    )


def precision_recall(scores: Scores) -> str:
    """Interpolated precision at recall 0, .1, ..., 1, as a picture and as a table."""
    recall, precision = np.linspace(0, 1, 11), scores.precision_11
    x, y = _LEFT + _WIDTH * recall, _TOP + _HEIGHT * (1 - precision)
    points = list(zip(x, y, recall, precision, strict=True))
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b, _, _ in points)
    dots = "".join(
        f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3.5"><title>recall {r:.1f}: precision {p:.3f}</title></circle>'
        for a, b, r, p in points
    )
    cells = "".join(f'<tr><th scope="row">{r:.1f}</th><td>{p:.3f}</td></tr>' for _, _, r, p in points)
    middle = _TOP + _HEIGHT / 2
    return (
        f'<svg class="curve" viewBox="0 0 {_LEFT + _WIDTH + 16} {_TOP + _HEIGHT + 46}" role="img" '
        f'aria-label="Precision falls from {precision[0]:.3f} at recall 0 to {precision[-1]:.3f} at recall 1">'
        f'{_axes()}<polyline points="{line}"/>{dots}'
        f'<text class="name" x="{_LEFT + _WIDTH / 2}" y="{_TOP + _HEIGHT + 40}">recall</text>'
        f'<text class="name" x="12" y="{middle}" transform="rotate(-90 12 {middle})">precision</text></svg>'
        '<details><summary>The curve as numbers</summary><table class="numbers"><thead><tr><th scope="col">recall</th>'
        f'<th scope="col">precision</th></tr></thead><tbody>{cells}</tbody></table></details>'
    )


def _row(name: str, values: dict[str, float], kind: str) -> str:
    cells = "".join(f"<td>{values[measure]:.3f}</td>" for measure in _MEASURES)
    return f'<tr class="{kind}"><th scope="row">{escape(name)}</th>{cells}</tr>'


def _axes() -> str:
    right, bottom = _LEFT + _WIDTH, _TOP + _HEIGHT
    lines = []
    for tick in np.linspace(0, 1, 6):
        x, y = _LEFT + _WIDTH * tick, bottom - _HEIGHT * tick
        lines.append(f'<line x1="{_LEFT}" y1="{y:.1f}" x2="{right}" y2="{y:.1f}"/>')
        lines.append(f'<text class="y" x="{_LEFT - 8}" y="{y + 4:.1f}">{tick:.1f}</text>')
        lines.append(f'<text class="x" x="{x:.1f}" y="{bottom + 18}">{tick:.1f}</text>')
    return "".join(lines)
