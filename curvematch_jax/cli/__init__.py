"""The command line `curvematch`."""

from ._app import main

__all__ = ["main"]
