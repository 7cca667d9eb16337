"""Does the sampler decide whether a screening succeeds? The dissertation's open question, answered by
counting.

Section 3.5 reports that the forward REML screening finds Welch's six inputs from IHS and D-optimal samples
but not from a random LHS, surmises that fixing eta = 2 leaves too few degrees of freedom, and leaves open
which sampler is better and whether it depends on the data (section 9.2.1). Here many samples of each kind
are screened, by the published forward search and by the default one, with columns shuffled; a failure is
laid to the search when the true set has the higher likelihood, and to the information in the runs when it
has not.

    python -m studies.sampler_question                  the small setting, minutes
    python -m studies.sampler_question --setting full   hours; stop and run again at any time
"""

import argparse
import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import qmc

import doe
from studies.screening_functions import FUNCTIONS
from surrogates import KrigingScreener, wilson_interval
from surrogates.screening.partitions.canonical import canonical_runs
from surrogates.screening.partitions.landscape import landscape_of
from surrogates.screening.sets.backward import alone
from surrogates.screening.sets.forward import split
from workbench.space.streams import stream

__all__ = ["METHODS", "SAMPLERS", "SETTINGS", "Trial", "figures", "run", "summarise", "trial"]

Array = NDArray[np.float64]
INPUTS = 20
MAXIMIN_SWAPS = 20_000

SAMPLERS: dict[str, Callable[[int, np.random.Generator], Array]] = {
    "lhs": lambda n, rng: doe.lhs(n, INPUTS, rng=rng),
    "ihs": lambda n, rng: doe.ihs(n, INPUTS, rng=rng),
    "d_optimal": lambda n, rng: doe.d_optimal_select(n, INPUTS, model="linear", pool=1000, rng=rng),
    "maximin": lambda n, rng: doe.optimised_lhs(n, INPUTS, criterion="phi_p", swaps=MAXIMIN_SWAPS, rng=rng),
    "sobol": lambda n, rng: qmc.Sobol(INPUTS, rng=rng).random(1 << (n - 1).bit_length())[:n],
}

