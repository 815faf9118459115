"""Hostile files: do they ever crash, hang, fill the memory, reach for other files, or end in anything but one sentence?

    python benchmarks/fuzz.py [--count 20000] [--seed 0] [--jobs 2] [--kinds off glb ...] [--save DIR] [--out FILE.json]

Small valid files in every format are broken in a few places (`_mutations.py`), or are made to be small on disk and
large once read (`_bombs.py`). Worker processes read them as users do (`_judge.py`): mesh files by `load_mesh` and, when
that succeeds, `extract_parts`; parts files by `load_parts`; matrices by `load_matrix`. A file is refused by a
`ValueError` (`MeshError`), `FileNotFoundError` or `ImportError` whose message is one line that names the file.
Anything else is a violation, and so is: the death of the worker; more than 10 seconds of its processor, or 30 on the
clock; more than 1 GiB of memory; opening, listing or changing any file but the given one; a socket, a process,
unpickling; a warning; a word on stdout or stderr; a result that is not finite or has wrong shapes. Linux only.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

from _judge import Case, Verdict, judge, smaller
from _record import versions, write
from _seeds import FORMATS, suffix_of

from curvematch_jax.extraction._workers import in_processes

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


def main() -> int:
    parser = argparse.ArgumentParser(description="Hostile files against the readers.")
    parser.add_argument("--count", type=int, default=20_000, help="files")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2, help="worker processes")
    parser.add_argument("--kinds", nargs="+", choices=FORMATS, default=FORMATS, help="kinds of files")
    parser.add_argument("--save", type=Path, metavar="DIR", help="put the files that violate something here")
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="write the figures here, too")
    arguments = parser.parse_args()
    start = time.perf_counter()
    verdicts = []
    for case, verdict in run(cases(arguments.count, arguments.seed, arguments.kinds), arguments.jobs):
        verdicts.append((case, verdict))
        if verdict.violations:
            print(case.kind, case.seed, *verdict.violations, file=sys.stderr, flush=True)
            if arguments.save:
                save(case, verdict, arguments.save)
        if len(verdicts) % 1000 == 0:
            print(f"{len(verdicts)} files, {time.perf_counter() - start:.0f} s", file=sys.stderr, flush=True)
    facts = {
        "count": arguments.count,
        "seed": arguments.seed,
        "jobs": arguments.jobs,
        **summary(verdicts),
        "seconds": time.perf_counter() - start,
        "versions": versions("pymeshfix", "fast-simplification"),
    }
    print(json.dumps(facts, indent=1))
    if arguments.out:
        write(arguments.out, facts)
    return 1 if facts["violations"] else 0


if __name__ == "__main__":
    sys.exit(main())
