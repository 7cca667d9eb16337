"""Inputs that the second witness names and the likelihood confirms.

The likelihood alone charges an input the price of a search among all of them. An input that shows in the
leave-one-out errors is no longer searched for: it joins the selection when it raises l by `CONFIRMED`, the
95 % point of a single one. What is named there and not confirmed, or by a sparse regression of the response
alone, stays a disagreement, told in the verdict: that regression named as many inert inputs as active ones
(`docs/decisions/0033-three-states-and-a-second-witness.md`).
"""

from dataclasses import dataclass, replace

import numpy as np

from .hidden_share import HiddenShare, RoughSide, hidden_share, rough_side
from .partitions.anova import AnovaLandscape, AnovaOptimum, anova_landscape
from .partitions.canonical import CanonicalRuns
from .partitions.landscape import PACKED_RUNS, landscape_of
from .partitions.optimum import Landscape, Optimum, left_out_errors
from .sets.anova import AnovaSets, anova_sets
from .sets.joint_effect_of_the_rest import rest_gain
from .sets.methods import Found, find_sets
from .sets.rival_sets import CLEAR_MARGIN, Rivals
from .sets.rules import Rules
from .witness import inputs_in_errors, quadratic_witness

__all__ = ["SMOOTH", "Examined", "examined", "screened", "where_it_errs"]

CONFIRMED = 1.92  # in l: chi^2 with one degree, 95 %
RESOLVED_SHARE = 0.01  # of the variance: below, there is nothing left to testify about
STARTS = (-4.0, -1.5, 0.5)  # log theta of an input that joins
FINE_NUGGET = 1e-8
SMOOTH, ROUGH = 2.0, 1.5  # exponents of the correlation
LEAD = 3.0  # in l, of a rival of the smooth one
MOST_DOUBT = 0.1  # that the smooth one's x may cast on it, a share of the variance
TOLERANCE, EVALUATIONS = 1e-3, 200


@dataclass(frozen=True, slots=True, kw_only=True)
class Examined:
    """A screening after the second witness.

    Attributes:
        found: with the confirmed units behind the selected ones.
        confirmed, disputed: units that the witness named and the likelihood confirmed, and did not.
        eta: exponent of the correlation.
        anova: the maximum, where the selection is that of an ANOVA correlation.
        errors: (n,) leave-one-out, of the standardised response of the canonical runs.
        share: what stays unexplained.
        open: selected units that a nearly as likely set does without.
        open_share: y, the upper bound of what such a set leaves unexplained: none of them is above it; 0
            without one.
    """

    found: Found
    confirmed: tuple[int, ...]
    disputed: tuple[int, ...]
    eta: float
    anova: AnovaOptimum | None = None
    errors: np.ndarray
    share: HiddenShare
    open: tuple[int, ...]
    open_share: float


def screened(
    runs: CanonicalRuns, method: str, rules: Rules, *, testify: bool, free: bool, seed: int
) -> Examined:
    """Screen canonical runs, and look at the selection.

    With `free` a smooth correlation (exponent 2) that leaves more than 1 % unexplained has a rough one (1.5)
    as a rival, whose selection stands when it leads by 3 in l at the price of its size. Steps and kinks look
    to a smooth correlation like waves of inert inputs. An ANOVA correlation, in which a weak input may bend,
    is the next rival, of the likelier of the two and under the same terms.
    """
    smooth = _looked_at(runs, method, rules, testify=testify, seed=seed)
    if not free or not smooth.share.upper > RESOLVED_SHARE or not smooth.found.accepted:
        return smooth
    doubt = min(smooth.share.upper, MOST_DOUBT)
    rough = _looked_at(runs, method, replace(rules, eta=ROUGH), testify=testify, seed=seed)
    stands = smooth
    if _worth(rough, rules) > _worth(smooth, rules) + LEAD:
        # the rough one's own x was exceeded in more than one of twenty screenings
        stands = replace(rough, share=replace(rough.share, upper=max(rough.share.upper, doubt)))
    if not testify or len(runs.y) > PACKED_RUNS:
        return stands
    anova = anova_landscape(runs, restricted=rules.restricted, eta=SMOOTH, nugget=rules.nugget)
    sets = anova_sets(anova, smooth.found.optima[smooth.found.accepted], threshold=rules.threshold)
    if sets.worth(sets.best) <= _worth(stands, rules) + LEAD:
        return stands
    return _by_anova(anova, sets, stands, runs, rules, doubt)


def _by_anova(
    anova: AnovaLandscape,
    sets: AnovaSets,
    before: Examined,
    runs: CanonicalRuns,
    rules: Rules,
    doubt: float,
) -> Examined:
    """The selection of an ANOVA correlation in place of that of a product; x is at least `doubt`.

    What reads thetas of a screening gets those of the product with these units.
    """
    ground = landscape_of(runs, restricted=rules.restricted, eta=before.eta)
    best = sets.best
    errors = anova.left_out_errors(best)
    share = hidden_share(errors, runs.y)
    order = [best.units[i] for i in np.argsort(-best.weight, kind="stable")]
    chain: list[tuple[int, ...]] = [()]
    optima = [before.found.optima[0]]
    for unit in order:
        optima.append(_joined(ground, optima[-1], chain[-1], unit, replace(rules, eta=before.eta)))
        chain.append((*chain[-1], unit))
    closest = {unit: at for unit in order if (at := sets.without(unit))}
    falls = {unit: sets.worth(best) - sets.worth(at) for unit, at in closest.items()}
    doubted = tuple(unit for unit in order if falls.get(unit, np.inf) < CLEAR_MARGIN)
    without = [hidden_share(anova.left_out_errors(closest[u]), runs.y).upper for u in doubted]
    found = replace(
        before.found,
        sets=chain,
        optima=optima,
        etas=[before.found.etas[0]] * len(chain),
        accepted=len(order),
        rest_gain=float("nan"),
        starts_at_best=sets.agreeing,
        beside=Rivals(
            closest=tuple((at.units, sets.worth(best) - sets.worth(at)) for at in sets.optima[1:6]),
            margin=min(falls.values(), default=float("inf")),
            doubts=(),
        ),
        ranked=tuple(dict.fromkeys((*order, *before.found.ranked))),
    )
    return Examined(
        found=found,
        confirmed=(),  # their l is not the one that confirmed
        disputed=tuple(u for u in before.disputed if u not in order),
        eta=before.eta,
        anova=best,
        errors=errors,
        share=replace(share, upper=max(share.upper, doubt)),
        open=doubted,
        open_share=max(without, default=0.0),
    )


