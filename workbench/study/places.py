"""Where in a study file the keys stand that an opened model may refuse: "study.toml, line 7" by key.

A worker opens the model from its description and has no study file; with these it can say the line.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from workbench.study.toml_lines import find_line

__all__ = ["model_places"]


def model_places(
    text: str, where: str, *, model: Mapping[str, Any], parameters: Iterable[str], responses: Iterable[str]
) -> dict[str, str]:
    """File and line by key: those of `[model]`, "templates[1]", "parameter a", "read of y".

    >>> text = '[model]\\nkind = "python"\\nfunction = "f"\\n[[parameter]]\\nname = "a"'
    >>> found = model_places(text, "s.toml", model={"function": "f"}, parameters=["a"], responses=[])
    >>> found["function"], found["parameter a"]
    ('s.toml, line 3', 's.toml, line 4')
    """
    paths: dict[str, tuple[str | int, ...]] = {key: ("model", key) for key in model}
    for k in range(len(model.get("templates", ()))):
        paths[f"templates[{k + 1}]"] = ("model", "templates", k)
    paths |= {f"parameter {name}": ("parameter", k) for k, name in enumerate(parameters)}
    paths |= {f"read of {name}": ("response", k, "read") for k, name in enumerate(responses)}
    lines = {key: find_line(text, path) for key, path in paths.items()}
    return {key: f"{where}, line {line}" for key, line in lines.items() if line is not None}
