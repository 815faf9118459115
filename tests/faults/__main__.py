"""What is left of runs that are killed, of a full disk, and of one that must not be written to.

    python -m tests.faults [--kills 100] [--seed 0] [--out FILE.json]

`curvematch matrix` and `curvematch parts` are killed (SIGKILL) at random moments and started again with the same
command until they come to their end; then from the beginning, until there were enough kills. At each end the whole
folder has to have the bytes of a run that was never stopped. A result that was whole before a kill must never be
written again: files keep their inodes and times. Exits with status 1 when anything of this fails.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
import tempfile
from pathlib import Path

from benchmarks._record import surroundings, write

from ._scenarios import faulty_disks, kill_again_and_again, matrix_scenario, parts_scenario


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=100, help="of each command")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, metavar="FILE.json")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scenarios = [matrix_scenario(folder), parts_scenario(folder)]
        campaigns = [kill_again_and_again(s, folder / s.name, arguments.kills, arguments.seed) for s in scenarios]
        disks = {s.name: faulty_disks(s, folder / f"{s.name}-disk") for s in scenarios}
    for campaign in campaigns:
        print(", ".join(f"{name} {value}" for name, value in dataclasses.asdict(campaign).items()), flush=True)
    print(json.dumps(disks, indent=1), flush=True)
    sound = all(campaign.sound for campaign in campaigns)
    sound &= all(outcome in ("sound", "skipped") for found in disks.values() for outcome in found.values())
    if arguments.out:
        found = {"campaigns": [dataclasses.asdict(campaign) for campaign in campaigns], "disks": disks}
        write(arguments.out, {**surroundings(), "seed": arguments.seed, **found})
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
