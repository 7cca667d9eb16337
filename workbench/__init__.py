"""holdfast's workbench: names, units, files, campaigns, worst case, reports and the command line.

Public names are loaded on first use, so `import workbench` and `import workbench.engine` stay light.
"""

from importlib import import_module
from typing import Any

from workbench import _siblings

__distribution__ = "holdfast"

_siblings.check()

# public name -> module that defines it
_PUBLIC = {
    "Distribution": "workbench.space",
    "Parameter": "workbench.space",
    "Response": "workbench.space",
    "Space": "workbench.space",
    "WorstCase": "workbench.worst_case",
    "minimax": "workbench.minimax",
    "re_evaluate": "workbench.robust",
    "worst_case": "workbench.worst_case",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("holdfast")
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'workbench' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
