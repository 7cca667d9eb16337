"""`study.lock.json`: what a campaign was resolved to (defaults, versions, seed, hashes), to repeat it.

It also guards the runs: when the model's source changes under stored runs, continuing would mix two models,
so that is refused until the user says which is meant.
"""

import json
import platform
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from workbench.campaign.store import Store
from workbench.errors import StudyError
from workbench.models.protocol import ModelSpec
from workbench.provenance.state import ModelState
from workbench.space.units import counted
from workbench.study.record import Study
from workbench.system.atomic import read_json, write_json

__all__ = [
    "CURE",
    "ModelChange",
    "check_lock",
    "model_change",
    "present_version",
    "take_state",
    "versions",
    "write_lock",
]

FILE = "study.lock.json"
MOST_SHOWN = 5
CURE = (  # of a changed model
    "Undo that; or give --same-model when their results still hold, or --new-version to make them anew "
    "beside the old ones"
)
PACKAGES = ("holdfast", "numpy", "scipy", "numba", "scikit-learn", "pyDOE3", "pandas", "xarray", "matplotlib")


def versions() -> dict[str, str]:
    """Python and the packages that results depend on."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def write_lock(folder: Path, study: Study, spec: ModelSpec) -> None:
    """Write the lock of a campaign."""
    content = {
        "resolved": study.to_dict(),
        "study_hash": study.hash,
        "space_hash": study.space.hash,
        "seed": study.seed,
        "model": {"identity": spec.identity, "version": spec.version, "source": source(spec)},
        "versions": versions(),
    }
    if read_json(folder / FILE) != content:
        write_json(folder / FILE, content)


def check_lock(
    folder: Path, spec: ModelSpec, *, runs: int, keep_runs: bool, guarded: bool = True
) -> list[str]:
    """What a person should know before continuing with `runs` stored runs.

    `guarded`: compare the source with the lock's; not where runs know the state of the model that made them.

    Raises:
        StudyError: the model's source is not the one that made the stored runs.
    """
    lock = read_json(folder / FILE)
    if not isinstance(lock, dict) or not runs:
        return []
    notes = []
    model: dict[str, Any] = lock.get("model", {})
    same_name = (model.get("identity"), model.get("version")) == (spec.identity, spec.version)
    now = source(spec)
    if guarded and same_name and model.get("source") and now and model["source"] != now:
        if not keep_runs:
            raise StudyError(
                f"the source of the model changed after {counted(runs, 'run was', 'runs were')} stored in "
                f"{folder.name}. Give --keep-runs when their results still hold, or set [model] version = "
                '"2" to make them anew'
            )
        notes.append(
            f"the source of the model changed; {counted(runs, 'run is', 'runs are')} kept as you asked"
        )
    before, after = lock.get("versions", {}), versions()
    moved = [f"{n} {before[n]} -> {after[n]}" for n in after if n in before and before[n] != after[n]]
    if moved:
        notes.append(f"continued with other versions than it was begun with: {', '.join(moved)}")
    return notes


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelChange:
    """Stored runs that other states of the model made, of which nobody said that they give the same.

    runs: how many    changes: what changed since, for a person    digests: of those states
    """

    runs: int
    changes: str
    digests: tuple[str, ...]

    def sentence(self, place: str) -> str:
        """For a person."""
        return (
            f"the source of the model changed after {counted(self.runs, 'run was', 'runs were')} stored in "
            f"{place}: {self.changes}"
        )


def model_change(store: Store, state: ModelState, spec: ModelSpec) -> ModelChange | None:
    """What changed in the model since runs were stored; None where they are by this state, or one like it."""
    known = store.select("SELECT id, digest, same_as, content FROM model_state ORDER BY id")
    alike = _alike(state.digest, [(digest, same_as) for _, digest, same_as, _ in known])
    strange = [id_ for id_, digest, _, _ in known if digest not in alike]
    if not strange:  # the runs are counted only where there may be some: a million take most of a second
        return None
    others = store.select(
        "SELECT s.digest, COUNT(*) FROM evaluation AS e JOIN model_state AS s ON s.id = e.state "
        f"WHERE e.state IN ({', '.join(map(str, strange))}) "
        "AND e.model = ? AND e.version = ? AND e.status = 'ok' GROUP BY s.digest ORDER BY MAX(s.id)",
        [spec.identity, spec.version],
    )
    if not others:
        return None
    content = next(json.loads(text) for _, digest, _, text in reversed(known) if digest == others[-1][0])
    return ModelChange(
        runs=sum(count for _, count in others),
        changes=_changes(content["decides"], state.decides),
        digests=tuple(digest for digest, _ in others),
    )


def take_state(
    store: Store, state: ModelState, spec: ModelSpec, *, place: str, same_model: bool
) -> list[str]:
    """From now on answers belong to this state of the model; what a person should know.

    Raises:
        StudyError: stored runs were made by another state, and nobody said that it gives the same.
    """
    known = store.select("SELECT id, digest, content FROM model_state ORDER BY id")
    change = model_change(store, state, spec)
    notes = []
    vouched: list[str | None] = []
    if change is not None:
        if not same_model:
            raise StudyError(f"{change.sentence(place)}. {CURE}")
        vouched = list(change.digests)
        notes.append(
            f"the source of the model changed ({change.changes}); "
            f"{counted(change.runs, 'run is', 'runs are')} kept as you asked"
        )
    text = json.dumps(state.to_dict(), sort_keys=True)
    same = [id_ for id_, _, content in known if content == text]
    if same and not vouched:
        store.state_now = same[0]
        return notes
    with store.transaction():
        for digest in vouched or [None]:
            store.write(
                "INSERT INTO model_state (digest, same_as, content, seen) VALUES (?, ?, ?, ?)",
                [state.digest, digest, text, time.time()],
            )
    ((store.state_now,),) = store.select("SELECT MAX(id) FROM model_state")
    return notes


def present_version(store: Store, base: str, *, anew: bool = False) -> str:
    """The version that runs of the study's version `base` go by; `anew`: the next one."""
    name = f"version {base}"
    found = store.select("SELECT value FROM meta WHERE key = ?", [name])
    version = str(found[0][0]) if found else base
    if anew:
        number = int(version.rpartition("~")[2]) if version != base else 1
        version = f"{base}~{number + 1}"
        store.write("INSERT OR REPLACE INTO meta (key, value) VALUES (?, ?)", [name, version])
    return version


