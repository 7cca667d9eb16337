"""Are `doe` and `surrogates` ours? Strangers on public indexes carry the same import names."""

from importlib.util import find_spec
from pathlib import Path

__all__ = ["check"]

MARKER = b'__distribution__ = "holdfast"'


def check(names: tuple[str, ...] = ("doe", "surrogates")) -> None:
    """Raise ImportError when one of `names` would import a package that is not holdfast's.

    Finds without importing, so that `import workbench.engine` stays free of doe and surrogates.
    """
    for name in names:
        spec = find_spec(name)
        file = spec.origin if spec is not None else None
        if file is None or not Path(file).is_file() or MARKER not in Path(file).read_bytes():
            raise ImportError(
                f"`import {name}` finds {file}, not the {name} package of holdfast. Rename or remove "
                "that file, or install holdfast in a virtual environment of its own"
            )
