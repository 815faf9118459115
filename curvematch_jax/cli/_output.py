"""What the commands say: results on stdout, everything else on stderr."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..extraction import Failure
from ..retrieval import Ranking, Scores

_HEADINGS = {
    "nn": "NN",
    "ft": "FT",
    "st": "ST",
    "e": "E",
    "dcg": "DCG",
    "map": "mAP",
}
# Matched parts of an object that are listed for people.
_MATCHES = 3


@dataclass(frozen=True)
class Output:
    """Where a command's messages go, as its options `--json` and `--quiet` say."""

    as_json: bool
    quiet: bool

    @property
    def progress(self) -> bool:
        """Whether to show bars: on a terminal, unless quiet."""
        return not self.quiet and sys.stderr.isatty()

    def result(self, text: str, data: Mapping[str, object]) -> None:
        """The command's result, as text for people or as one JSON object."""
        print(json.dumps(data, allow_nan=False) if self.as_json else text)

    def note(self, message: str) -> None:
        """Something worth knowing that is no failure."""
        if not self.quiet:
            complain(message)

    def failures(self, failures: Sequence[Failure]) -> None:
        """The inputs that had to be left out, each with its reason; said even when quiet."""
        for failure in failures:
            complain(failure.reason if failure.name in failure.reason else f"{failure.name}: {failure.reason}")


def complain(message: str) -> None:
    """One line on stderr."""
    print(f"curvematch: {' '.join(message.split())}", file=sys.stderr)


def scores_table(scores: Scores) -> str:
    """The measures of every class and of all queries; the last line but one averages the classes."""
    by_class = scores.by_class()
    rows = [(name, *(values[key] for key in _HEADINGS)) for name, values in by_class.items()]
    macro = [sum(values[key] for values in by_class.values()) / len(by_class) for key in _HEADINGS]
    rows += [("all classes", *macro), ("all queries", *(getattr(scores, key) for key in _HEADINGS))]
    width = max(len(row[0]) for row in rows)
    lines = [" " * width + "".join(f"{heading:>8}" for heading in _HEADINGS.values())]
    lines += [f"{name:<{width}}" + "".join(f"{value:8.3f}" for value in values) for name, *values in rows]
    if scores.left_out:
        lines.append(f"left out, as they have one member: {', '.join(scores.left_out)}")
    return "\n".join(lines)


def ranking_rows(ranking: Ranking, top: int, explained: bool = False) -> list[dict[str, object]]:
    """The best of a ranking, for JSON; explained ones have the matches of their parts."""
    return [
        {
            "rank": place,
            "name": ranking.names[index],
            "probability": float(ranking.probability[index]),
            "dissimilarity": float(ranking.dissimilarity[index]),
            **({"matches": [match._asdict() for match in ranking.explain(index)]} if explained else {}),
        }
        for place, index in enumerate(ranking.order[:top].tolist(), start=1)
    ]


def ranking_table(ranking: Ranking, top: int) -> str:
    """The best of a ranking, for people."""
    rows = ranking_rows(ranking, top)
    width = max(len(str(row["name"])) for row in rows)
    lines = [f"rank  {'name':<{width}}  probability  dissimilarity"]
    lines += [
        f"{row['rank']:>4}  {row['name']:<{width}}  {row['probability']:>11.5f}  {row['dissimilarity']:>13.5g}"
        for row in rows
    ]
    lines.append(f"conflict {ranking.conflict:.5f}, ignorance {ranking.ignorance:.5f}")
    return "\n".join(lines)


def matches_table(ranking: Ranking, top: int) -> str:
    """Which parts of the query matched which parts of each of the best objects best, for people."""
    rows = [(ranking.names[j], match) for j in ranking.order[:top].tolist() for match in ranking.explain(j)[:_MATCHES]]
    width = max((len(name) for name, _ in rows), default=4)
    lines = [f"{'name':<{width}}  query part -> object part  distance     mass"]
    lines += [f"{name:<{width}}  {m.part:>10} -> {m.other:<11}  {m.distance:8.5f}  {m.mass:7.5f}" for name, m in rows]
    lines.append(f"The {_MATCHES} nearest parts of each; --json lists all.")
    return "\n".join(lines)
