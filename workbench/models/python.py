"""A Python function as a model: `module:name`, or `file.py:name` relative to the study file.

The function takes the parameters by name and returns a number, or a mapping of response names to numbers or
histories. Where it also returns derivatives, as a pair (see `workbench.models.gradients`), or a second
function does, a worst-case search climbs by them. A gradient that raises does not cost the run its response.
"""

import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from hashlib import blake2b
from pathlib import Path
from types import ModuleType
from typing import Any

from workbench.errors import StudyError
from workbench.models.gradients import WithGradient
from workbench.models.protocol import ModelSpec

__all__ = ["PythonModel", "load_function", "source_digest"]


@dataclass(frozen=True, slots=True)
class PythonModel:
    """A function that takes the parameters by name, and perhaps another that gives its derivatives there."""

    function: Callable[..., Any]
    gradient: Callable[..., Any] | None = None

    @classmethod
    def opened(cls, spec: ModelSpec) -> "PythonModel":
        """Import the function and check that it takes the study's parameters."""
        with spec.placed("function"):
            function = load_function(spec.options["function"], Path(spec.folder))
            check_signature(function, spec.names)
        if "gradient" not in spec.options:
            return cls(function)
        with spec.placed("gradient"):
            gradient = load_function(spec.options["gradient"], Path(spec.folder))
            check_signature(gradient, spec.names)
        return cls(function, gradient)

    def run(self, row: Mapping[str, Any], workdir: Path | None) -> Any:
        """Call the function, and the gradient where there is one."""
        values = self.function(**row)
        if self.gradient is None:
            return values
        try:
            return WithGradient(values, self.gradient(**row))
        except Exception as exc:  # the response is known; a search can do without its slope here
            return WithGradient(values, exc)

    def close(self) -> None:
        """Nothing to release."""


def load_function(reference: str, folder: Path) -> Callable[..., Any]:
    """The function behind `module:name` or `file.py:name` (relative to `folder`).

    Raises:
        StudyError: no such module, file or name, or the import itself fails.
    """
    place, colon, name = reference.rpartition(":")
    if not colon or not place or not name.isidentifier():
        raise StudyError(f"function {reference!r} needs the form 'module:name' or 'file.py:name'")
    module = (
        _import_file(folder / place, reference) if place.endswith(".py") else _import_module(place, folder)
    )
    function = getattr(module, name, None)
    if function is None:
        public = [n for n, v in vars(module).items() if callable(v) and not n.startswith("_")]
        close = get_close_matches(name, public, n=1)
        hint = f". Did you mean {close[0]!r}?" if close else ""
        raise StudyError(f"function {reference!r}: {place} has no {name!r}{hint}")
    if not callable(function):
        raise StudyError(f"function {reference!r}: {name!r} is a {type(function).__name__}, not a function")
    return function  # type: ignore[no-any-return]


def check_signature(function: Callable[..., Any], names: tuple[str, ...]) -> None:
    """Refuse a function that cannot be called with exactly these names."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        return  # built in C: only the call can tell
    try:
        signature.bind(**dict.fromkeys(names))
    except TypeError as exc:
        name = getattr(function, "__name__", "the function")
        raise StudyError(
            f"{name}{signature} cannot be called with the study's parameters {', '.join(names)}: {exc}"
        ) from None


def source_digest(reference: str, folder: Path) -> str:
    """A digest of the file that defines the function, without importing it; empty without a file."""
    place = reference.rpartition(":")[0]
    if place.endswith(".py"):
        file: Path | None = folder / place
    else:
        try:
            spec = importlib.util.find_spec(place)
        except (ImportError, ValueError):
            spec = None
        file = (
            Path(spec.origin)
            if spec is not None and spec.origin
            else folder / f"{place.replace('.', '/')}.py"
        )
    assert file is not None
    try:
        return blake2b(file.read_bytes(), digest_size=16).hexdigest()
    except OSError:
        return ""


def _import_file(path: Path, reference: str) -> ModuleType:
    if not path.is_file():
        raise StudyError(f"no file {path}: function {reference!r} is looked up beside the study file")
    _add_to_path(path.parent)
    name = f"holdfast_model_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickle look their module up by name
    _execute(lambda: spec.loader.exec_module(module), path.name)  # type: ignore[union-attr]
    return module


def _import_module(place: str, folder: Path) -> ModuleType:
    _add_to_path(folder)
    module: ModuleType | None = None

    def load() -> None:
        nonlocal module
        module = importlib.import_module(place)

    _execute(load, place)
    assert module is not None
    return module


def _execute(action: Callable[[], None], place: str) -> None:
    # no bytecode beside the user's files: within a second of an edit it would be taken for current
    writes, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        action()
    except ModuleNotFoundError as exc:
        whole = place.split(".")
        if exc.name in {".".join(whole[: k + 1]) for k in range(len(whole))}:
            raise StudyError(f"no module {exc.name!r}: the function is said to stand in {place!r}") from None
        raise StudyError(f"importing {place} failed: {exc}") from exc
    except (Exception, SystemExit) as exc:
        raise StudyError(f"importing {place} failed: {type(exc).__name__}: {exc}") from exc
    finally:
        sys.dont_write_bytecode = writes


def _add_to_path(folder: Path) -> None:
    """Let the model import its neighbours; at the end, so that they never hide an installed package."""
    text = str(folder.resolve())
    if text not in sys.path:
        sys.path.append(text)
