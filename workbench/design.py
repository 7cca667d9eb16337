"""The `Design` object: runs with identities, in unit, coded and physical values, and where they come from.

A design is made once (`make_design`) and never changed. Run ids are `r0001`, `r0002`, ... in the order the
runs were added, so growing a design never renames a run.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.design_kinds import DesignOptions, points_of_kind
from workbench.errors import StudyError
from workbench.space import Space
from workbench.streams import stream

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["Design", "DesignOptions", "make_design", "versions"]

VERSIONED = ("holdfast", "numpy", "scipy", "numba", "pyDOE3")


@cache
def versions() -> dict[str, str]:
    """Versions of the packages that a design depends on."""
    return {name: version(name) for name in VERSIONED}


@dataclass(frozen=True, kw_only=True)
class Design:
    """n runs of d parameters.

    unit: (n, d) in [0, 1], read-only, levels at k/(N - 1)    run_ids: n names    block: n numbers or empty
    algorithm, options, seed: how it was made
    """

    space: Space
    unit: np.ndarray
    run_ids: tuple[str, ...]
    algorithm: str
    options: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0
    block: tuple[int, ...] = ()

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

    def rows(self) -> list[dict[str, Any]]:
        """What a model is called with, one mapping per run."""
        return self.space.rows(self.unit)

    def to_pandas(self) -> "pd.DataFrame":
        """Physical values, one row per run id, one column per parameter; units in `attrs["units"]`."""
        import pandas as pd

        frame = pd.DataFrame(self.rows(), index=pd.Index(self.run_ids, name="run_id"))
        frame.attrs["units"] = dict(zip(self.space.names, self.space.units, strict=True))
        return frame

    def to_xarray(self) -> "xr.Dataset":
        """Physical values over `run`, units and provenance in the attributes."""
        import xarray as xr

        physical = self.physical
        columns = {
            p.name: (
                "run",
                np.array(physical[:, j].tolist()),
                {"units": p.unit, "long_name": p.label or p.name, "kind": p.kind},
            )
            for j, p in enumerate(self.space.parameters)
        }
        attributes = {
            "algorithm": self.algorithm,
            "seed": self.seed,
            "space_hash": self.space.hash,
            **{f"option_{k}": v for k, v in self.options.items()},
            **{f"version_{k}": v for k, v in versions().items()},
        }
        return xr.Dataset(columns, coords={"run": list(self.run_ids)}, attrs=attributes)

    def to_dict(self) -> dict[str, Any]:
        """Plain types for JSON: the `design.json` of a campaign."""
        physical = [list(row.values()) for row in self.rows()]
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
            "unit": self.unit.tolist(),
            "physical": physical,
            "run_ids": list(self.run_ids),
            "versions": versions(),
            "space_hash": self.space.hash,
        }


def make_design(
    space: Space, kind: str, runs: int | None, *, seed: int = 0, options: DesignOptions | None = None
) -> Design:
    """A design of `runs` runs in `space`.

    kind: lhs | optimised_lhs | ihs | d_optimal_select | d_optimal_within | sobol | halton | grid
    runs: their number; None for a grid with given levels.
    """
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
