"""Samplers side by side: how far apart, how even, how uncorrelated their points are, at several sizes.

The table answers which sampler is good for what; the curve answers when IHS helps: its published target
spacing n^(1 - 1/d) is wider than the nearest-neighbour distance of random points for few factors and
narrower for many, and the sampler does what it is told. Distances are in units of the unit cube, criteria
as in `doe.criteria.spread`.

    python -m studies.sampler_quality [folder]     the table, and both figures as PNG
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import doe
from workbench.space.streams import stream

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["SAMPLERS", "SIZES", "figures", "run", "table"]

Floats = NDArray[np.float64]
Sampler = Callable[[int, int, np.random.Generator], Floats]

SWAPS = 200_000
SAMPLERS: dict[str, Sampler] = {
    "random LHS": lambda n, d, rng: doe.lhs(n, d, rng=rng),
    "centred LHS": lambda n, d, rng: doe.centred_lhs(n, d, rng=rng),
    "Sobol'": lambda n, d, rng: doe.sobol(n, d, rng=rng),
    "IHS published": lambda n, d, rng: doe.ihs(n, d, rng=rng),
    "IHS auto": lambda n, d, rng: doe.ihs(n, d, target="auto", rng=rng),
    "D-optimal rows": lambda n, d, rng: doe.d_optimal_select(n, d, pool=1000, rng=rng),
    "D-optimal LHS": lambda n, d, rng: doe.d_optimal_within(n, d, rng=rng),
    "phi_p swaps": lambda n, d, rng: doe.optimised_lhs(n, d, swaps=SWAPS, rng=rng),
    "CD2 swaps": lambda n, d, rng: doe.optimised_lhs(n, d, criterion="cd2", swaps=SWAPS, rng=rng),
    "MaxPro swaps": lambda n, d, rng: doe.optimised_lhs(n, d, criterion="maxpro", swaps=SWAPS, rng=rng),
    "joint swaps": lambda n, d, rng: doe.optimised_lhs(
        n, d, criterion=("phi_p", "cd2", "correlation"), weights=(8, 2, 1), swaps=SWAPS, rng=rng
    ),
}
SIZES = ((50, 20), (64, 8), (100, 10))
DIMENSIONS = (2, 3, 4, 6, 8, 9, 10, 12, 16, 20, 30, 50)
CURVE_RUNS = 50
CURVES = ("random LHS", "IHS published", "IHS auto", "phi_p swaps")
HEADINGS = ("min d", "mean nn d", "phi_p", "CD2", "max corr", "D-eff")
METRICS: dict[str, Callable[[Floats], float]] = {
    "min_distance": doe.min_distance,
    "nearest_mean": lambda x: float(doe.nearest_distances(x).mean()),
    "phi_p": doe.phi_p,
    "cd2": doe.cd2,
    "max_correlation": doe.max_correlation,
    "d_efficiency": doe.d_efficiency,
}


def run(
    seed: int = 0,
    *,
    sizes: tuple[tuple[int, int], ...] = SIZES,
    dimensions: tuple[int, ...] = DIMENSIONS,
    repeats: int = 5,
) -> xr.Dataset:
    """Medians over `repeats` designs: `quality` (sampler, size, metric), `nearest` (curve, d) in grid units.

    `target` (d) is the published spacing, `auto` (d) that of `target="auto"`, both in grid units.
    """
    quality = np.empty((len(SAMPLERS), len(sizes), len(METRICS)))
    for s, (name, make) in enumerate(SAMPLERS.items()):
        for z, (n, d) in enumerate(sizes):
            found = [
                [metric(points) for metric in METRICS.values()]
                for points in (
                    make(n, d, stream(seed, f"{name} {n}x{d}", replicate=r)) for r in range(repeats)
                )
            ]
            quality[s, z] = np.median(found, axis=0)
    nearest = np.empty((len(CURVES), len(dimensions)))
    for c, name in enumerate(CURVES):
        for k, d in enumerate(dimensions):
            nearest[c, k] = CURVE_RUNS * np.median(
                [
                    doe.nearest_distances(
                        SAMPLERS[name](CURVE_RUNS, d, stream(seed, f"{name} curve {d}", replicate=r))
                    ).mean()
                    for r in range(repeats)
                ]
            )
    return xr.Dataset(
        {
            "quality": (("sampler", "size", "metric"), quality),
            "nearest": (("curve", "d"), nearest, {"units": "1/n"}),
            "target": ("d", [doe.published_spacing(CURVE_RUNS, d) for d in dimensions], {"units": "1/n"}),
            "auto": ("d", [doe.auto_spacing(CURVE_RUNS, d) for d in dimensions], {"units": "1/n"}),
        },
        coords={
            "sampler": list(SAMPLERS),
            "size": [f"{n}x{d}" for n, d in sizes],
            "metric": list(METRICS),
            "curve": list(CURVES),
            "d": list(dimensions),
        },
        attrs={"seed": seed, "repeats": repeats, "swaps": SWAPS, "curve_runs": CURVE_RUNS},
    )


def table(ds: xr.Dataset) -> str:
    """The medians as text, 80 columns."""
    lines = []
    for size in ds.size.values:
        lines += [f"{size}", f"  {'sampler':<15}" + "".join(f"{name:>11}" for name in HEADINGS)]
        for name in ds.sampler.values:
            row = ds.quality.sel(sampler=name, size=size).values
            lines.append(f"  {name:<15}" + "".join(f"{v:>11.4g}" for v in row))
    return "\n".join(lines)


def figures(ds: xr.Dataset) -> dict[str, "Figure"]:
    """Nearest-neighbour distance against the number of factors; phi_p and CD2 of every sampler."""
    from matplotlib.figure import Figure

    curve = Figure(figsize=(7.5, 4.6), layout="constrained")
    ax = curve.add_subplot()
    for name, style in zip(ds.curve.values, ("0.5", "tab:red", "tab:orange", "tab:blue"), strict=True):
        ax.plot(ds.d, ds.nearest.sel(curve=name), "o-", color=style, label=str(name), markersize=3.5)
    ax.plot(ds.d, ds.target, "k--", linewidth=1, label="published target")
    ax.set(
        xlabel="number of factors (1)",
        ylabel="mean nearest-neighbour distance (grid units, 1/n)",
        title=f"IHS follows its target: n = {ds.attrs['curve_runs']}",
    )
    ax.legend()

    bars = Figure(figsize=(9.0, 4.6), layout="constrained")
    axes = bars.subplots(1, 2, sharey=True)
    place = np.arange(ds.sizes["sampler"])
    height = 0.8 / ds.sizes["size"]
    for ax, metric, label in zip(axes, ("phi_p", "cd2"), ("phi_p", "CD2"), strict=True):
        for k, size in enumerate(ds.size.values):
            values = ds.quality.sel(metric=metric, size=size)
            ax.barh(place + k * height, values / values.sel(sampler="random LHS"), height, label=str(size))
        ax.axvline(1.0, color="k", linewidth=0.8)
        ax.set(xlabel=f"{label} over that of a random LHS (1), lower is better")
        ax.set_yticks(place + 0.4 - height / 2, list(ds.sampler.values))
    axes[1].set_xscale("log")
    axes[1].xaxis.set_major_formatter("{x:g}")
    axes[0].invert_yaxis()
    axes[1].legend(title="runs x factors")
    return {"nearest": curve, "criteria": bars}


def main() -> None:
    """Print the table and save the figures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()
    ds = run()
    print(table(ds))
    for name, figure in figures(ds).items():
        figure.savefig(folder / f"sampler_quality_{name}.png", dpi=120)


if __name__ == "__main__":
    main()
