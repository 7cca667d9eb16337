"""A second witness: sparse regression on linear terms, squares and products of the same runs.

A Kriging of smooth correlation may lose an input of a response with steps and kinks, whose average slope or
curvature still shows. The witness costs no run and milliseconds:

1. Least angle regression (Efron et al., Ann. Stat. 32, 2004, 407-499) orders the d (d + 3)/2 terms.
2. A product counts from when one of its inputs has entered by itself (weak hierarchy: Bien, Taylor and
   Tibshirani, Ann. Stat. 41, 2013, 1111-1141); the number of terms is that of the smallest leave-one-out
   error of the least squares, corrected for their number (Blatman and Sudret, J. Comput. Phys. 230, 2011).
3. An input stays where the best of its terms explains more of what the terms of the others leave than the
   best of all free terms does of the same residuals shuffled (Freedman and Lane, 1983), with probability
   `RISK`: chance, reckoned for the choice among all terms.

The same test asks the leave-one-out errors of a Kriging whether an input that it lacks shows in them
(`inputs_in_errors`). What neither can see: a pure interaction of inputs that lack, a wave without slope and
curvature.
"""

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sklearn.linear_model import lars_path

from .partitions.canonical import CanonicalRuns

__all__ = ["Witness", "inputs_in_errors", "quadratic_witness"]

Array = NDArray[np.float64]

RISK = 0.01  # of an input that does not act, per screening
SHUFFLES = 400
MOST_INPUTS = 60  # of which products are looked at; beyond, of the strongest so many
FEWEST_RUNS = 12
LARGEST_SHARE, MOST_TERMS = 3, 40  # at most a term per so many runs, and no more than that


@dataclass(frozen=True, slots=True, kw_only=True)
class Witness:
    """What the regression says.

    Attributes:
        inputs: units that it finds, the one of the largest loss first.
        loss: (u,) share of the variance that the sum of squares rises by without the terms of a unit; 0 for
            those not found.
        p_value: (u,) chance of a unit's best term, 1 for those that never entered.
        q2: leave-one-out, of the least squares on the terms kept, corrected for their number.
    """

    inputs: tuple[int, ...]
    loss: Array
    p_value: Array
    q2: float


@dataclass(frozen=True, slots=True)
class _Terms:
    """Standardised terms (n, p) and the one or two units of each; main: in one unit only."""

    values: Array
    units: list[tuple[int, ...]]

    def of(self, unit: int) -> list[int]:
        return [j for j, owners in enumerate(self.units) if unit in owners]


def _terms(runs: CanonicalRuns) -> _Terms:
    """Linear terms, squares and products of the columns, each centred and of length 1."""
    single: list[Array] = []
    owner: list[int] = []
    parts: list[Array] = []
    units: list[tuple[int, ...]] = []
    for u, columns in enumerate(runs.units):
        for k in columns:
            column = runs.x[:, k]
            found = np.unique(column) if k in runs.labels else None
            made = (
                [2.0 * column - 1.0]
                if found is None
                else [(column == label).astype(float) for label in found[len(found) == 2 :]]
            )
            for z in made:
                single.append(z - z.mean())
                owner.append(u)
                parts.append(z)
                units.append((u,))
            if found is None:
                parts.append((2.0 * column - 1.0) ** 2)
                units.append((u,))
    strength = np.array([abs(z @ runs.y) / (np.linalg.norm(z) or 1.0) for z in single])
    kept = np.sort(np.argsort(-strength, kind="stable")[:MOST_INPUTS])
    for a, i in enumerate(kept):
        for j in kept[a + 1 :]:
            if owner[i] != owner[j]:
                parts.append(single[i] * single[j])
                units.append((owner[i], owner[j]))
    values = np.column_stack(parts)
    values -= values.mean(axis=0)
    size = np.linalg.norm(values, axis=0)
    alive = size > 1e-9
    return _Terms(values[:, alive] / size[alive], [u for u, a in zip(units, alive, strict=True) if a])


