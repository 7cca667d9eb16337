"""What a screening found out about its data and itself, and whether it may be believed.

Three states, and two numbers: x, the share of the variance above which no input is missing, and y, above
which no selected input is open (`surrogates.screening.hidden_share`). A selected input is open when a set
without it is nearly as likely; what that set leaves unexplained bounds what the input does, so y is reckoned
as x is, from that set.

    resolved          x and y are at most 1 %, no input lies at the border of 1 % (`listed_apart`), and no
                      doubt below stands
    partly resolved   others below x may hide, and whether the open inputs act, each below y, is not known
    not resolved      the runs are too few, or one start alone led here, or x or y is above 30 %

A second witness (`surrogates.screening.witness`) that names an input which the likelihood does not confirm,
or one that only both together show, keeps a screening from being resolved.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .hidden_share import HiddenShare, RoughSide, percent
from .listed_apart import MINOR_SHARE, SelectedShare, apart_in_words, at_the_border, border_in_words
from .sets.rival_sets import CLEAR_MARGIN

__all__ = ["Evidence", "Judgement", "ScreeningDiagnosis", "fewest_runs", "judge"]

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

    def judged_anew(self, evidence: "Evidence", judged: "Judgement", **changed: Any) -> "ScreeningDiagnosis":
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
class Evidence:
    """What a screening is judged by.

    Attributes:
        n_runs, n_inputs, n_selected: sizes; inputs that vary.
        constant_response: nothing to screen.
        pool_gain: what one theta for all inputs adds to l over a response that depends on none (greedy
            methods).
        margin: see `ScreeningDiagnosis`; None for a greedy method, which knows no rival sets and therefore
            cannot be resolved.
        rest_gain, q2, starts_at_best, repeated, confirmed, disputed, open, open_share, rough_side, minor,
            border: see `ScreeningDiagnosis`.
        hidden_share: x; None for 1 - q2.
        is_rough, is_anova: whether the correlation is the rough one, or has a weight for each input.
    """

    n_runs: int
    n_inputs: int
    n_selected: int
    constant_response: bool = False
    pool_gain: float = float("nan")
    margin: float | None
    rest_gain: float
    q2: float
    starts_at_best: int
    repeated: Sequence[tuple[int, int]] = ()
    hidden_share: float | None = None
    confirmed: Sequence[int] = ()
    disputed: Sequence[int] = ()
    open: Sequence[int] = ()
    open_share: float = 0.0
    rough_side: RoughSide | None = None
    minor: Sequence[int] = ()
    border: Sequence[int] = ()
    is_rough: bool = False
    is_anova: bool = False

    def with_hidden(self, share: HiddenShare) -> "Evidence":
        """The same where left-out runs say that this share hides further inputs, if it is the larger."""
        if self.hidden_share is not None and not share.upper > self.hidden_share:
            return self
        return replace(self, hidden_share=share.upper, q2=min(self.q2, 1.0 - share.unexplained))

    def with_open(self, shares: Sequence[SelectedShare]) -> "Evidence":
        """The same where these total indices say how much open inputs may do: y is no less."""
        found = [one.upper for one in shares if one.column in self.open and one.mean >= MINOR_SHARE]
        return replace(self, open_share=max(self.open_share, *found)) if found else self

    def with_shares(
        self, shares: Sequence[SelectedShare], minor: Sequence[int], together: Sequence[Sequence[int]]
    ) -> "Evidence":
        """The same with what total indices say: which inputs lie at the border of the list, and that `minor`
        are listed apart. The selection lacks these, so x is no less than they may be."""
        border = at_the_border(shares, together)
        if not minor or self.hidden_share is None:
            return replace(self, border=border)
        largest = max(share.upper for share in shares if share.column in minor)
        lacking = max(self.hidden_share, min(largest, MINOR_SHARE))
        return replace(self, minor=tuple(minor), border=border, hidden_share=lacking)


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
    missing = f"no input above {percent(x)} of the variance is missing"
    where = _where(e.rough_side, name, place or (lambda column, bound: f"{bound:.3g}"))
    known = ""
    if e.repeated:
        pairs = ", ".join(f"{name(i)} and {name(j)}" for i, j in e.repeated)
        known = f"inputs {pairs} cannot be told apart from these runs"
    if doubts.reasons:
        advice = "; ".join(part for part in (*dict.fromkeys(doubts.cures), where, known) if part)
        bound = [*([missing] if x <= PARTLY_SHARE else []), *apart_in_words(e.minor, name)]
        return Judgement(
            state="not resolved",
            verdict="; ".join(["not resolved: " + doubts.reasons[0], *doubts.reasons[1:], *bound]),
            advice=advice,
        )
    certain = _certainty(e, name)
    is_certain = max(x, e.open_share) <= RESOLVED_SHARE and not (
        e.disputed or e.confirmed or e.is_rough or e.is_anova
    )
    if is_certain and not e.border:
        verdict = "; ".join([f"resolved: {missing}", certain, *apart_in_words(e.minor, name)])
        return Judgement(state="resolved", verdict=verdict, advice=known)
    hide = f"{percent(x)} of the variance may hide further inputs" if x > RESOLVED_SHARE else missing
    said = [
        hide,
        *([ANOVA_RUNS] if e.is_anova else [ROUGH_RUNS] if e.is_rough else []),
        *_rest(e),
        *_testimony(e, name),
        certain,
        *apart_in_words(e.minor, name),
        *border_in_words(e.border, name),
    ]
    settle = f" and to settle {', '.join(map(name, e.open))}" if e.open_share > RESOLVED_SHARE else ""
    cures = [f"add about {_more_runs(e.n_runs)} runs to see weaker inputs{settle}", where, known]
    if is_certain:  # but for the border: a list of drivers need not be better than that
        keep = f"keep {', '.join(map(name, e.border))} or not: about {percent(MINOR_SHARE)} of the variance"
        cures = [keep, known]
    if x > ROUGH_SHARE:
        cures.insert(1, ROUGH_ADVICE)
    return Judgement(
        state="partly resolved",
        verdict="partly resolved: " + "; ".join(said),
        advice="; ".join(part for part in cures if part),
    )


ROUGH_RUNS = "the runs speak for steps or kinks, where weak inputs are hard to tell"
ANOVA_RUNS = "found by a correlation in which weak inputs may bend, where those near 1 % are hard to tell"
ROUGH_ADVICE = "the response is rough for so many runs: elementary effects (Morris) need no smoothness"


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
    doubts, n = _Doubts(), e.n_runs
    if not x <= PARTLY_SHARE:
        doubts.add(
            f"left-out runs are predicted with Q2 = {e.q2:.2f} only; further inputs may hide in the rest",
            f"add about {_more_runs(n)} runs, or look for an input that varied but is not in the table",
        )
        doubts.cures.append(ROUGH_ADVICE)
    if e.open_share > PARTLY_SHARE:
        doubts.add(
            f"a set without {', '.join(map(name, e.open))} is only {max(e.margin, 0.0):.1f} lower in l, and "
            f"leaves up to {percent(e.open_share)} of the variance unexplained",
            "" if doubts.cures else f"add about {max(8, n // 4)} runs to the design",
        )
    needed = fewest_runs(e.n_inputs)
    if n < needed:
        doubts.add(
            f"{n} runs are few for {e.n_inputs} inputs: weaker ones may be missed", f"come to {needed} runs"
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
        f"{percent(e.open_share)} of the variance: a set without is only {max(e.margin, 0.0):.1f} lower in "
        "log-likelihood"
    )


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
