"""Where to begin on long windows: thousands of runs without gradients, in the few directions that rows see.

Between rigid bodies a response sees the densities through a few sums (`outcome/purify.py`). Gradients at one
design show only those that act there: round an even layout some cancel by symmetry. The rows' gradients of
several designs together span them all, V (k, members); designs are then drawn from

    alpha(y) = the point of the budgets and bounds nearest to   even layout + c V'y,      y in R^k

which for large y is the vertex of the feasible set in that direction. The largest row over y has many local
minima and needs no gradient to be compared: they are sought by short searches of the covariance matrix
adaptation evolution strategy (Hansen 2016, "The CMA evolution strategy: a tutorial"), the first from the even
layout, the others from random points far from it. Searches that all begin at the even layout end in one
valley, however wide they begin; which valley leads down farthest only steps with gradients tell. A run of a
rigid-body system costs a few per cent of its gradients.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import FAILURES, Evaluation, LayoutProblem
from ..outcome.history import Recorder

__all__ = [
    "Adapted", "evolve", "probed_starts", "probes_by_default", "seen_directions", "spread", "values_alone",
    "within_budgets",
]  # fmt: skip

Array = NDArray[np.float64]

_LOOKS = 8  # designs whose gradients give the directions
_REACH = 0.3  # of those designs from the even layout, in units of its share
_FAINT, _MOST = 0.02, 8  # singular value, relative, of the last direction that is kept; directions at most
_POPULATION = 16
_LONGEST = 400  # values of one search: steps with gradients end what is left faster
_FAR = (2.0, 4.0, 8.0)  # distances of first points from the even layout, in turn, which comes first itself
_NARROW, _WIDE = 0.5, 0.25  # width of the first steps: the even layout's, and a share of the distance
_ALIKE = 2e-2  # relative spread of the better half that ends a search for a start
_ROWS = 60  # of a history that enter the directions
_TURNS = 4  # through the budgets while a design is drawn into them
_HALVINGS = 50
_ENOUGH = 200  # evaluations from which searches from far points leave enough steps to each of their ends
_EACH = 20  # runs without gradients per evaluation


@dataclass(frozen=True, slots=True, kw_only=True)
class Adapted:
    """The best point (k,) of an evolution strategy, its value, and the values that it took."""

    point: Array
    value: float
    used: int


def probes_by_default(evaluation: Evaluation, max_evaluations: int) -> int:
    """Runs without gradients that a search makes where nobody says how many.

    There are some for histories whose slopes are carried forward, which take many times as long as a run;
    an adjoint sweep takes about as long as a run, and a static problem has nothing to search in time.
    """
    history = np.atleast_2d(evaluation.values).shape[1] > 1
    if not history or max_evaluations < _ENOUGH or evaluation.limit_rows:
        return 0
    carried = evaluation.factors(np.array([0], dtype=np.intp)) is not None
    return _EACH * max_evaluations if carried else 0


def probed_starts(
    problem: LayoutProblem,
    recorder: Recorder,
    *,
    probes: int,
    max_evaluations: int,
    most: int,
    rng: np.random.Generator,
) -> list[tuple[float, Array]]:
    """Values and densities at the ends of the searches without gradients, the best first.

    probes: runs without gradients at most; how many were made is told to the recorder.    most: searches.
    max_evaluations: of the recorder, which the looks that give the directions count for.
    """
    even = spread(problem)
    if most < 1 or np.array_equal(even, problem.upper):
        return []  # or no budget binds: all of every member is the only design that uses them
    V = seen_directions(problem, recorder, max_evaluations=max_evaluations, rng=rng)
    if not len(V):
        return []
    columns = V * _unit(problem, even)

    def design(y: Array) -> Array:
        return within_budgets(problem, even + y @ columns)

    found: list[tuple[float, Array]] = []
    for far in itertools.chain([0.0], itertools.cycle(_FAR)):
        if probes < 2 * _POPULATION or len(found) >= most:
            break
        centre = rng.standard_normal(len(V))
        centre *= far / float(np.linalg.norm(centre))
        end = evolve(
            lambda y: _largest(problem, design(y)), centre, width=max(_NARROW, _WIDE * far),
            most=min(probes, _LONGEST), alike=_ALIKE, rng=rng,
        )  # fmt: skip
        probes -= end.used
        recorder.probes += end.used
        if np.isfinite(end.value):
            found.append((end.value, design(end.point)))
    return sorted(found, key=lambda start: start[0])


def seen_directions(
    problem: LayoutProblem, recorder: Recorder, *, max_evaluations: int, rng: np.random.Generator
) -> Array:
    """(k, members): orthonormal directions in units of the bounds' width that rows see and budgets do not.

    They come from the rows' gradients at the even layout and at designs along the directions known by then.
    """
    even, width = spread(problem), problem.upper - problem.lower
    costs = np.linalg.qr((problem.costs * width).T)[0]
    tables: list[Array] = []
    modes, density = np.zeros((0, problem.members)), even
    for _ in range(_LOOKS):
        if recorder.evaluations >= max_evaluations:
            break
        evaluation = problem.tried(density)
        if evaluation is None:
            recorder.fail(density)
        else:
            recorder.add(density, evaluation)
            table = _slopes(problem, evaluation) * width
            table -= (table @ costs) @ costs.T
            size = float(np.linalg.norm(table, 2))
            if size > 0.0:
                tables.append(table / size)
                strength, modes = np.linalg.svd(np.vstack(tables), full_matrices=False)[1:]
                modes = modes[:_MOST][strength[:_MOST] > _FAINT * strength[0]]
        if not len(modes):
            break
        step = _REACH * rng.standard_normal(len(modes)) @ modes
        density = within_budgets(problem, even + step * _unit(problem, even))
    return np.asarray(modes)


def _slopes(problem: LayoutProblem, evaluation: Evaluation) -> Array:
    """Gradients of rows along the histories, or the factors of squares, whose directions are the same."""
    size = np.atleast_2d(evaluation.values).size
    rows = np.arange(0, size, max(1, size // _ROWS))
    factors = evaluation.factors(rows)
    if factors is not None:
        return np.asarray(factors.reshape(-1, problem.members), dtype=float)
    return problem.checked_gradients(evaluation, rows)


def _unit(problem: LayoutProblem, even: Array) -> Array:
    """(members,): a step of length 1 moves the densities by their even share, root mean square."""
    width = problem.upper - problem.lower
    free = width > 0
    share = float(((even - problem.lower)[free] / width[free]).mean())
    return np.asarray(width * max(share, 1e-3) * np.sqrt(free.sum()))


def values_alone(problem: LayoutProblem, density: Array) -> Array | None:
    """(scenarios, nodes) of a run whose gradients nobody asks for, or None where the model fails."""
    try:
        values = np.atleast_2d(np.asarray(problem.evaluate(density).values, dtype=float))
    except FAILURES:
        return None
    return values if np.isfinite(values).all() else None


def _largest(problem: LayoutProblem, density: Array) -> float:
    values = values_alone(problem, density)
    return np.inf if values is None else float(values.max())


def spread(problem: LayoutProblem) -> Array:
    """One share of every width, as large as the budgets allow."""
    width = problem.upper - problem.lower
    need = problem.costs @ width
    room = problem.limits - problem.costs @ problem.lower
    share = min(1.0, float((room[need > 0] / need[need > 0]).min(initial=1.0)))
    return np.asarray(problem.lower + share * width)


def within_budgets(problem: LayoutProblem, point: Array) -> Array:
    """The design within bounds that uses every budget, nearest to a point (members,).

    Exact for budgets without common members; with common ones the turns through the budgets end near it, and
    what is left over is drawn in towards the lower bounds.

    >>> import numpy as np
    >>> from workbench.engine.layout.formulation.problem import static_problem
    >>> problem = static_problem(lambda a: (0.0, 0 * a), start=np.zeros(3), budgets=[(np.ones(3), 1.0)])
    >>> within_budgets(problem, np.array([0.9, 0.5, 0.1])).round(6)
    array([0.7, 0.3, 0. ])
    """
    shift = np.zeros(problem.members)
    disjoint = bool((np.count_nonzero(problem.costs, axis=0) <= 1).all())
    for _ in range(1 if disjoint else _TURNS):
        for cost, limit in zip(problem.costs, problem.limits, strict=True):
            rest = point - shift
            inside = cost > 0
            reach = float((np.abs(rest[inside]) + np.abs(problem.upper[inside])).max(initial=0.0))
            high = reach / float(cost[inside].min(initial=1.0)) + 1e-300
            low = -high
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                used = cost @ np.clip(rest - middle * cost, problem.lower, problem.upper)
                low, high = (middle, high) if used > limit else (low, middle)
            shift = shift + high * cost
    return problem.into_budgets(point - shift)


def evolve(
    function: Callable[[Array], float],
    start: Array,
    *,
    width: float,
    most: int,
    alike: float = 1e-3,
    rng: np.random.Generator,
) -> Adapted:
    """Minimise a function of few variables by its values alone, from a start (k,) and a first step `width`.

    most: values at most.    alike: relative spread of the better half of a generation that ends it. Only
    the order of values counts, so inf is a value like any other. Weights and rates are those of Hansen 2016,
    table 1, without negative weights.

    >>> import numpy as np
    >>> bowl = evolve(lambda y: float(((y - 3.0) ** 2 * [1, 100]).sum()), np.zeros(2), width=1.0, most=4000,
    ...               rng=np.random.default_rng(0))
    >>> bool(np.abs(bowl.point - 3.0).max() < 0.01)
    True
    """
    d, n = len(start), _POPULATION
    half = n // 2
    weights = np.log(half + 0.5) - np.log(np.arange(1, half + 1))
    weights /= weights.sum()
    mass = 1.0 / float(weights @ weights)  # mu_eff
    c_s = (mass + 2) / (d + mass + 5)
    damping = 1 + 2 * max(0.0, np.sqrt((mass - 1) / (d + 1)) - 1) + c_s
    c_c = (4 + mass / d) / (d + 4 + 2 * mass / d)
    c_1 = 2 / ((d + 1.3) ** 2 + mass)
    c_mu = min(1 - c_1, 2 * (mass - 2 + 1 / mass) / ((d + 2) ** 2 + mass))
    expected = np.sqrt(d) * (1 - 1 / (4 * d) + 1 / (21 * d * d))
    mean, C, path_s, path_c = start.copy(), np.eye(d), np.zeros(d), np.zeros(d)
    best, value, used, generation = start, np.inf, 0, 0
    while used + n <= most:
        squares, Q = np.linalg.eigh(C)
        root = np.sqrt(np.maximum(squares, 1e-20))
        steps = (rng.standard_normal((n, d)) * root) @ Q.T
        values = np.array([function(mean + width * step) for step in steps])
        used, generation = used + n, generation + 1
        order = np.argsort(values, kind="stable")
        if values[order[0]] < value:
            value, best = float(values[order[0]]), mean + width * steps[order[0]]
        chosen = steps[order[:half]]
        step = weights @ chosen
        mean = mean + width * step
        path_s = (1 - c_s) * path_s + np.sqrt(c_s * (2 - c_s) * mass) * (Q @ ((Q.T @ step) / root))
        length = float(np.linalg.norm(path_s))
        slow = length / np.sqrt(1 - (1 - c_s) ** (2 * generation)) < (1.4 + 2 / (d + 1)) * expected
        path_c = (1 - c_c) * path_c + slow * np.sqrt(c_c * (2 - c_c) * mass) * step
        C = (1 - c_1 - c_mu) * C + c_1 * np.outer(path_c, path_c) + c_mu * (chosen.T * weights) @ chosen
        width *= float(np.exp(min(c_s / damping * (length / expected - 1), 1.0)))
        last, first = values[order[half]], values[order[0]]
        if np.isfinite(last) and last - first <= alike * abs(first):
            break
    return Adapted(point=best, value=value, used=used)
