"""The Python function "module:function" of a study file that gives a layout problem or a layout model."""

import importlib
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from workbench.errors import StudyError

__all__ = ["load_problem"]


def load_problem(
    reference: str, options: Mapping[str, Any] | None = None, *, folder: Path | None = None
) -> Any:
    """Call "module:function" with the options; modules beside the study file are found.

    Raises StudyError when the reference cannot be resolved or the function refuses its options.

    >>> load_problem("studies.trusses:cantilever").title
    'cantilever'
    """
    module_name, _, function_name = reference.partition(":")
    if not module_name or not function_name:
        raise StudyError(f"layout problem needs the form 'module:function', got '{reference}'")
    if folder is not None and str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    try:
        function = getattr(importlib.import_module(module_name), function_name)
    except ModuleNotFoundError as error:
        raise StudyError(
            f"layout problem '{reference}': no module '{error.name}'. Put it beside the study file or "
            "install it"
        ) from error
    except AttributeError as error:
        raise StudyError(f"layout problem '{reference}': module has no '{function_name}'") from error
    try:
        return function(**dict(options or {}))
    except (TypeError, ValueError) as error:
        raise StudyError(f"layout problem '{reference}' with {dict(options or {})}: {error}") from error
