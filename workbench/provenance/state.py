"""The state of a model: what decides its results, by content, and the circumstances that are written down.

What decides: the function's code and all that it imports inside the study's and the user's own folders, data
files that it names, templates and copied files, solvers with their linked libraries, an FMU, and what
`[model.state]` lists. The circumstances (packages, Python, processor, commit) are attributed to runs; where
they change, nothing is refused.
"""

import json
import os
import platform
import re
import shutil
import subprocess
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from fnmatch import fnmatch
from hashlib import blake2b
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from workbench.models.protocol import ModelSpec
from workbench.provenance.closure import closure_of
from workbench.provenance.content import ContentCache, digest_of
from workbench.provenance.named import included_files, model_files, named_files, programs
from workbench.provenance.reading import digest_without, reader_files

__all__ = ["ModelState", "model_state"]

LONGEST_STATUS = 1.0  # s that git may take to compare files with the commit
DISTRIBUTIONS = {"sklearn": "scikit-learn", "yaml": "PyYAML", "PIL": "pillow", "cv2": "opencv-python"}
LIBRARY = re.compile(r"=> (/\S+) \(0x|^\s+(/\S+) \(0x", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelState:
    """`decides`: what ("code solver.py", "library libm.so.6") -> digest. `circumstances`: what -> text."""

    decides: Mapping[str, str]
    circumstances: Mapping[str, str]

    @property
    def digest(self) -> str:
        """Of what decides."""
        return blake2b(json.dumps(dict(self.decides), sort_keys=True).encode(), digest_size=16).hexdigest()

    def to_dict(self) -> dict[str, Any]:
        """Plain types for JSON."""
        return {"decides": dict(self.decides), "circumstances": dict(self.circumstances)}


def model_state(spec: ModelSpec, wanted: Mapping[str, Any], *, cache: ContentCache) -> ModelState:
    """The present state of the model of a study; `wanted` is `[model.state]`."""
    study = Path(spec.folder)
    decides: dict[str, str] = {}
    packages = {"numpy"}
    closure = closure_of(model_files(spec), study, cache)
    packages |= closure.packages
    readings = reader_files(spec)
    packages |= closure_of(list(readings), study, cache).packages
    for path, readers in readings.items():  # an edited reader is another reading, no other model
        for name in (n for n, place in closure.places.items() if place == path):
            closure.code[name] = digest_without(path, readers, cache)
    decides |= {f"code {name}": digest for name, digest in closure.code.items()}
    decides |= {f"data {name}": digest for name, digest in closure.data.items()}
    for name in named_files(spec):
        if not name.endswith(".py"):
            decides[f"file {name}"] = _digest(study / name, cache)
    for file in included_files(study, wanted.get("include", ())):
        decides[f"file {file.relative_to(study).as_posix()}"] = _digest(file, cache)
    for program in programs(spec):
        if program.suffix != ".py":  # those are code
            decides |= _program(program, cache)
    for name in wanted.get("environment", ()):
        decides[f"environment {name}"] = os.environ.get(name, "")
    out = wanted.get("exclude", ())
    decides = {k: v for k, v in decides.items() if not any(fnmatch(k.partition(" ")[2], p) for p in out)}
    cache.write()
    return ModelState(decides=dict(sorted(decides.items())), circumstances=_circumstances(packages, study))


def _program(path: Path, cache: ContentCache) -> dict[str, str]:
    """A program and the libraries that it is linked with, by content."""
    libraries = [Path(library) for library in cache.of(path, linked_libraries)]
    with ThreadPoolExecutor() as threads:  # a digest gives the interpreter up while it reads and sums
        digests = list(threads.map(lambda file: _digest(file, cache), [path, *libraries]))
    names = [f"program {path.name}", *(f"library {library.name}" for library in libraries)]
    return dict(zip(names, digests, strict=True))


def linked_libraries(path: Path) -> list[str]:
    """Paths of the shared libraries that the loader would take; none for scripts and static programs."""
    with open(path, "rb") as file:
        if file.read(4) != b"\x7fELF":
            return []
    tool = shutil.which("ldd")
    if tool is None:
        return []
    try:
        ended = subprocess.run([tool, str(path)], capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return []
    return sorted({a or b for a, b in LIBRARY.findall(ended.stdout)})


def _digest(path: Path, cache: ContentCache) -> str:
    try:
        return str(cache.of(path, digest_of))
    except OSError:
        return "missing"


def _circumstances(packages: set[str], study: Path) -> dict[str, str]:
    found = {"python": platform.python_version(), "machine": platform.machine(), "processor": _processor()}
    for name in sorted({"holdfast", *packages}):
        try:
            found[f"package {name}"] = version(DISTRIBUTIONS.get(name, name))
        except PackageNotFoundError:
            continue
    commit = _commit(study)
    return {**found, "commit": commit, "tree": _tree(study)} if commit else found


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")


def _tree(folder: Path) -> str:
    """Whether files that git follows differ from the commit: "clean", "dirty", or "unknown" to git."""
    try:
        done = subprocess.run(
            ["git", "--no-optional-locks", "-C", str(folder), "status", "--porcelain", "-uno"],
            capture_output=True,
            timeout=LONGEST_STATUS,
            check=False,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    if done.returncode != 0:
        return "unknown"
    return "dirty" if done.stdout.strip() else "clean"


def _commit(folder: Path) -> str:
    """The commit that the repository around a folder stands at; empty where there is none."""
    for place in (folder, *folder.parents):
        git = place / ".git"
        if git.is_file():
            git = Path(place, git.read_text().partition("gitdir:")[2].strip())
        head = git / "HEAD"
        if not head.is_file():
            continue
        text = head.read_text().strip()
        if not text.startswith("ref: "):
            return text
        common = git / "commondir"
        base = (git / common.read_text().strip()) if common.is_file() else git
        reference = base / text[5:]
        if reference.is_file():
            return reference.read_text().strip()
        packed = base / "packed-refs"
        lines = packed.read_text().splitlines() if packed.is_file() else []
        return next((line.split()[0] for line in lines if line.endswith(text[5:])), "")
    return ""
