"""Ground-structure trusses: convex layouts whose optimum a linear programme knows.

A member between every two nodes whose grid offsets are coprime; areas a_i >= 0, budget sum L_i a_i <= V,
compliance C = f'u of K(a) u = f, E = 1. For one load the optimum is (min sum L_i |q_i| under equilibrium)^2
/ V, the square of the plastic design (Dorn, Gomory and Greenberg 1964). C is convex in a with

    dC/da_i = -(b_i'u)^2 / L_i,     d2C/da2 = 2 X K^-1 X',     row i of X = (b_i'u / L_i) b_i

b_i the unit elongation row of member i, so the factor of the second derivative costs one triangular solve.

Run `python -m studies.trusses` for the gallery: layouts, histories, optima.
"""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from scipy import sparse
from scipy.linalg import solve_triangular
from scipy.optimize import linprog

from workbench.engine.layout.formulation.problem import (
    InvalidLayout,
    LayoutProblem,
    MemberGeometry,
    static_problem,
)
from workbench.engine.layout.optimise import optimise_layout

__all__ = [
    "FOUR_LOADS", "ONE_LOAD", "TIP_LOAD", "Truss", "cantilever", "domain_budgets", "figures",
    "ground_structure", "least_volume", "plastic_optimum", "problem", "run", "stress_limited", "two_bar",
]  # fmt: skip

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# a load case is a tuple of (force (2,), point (2,))
ONE_LOAD = ((((0.0, -1.0), (6.0, 1.5)),),)
TIP_LOAD = ((((0.0, -1.0), (6.0, 3.0)),),)
FOUR_LOADS = (
    (((0.0, -1.0), (6.0, 3.0)),),
    (((0.0, -1.0), (6.0, 0.0)),),
    (((1.0, 0.0), (6.0, 1.5)),),
    (((0.0, -1.5), (3.0, 3.0)),),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Truss:
    """nodes (p, 2) m    ends (n, 2) node numbers    lengths (n,) m    rows (n, dof): elongation per
    displacement loads (dof, cases) N    free (2 p,): True where a node may move.
    """

    nodes: Any
    ends: Any
    lengths: Any
    rows: Any
    loads: Any
    free: Any

    def compliances(self, areas: Any) -> tuple[Any, Any, Any]:
        """Values (cases,), gradients (cases, n) and factors (cases, dof, n) of f'u."""
        K = (self.rows.T * (areas / self.lengths)) @ self.rows
        # unused nodes hang on members of vanishing area: scaling by the diagonal keeps their digits
        scale = 1 / np.sqrt(np.maximum(np.diag(K), 1e-300))
        try:
            L = np.linalg.cholesky(K * scale[:, None] * scale)
        except np.linalg.LinAlgError:
            raise InvalidLayout(
                "the truss is a mechanism: the areas left do not hold every node. "
                "Raise the lower bound of the areas above zero"
            ) from None
        forces = solve_triangular(L, self.loads * scale[:, None], lower=True)
        u = scale[:, None] * solve_triangular(L, forces, lower=True, trans=1)
        elongation = self.rows @ u
        half = solve_triangular(L, (self.rows * scale).T, lower=True)  # (dof, n)
        factors = np.sqrt(2) * half[None] * (elongation / self.lengths[:, None]).T[:, None, :]
        return (forces**2).sum(0), -(elongation**2 / self.lengths[:, None]).T, factors


def ground_structure(
    *,
    columns: int = 7,
    rows: int = 5,
    width: float = 6.0,
    height: float = 3.0,
    loads: Sequence[Any] = ONE_LOAD,
    supports: Any = None,
) -> Truss:
    """Grid of nodes, a member between every two with coprime offsets.

    supports: coordinates (2,) -> True where a node is held; by default the left edge.

    >>> len(ground_structure().ends)
    386
    """
    grid = [(i, j) for i in range(columns) for j in range(rows)]
    nodes = np.array([(i * width / (columns - 1), j * height / (rows - 1)) for i, j in grid])
    ends = np.array([
        (a, b)
        for a in range(len(grid))
        for b in range(a + 1, len(grid))
        if math.gcd(abs(grid[a][0] - grid[b][0]), abs(grid[a][1] - grid[b][1])) == 1
    ])  # fmt: skip
    direction = nodes[ends[:, 1]] - nodes[ends[:, 0]]
    lengths = np.hypot(*direction.T)
    direction /= lengths[:, None]
    elongation = np.zeros((len(ends), len(nodes), 2))
    member = np.arange(len(ends))
    elongation[member, ends[:, 0]] = -direction
    elongation[member, ends[:, 1]] = direction
    held = np.array([bool(supports(p)) if supports else p[0] < 1e-9 for p in nodes])
    free = np.repeat(~held, 2)
    forces = np.zeros((len(loads), len(nodes), 2))
    for case, load in enumerate(loads):
        for force, point in load:
            distance = np.hypot(*(nodes - np.asarray(point)).T)
            if distance.min() > 1e-6 * width:
                raise InvalidLayout(f"load case {case} acts at {tuple(point)} m where there is no node")
            forces[case, distance.argmin()] += force
    return Truss(
        nodes=nodes,
        ends=ends,
        lengths=lengths,
        rows=elongation.reshape(len(ends), -1)[:, free],
        loads=forces.reshape(len(loads), -1)[:, free].T,
        free=free,
    )


def domain_budgets(truss: Truss, *, volume: float = 1.0, domains: int = 1) -> list[tuple[Any, float]]:
    """Budgets of volume, the width cut into equal domains by the midpoints of the members."""
    middle = truss.nodes[truss.ends].mean(axis=1)[:, 0]
    edges = np.linspace(truss.nodes[:, 0].min(), truss.nodes[:, 0].max(), domains + 1)[1:-1]
    which = np.searchsorted(edges, middle, side="right")
    return [(np.where(which == k, truss.lengths, 0.0), volume / domains) for k in range(domains)]


def problem(
    truss: Truss,
    *,
    budgets: Sequence[tuple[Any, float]] | None = None,
    lower: Any = 0.0,
    upper: Any = None,
    second_order: bool = True,
) -> LayoutProblem:
    """The largest compliance over the load cases under budgets of volume, from equal areas.

    second_order: hand over the factors of the second derivative, as the default does; without them a method
        sees values and gradients only, as its peers do.
    """
    budgets = domain_budgets(truss) if budgets is None else budgets
    total = sum(limit for _, limit in budgets)
    start = np.full(len(truss.ends), total / truss.lengths.sum())
    for cost, limit in budgets:
        start = np.where(np.asarray(cost) > 0, start * min(1.0, limit / (cost @ start)), start)

    def compliance(areas: Any) -> tuple[Any, ...]:
        result = truss.compliances(areas)
        return result if second_order else result[:2]

    points = truss.nodes[truss.ends]
    return static_problem(
        compliance,
        start=start,
        budgets=budgets,
        lower=lower,
        upper=total / truss.lengths if upper is None else upper,
        convex=True,
        title="truss",
        geometry=MemberGeometry(
            body_a=truss.ends[:, 0],
            point_a=points[:, 0],
            body_b=truss.ends[:, 1],
            point_b=points[:, 1],
            kind=("bar",) * len(truss.ends),
        ),
    )


def plastic_optimum(truss: Truss, *, volume: float = 1.0) -> float:
    """The optimal compliance for one load case from the plastic linear programme.

    >>> round(plastic_optimum(ground_structure()), 4)
    465.8403
    """
    n = len(truss.ends)
    solution = linprog(
        np.r_[truss.lengths, truss.lengths],
        A_eq=np.hstack([truss.rows.T, -truss.rows.T]),
        b_eq=truss.loads[:, 0],
        bounds=[(0, None)] * (2 * n),
        method="highs",
    )
    assert solution.fun is not None
    return float(solution.fun**2 / volume)


def least_volume(truss: Truss, *, limit: float = 1.0) -> float:
    """The least volume whose members carry every load case within a stress limit, by plastic design.

    A linear programme over areas and forces in equilibrium. An elastic truss under one load case reaches it;
    under several it is a lower bound, since forces in equilibrium need not belong to displacements.

    >>> round(least_volume(ground_structure()) ** 2, 3)       # one load: the root of the compliance
    465.84
    """
    n, cases = len(truss.ends), truss.loads.shape[1]
    stack: Any = sparse
    eye, rows = stack.identity(n), stack.csr_matrix(truss.rows.T)
    pull_push = stack.block_diag([stack.hstack([rows, -rows])] * cases)
    solution = linprog(
        np.r_[truss.lengths, np.zeros(2 * n * cases)],
        A_eq=stack.hstack([stack.csr_matrix((pull_push.shape[0], n)), pull_push]).tocsr(),
        b_eq=truss.loads.T.ravel(),
        A_ub=stack.hstack([
            stack.vstack([-limit * eye] * cases), stack.block_diag([stack.hstack([eye, eye])] * cases)
        ]).tocsr(),
        b_ub=np.zeros(n * cases), method="highs",
    )  # fmt: skip
    assert solution.fun is not None
    return float(solution.fun)


def stress_limited(truss: Truss, *, limit: float = 1.0, lower: float = 1e-7) -> LayoutProblem:
    """The least volume of an elastic truss with |stress| <= limit in every member and load case.

    lower: smallest area, in units of the equal areas that would just do, which are the start times 1.5.

        d sigma_i/d a_j = -(b_i K^-1 b_j') e_j/(L_i L_j),    e = b u the elongations
    """
    n = len(truss.ends)

    def stresses(areas: Any) -> tuple[Any, Any]:
        K = (truss.rows.T * (areas / truss.lengths)) @ truss.rows
        scale = 1 / np.sqrt(np.diag(K))
        flexibility = np.linalg.inv(K * scale[:, None] * scale) * scale[:, None] * scale
        elongation = truss.rows @ (flexibility @ truss.loads)
        stress = (elongation / truss.lengths[:, None]).T.ravel()
        pairs = truss.rows @ flexibility @ truss.rows.T / truss.lengths[:, None] / truss.lengths
        slopes = -(pairs[None] * elongation.T[:, None, :]).reshape(-1, n)
        return np.abs(stress) / limit - 1, slopes * np.sign(stress)[:, None] / limit

    enough = float(stresses(np.ones(n))[0].max()) + 1
    return static_problem(
        lambda a: (float(truss.lengths @ a), truss.lengths.copy()), start=np.full(n, 1.5 * enough),
        lower=lower * enough, upper=30 * enough, constraints=stresses, title="stress limits",
    )  # fmt: skip


def cantilever() -> LayoutProblem:
    """Svanberg's five-piece cantilever (1987): exact optimum 1.3399563606."""
    weights = np.array([61.0, 37.0, 19.0, 7.0, 1.0])
    return static_problem(
        lambda x: (0.0624 * x.sum(), np.full(5, 0.0624)),
        start=np.full(5, 5.0),
        lower=1.0,
        upper=10.0,
        constraints=lambda x: ((weights / x**3).sum() - 1, -3 * weights / x**4),
        title="cantilever",
    )


def two_bar() -> LayoutProblem:
    """Svanberg's two-bar truss (1987): exact optimum 1.5086524175 at (1.411631, 0.377072)."""

    def weight(x: Any) -> tuple[float, Any]:
        root = np.sqrt(1 + x[1] ** 2)
        return x[0] * root, np.array([root, x[0] * x[1] / root])

    def stresses(x: Any) -> tuple[Any, Any]:
        root = np.sqrt(1 + x[1] ** 2)
        values, gradients = [], []
        for sign in (1, -1):
            inner = 8 / x[0] + sign / (x[0] * x[1])
            values.append(0.124 * root * inner - 1)
            gradients.append(0.124 * np.array([
                -root * inner / x[0], x[1] / root * inner - sign * root / (x[0] * x[1] ** 2),
            ]))  # fmt: skip
        return np.array(values), np.array(gradients)

    return static_problem(
        weight, start=[1.5, 0.5], lower=[0.2, 0.1], upper=[4.0, 1.6], constraints=stresses, title="two-bar"
    )


def run() -> xr.Dataset:
    """The gallery: each truss by the default method, told second derivatives or gradients alone, with its
    optimum and the evaluations it took."""
    cases = {
        "one load": (ground_structure(), None, 465.8403),
        "four loads": (ground_structure(loads=FOUR_LOADS), None, 561.781),
        "two domains": (ground_structure(loads=TIP_LOAD), 2, 508.741),
        "9 x 5 nodes": (
            ground_structure(columns=9, width=8.0, loads=((((0.0, -1.0), (8.0, 1.5)),),)), None, np.nan,
        ),
    }  # fmt: skip
    known = ["second derivatives", "gradients only"]
    best, gap = np.full((2, len(cases), 150), np.nan), np.zeros((2, len(cases)))
    counts = np.full((2, len(cases), 3), np.nan)
    areas: dict[str, Any] = {}
    for i, (name, (truss, domains, optimum)) in enumerate(cases.items()):
        reference = plastic_optimum(truss) if np.isnan(optimum) else optimum
        budgets = domain_budgets(truss, domains=domains or 1)
        for k in range(2):
            target = problem(truss, budgets=budgets, second_order=k == 0)
            result = optimise_layout(target, max_evaluations=150, tolerance=1e-7)
            values = np.array([entry.best for entry in result.history])
            best[k, i, : len(values)] = values / reference - 1
            gap[k, i] = values[-1] / reference - 1
            for level, e in enumerate((1e-2, 1e-3, 2e-6)):
                if values[-1] <= reference * (1 + e):
                    counts[k, i, level] = 1 + int(np.argmax(values <= reference * (1 + e)))
        areas[name] = (truss, result.density)
    ds = xr.Dataset(
        {
            "gap": (("known", "case", "evaluation"), best), "last_gap": (("known", "case"), gap),
            "evaluations_to": (("known", "case", "level"), counts),
        },
        coords={
            "known": known, "case": list(cases), "evaluation": np.arange(1, 151),
            "level": [1e-2, 1e-3, 2e-6],
        },
    )  # fmt: skip
    ds.attrs["areas"] = areas
    return ds


def figures(ds: xr.Dataset) -> dict[str, "Figure"]:
    """Distance to the optimum over evaluations, and the trusses."""
    from matplotlib.figure import Figure

    from workbench.figures.layout import plot_layout

    history = Figure(figsize=(6.4, 3.6), layout="constrained")
    ax = history.add_subplot()
    for case, style in zip(ds.case.values, ("-", "--", "-.", ":"), strict=True):
        for known, colour in zip(ds.known.values, ("tab:blue", "tab:orange"), strict=True):
            gap = np.maximum(ds.gap.sel(case=case, known=known), 1e-8)
            ax.semilogy(ds.evaluation, gap, style, color=colour, label=f"{case}, {known}")
    ax.set_xlim(0, 150)
    ax.set_xlabel("evaluation")
    ax.set_ylabel("value / optimum - 1")
    ax.legend(frameon=False, fontsize="x-small", ncols=2)
    drawing = Figure(figsize=(9.0, 6.4), layout="constrained")
    for k, (name, (truss, areas)) in enumerate(ds.attrs["areas"].items()):
        ax = drawing.add_subplot(2, 2, k + 1)
        points = truss.nodes[truss.ends]
        members = [
            {"density": a, "point_a": p[0], "point_b": p[1]} for a, p in zip(areas, points, strict=True)
        ]
        plot_layout(members, thickest=5.0, ax=ax)
        ax.set_title(name)
    return {"history": history, "trusses": drawing}


def main() -> None:
    """Print the table and save the figures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path.cwd()
    ds = run()
    for known in ds.known.values:
        for case in ds.case.values:
            one = ds.sel(case=case, known=known)
            counts = ", ".join(
                f"{n:g} to {100 * e:g} %"
                for n, e in zip(one.evaluations_to.values, ds.level.values, strict=True)
            )
            print(f"{known:19s} {case:12s} gap {float(one.last_gap):8.1e}   evaluations {counts}")
    for name, figure in figures(ds).items():
        figure.savefig(folder / f"trusses_{name}.png", dpi=120)


if __name__ == "__main__":
    main()
