"""holdfast's workbench: names, units, files, campaigns, worst case, reports and the command line.

Public names are loaded on first use, so `import workbench` and `import workbench.engine` stay light.
"""

import sys
from collections.abc import Sequence
from importlib import import_module
from types import ModuleType
from typing import Any

from workbench import _siblings

__distribution__ = "holdfast"

_siblings.check()

# public name -> module that defines it
_PUBLIC = {
    "Campaign": "workbench.stages.campaign",
    "Design": "workbench.sampling.plan",
    "DesignOptions": "workbench.sampling.plan",
    "Distribution": "workbench.space.box",
    "History": "workbench.models.histories",
    "Parameter": "workbench.space.box",
    "Response": "workbench.space.box",
    "RunPlan": "workbench.screening.run_planning",
    "Screening": "workbench.screening.record",
    "Space": "workbench.space.box",
    "Study": "workbench.study.record",
    "WorstCase": "workbench.search.worst_case",
    "compare": "workbench.sampling.plan",
    "load_study": "workbench.study.loading",
    "make_design": "workbench.sampling.plan",
    "minimax": "workbench.robust.minimax",
    "plan_runs": "workbench.screening.run_planning",
    "re_evaluate": "workbench.robust.re_evaluation",
    "report_numbers": "workbench.report.writing",
    "screen": "workbench.screening.kriging",
    "weighted": "workbench.models.readings",
    "within": "workbench.models.readings",
    "worst_case": "workbench.search.worst_case",
    "worst_cases": "workbench.search.worst_cases",
    "worst_quantile": "workbench.search.worst_quantile",
    "write_report": "workbench.report.writing",
}

__all__ = sorted(_PUBLIC)


class _Package(ModuleType):
    """This package: importing the module `worst_case` must not hide the function `worst_case`."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _PUBLIC and isinstance(value, ModuleType)):  # the import system binds submodules here
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


class _Moved:
    """Asked last for a module: those of the time before the rooms are found in `workbench._moved`."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> Any:
        if not name.startswith("workbench."):
            return None
        from workbench._moved import MovedFinder

        return MovedFinder.find_spec(name, path, target)


sys.meta_path.append(_Moved)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("holdfast")
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'workbench' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
