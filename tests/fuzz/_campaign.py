"""Many hostile files in worker processes: which ones, what becomes of them, and what is kept of those that do harm."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

from curvematch_jax.extraction._workers import in_processes

from ._judge import Case, Verdict, judge, smaller
from ._seeds import FORMATS, suffix_of

_CLOCK = 30.0  # seconds; workers that share a machine are slower than their own processor time says


def cases(count: int, seed: int, kinds: Sequence[str] = FORMATS) -> list[Case]:
    """Each kind in turn; a case depends on the seed and its number alone."""
    return [Case(kinds[k % len(kinds)], (seed, k)) for k in range(count)]


def run(chosen: Sequence[Case], jobs: int) -> Iterator[tuple[Case, Verdict]]:
    """Every case with its verdict, as they come."""
    for outcome in in_processes(judge, chosen, jobs, _CLOCK):
        failure = outcome.failure or ""
        kind = "hang" if failure.startswith("took longer") else "crash"
        yield chosen[outcome.task], outcome.result or Verdict("failed", ((kind, failure),))


def summary(verdicts: Sequence[tuple[Case, Verdict]]) -> dict:
    """Counts by kind of file and outcome, violations by kind, and what the stages took."""
    outcomes: defaultdict[str, Counter[str]] = defaultdict(Counter)
    stages: defaultdict[str, list[float]] = defaultdict(list)
    violations: Counter[str] = Counter()
    for case, verdict in verdicts:
        outcomes[case.kind][verdict.outcome] += 1
        violations.update({kind for kind, _ in verdict.violations})
        for stage, seconds in verdict.seconds.items():
            stages[stage].append(seconds)
    return {
        "files": {kind: dict(sorted(counts.items())) for kind, counts in outcomes.items()},
        "violations": dict(violations),
        "violating_files": sum(bool(verdict.violations) for _, verdict in verdicts),
        "peak_mebibytes": max(verdict.memory for _, verdict in verdicts) / 2**20,
        "stages": {
            stage: {"calls": len(all_of), "mean_seconds": sum(all_of) / len(all_of), "most_seconds": max(all_of)}
            for stage, all_of in sorted(stages.items())
        },
    }


def save(case: Case, verdict: Verdict, folder: Path) -> None:
    """The file beside what was wrong with it; made smaller unless reading it kills or hangs."""
    if not {kind for kind, _ in verdict.violations} & {"crash", "hang", "slow", "memory"}:
        case = next(in_processes(smaller, [case], 1, 2 * _CLOCK)).result or case
    place = folder / f"{case.kind}-{'-'.join(map(str, case.seed))}"
    content = case.made()
    place.mkdir(parents=True, exist_ok=True)
    files = content if isinstance(content, dict) else {f"given.{suffix_of(case.kind)}": content}
    for name, data in files.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).write_bytes(data)
    (place / "violations.txt").write_text("\n".join(f"{kind}: {detail}" for kind, detail in verdict.violations) + "\n")
