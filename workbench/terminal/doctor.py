"""Is this installation sound? Versions, namesakes of our packages, workers that answer, a disk that syncs."""

import sqlite3
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench import _siblings
from workbench.campaign.lock import versions
from workbench.campaign.store import Store, run_key
from workbench.errors import HoldfastError
from workbench.models.protocol import Answer, ModelSpec
from workbench.system.database import NETWORK, file_system
from workbench.workers.processes import ProcessPool, usable_processors

__all__ = ["Finding", "Findings", "examine"]

EXTRAS = {"h5netcdf": "netcdf", "pyarrow": "parquet", "dask": "dask", "fmpy": "fmi"}
COMMITS = 20


@dataclass(frozen=True, slots=True)
class Finding:
    """One check: what, whether it is in order, and in which words."""

    check: str
    ok: bool
    text: str


@dataclass(frozen=True, slots=True)
class Findings:
    """All checks."""

    findings: tuple[Finding, ...]

    @property
    def healthy(self) -> bool:
        """Whether every check is in order."""
        return all(f.ok for f in self.findings)

    def lines(self) -> list[str]:
        """For a person."""
        return [f"{'ok ' if f.ok else 'BAD'}  {f.check:<11} {f.text}" for f in self.findings]

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        checks = [{"check": f.check, "ok": f.ok, "text": f.text} for f in self.findings]
        return {"healthy": self.healthy, "checks": checks}


def examine() -> Findings:
    """Run all checks; takes a second or two."""
    return Findings(tuple([*_versions(), _names(), _workers(), _store(), _extras()]))


def _versions() -> list[Finding]:
    found = versions()
    missing = [name for name, v in found.items() if v == "not installed"]
    text = ", ".join(f"{name} {v}" for name, v in found.items())
    return [Finding("versions", not missing, text)]


def _names() -> Finding:
    try:
        _siblings.check(("doe", "surrogates", "workbench", "studies"))
    except ImportError as exc:
        return Finding("names", False, str(exc))
    return Finding("names", True, "doe, surrogates, studies and workbench are holdfast's own")


def _workers() -> Finding:
    """Two workers that spin at the same time: how much of two processors they get."""
    spec = ModelSpec(
        kind="python",
        options={"function": "workbench.terminal.doctor:spin"},
        folder=tempfile.gettempdir(),
        names=("seconds",),
        responses={"cpu": None},
        identity="doctor",
        version="1",
    )
    begun = time.perf_counter()
    try:
        pool = ProcessPool(spec, workers=2, timeout=30.0)
        try:
            pool.probe()
            ready = time.perf_counter() - begun
            begun = time.perf_counter()
            answers: list[Answer] = []
            for task in range(2):
                pool.submit(task, {"seconds": 0.2})
            while len(answers) < 2:
                answers += [answer for _, answer in pool.completed()]
            wall = time.perf_counter() - begun
        finally:
            pool.close()
    except HoldfastError as exc:
        return Finding("workers", False, str(exc))
    bad = [a.error for a in answers if a.status != "ok"]
    if bad:
        return Finding("workers", False, bad[0])
    share = sum(a.outputs["cpu"] for a in answers) / wall
    text = (
        f"2 workers ready after {ready:.2g} s, together {share:.2g} of {usable_processors()} processors busy"
    )
    return Finding("workers", True, text)


def spin(seconds: float) -> float:
    """Compute for `seconds` on the clock; the processor seconds that took."""
    begun = time.process_time()
    until = time.perf_counter() + seconds
    while time.perf_counter() < until:
        pass
    return time.process_time() - begun


def _store() -> Finding:
    here = Path.cwd()
    kind = file_system(here) or "unknown"
    try:
        with tempfile.TemporaryDirectory(dir=here) as name:
            store = Store.opened(Path(name) / "runs.sqlite")
            begun = time.perf_counter()
            for k in range(COMMITS):
                store.enqueue(
                    [(run_key("doctor", "1", {"k": k}), {"k": k})],
                    batch="doctor",
                    model="",
                    version="",
                    seed=0,
                )
            pace = (time.perf_counter() - begun) / COMMITS
            wrong = store.check()
            store.close()
    except (HoldfastError, OSError) as exc:
        return Finding("store", False, f"{here}: {exc}")
    journal = "TRUNCATE (network file system)" if kind in NETWORK else "WAL"
    text = (
        f"SQLite {sqlite3.sqlite_version}, {journal} on {kind}, {1000 * pace:.2g} ms per durable commit here"
    )
    return Finding("store", not wrong, text)


def _extras() -> Finding:
    from importlib.util import find_spec

    texts = [f"{extra} {'yes' if find_spec(module) else 'no'}" for module, extra in EXTRAS.items()]
    return Finding("extras", True, ", ".join(texts))
