"""Hostile files: do they ever crash, hang, fill the memory, reach for other files, or end in anything but one sentence?

    python -m tests.fuzz [--count 20000] [--seed 0] [--jobs 2] [--kinds off glb ...] [--save DIR] [--out FILE.json]

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
from pathlib import Path

from benchmarks._record import surroundings, write

from ._campaign import cases, run, save, summary
from ._seeds import FORMATS


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
        **surroundings(),
    }
    print(json.dumps(facts, indent=1))
    if arguments.out:
        write(arguments.out, facts)
    return 1 if facts["violations"] else 0


if __name__ == "__main__":
    sys.exit(main())
