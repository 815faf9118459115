"""Speed and quality of the package, measured by `python -m benchmarks NAME DIR...`; `--help` lists all of them.

A benchmark is a module, or a package, of that name. Its docstring says what is measured and how; `options(parser)` adds
its arguments, and `run(arguments)` measures and hands the results to `_record.record`. A new one is named
in `NAMES` and tried on small input in `tests/benchmarks/test_benchmarks.py`.
"""

NAMES = (
    "engine",
    "tradeoff",
    "peers",
    "outlines",
    "specimens",
    "statistics",
    "retrieval",
    "ablation",
    "baselines",
    "composites",
    "figures",
    "features",
    "symmetry",
    "shortcut",
    "remeshing",
    "scaling",
)
