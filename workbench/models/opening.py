"""From the description of a model to the model, ready to run: one table of kinds.

A kind is a class that stands elsewhere, named by "module:class" and imported when a model of it is opened: a
worker loads the code of its own kind only, and the kind `layout`, which lives higher up, needs no arrow up
from here.
"""

from importlib import import_module

from workbench.errors import StudyError
from workbench.models.protocol import Model, ModelSpec

__all__ = ["KINDS", "open_model"]

# kind -> class with `opened(spec)`; `layout` is the robust loop's own and stands in no study file
KINDS = {
    "python": "workbench.models.python:PythonModel",
    "command": "workbench.models.command:CommandModel",
    "fmu": "workbench.models.fmu:FmuModel",
    "table": "workbench.models.table:TableModel",
    "layout": "workbench.robust_layout.model:LayoutRun",
}


def open_model(spec: ModelSpec) -> Model:
    """The model of a description.

    Raises:
        StudyError: no such kind; or the function, file or solver does not exist or does not take the study's
            parameters.
    """
    if spec.kind not in KINDS:
        kinds = ", ".join(name for name in KINDS if name != "layout")
        raise StudyError(f"model kind {spec.kind!r} cannot be run here; it is one of {kinds}")
    module, _, name = KINDS[spec.kind].partition(":")
    model: Model = getattr(import_module(module), name).opened(spec)
    return model