def _alike(digest: str, vouched: Sequence[tuple[str, str | None]]) -> set[str]:
    """Digests of states that somebody vouched for to equal this one, one by one."""
    found = {digest}
    while True:
        more = {
            end
            for pair in vouched
            if None not in pair and found & set(pair)
            for end in pair
            if end is not None
        }
        if more <= found:
            return found
        found |= more


def _changes(before: Mapping[str, str], after: Mapping[str, str]) -> str:
    changed = [name for name in after if name in before and before[name] != after[name]]
    texts = [f"{name} changed" for name in changed]
    texts += [f"{name} is new" for name in after if name not in before]
    texts += [f"{name} is gone" for name in before if name not in after]
    shown = ", ".join(texts[:MOST_SHOWN])
    return shown + (f" and {len(texts) - MOST_SHOWN} more" if len(texts) > MOST_SHOWN else "")


def file_digest(path: Path) -> str:
    """A digest of a file; empty when it cannot be read."""
    try:
        return blake2b(path.read_bytes(), digest_size=16).hexdigest()
    except OSError:
        return ""


def source(spec: ModelSpec) -> str:
    """A digest of the source of a Python function or of a command's decks; empty for other models."""
    if spec.kind == "command":
        from workbench.models.command import command_digest

        return command_digest(spec)
    if spec.kind == "fmu":
        return file_digest(Path(spec.folder) / spec.options["file"])
    if spec.kind != "python":
        return ""
    from workbench.models.python import source_digest

    digest = source_digest(spec.options["function"], Path(spec.folder))
    gradient = spec.options.get("gradient", spec.options["function"])
    if gradient.rpartition(":")[0] == spec.options["function"].rpartition(":")[0]:
        return digest
    return digest + source_digest(gradient, Path(spec.folder))
