"""Optional dependencies: loaded where they are used, with the install command when they are missing."""

import importlib
from types import ModuleType


def require(module: str, extra: str, purpose: str) -> ModuleType:
    """Import `module`, which the extra `extra` brings.

    Args:
        module: name to import, dots allowed.
        extra: the extra of this package that installs it.
        purpose: what needs it, the subject of the message: "repairing a mesh".

    Raises:
        ImportError: when it is not installed, with the line that installs it.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        message = f"{purpose} needs {package}: pip install 'curvematch_jax[{extra}]'"
        raise ImportError(message) from error
