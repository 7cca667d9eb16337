"""holdfast's workbench: names, units, files, campaigns, worst case, reports and the command line.

Public names are loaded on first use, so `import workbench` and `import workbench.engine` stay light.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

from workbench import _siblings

__distribution__ = "holdfast"

_siblings.check()

# public name -> module that defines it
_PUBLIC = {
    "Campaign": "workbench.campaign",
    "Design": "workbench.design",
    "DesignOptions": "workbench.design",
    "Distribution": "workbench.space",
    "History": "workbench.model",
    "Parameter": "workbench.space",
    "Response": "workbench.space",
    "RunPlan": "workbench.run_planning",
    "Screening": "workbench.screening",
    "Space": "workbench.space",
    "Study": "workbench.study",
    "WorstCase": "workbench.worst_case",
    "compare": "workbench.design",
    "load_study": "workbench.study",
    "make_design": "workbench.design",
    "minimax": "workbench.minimax",
    "plan_runs": "workbench.run_planning",
    "re_evaluate": "workbench.robust",
    "report_numbers": "workbench.report",
    "screen": "workbench.screening",
    "weighted": "workbench.readings",
    "within": "workbench.readings",
    "worst_case": "workbench.worst_case",
    "worst_cases": "workbench.worst_cases",
    "worst_quantile": "workbench.worst_quantile",
    "write_report": "workbench.report",
}

__all__ = sorted(_PUBLIC)


class _Package(ModuleType):
    """This package: importing the module `worst_case` must not hide the function `worst_case`."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _PUBLIC and isinstance(value, ModuleType)):  # the import system binds submodules here
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("holdfast")
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'workbench' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
