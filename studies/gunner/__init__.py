"""The gunner: a vehicle, a gunner in its hatch and the proving grounds of chapter VIII, on open data.

`system(Case(...))` is the multibody system of a case, `responses(name, row)` one run of a row of uncertain
parameters on a proving ground. Public names are loaded on first use.
"""

from typing import Any

__all__ = ["Case", "responses", "system"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from . import cases, uncertain

        return {"Case": cases.Case, "responses": uncertain.responses, "system": cases.system}[name]
    raise AttributeError(f"module '{__name__}' has no attribute {name!r}")