def _ordered(terms: _Terms, y: Array, most: int) -> list[int]:
    """Terms as least angle regression takes them in, a product from when one of its units is in."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of degenerate regressors, one warning each
        active = lars_path(terms.values, y, method="lar", max_iter=2 * most)[1]
    order: list[int] = []
    waiting: list[int] = []
    present: set[int] = set()
    for j in map(int, active):
        owners = terms.units[j]
        if len(owners) == 2 and not present & set(owners):
            waiting.append(j)
            continue
        order.append(j)
        if len(owners) == 1:
            present |= set(owners)
            order += [w for w in waiting if present & set(terms.units[w])]
            waiting = [w for w in waiting if not present & set(terms.units[w])]
    return order[:most]


def _best_size(terms: _Terms, order: list[int], y: Array) -> tuple[int, float]:
    """How many of the ordered terms predict best, and their corrected Q2."""
    n = len(y)
    spread = float(y @ y)
    best, best_error = 0, spread * (n / (n - 1)) ** 2
    for m in range(1, len(order) + 1):
        a = terms.values[:, order[:m]]
        q, r = np.linalg.qr(a)
        diagonal = np.abs(np.diagonal(r))
        if diagonal.min() < 1e-6 * diagonal.max():
            break
        leverage = 1.0 / n + (q**2).sum(axis=1)
        if leverage.max() > 1.0 - 1e-9:
            break
        error = float((((y - q @ (q.T @ y)) / (1.0 - leverage)) ** 2).sum())
        inverse = np.linalg.inv(r)
        # Chapelle, Vapnik and Bengio (2002): what least squares of m terms on n runs lose on fresh ones
        error *= n / max(n - m - 1, 1) * (1.0 + float((inverse**2).sum()) / n) if m < n - 1 else np.inf
        if error < best_error:
            best, best_error = m, error
    return best, 1.0 - best_error / spread


def _free_of(terms: _Terms, base: list[int], y: Array, units: set[int]) -> tuple[Array, list[int], Array]:
    """Residual of y on the base, the terms that hierarchy admits beside it, orthogonal to it."""
    q = np.linalg.qr(terms.values[:, base])[0] if base else np.zeros((len(y), 0))
    free = [
        j
        for j, owners in enumerate(terms.units)
        if not set(owners) <= units and (len(owners) == 1 or units & set(owners))
    ]
    z = terms.values[:, free]
    z = z - q @ (q.T @ z)
    size = np.linalg.norm(z, axis=0)
    z = np.where(size > 1e-6, z / np.maximum(size, 1e-6), 0.0)
    return y - q @ (q.T @ y), free, z


def _chance(
    terms: _Terms, base: list[int], y: Array, unit: int, units: set[int], rng: np.random.Generator
) -> float:
    """Probability that shuffled residuals of the base have a free term as good as the best of the unit."""
    residual, free, z = _free_of(terms, base, y, units)
    length = float(np.linalg.norm(residual))
    own = [i for i, j in enumerate(free) if unit in terms.units[j]]
    if not own or length < 1e-9:
        return 1.0
    seen = np.abs(z[:, own].T @ residual).max() / length
    shuffled = rng.permuted(np.tile(residual, (SHUFFLES, 1)), axis=1)
    best = np.abs(shuffled @ z).max(axis=1) / length
    return float((1 + (best >= seen).sum()) / (SHUFFLES + 1))


def quadratic_witness(runs: CanonicalRuns, *, rng: np.random.Generator) -> Witness:
    """Find the units that a sparse quadratic regression of canonical runs needs.

    Of fewer than 12 runs, or none that vary, it says nothing.
    """
    u, n = len(runs.units), len(runs.y)
    y = runs.y - runs.y.mean()
    nothing = Witness(inputs=(), loss=np.zeros(u), p_value=np.ones(u), q2=0.0)
    spread = float(y @ y)
    if n < FEWEST_RUNS or u == 0 or spread <= 0.0:
        return nothing
    terms = _terms(runs)
    order = _ordered(terms, y, min(n // LARGEST_SHARE, MOST_TERMS))
    size, q2 = _best_size(terms, order, y)
    chosen = order[:size]
    p_value, loss = np.ones(u), np.zeros(u)
    while chosen:
        present = sorted({k for j in chosen for k in terms.units[j]})
        for unit in present:
            base = [j for j in chosen if unit not in terms.units[j]]
            others = {k for j in base for k in terms.units[j]}
            p_value[unit] = _chance(terms, base, y, unit, others, rng)
            left = _free_of(terms, base, y, others)[0]
            whole = _free_of(terms, chosen, y, set(present))[0]
            loss[unit] = (left @ left - whole @ whole) / spread
        worst = max(present, key=lambda k: (p_value[k], -loss[k]))
        if p_value[worst] <= RISK:
            break
        chosen = [j for j in chosen if worst not in terms.units[j]]
    found = {k for j in chosen for k in terms.units[j]}
    loss = np.where([k in found for k in range(u)], loss, 0.0)
    ranked = tuple(sorted(found, key=lambda k: (-loss[k], k)))
    return Witness(inputs=ranked, loss=loss, p_value=p_value, q2=q2)


def inputs_in_errors(
    runs: CanonicalRuns, errors: Array, selected: tuple[int, ...], *, rng: np.random.Generator
) -> tuple[int, ...]:
    """Units that are not selected and show in leave-one-out errors (n,), the clearest first.

    The terms are slopes and squares of the other units and their products with selected ones; a unit shows
    when its best term correlates with the errors as the best of all terms does with shuffled errors in no
    more than `RISK` of the cases. Errors that are nan count as 0.
    """
    n, rest = len(runs.y), [u for u in range(len(runs.units)) if u not in selected]
    left = np.where(np.isfinite(errors), errors, 0.0)
    left = left - left.mean()
    length = float(np.linalg.norm(left))
    if n < FEWEST_RUNS or not rest or length <= 0.0:
        return ()
    terms = _terms(runs)
    free = _free_of(terms, [], left, set(selected))
    shuffled = rng.permuted(np.tile(left, (SHUFFLES, 1)), axis=1)
    best = np.sort(np.abs(shuffled @ free[2]).max(axis=1))
    bound = best[int(np.ceil((1.0 - RISK) * SHUFFLES)) - 1]
    seen = np.abs(free[2].T @ left)
    strength = {
        u: max((float(seen[i]) for i, j in enumerate(free[1]) if u in terms.units[j]), default=0.0)
        for u in rest
    }
    return tuple(u for u in sorted(rest, key=lambda u: -strength[u]) if strength[u] > bound)
