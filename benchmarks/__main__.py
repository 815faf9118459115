"""The command `python -m benchmarks`: finds a benchmark by its name and runs it."""

import argparse
import ast
import importlib
import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path

from . import NAMES


def main(argv: Sequence[str] | None = None) -> int:
    """Run one benchmark; 2 if it cannot be run, with the reason in one line."""
    width = max(map(len, NAMES))
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description="Measure the package. `python -m benchmarks NAME --help` has the options of one benchmark.",
        epilog="benchmarks:\n" + "\n".join(f"  {name:{width}}  {first_line(name)}" for name in NAMES),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("name", choices=NAMES, metavar="NAME")
    parser.add_argument("rest", nargs=argparse.REMAINDER, metavar="...", help="its folders and options")
    given = parser.parse_args(argv)
    module = importlib.import_module(f"{__package__}.{given.name}")
    own = argparse.ArgumentParser(
        prog=f"{parser.prog} {given.name}",
        description=module.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    module.options(own)
    own.add_argument("--out", type=Path, metavar="PATH", help="a JSON file (figures: a folder); by default stdout")
    own.set_defaults(benchmark=given.name)
    arguments = own.parse_args(given.rest)
    try:
        module.run(arguments)
    except (ValueError, OSError, ImportError) as error:
        print(f"{own.prog}: {error}", file=sys.stderr)
        return 2
    return 0


def first_line(name: str) -> str:
    """Of the docstring of a benchmark, which is not imported for it."""
    spec = importlib.util.find_spec(f"{__package__}.{name}")
    assert spec is not None
    assert spec.origin is not None
    text = ast.get_docstring(ast.parse(Path(spec.origin).read_text(encoding="utf-8"))) or ""
    return text.partition("\n")[0]


if __name__ == "__main__":
    sys.exit(main())
