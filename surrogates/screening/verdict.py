"""What a screening found out about its data and itself, and whether it may be believed.

Three states, and two numbers: x, the share of the variance above which no input is missing, and y, above
which no selected input is open (`surrogates.screening.hidden_share`). A selected input is open when a set
without it is nearly as likely; what that set leaves unexplained bounds what the input does, so y is reckoned
as x is, from that set.

    resolved          x and y are at most 1 %, no input lies at the border of 1 % (`listed_apart`), and no
                      doubt below stands
    partly resolved   others below x may hide, and whether the open inputs act, each below y, is not known
    not resolved      the runs are too few, or one start alone led here, or x or y is above 30 %

Of a response screened by its ranks x, y and all shares are of the variance of the ranks, and every sentence
says so; what left-out runs leave unexplained of the response itself is said beside them, and keeps it from
being resolved. Where all inputs are selected nothing is left to hide, whatever stays unexplained, and no
sentence says what is missing; nor does one where the runs are few.

A second witness (`surrogates.screening.witness`) that names an input which the likelihood does not confirm,
or one that only both together show, keeps a screening from being resolved.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .evidence import Evidence
from .hidden_share import RoughSide, percent
from .listed_apart import MINOR_SHARE, SelectedShare, apart_in_words, border_in_words
from .sets.rival_sets import CLEAR_MARGIN

__all__ = ["Judgement", "ScreeningDiagnosis", "fewest_runs", "judge"]

FEW_RUNS, FEW_RUNS_PER_INPUT = 10, 2.0  # with fewer, weaker inputs are missed without a sign
RESOLVED_SHARE, PARTLY_SHARE = 0.01, 0.3  # of the variance that an input may hide in
ROUGH_SHARE = 0.1  # of it, unexplained with more runs than a smooth response needs: a rough one
NO_RIVAL = 1e300  # a margin beyond it: there is no rival set
SILENT_REST = 1.5  # in l: what a common theta of the inputs that were not selected may add


@dataclass(frozen=True, slots=True, kw_only=True)
class ScreeningDiagnosis:
    """Facts about one screening; inputs by column, runs by row, both 0-based as given.

    Attributes:
        n_runs, n_inputs: sizes.
        method, criterion, rule: in words, with sign, factor and constant.
        threshold: gain in l that an input must bring.
        base_log_likelihood: l before the first input: all theta 0, or one for all in a greedy method.
        nugget: at the selected set, relative to sigma2; `nugget_bounds` what it was allowed.
        starts, starts_at_best: ascents, and how many of them lead to the selected set.
        search_runs, evaluations: runs that the ascents saw, and likelihoods in them.
        rivals: other sets, with the fall of l - threshold * size from the selected set to them.
        margin: the smallest fall to a set that misses a selected input; inf when there is none.
        rest_gain: how far l rises when all inputs that were not selected share a theta; nan if not asked.
        q2: leave-one-out, of the Kriging with the selected inputs.
        duplicates, near_duplicates: pairs of runs.   constant, repeated: inputs; pairs of inputs.
        unexplained: share of the variance in the leave-one-out errors, of the better of the Kriging with the
            nugget's floor and without it.
        hidden_share: x, its upper 95 % bound or that of the strongest input listed apart: no input above it
            is missing.
        shares: total indices of the inputs that the likelihood selects (method "default").
        shares_of: "response", or "ranks": what x, y and the shares are of.
        own_unexplained: of a screening by ranks, what left-out runs leave unexplained of the response itself.
        minor: of them those below 1 %, which stand apart from the selection.
        border: of them those of which the runs do not tell on which side of 1 % they lie.
        confirmed, disputed: inputs that the second witness named and the likelihood confirmed, and did not.
        open: selected inputs that a nearly as likely set does without.
        open_share: y, the upper 95 % bound: no open input is above it; 0 without one.
        rough_side: where the errors are large, in the coordinates of X; None where they are spread.
        state: "resolved", "partly resolved", "not resolved", "not judged" or "nothing to screen".
        resolved: whether the state is "resolved".   verdict, advice: the judgement, in words.
    """

    n_runs: int
    n_inputs: int
    method: str
    criterion: str
    rule: str
    threshold: float
    base_log_likelihood: float
    nugget: float
    nugget_bounds: tuple[float, float]
    starts: int
    starts_at_best: int
    search_runs: int
    evaluations: int
    rivals: tuple[tuple[tuple[int, ...], float], ...]
    margin: float
    rest_gain: float
    q2: float
    duplicates: tuple[tuple[int, int], ...]
    near_duplicates: tuple[tuple[int, int], ...]
    constant: tuple[int, ...]
    repeated: tuple[tuple[int, int], ...]
    unexplained: float
    hidden_share: float
    shares: tuple[SelectedShare, ...]
    minor: tuple[int, ...]
    border: tuple[int, ...]
    confirmed: tuple[int, ...]
    disputed: tuple[int, ...]
    open: tuple[int, ...]
    open_share: float
    rough_side: RoughSide | None
    state: str
    resolved: bool
    verdict: str
    advice: str
    shares_of: str = "response"
    own_unexplained: float = 0.0

    def judged_anew(self, evidence: Evidence, judged: "Judgement", **changed: Any) -> "ScreeningDiagnosis":
        """The same screening with other evidence, and what else has changed."""
        return replace(
            self, hidden_share=float(evidence.hidden_share or 0.0), q2=evidence.q2,
            minor=tuple(evidence.minor), border=tuple(evidence.border), open_share=evidence.open_share,
            state=judged.state, resolved=judged.state == "resolved", verdict=judged.verdict,
            advice=judged.advice, **changed,
        )  # fmt: skip


def fewest_runs(n_inputs: int) -> int:
    """The runs from which on a screening of so many inputs may be called resolved: 10 and 2 per input.

    >>> fewest_runs(20)
    50
    """
    return int(np.ceil(FEW_RUNS + FEW_RUNS_PER_INPUT * n_inputs))


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """State, verdict and advice in words (see `ScreeningDiagnosis`)."""

    state: str
    verdict: str
    advice: str


@dataclass(slots=True)
class _Doubts:
    """Reasons against, and what cures them."""

    reasons: list[str] = field(default_factory=list)
    cures: list[str] = field(default_factory=list)

    def add(self, reason: str, cure: str) -> None:
        self.reasons.append(reason)
        self.cures.append(cure)


def judge(
    evidence: Evidence,
    *,
    name: Callable[[int], str] = str,
    place: Callable[[int, float], str] | None = None,
) -> Judgement:
    """The state of a screening, the verdict in a sentence, and what to do.

    `name` says what a column is called, `place` how a value of a column is written (three digits).

    >>> facts = {"n_runs": 50, "n_inputs": 20, "n_selected": 3, "margin": 9.0, "rest_gain": 0.2}
    >>> found = judge(Evidence(**facts, q2=0.99, starts_at_best=8, hidden_share=0.004))
    >>> print(found.verdict.split("; ")[0])
    resolved: no input above 0.4 % of the variance is missing
    >>> print(judge(Evidence(**facts, q2=0.96, starts_at_best=8, hidden_share=0.05)).state)
    partly resolved
    """
    e = evidence
    if (plain := _unjudged(e)) is not None:
        return plain
    assert e.margin is not None
    x = 1.0 - e.q2 if e.hidden_share is None else e.hidden_share
    doubts = _doubts(e, x, name)
    missing = f"no input above {percent(x)} of {e.whole} is missing"
    if e.lists_all:
        missing = "every input is selected or listed apart" if e.minor else "all inputs are selected"
    where = _where(e.rough_side, name, place or (lambda column, bound: f"{bound:.3g}"))
    known = ""
    if e.repeated:
        pairs = ", ".join(f"{name(i)} and {name(j)}" for i, j in e.repeated)
        known = f"inputs {pairs} cannot be told apart from these runs"
    if doubts.reasons:
        advice = "; ".join(part for part in (*dict.fromkeys(doubts.cures), where, known) if part)
        # few runs leave few errors to reckon x from, and a chance selection fits them all
        is_known = x <= PARTLY_SHARE and (e.lists_all or e.n_runs >= fewest_runs(e.n_inputs))
        bound = [*([missing] if is_known else []), *apart_in_words(e.minor, name), *_of_ranks(e)]
        return Judgement(
            state="not resolved",
            verdict="; ".join(["not resolved: " + doubts.reasons[0], *doubts.reasons[1:], *bound]),
            advice=advice,
        )
    certain = _certainty(e, name)
    is_certain = max(x, e.open_share, e.own_unexplained) <= RESOLVED_SHARE and not (
        e.disputed or e.confirmed or e.is_rough or e.is_anova
    )
    if is_certain and not e.border:
        apart = apart_in_words(e.minor, name)
        verdict = "; ".join([f"resolved: {missing}", certain, *apart, *_of_ranks(e)])
        return Judgement(state="resolved", verdict=verdict, advice=known)
    hide = f"{percent(x)} of {e.whole} may hide further inputs" if x > RESOLVED_SHARE else missing
    if e.lists_all and x > RESOLVED_SHARE:
        hide = f"{missing}, and up to {percent(x)} of {e.whole} stays unexplained"
    said = [
        hide,
        *([ANOVA_RUNS] if e.is_anova else [ROUGH_RUNS] if e.is_rough else []),
        *_rest(e),
        *_testimony(e, name),
        certain,
        *apart_in_words(e.minor, name),
        *border_in_words(e.border, name),
        *_of_ranks(e),
    ]
    aims = [] if e.lists_all else ["to see weaker inputs"]
    if e.open_share > RESOLVED_SHARE:
        aims.append(f"to settle {', '.join(map(name, e.open))}")
    more = f"add about {_more_runs(e.n_runs)} runs {' and '.join(aims)}" if aims else NO_MORE_TO_LIST
    cures = [more, where if aims else "", known]
    if is_certain:  # but for the border: a list of drivers need not be better than that
        keep = f"keep {', '.join(map(name, e.border))} or not: about {percent(MINOR_SHARE)} of {e.whole}"
        cures = [keep, known]
    if x > ROUGH_SHARE and not e.lists_all:
        cures.insert(1, ROUGH_ADVICE)
    return Judgement(
        state="partly resolved",
        verdict="partly resolved: " + "; ".join(said),
        advice="; ".join(part for part in cures if part),
    )


ROUGH_RUNS = "the runs speak for steps or kinks, where weak inputs are hard to tell"
ANOVA_RUNS = "found by a correlation in which weak inputs may bend, where those near 1 % are hard to tell"
NO_MORE_TO_LIST = "no further runs for the list: they would only let the Kriging predict better"
ROUGH_ADVICE = "the response is too rough for these runs: elementary effects (Morris) need no smoothness"


def _more_runs(n: int) -> int:
    """Half as many again."""
    return max(8, n // 2)


def _unjudged(e: Evidence) -> Judgement | None:
    """The cases in which there is nothing to weigh."""
    if e.constant_response:
        return Judgement(
            state="nothing to screen",
            verdict="nothing to screen: the response is constant",
            advice="check the response; widen the bounds",
        )
    if e.n_inputs == 0:
        return Judgement(
            state="nothing to screen",
            verdict="nothing to screen: no input varies",
            advice="vary the inputs: each has the same value in all runs",
        )
    if e.n_selected == 0 and e.pool_gain >= CLEAR_MARGIN:
        return Judgement(
            state="not judged",
            verdict=f"not judged: one theta shared by all inputs raises l by {e.pool_gain:.1f} over noise, "
            "and no input gains by a theta of its own",
            advice="compare with method='default', which gives the inputs that do not act no theta",
        )
    if e.n_selected == 0:
        return Judgement(
            state="not resolved",
            verdict="not resolved: no input explains the response better than noise does",
            advice="add runs (twice as many), or average out the noise, or choose a less noisy response",
        )
    if e.margin is None:
        return Judgement(
            state="not judged",
            verdict="not judged: a greedy path knows no rival sets",
            advice="compare with method='default', which searches for them",
        )
    return None


def _doubts(e: Evidence, x: float, name: Callable[[int], str]) -> _Doubts:
    """What keeps a selection from being certain."""
    assert e.margin is not None
    doubts, n, needed = _Doubts(), e.n_runs, fewest_runs(e.n_inputs)
    more = max(_more_runs(n), needed - n)
    if not x <= PARTLY_SHARE:
        doubts.add(
            f"left-out runs are predicted with Q2 = {e.q2:.2f} only"
            + ("; further inputs may hide in the rest" if not e.lists_all else ", by all inputs"),
            f"add about {more} runs, or look for an input that varied but is not in the table",
        )
        doubts.cures.append(ROUGH_ADVICE)
    if e.own_unexplained > PARTLY_SHARE and not e.lists_all:
        doubts.add(
            f"ranks tell little of this response: of its own variance {percent(e.own_unexplained)} stays "
            "unexplained where runs are left out",
            "" if doubts.cures else f"add about {more} runs: what acts in the tail may be missing",
        )
    if e.open_share > PARTLY_SHARE:
        doubts.add(
            f"a set without {', '.join(map(name, e.open))} is only {max(e.margin, 0.0):.1f} lower in l, and "
            f"leaves up to {percent(e.open_share)} of {e.whole} unexplained",
            "" if doubts.cures else f"add about {max(8, n // 4, needed - n)} runs to the design",
        )
    if n < needed:
        doubts.add(
            f"{n} runs are few for {e.n_inputs} inputs"
            + (": weaker ones may be missed" if not e.lists_all else ""),
            "" if any(doubts.cures) else f"come to {needed} runs",
        )
    if e.starts_at_best <= 1:
        doubts.add("at most one start led to the selected set", "screen again with more starts")
    if doubts.reasons:
        doubts.reasons += [*_rest(e), *_testimony(e, name)]
        if e.open and e.open_share <= PARTLY_SHARE:
            doubts.reasons.append(_certainty(e, name))
    return doubts


def _certainty(e: Evidence, name: Callable[[int], str]) -> str:
    """How far the sets without a selected input fall, and which selected inputs are open."""
    assert e.margin is not None
    if not e.open:
        gap = f"at least {e.margin:.1f} lower" if e.margin < NO_RIVAL else "much lower"
        return f"every set that misses a selected input is {gap} in log-likelihood"
    names, many = ", ".join(map(name, e.open)), len(e.open) > 1
    return (
        f"whether {names} act{'' if many else 's'} is open, {'each ' if many else ''}with at most "
        f"{percent(e.open_share)} of {e.whole}: a set without is only {max(e.margin, 0.0):.1f} lower in "
        "log-likelihood"
    )


def _of_ranks(e: Evidence) -> list[str]:
    """Of what the shares are, where it is not the response, and what is known of that."""
    if not e.is_by_ranks:
        return []
    left = f"{percent(e.own_unexplained)} stays unexplained where runs are left out"
    return [f"shares are of the ranks: of the variance of the response itself {left}"]


def _rest(e: Evidence) -> list[str]:
    """What the inputs that were not selected do together, where it shows."""
    if not e.rest_gain > SILENT_REST:
        return []
    return [f"the inputs that were not selected still act together: l rises by {e.rest_gain:.1f} if they may"]


def _testimony(e: Evidence, name: Callable[[int], str]) -> list[str]:
    """What the second witness says beyond the likelihood."""
    said = []
    if e.confirmed:
        said.append(f"only regression and likelihood together show {', '.join(map(name, e.confirmed))}")
    if e.disputed:
        said.append(
            f"a regression on the same runs names {', '.join(map(name, e.disputed))}, the likelihood does not"
        )
    return said


def _where(side: RoughSide | None, name: Callable[[int], str], place: Callable[[int, float], str]) -> str:
    if side is None:
        return ""
    beyond = "above" if side.above else "below"
    return (
        f"put them where {name(side.column)} is {beyond} {place(side.column, side.bound)}: "
        f"{100 * side.share:.0f} % of the squared error lies there"
    )
