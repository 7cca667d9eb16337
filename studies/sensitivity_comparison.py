"""One table for chapters IV to VI: every method on the two-body and three-body systems, error and time.

Error is relative to the continuous truth (order 8, peak located exactly) where the system has no joint, and
to the exact discrete gradient; time is CPU time relative to one forward run. The default's loop is compiled,
the others are numpy over compiled forces: read their times with that in mind.
"""

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from workbench.engine import NotSupported, RungeKutta8, gradient, locate_peak, simulate
from workbench.engine.sensitivity.gradient import METHODS

from . import three_body, two_body

__all__ = ["figures", "run", "table"]

REPEATS = 3


def _cpu(call: Any) -> tuple[Any, float]:
    best, out = np.inf, None
    for _ in range(REPEATS):
        start = time.process_time()
        out = call()
        best = min(best, time.process_time() - start)
    return out, best


def run(seed: int = 0, *, steps: int = 200) -> xr.Dataset:
    """Cases A and C of two bodies, and three bodies with a joint; nothing is drawn, the seed plays no
    part."""
    cases = {"A": two_body.problem("A"), "C": two_body.problem("C"), "three bodies": three_body.problem()}
    names = list(METHODS)
    shape = (len(cases), len(names))
    truth_error, discrete_error, cosine, ratio = (np.full(shape, np.nan) for _ in range(4))
    gradients = {}
    for row, (case, p) in enumerate(cases.items()):
        trajectory, forward = _cpu(lambda p=p: simulate(p.system, p.density, p.t_end, steps, scheme=p.scheme))
        exact = gradient(p.system, p.density, trajectory, p.objective)
        truth = None
        if not p.system.joints:
            fine = locate_peak(simulate(p.system, p.density, p.t_end, 40, scheme=RungeKutta8()), p.objective)
            truth = gradient(p.system, p.density, fine, p.objective)
        for column, name in enumerate(names):
            try:
                found, cost = _cpu(
                    lambda p=p, t=trajectory, name=name: gradient(p.system, p.density, t, p.objective, name)
                )
            except NotSupported:
                continue
            gradients[case, name] = found
            discrete_error[row, column] = np.linalg.norm(found - exact) / np.linalg.norm(exact)
            cosine[row, column] = found @ exact / np.linalg.norm(found) / np.linalg.norm(exact)
            ratio[row, column] = (forward + cost) / forward
            if truth is not None:
                truth_error[row, column] = np.linalg.norm(found - truth) / np.linalg.norm(truth)
    first = np.array([gradients["C", name][:51] / np.abs(gradients["C", name]).max() for name in names])
    dims = ("case", "sensitivity")
    return xr.Dataset(
        {
            "error_against_truth": (dims, truth_error),
            "error_against_discrete": (dims, discrete_error),
            "cosine": (dims, cosine),
            "time_over_forward": (dims, ratio),
            "first_members": (("sensitivity", "member"), first),
        },
        coords={"case": list(cases), "sensitivity": names, "member": np.arange(1, 52)},
        attrs={"title": "sensitivity methods of chapters II, IV, V and VI", "steps": steps, "seed": seed},
    )


def table(ds: xr.Dataset) -> str:
    """The comparison as text, 80 columns."""
    lines = []
    for case in ds.case.values:
        lines += [
            f"{case}",
            f"  {'method':<28}{'vs truth':>10}{'vs discrete':>13}{'cosine':>9}{'x forward':>11}",
        ]
        for name in ds.sensitivity.values:
            part = ds.sel(case=case, sensitivity=name)
            if np.isnan(part.cosine):
                lines.append(f"  {name:<28}{'not for systems with joints':>43}")
                continue
            truth = "-" if np.isnan(part.error_against_truth) else f"{float(part.error_against_truth):.1e}"
            lines.append(
                f"  {name:<28}{truth:>10}{float(part.error_against_discrete):>13.1e}"
                f"{float(part.cosine):>9.4f}{float(part.time_over_forward):>11.1f}"
            )
    return "\n".join(lines)


def figures(ds: xr.Dataset) -> Any:
    """Normalised gradients of the first 51 members, case C (after figures 4.3, 5.5 and 6.4)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.2), layout="constrained")
    ax = figure.add_subplot()
    styles = {"discrete_adjoint": "k-", "constant_load": "r--", "iterative_printed": "b:", "adjoint": "g-."}
    for name, style in styles.items():
        ax.plot(ds.member, ds.first_members.sel(sensitivity=name), style, label=name)
    ax.set(xlabel="member", ylabel="dG/dα over its largest magnitude")
    ax.legend()
    return figure


def storyboards() -> dict[str, Any]:
    """Stills of both systems at their uniform design: what the objective sees."""
    from matplotlib.figure import Figure

    from workbench.figures.motion import plot_storyboard

    drawn = {}
    for name, p in (("two_body", two_body.problem("C")), ("three_body", three_body.problem())):
        trajectory = simulate(p.system, p.density, p.t_end, p.steps, scheme=p.scheme)
        figure = Figure(figsize=(9.0, 3.4), layout="constrained")
        plot_storyboard(trajectory, (0.0, 0.1, 0.2), ax=figure.add_subplot())
        drawn[name] = figure
    return drawn


def main() -> None:
    """Print the table and save the figures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()
    ds = run()
    print(table(ds))
    figures(ds).savefig(folder / "sensitivity_comparison.png", dpi=100)
    for name, figure in storyboards().items():
        figure.savefig(folder / f"{name}_storyboard.png", dpi=100)


if __name__ == "__main__":
    main()