def _looked_at(runs: CanonicalRuns, method: str, rules: Rules, *, testify: bool, seed: int) -> Examined:
    found = find_sets(runs, method, rules, np.random.default_rng(seed))
    return examined(found, runs, rules, testify=testify, rng=np.random.default_rng(seed))


def _worth(seen: Examined, rules: Rules) -> float:
    """l less the threshold for each selected unit."""
    at = seen.found.accepted
    return seen.found.optima[at].value - rules.threshold * len(seen.found.sets[at])


def examined(
    found: Found, runs: CanonicalRuns, rules: Rules, *, testify: bool, rng: np.random.Generator
) -> Examined:
    """Ask the witness about the selection of a screening.

    `testify` False asks nobody and only reckons what is unexplained.
    """
    ground = landscape_of(runs, restricted=rules.restricted, eta=found.etas[found.accepted])
    confirmed: tuple[int, ...] = ()
    disputed: tuple[int, ...] = ()
    certain = set(found.sets[found.accepted]).intersection(*(members for members, _ in found.beside.doubts))
    without = [_unexplained(ground, optimum, runs)[1].upper for _, optimum in found.beside.doubts]
    errors, share = _unexplained(ground, found.optima[found.accepted], runs)
    while testify and share.upper > RESOLVED_SHARE:
        selected = found.sets[found.accepted]
        named = inputs_in_errors(runs, errors, selected, rng=rng)
        # with nothing selected the errors are the response, and a confirmation would be no second look
        ends = [
            (u, _joined(ground, found.optima[found.accepted], selected, u, rules)) for u in named if selected
        ]
        better = [(u, e) for u, e in ends if e.value - found.optima[found.accepted].value >= CONFIRMED]
        if not better:
            disputed = named
            break
        unit, end = max(better, key=lambda pair: pair[1].value)
        at = found.accepted + 1
        found = replace(
            found,
            sets=[*found.sets[:at], (*selected, unit)],
            optima=[*found.optima[:at], end],
            etas=[*found.etas[:at], found.etas[at - 1]],
            accepted=at,
            ranked=(*selected, unit, *(u for u in found.ranked if u not in (*selected, unit))),
        )
        confirmed += (unit,)
        errors, share = _unexplained(ground, end, runs)
    if confirmed:
        at = found.accepted
        rest = rest_gain(ground, found.sets[at], found.optima[at].phi, rules.nugget)
        found = replace(found, rest_gain=rest)  # of those that are still not selected, if any
    if testify and share.upper > RESOLVED_SHARE:
        regression = quadratic_witness(runs, rng=rng).inputs
        disputed = tuple(dict.fromkeys((*disputed, *regression)))
    selected = found.sets[found.accepted]
    return Examined(
        found=found,
        confirmed=confirmed,
        disputed=tuple(u for u in disputed if u not in selected),
        eta=rules.eta,
        errors=errors,
        share=share,
        open=tuple(u for u in selected if u not in certain and u not in confirmed),
        open_share=max(without, default=0.0),
    )


def _joined(ground: Landscape, at: Optimum, selected: tuple[int, ...], unit: int, rules: Rules) -> Optimum:
    """The best maximum with one more unit."""
    log_theta = at.log_theta(ground.n_units)
    partition = tuple((u,) for u in (*selected, unit))
    base = [log_theta[u] for u in selected]
    return max(
        (
            ground.climb(
                partition,
                np.array([*base, new, at.phi[-1]]),
                nugget=rules.nugget,
                tolerance=TOLERANCE,
                max_evaluations=EVALUATIONS,
            )
            for new in STARTS
        ),
        key=lambda end: end.value,
    )


def _unexplained(ground: Landscape, at: Optimum, runs: CanonicalRuns) -> tuple[np.ndarray, HiddenShare]:
    """Leave-one-out errors of the selection; the nugget's floor, which blurs what is smooth, is lifted."""
    errors = left_out_errors(ground, at)
    share = hidden_share(errors, runs.y)
    if not at.partition:
        return errors, share
    nugget = (FINE_NUGGET, max(10.0, 1.1 * float(np.exp(at.phi[-1]))))
    finer = left_out_errors(
        ground,
        ground.climb(at.partition, at.phi, nugget=nugget, tolerance=TOLERANCE, max_evaluations=EVALUATIONS),
    )
    other = hidden_share(finer, runs.y)
    return (finer, other) if other.unexplained < share.unexplained else (errors, share)


def where_it_errs(seen: Examined, runs: CanonicalRuns, x: np.ndarray, *, seed: int) -> RoughSide | None:
    """Where the Kriging errs, in the coordinates of the given x (n, d); labels have no above and below."""
    numbers = [int(k) for i, k in enumerate(runs.columns) if i not in runs.labels]
    return rough_side(x[runs.rows], seen.errors, numbers, rng=np.random.default_rng(seed))
