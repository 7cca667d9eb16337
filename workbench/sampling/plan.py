"""The `Design` object: runs with identities, in unit, coded and physical values, and where they come from.

A design is made once (`make_design`) and never changed. Run ids are `r0001`, `r0002`, ... in the order the
runs were added, so growing a design never renames a run.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

import numpy as np

import doe
from workbench.errors import StudyError
from workbench.sampling.growth import balanced_blocks, further_runs
from workbench.sampling.kinds import DEFAULT, DesignOptions
from workbench.sampling.points import points_of_kind, random_points
from workbench.space.box import Space, need_space
from workbench.space.streams import stream

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["Design", "DesignOptions", "compare", "make_design", "run_ids", "versions"]

CONSTRAINED_REFERENCES = 16  # each is made feasible by swaps, in Python
VERSIONED = ("holdfast", "numpy", "scipy", "numba", "pyDOE3")


@cache
def versions() -> dict[str, str]:
    """Versions of the packages that a design depends on."""
    found = {}
    for name in VERSIONED:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


@dataclass(frozen=True, kw_only=True)
class Design:
    """n runs of d parameters, made by `make_design` or given.

    unit: (n, d) in [0, 1], read-only, levels at k/(N - 1)    run_ids: n different names
    algorithm, options, seed: how it was made    block: block number of each run, or empty
    beside_fresh: of a design just grown its figures, each beside that of as many runs drawn at once; or empty
    """

    space: Space
    unit: np.ndarray
    run_ids: tuple[str, ...]
    algorithm: str
    options: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0
    block: tuple[int, ...] = ()
    beside_fresh: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        unit = np.array(self.unit, dtype=float, order="C", ndmin=2)
        unit.flags.writeable = False
        object.__setattr__(self, "unit", unit)
        object.__setattr__(self, "run_ids", tuple(self.run_ids))
        if len(self.run_ids) != len(unit):
            raise StudyError(
                f"a design needs one run id per run, got {len(self.run_ids)} for {len(unit)} runs"
            )
        if len(set(self.run_ids)) < len(self.run_ids):
            raise StudyError("run ids are given twice; every run has its own")
        if self.block and len(self.block) != len(unit):
            raise StudyError(f"a design needs one block per run, got {len(self.block)} for {len(unit)} runs")

    def __len__(self) -> int:
        return len(self.unit)

    @property
    def coded(self) -> np.ndarray:
        """Values on -1..1, (n, d)."""
        return 2.0 * self.unit - 1.0

    @property
    def physical(self) -> np.ndarray:
        """Values in the parameters' units, (n, d): floats, or objects when a parameter is categorical."""
        return self.space.physical(self.unit)

    def rows(self, some: slice = slice(None)) -> list[dict[str, Any]]:
        """What a model is called with, one mapping per run; of `some` of the runs."""
        return self.space.rows(self.unit[some])

    # ---- verbs: each hands back a new design in which every run keeps its id ----

    def subset(self, runs: Iterable[str | int]) -> "Design":
        """The runs named by id or by position, in the order given."""
        place = {name: k for k, name in enumerate(self.run_ids)}
        rows = []
        for run in runs:
            k = place.get(run, -1) if isinstance(run, str) else int(run)
            if not 0 <= k < len(self):
                raise StudyError(f"the design has no run {run!r}; it has {len(self)}, from {self._span()}")
            rows.append(k)
        return self._take(np.array(rows, dtype=int))

    def randomised(self, *, seed: int) -> "Design":
        """The runs in random order, inside their blocks where there are any."""
        rng = stream(seed, "run order")
        order = rng.permutation(len(self))
        if self.block:
            order = order[np.argsort(np.array(self.block)[order], kind="stable")]
        return self._take(order)

    def replicated(self, times: int) -> "Design":
        """Every run `times` times; the repeats follow with new ids."""
        if times < 1:
            raise StudyError(f"times needs a whole number >= 1, got {times}")
        return self.appended(np.tile(self.unit, (times - 1, 1)), block=self.block * (times - 1))

    def blocked(self, blocks: int, *, seed: int) -> "Design":
        """The runs in blocks whose sizes differ by one at most and whose mean levels agree as far as they
        can.

        Runs are swapped between blocks while that brings the blocks' means nearer to the mean of the design.
        """
        n = len(self)
        if not 1 <= blocks <= n:
            raise StudyError(f"blocks needs a whole number from 1 to the {n} runs, got {blocks}")
        rng = stream(seed, "blocks")
        number = rng.permutation(np.arange(n) % blocks)
        return replace(self, block=tuple((balanced_blocks(self.unit, number) + 1).tolist()))

    def appended(self, unit: np.ndarray, *, block: tuple[int, ...] = ()) -> "Design":
        """The runs and, after them, new ones at `unit` (m, d) with the next free ids."""
        added = np.asarray(unit, dtype=float).reshape(-1, self.space.dimension)
        numbers = [int(name[1:]) for name in self.run_ids if name[:1] == "r" and name[1:].isdigit()]
        names = run_ids(len(added), first=max(numbers, default=0) + 1)
        return replace(
            self,
            unit=np.vstack([self.unit, added]),
            run_ids=(*self.run_ids, *names),
            block=(*self.block, *block) if len(block) == len(added) else (),
            beside_fresh={},
        )

    def grown(self, runs: int, *, seed: int, model: str | None = None) -> "Design":
        """The design with `runs` more: the present runs stay as they are and keep their ids.

        Without `model` the new points fill the gaps; with one they are D-optimal beside the present runs.
        """
        if runs < 1:
            raise StudyError(f"runs needs a whole number >= 1, got {runs}")
        rng = stream(seed, "growth", replicate=len(self))
        further = further_runs(self.space, self.unit, runs, seed=seed, rng=rng, model=model)
        return replace(self.appended(further.points), beside_fresh=further.beside_fresh)

    def _take(self, rows: np.ndarray) -> "Design":
        return replace(
            self,
            unit=self.unit[rows],
            run_ids=tuple(self.run_ids[k] for k in rows),
            block=tuple(self.block[k] for k in rows) if self.block else (),
            beside_fresh={},
        )

    def _span(self) -> str:
        return f"{self.run_ids[0]} to {self.run_ids[-1]}" if self.run_ids else "none"

    # ---- tables ----

    def quality(self, *, model: str = "linear", references: int | None = None) -> doe.Quality:
        """Figures of merit of the unit points with their percentiles among random Latin hypercubes.

        These are of the same kind: on the same levels and words, after the same distributions, inside the
        same constraints (then 16 of them, where `references` does not say).
        """
        rng = stream(self.seed, "design quality")
        if references is None and self.space.constraints:
            references = CONSTRAINED_REFERENCES

        def drawn(generator: np.random.Generator) -> np.ndarray:
            return random_points(self.space, len(self), rng=generator)

        return doe.quality(self.unit, model, references=references, drawn=drawn, rng=rng)

    @cached_property
    def _figures(self) -> dict[str, dict[str, Any]]:
        """{metric: {value, percentile, better}}; empty for fewer than two runs."""
        return self.quality().to_dict() if len(self) > 1 else {}

    def to_pandas(self) -> "pd.DataFrame":
        """Physical values, one row per run id, one column per parameter; units in `attrs["units"]`."""
        import pandas as pd

        frame = pd.DataFrame(self.rows(), index=pd.Index(self.run_ids, name="run_id"))
        if self.block:
            frame.insert(0, "block", self.block)
        frame.attrs["units"] = dict(zip(self.space.names, self.space.units, strict=True))
        return frame

    def to_xarray(self) -> "xr.Dataset":
        """Physical values over `run`, unit values over `run` and `parameter`; provenance as attributes."""
        import xarray as xr

        physical = self.physical
        columns: dict[str, Any] = {
            p.name: (
                "run",
                np.array(physical[:, j].tolist()),
                {"units": p.unit, "long_name": p.label or p.name, "kind": p.kind},
            )
            for j, p in enumerate(self.space.parameters)
        }
        described = {"units": "1", "long_name": "unit coordinate"}
        columns["unit_value"] = (("run", "parameter"), self.unit, described)
        attributes = {
            "algorithm": self.algorithm,
            "seed": self.seed,
            "space_hash": self.space.hash,
            **{f"option_{k}": v for k, v in self.options.items()},
            **{f"version_{k}": v for k, v in versions().items()},
        }
        coordinates = {"run": list(self.run_ids), "parameter": list(self.space.names)}
        return xr.Dataset(columns, coords=coordinates, attrs=attributes)

    def to_dict(self) -> dict[str, Any]:
        """Plain types for JSON."""
        physical = [list(row.values()) for row in self.rows()]
        return {**self.head(), "unit": self.unit.tolist(), "physical": physical}

    def head(self) -> dict[str, Any]:
        """`to_dict` without the points of the runs."""
        return {
            "algorithm": self.algorithm,
            "options": dict(self.options),
            "seed": self.seed,
            "n": len(self),
            "d": self.space.dimension,
            "parameters": [
                {
                    "name": p.name,
                    "unit": p.unit,
                    "kind": p.kind,
                    "lower": p.lower,
                    "upper": p.upper,
                    "levels": list(p.levels),
                    "scale": p.scale,
                    "baseline": p.baseline,
                }
                for p in self.space.parameters
            ],
            "space": self.space.to_dict(),
            "run_ids": list(self.run_ids),
            "block": list(self.block),
            "quality": self._figures,
            "beside_fresh": {name: list(pair) for name, pair in self.beside_fresh.items()},
            "versions": versions(),
            "space_hash": self.space.hash,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "Design":
        """The design that `to_dict` wrote."""
        return cls(
            space=Space.from_dict(data["space"]),
            unit=np.array(data["unit"], dtype=float).reshape(data["n"], data["d"]),
            run_ids=tuple(data["run_ids"]),
            algorithm=data["algorithm"],
            options=data["options"],
            seed=data["seed"],
            block=tuple(data.get("block", ())),
            beside_fresh={name: (a, b) for name, (a, b) in data.get("beside_fresh", {}).items()},
        )


def make_design(
    space: Space,
    kind: str = DEFAULT,
    runs: int | None = None,
    *,
    seed: int = 0,
    options: DesignOptions | None = None,
) -> Design:
    """A design of `runs` runs in `space`, the same for the same seed.

    kind: one of `workbench.sampling.kinds.KINDS`; by default spread, even and uncorrelated together
    runs: their number; None for kinds that fix it themselves.

    >>> from workbench.space.box import Parameter
    >>> k = Parameter("k", lower=1, upper=5, unit="N/m")
    >>> space = Space([k, Parameter("n", lower=1, upper=3, kind="integer")])
    >>> design = make_design(space, "optimised_lhs", 6, seed=1, options=DesignOptions(swaps=500))
    >>> sorted(design.to_pandas()["n"])
    [1, 1, 2, 2, 3, 3]

    Raises: StudyError for an unknown kind or option, and constraints that cannot be met.
    """
    need_space(space, name="space")
    chosen = DesignOptions() if options is None else options
    unit, used = points_of_kind(space, kind, runs, rng=stream(seed, "design"), options=chosen)
    return Design(
        space=space,
        unit=unit,
        run_ids=run_ids(len(unit)),
        algorithm=kind,
        options=used,
        seed=seed,
    )


def run_ids(n: int, *, first: int = 1) -> tuple[str, ...]:
    """Names of n runs, counted from `first`: r0001, r0002, ..."""
    return tuple(f"r{k:04d}" for k in range(first, first + n))


def compare(designs: Mapping[str, Design] | Sequence[Design], *, model: str = "linear") -> "pd.DataFrame":
    """Figures of merit of several designs side by side: a row per figure, two columns per design.

    The second column holds the share, in per cent, of random Latin hypercubes of the same size that the
    design is better than.
    """
    import pandas as pd

    named = dict(designs) if isinstance(designs, Mapping) else {d.algorithm: d for d in designs}
    if len(named) < len(designs):
        raise StudyError("designs of the same algorithm need names: compare({'first': ..., 'second': ...})")
    if not named:
        raise StudyError("compare needs at least one design")
    columns = {}
    for name, design in named.items():
        found = design.quality(model=model)
        figures = found.to_dict()
        columns[name, "value"] = {k: q["value"] for k, q in figures.items()}
        columns[name, "better than"] = {
            k: found.beats(k) if k in found.percentiles else float("nan") for k in figures
        }
    return pd.DataFrame(columns)