METHODS: dict[str, dict[str, object]] = {
    "forward": {"method": "forward"},
    "default": {"method": "default"},
    "default, eta = 1.9": {"method": "default", "eta": 1.9},
    "default, eta = 1.5": {"method": "default", "eta": 1.5},
    "default, eta free": {"method": "default", "eta": None},
}
ETA_LADDER = (2.0, 1.9, 1.75, 1.5, 1.25)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One screening of one sample.

    `first`: the k first of the ranking are the k active inputs. `exact`: exactly they are selected.
    `failure`: "" | "search" | "information", for `first`. `spacing`: mean distance of a point to its
    nearest neighbour.
    """

    function: str
    sampler: str
    n: int
    method: str
    replicate: int
    first: bool
    exact: bool
    missed: int
    false: int
    resolved: bool
    failure: str
    spacing: float
    eta: float


def _cells(
    functions: Iterable[str], samplers: Iterable[str], sizes: Iterable[int], methods: Iterable[str]
) -> list[tuple[str, str, int, str]]:
    return list(product(functions, samplers, sizes, methods))


# (function, sampler, n, method) cells, and replicates of each
SETTINGS: dict[str, tuple[list[tuple[str, str, int, str]], int]] = {
    "tiny": (_cells(["waves"], ["lhs"], [24], ["forward", "default"]), 3),
    "small": (
        _cells(["welch"], ["lhs", "ihs", "d_optimal"], [50], ["forward", "default"])
        + _cells(
            [f for f in FUNCTIONS if f != "welch"], ["lhs", "ihs", "d_optimal"], [40], ["forward", "default"]
        ),
        12,
    ),
    "rates": (
        _cells(["welch"], SAMPLERS, [50, 64, 80], ["default"])
        + _cells(["welch"], ["ihs"], [40], ["default"])
        + _cells(["welch"], SAMPLERS, [50, 64], ["forward"]),
        100,
    ),
    "functions": (
        _cells(
            [f for f in FUNCTIONS if f != "welch"],
            ["lhs", "ihs", "d_optimal"],
            [40, 64],
            ["forward", "default"],
        ),
        25,
    ),
    "welch": (
        _cells(["welch"], SAMPLERS, [50], ["forward", "default"])
        + _cells(["welch"], ["lhs", "ihs", "d_optimal"], [40, 64], ["forward", "default"])
        + _cells(["welch"], ["lhs", "ihs"], [50], [m for m in METHODS if "eta" in m]),
        40,
    ),
    "full": (
        _cells(["welch"], SAMPLERS, [30, 40, 50, 64, 80], ["forward", "default"])
        + _cells(["welch"], ["lhs", "ihs", "d_optimal"], [50], [m for m in METHODS if "eta" in m])
        + _cells([f for f in FUNCTIONS if f != "welch"], SAMPLERS, [25, 40, 64], ["forward", "default"]),
        100,
    ),
}


def trial(function: str, sampler: str, n: int, method: str, replicate: int, *, seed: int = 0) -> Trial:
    """Draw a sample, shuffle its columns, evaluate, screen and judge; the same sample for every method."""
    rng = stream(seed, f"sample {sampler} {n}", replicate=replicate)
    x = np.asarray(SAMPLERS[sampler](n, rng))
    target = FUNCTIONS[function]
    y = target.evaluate(x)
    order = stream(seed, "columns", replicate=replicate).permutation(INPUTS)
    x = x[:, order]
    active = {int(np.flatnonzero(order == k)[0]) for k in target.active}
    screener = _screened(x, y, METHODS[method], replicate)
    selected = set(screener.selected_.tolist())
    first = set(_ranking(screener, len(active))) == active
    return Trial(
        function=function,
        sampler=sampler,
        n=n,
        method=method,
        replicate=replicate,
        first=first,
        exact=selected == active,
        missed=len(active - selected),
        false=len(selected - active),
        resolved=bool(screener.diagnosis_.resolved),
        failure="" if first else _failure(screener, x, y, active),
        spacing=float(np.mean(doe.nearest_distances(x))),
        eta=float(screener.eta_),
    )


def _screened(x: Array, y: Array, options: dict[str, object], seed: int) -> KrigingScreener:
    if options.get("eta", 2.0) is None:  # free: the exponent with the best score
        fits = [KrigingScreener(eta=eta, seed=seed).fit(x, y) for eta in ETA_LADDER]
        return max(fits, key=lambda s: s.log_likelihood_ - s.diagnosis_.threshold * len(s.selected_))
    return KrigingScreener(**options, seed=seed).fit(x, y)  # type: ignore[arg-type]


def _ranking(screener: KrigingScreener, k: int) -> list[int]:
    return [int(i) for i in screener.ranking_[:k]]


def _failure(screener: KrigingScreener, x: Array, y: Array, active: set[int]) -> str:
    """Whose fault: does the true set have the higher likelihood than the found set of the same size?"""
    runs = canonical_runs(x, y, scaled=screener.method == "default")
    ground = landscape_of(runs, eta=screener.eta_)
    place = {int(k): i for i, k in enumerate(runs.columns)}
    bounds = screener.diagnosis_.nugget_bounds

    def best(members: Iterable[int]) -> float:
        units = tuple(place[k] for k in members)
        # the published search lets the other inputs share a theta, the default gives them none
        partition = alone(units) if screener.method == "default" else split(ground.n_units, units)
        common = [-8.0] * (len(partition) - len(units))
        starts = [
            np.array([*[own] * len(units), *common, np.log(bounds[0])]) for own in (-4, -3, -2, -1, 0, 1)
        ]
        ends = [
            ground.climb(partition, s, nugget=bounds, tolerance=1e-3, max_evaluations=100).value
            for s in starts
        ]
        return max(ends)

    return "search" if best(sorted(active)) > best(_ranking(screener, len(active))) + 0.01 else "information"


def run(
    setting: str = "small", *, folder: Path | None = None, seed: int = 0, limit: int | None = None
) -> xr.Dataset:
    """Screen what the setting asks for and summarise it.

    Every trial is appended to `folder`/trials.jsonl as soon as it is done, and trials that stand there are
    not repeated; `limit` stops after so many new ones.
    """
    cells, replicates = SETTINGS[setting]
    wanted = [(*cell, r) for r in range(replicates) for cell in cells]
    done = {_key(t): t for t in _stored(folder, seed)}
    new = [w for w in wanted if w not in done][:limit]
    for cell in new:
        result = trial(*cell, seed=seed)
        done[_key(result)] = result
        if folder is not None:
            _append(folder, json.dumps({"seed": seed, **asdict(result)}))
    return summarise([done[w] for w in wanted if w in done])


def _append(folder: Path, line: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "trials.jsonl").open("ab+") as file:
        if file.tell():
            file.seek(-1, 2)
            torn = file.read(1) != b"\n"  # the study was stopped while it wrote
            line = "\n" * torn + line
        file.write(line.encode() + b"\n")


def _key(t: Trial) -> tuple[str, str, int, str, int]:
    return t.function, t.sampler, t.n, t.method, t.replicate


def _stored(folder: Path | None, seed: int) -> Iterator[Trial]:
    file = None if folder is None else folder / "trials.jsonl"
    if file is None or not file.exists():
        return
    for line in file.read_text().splitlines():
        try:
            record = json.loads(line)
        except json.JSONDecodeError:  # the line that was being written when the study was stopped
            continue
        if record.pop("seed") == seed:
            yield Trial(**record)


def summarise(trials: list[Trial]) -> xr.Dataset:
    """Rates with 95 % Wilson intervals over function, sampler, n and screener; nan where nothing was run."""
    # not "method": xarray's sel has an argument of that name
    frame = pd.DataFrame([asdict(t) for t in trials]).rename(columns={"method": "screener"})
    rows = []
    for key, group in frame.groupby(["function", "sampler", "n", "screener"], sort=False):
        m = len(group)
        row = dict(zip(["function", "sampler", "n", "screener"], key, strict=True)) | {"trials": m}
        for name in ("first", "exact"):
            low, high = wilson_interval(int(group[name].sum()), m)
            row |= {name: group[name].mean(), f"{name}_lower": low, f"{name}_upper": high}
        row |= {name: group[name].mean() for name in ("missed", "false", "resolved", "spacing")}
        row |= {f"{why}_failures": int((group["failure"] == why).sum()) for why in ("search", "information")}
        right = group[group["resolved"]]
        rows.append(row | {"exact_when_resolved": right["exact"].mean() if len(right) else np.nan})
    table = pd.DataFrame(rows).set_index(["function", "sampler", "n", "screener"])
    ds = table.to_xarray()
    ds.attrs["title"] = "recovery of the active inputs by sampler, number of runs and method"
    for variable in ds.data_vars:
        ds[variable].attrs["units"] = "1"
    return ds


def figures(ds: xr.Dataset) -> dict[str, Figure]:
    """Recovery by sampler and method for each function and number of runs; over the runs where there are
    several."""
    found = {}
    for function in ds["function"].values.tolist():
        part = ds.sel(function=function).dropna("n", how="all")
        sizes = part["n"].values.tolist()
        for n in sizes:
            figure, ax = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
            plot_recovery(part.sel(n=n), ax=ax)
            ax.set_title(f"{function}, {n} runs of {INPUTS} inputs")
            found[f"{function}-{n}"] = figure
        if len(sizes) > 1:
            figure, ax = plt.subplots(figsize=(6.4, 3.2), layout="constrained")
            plot_over_runs(part, ax=ax)
            ax.set_title(f"{function}, {INPUTS} inputs, default search")
            found[f"{function}-runs"] = figure
    return found


def plot_over_runs(part: xr.Dataset, *, ax: Axes, screener: str = "default") -> Axes:
    """Share of samples whose active inputs, and no others, are selected, over the number of runs."""
    rows = part.sel(screener=screener)
    samplers = rows["sampler"].values.tolist()
    for j, sampler in enumerate(samplers):  # shifted a little, so that the intervals do not hide each other
        line = rows.sel(sampler=sampler).dropna("n", subset=["exact"]) if "n" in rows.dims else rows
        rate = line["exact"].values
        error = np.abs(np.stack([rate - line["exact_lower"].values, line["exact_upper"].values - rate]))
        at = line["n"].values + 0.5 * (j - (len(samplers) - 1) / 2)
        ax.errorbar(at, rate, error, fmt="o-", lw=1, ms=4, capsize=2, label=sampler)
    ax.set_xticks(rows["n"].values)
    ax.set_ylim(-0.03, 1.03)
    ax.set_xlabel("runs")
    ax.set_ylabel("share of samples with\nexactly the active inputs")
    ax.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


def plot_recovery(part: xr.Dataset, *, ax: Axes) -> Axes:
    """Share of samples whose first inputs are the active ones, with 95 % intervals, by sampler and method."""
    samplers = [s for s in part["sampler"].values.tolist() if part.sel(sampler=s)["first"].notnull().any()]
    methods = [m for m in part["screener"].values.tolist() if part.sel(screener=m)["first"].notnull().any()]
    for j, method in enumerate(methods):
        at = np.arange(len(samplers)) + 0.15 * (j - (len(methods) - 1) / 2)
        row = part.sel(screener=method, sampler=samplers)
        rate = row["first"].values
        error = np.abs(np.stack([rate - row["first_lower"].values, row["first_upper"].values - rate]))
        ax.errorbar(at, rate, np.nan_to_num(error), fmt="o", capsize=3, label=method)
    ax.set_xticks(range(len(samplers)), samplers)
    ax.set_ylim(-0.03, 1.03)
    ax.set_ylabel("share of samples with\nthe active inputs first")
    ax.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return ax


def main() -> None:
    """Run a setting, print its table, save its figures."""
    parser = argparse.ArgumentParser(description="Does the sampler decide whether a screening succeeds?")
    parser.add_argument("--setting", choices=SETTINGS, default="small")
    parser.add_argument("--folder", type=Path, default=Path("sampler_question.results"))
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    ds = run(options.setting, folder=options.folder, seed=options.seed)
    table = ds.to_dataframe().dropna(how="all")
    columns = ["trials", "first", "first_lower", "first_upper", "exact", "missed", "false"]
    print(table[[*columns, "search_failures", "information_failures"]].round(2).to_string())
    for name, figure in figures(ds).items():
        figure.savefig(options.folder / f"{name}.png", dpi=120)
        plt.close(figure)


if __name__ == "__main__":
    main()
