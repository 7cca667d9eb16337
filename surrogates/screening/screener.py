"""Screening of inputs by the likelihood of a Kriging model: which inputs does the response depend on?

    default   sparse multi-start ARD likelihood, backward, exchange               sets.ard
    forward   section 3.3 of the dissertation, literal                            sets.forward
    welch     the maximum-likelihood original with free exponents                 sets.welch

An input matters when it needs a theta of its own (eq. 3.7). The others share one common theta in the
published methods, and have theta = 0 in the default, where what is not selected must not act. The
criterion is the restricted log-likelihood l of eq. (3.13): l, not 2 l, constant 0, larger is better.
"""

from collections.abc import Callable, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils.validation import _check_feature_names_in, check_is_fitted, validate_data

from ..analysis.measure import Measure
from ..errors import TooFewRuns
from ..kriging.diagnosis import close_pairs
from ..kriging.given_runs import (
    LabelCodes,
    check_finite,
    check_response,
    refuse_text,
)
from .confirmation import SMOOTH, Examined, screened, where_it_errs
from .evidence import Evidence
from .hidden_share import HiddenShare
from .listed_apart import SelectedShare, minor_inputs, shares_of
from .partitions.canonical import CanonicalRuns, about_unit_wide, canonical_runs
from .partitions.landscape import landscape_of
from .partitions.optimum import left_out_q2, standard_scores
from .path import ScreeningStep, ranked_inputs, screening_path, told
from .sets.anova import anova_price
from .sets.methods import METHODS, Found
from .sets.rules import (
    Rules,
    check_columns,
    check_rules,
    criterion_in_words,
    nugget_bounds,
    rule_in_words,
    threshold_of,
)
from .verdict import Judgement, ScreeningDiagnosis, judge

__all__ = ["KrigingScreener"]

Array = NDArray[np.float64]

FEWEST_RUNS = 3
NOTHING_FOUND = Found(sets=[], optima=[], accepted=0, etas=[])  # where there was nothing to screen


class KrigingScreener(TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """Select the inputs that a response depends on.

    Args:
        method: "default", "forward" (as published) or "welch" (the maximum-likelihood original). The inputs
            are scaled to [0, 1] by their ranges; the last two take them as given where all ranges lie between
            0.1 and 10.
        criterion: "reml" (eq. 3.13) or "ml" (eq. 3.11); "welch" always takes "ml".
        threshold: gain in l that an input must bring. By default 1.92 for "forward" and "welch"; else the
            gain that the inert inputs together exceed with probability 0.05 (3.94 for 20 inputs).
        n_features: number of inputs to select, instead of choosing it by the threshold.
        n_starts: most ascents of the default method.
        enough: the default method stops starting when its best maximum was reached so many times.
        nugget: noise variance relative to sigma^2. None leaves it free above 1e-4 (method "default") or takes
            1e-8; a number fixes it; a pair bounds it.
        eta: exponent of the correlation, 1 to 2 ("welch" chooses its own). None is 2, and by the default
            method 1.5 where the runs speak for a rough response, see `surrogates.screening.confirmation`.
        categorical: columns that hold labels (numbers or strings).
        groups: sets of columns that share one theta and are selected together.
        measures: (d,) weights of the inputs, see `surrogates.analysis.measure`, over which shares of the
            variance are averaged; None is uniform.
        seed: of the starts. Same seed and data, same result, in whatever order the data come.

    Attributes:
        selected_: selected inputs, 0-based, most active first.
        minor_: inputs that the likelihood selects, too, and that stay below 1 % of the variance, by the
            default method (see `surrogates.screening.listed_apart`); () where `n_features` was asked for.
        ranking_: all inputs, the one that most likely acts first: by the weight of all sets found that hold
            it, see `surrogates.screening.sets.rival_sets`. Where the runs are enough, those selected lead.
        path_: a `ScreeningStep` per step.
        theta_, sigma2_, nugget_, log_likelihood_: at the selected set; theta_ in the coordinates of X.
        eta_: exponent of the correlation.   diagnosis_: a `ScreeningDiagnosis`.
        n_features_in_, feature_names_in_: of X.

    >>> import numpy as np
    >>> x = np.random.default_rng(1).random((30, 6))
    >>> screener = KrigingScreener().fit(x, np.sin(5 * x[:, 2]) + x[:, 4] ** 2)
    >>> screener.selected_, screener.diagnosis_.resolved
    (array([2, 4]), True)
    """

    def __init__(
        self,
        *,
        method: str = "default",
        criterion: str = "reml",
        threshold: float | None = None,
        n_features: int | None = None,
        n_starts: int = 200,
        enough: int = 8,
        nugget: float | tuple[float, float] | None = None,
        eta: float | None = None,
        categorical: Sequence[int] = (),
        groups: Sequence[Sequence[int]] = (),
        measures: Sequence[Measure | None] | None = None,
        seed: int = 0,
    ) -> None:
        self.method = method
        self.criterion = criterion
        self.threshold = threshold
        self.n_features = n_features
        self.n_starts = n_starts
        self.enough = enough
        self.nugget = nugget
        self.eta = eta
        self.categorical = categorical
        self.groups = groups
        self.measures = measures
        self.seed = seed

    def fit(self, X: ArrayLike, y: ArrayLike) -> Self:
        """Screen runs X (n, d) with responses y (n,).

        Raises ValueError for text, NaN or infinity (naming the run) and options that do not fit; TooFewRuns.
        """
        if self.method not in METHODS:
            raise ValueError(f"method needs one of {', '.join(METHODS)}, got {self.method!r}")
        check_rules(self)
        if len(self.categorical):
            self._codes = LabelCodes(self.categorical, X)
            X = self._codes(X)
        else:
            refuse_text(X)
        check_response(y)
        X, y = validate_data(
            self, X, y, y_numeric=True, ensure_all_finite=False, dtype=np.float64, ensure_min_samples=0
        )
        x, y = np.asarray(X, dtype=float), np.asarray(y, dtype=float)
        check_finite(x, y, range(len(y)))
        n, d = x.shape
        if n < FEWEST_RUNS:
            raise TooFewRuns(f"a screening needs at least {FEWEST_RUNS} runs, got n_samples = {n}: add runs")
        check_columns(self.groups, d)
        labels = tuple(int(k) % d for k in self.categorical)
        scaled = self.method == "default" or not about_unit_wide(x, labels=labels)
        runs = canonical_runs(x, y, labels=labels, groups=self.groups, scaled=scaled)
        threshold = threshold_of(self, len(runs.units))
        bounds = nugget_bounds(self.method, self.nugget, runs)
        # a response whose spread is rounding of its mean is constant
        constant = runs.scale <= 1e-13 * float(np.abs(y).max())
        found = seen = None
        if not constant and runs.units:
            rules = Rules(
                restricted=self.criterion == "reml",
                eta=SMOOTH if self.eta is None else self.eta,
                nugget=bounds,
                threshold=threshold,
                size=None if self.n_features is None else min(self.n_features, len(runs.units)),
                n_starts=self.n_starts,
                enough=self.enough,
            )
            own = self.method == "default"
            asked = own and self.n_features is None
            free = own and self.eta is None
            seen = screened(runs, self.method, rules, testify=asked, free=free, seed=self.seed)
            found = seen.found
        # what a later look at the stability starts from
        self._runs = runs if found is not None else None
        self._largest = (found.sets[-1], found.optima[-1]) if found is not None else None
        self._anova = None if seen is None else seen.anova
        self._record(runs, seen, threshold, bounds, x, y, constant)
        return self

    def _record(
        self,
        runs: CanonicalRuns,
        seen: Examined | None,
        threshold: float,
        bounds: tuple[float, float],
        x: Array,
        y: Array,
        constant: bool,
    ) -> None:
        """Set the fitted attributes; `seen` is None where there was nothing to screen."""
        d = x.shape[1]
        found = None if seen is None else seen.found
        self.eta_ = SMOOTH if seen is None else seen.eta
        steps: list[ScreeningStep] = []
        base = q2 = float("nan")
        scores = np.zeros(0)
        if found is not None:
            restricted = self.criterion == "reml" and self.method != "welch"
            steps, base = screening_path(runs, found, n_features=d, eta=self.eta_, restricted=restricted)
            best = found.optima[found.accepted]
            landscape = landscape_of(runs, restricted=True, eta=found.etas[found.accepted])
            q2, scores = left_out_q2(landscape, best), standard_scores(landscape, best)
            if seen is not None and seen.anova is not None:
                q2 = 1.0 - seen.share.unexplained
        accepted = [s for s in steps if s.accepted]
        last = accepted[-1] if accepted else None
        self.path_ = told(steps) if self.method == "default" else steps
        self.selected_ = np.array(last.selected if last else (), dtype=np.intp)
        self.ranking_ = ranked_inputs(runs, () if found is None else found.ranked, steps, scores, d)
        self.theta_ = last.theta if last else np.zeros(d)
        self.sigma2_ = last.sigma2 if last else runs.scale**2
        self.nugget_ = last.nugget if last else bounds[0]
        self.log_likelihood_ = last.log_likelihood if last else base
        shares = shares_of(self, x, y, runs, None if seen is None else seen.anova)
        self.diagnosis_ = self._diagnosed(
            runs,
            seen,
            threshold,
            bounds,
            x,
            constant,
            base=base,
            q2=q2,
            n_selected=sum(set(runs.given(u)) <= {*self.selected_} for u in range(len(runs.units))),
            shares=shares,
        )
        self._acting = self.selected_.tolist()
        self._list_apart(self.diagnosis_.minor)

    def _diagnosed(
        self,
        runs: CanonicalRuns,
        seen: Examined | None,
        threshold: float,
        bounds: tuple[float, float],
        x: Array,
        constant: bool,
        *,
        base: float,
        q2: float,
        n_selected: int,
        shares: tuple[SelectedShare, ...],
    ) -> ScreeningDiagnosis:
        n, d = x.shape
        found = NOTHING_FOUND if seen is None else seen.found
        side = (
            where_it_errs(seen, runs, x, seed=self.seed)
            if seen is not None and self.method == "default"
            else None
        )
        repeated = tuple(p for p in runs.repeated if set(p) & set(self.selected_.tolist()))
        self._plain = Evidence(
            n_runs=n,
            n_inputs=len(runs.units),
            n_selected=n_selected,
            constant_response=constant,
            pool_gain=found.pool_gain,
            margin=found.beside.margin if self.method == "default" else None,
            rest_gain=found.rest_gain,
            q2=q2,
            starts_at_best=found.starts_at_best,
            repeated=repeated,
            hidden_share=seen.share.upper if seen else None,
            confirmed=runs.given_all(seen.confirmed) if seen else (),
            disputed=runs.given_all(seen.disputed) if seen else (),
            open=runs.given_all(seen.open) if seen else (),
            open_share=seen.open_share if seen else 0.0,
            rough_side=side,
            is_rough=seen is not None and self.method == "default" and seen.eta < SMOOTH,
            is_anova=seen is not None and seen.anova is not None,
        )
        apart = minor_inputs(shares, self.groups, resolved=judge(self._plain).state == "resolved")
        self._evidence = self._plain.with_shares(shares, apart, self.groups)
        judged = judge(self._evidence)
        price = anova_price(threshold) if self._evidence.is_anova else threshold
        low, width = x.min(axis=0), np.ptp(x, axis=0)
        equal, near = close_pairs((x - low) / np.where(width > 0.0, width, 1.0))
        return ScreeningDiagnosis(
            n_runs=n,
            n_inputs=d,
            method=self.method,
            criterion=criterion_in_words(self.criterion if self.method != "welch" else "ml"),
            rule=rule_in_words(self.method, price, self.n_features),
            threshold=threshold,
            base_log_likelihood=base,
            nugget=self.nugget_,
            nugget_bounds=bounds,
            starts=found.starts,
            starts_at_best=found.starts_at_best,
            search_runs=found.search_runs or n,
            evaluations=found.evaluations,
            rivals=tuple((_inputs(runs, members), gap) for members, gap in found.beside.closest),
            margin=found.beside.margin,
            rest_gain=found.rest_gain,
            q2=q2,
            duplicates=tuple(equal),
            near_duplicates=tuple(near),
            constant=runs.constant,
            repeated=runs.repeated,
            unexplained=seen.share.unexplained if seen else float("nan"),
            hidden_share=float("nan") if seen is None else float(self._evidence.hidden_share or 0.0),
            shares=shares,
            minor=apart,
            border=tuple(self._evidence.border),
            confirmed=tuple(self._evidence.confirmed),
            disputed=tuple(self._evidence.disputed),
            open=tuple(self._evidence.open),
            open_share=self._evidence.open_share,
            rough_side=side,
            state=judged.state,
            resolved=judged.state == "resolved",
            verdict=judged.verdict,
            advice=judged.advice,
        )

    def allow_for(self, share: HiddenShare) -> Self:
        """Let at least this share of the variance hide further inputs, and judge anew; returns itself.

        For a response screened on another scale, if left-out runs say so on its own.
        """
        check_is_fitted(self)
        self._plain = self._plain.with_hidden(share)
        if not share.upper > self.diagnosis_.hidden_share:
            return self
        self._evidence = self._evidence.with_hidden(share)
        self._judge_anew(unexplained=share.unexplained)
        return self

    def by_ranks(self, own: HiddenShare) -> Self:
        """Say of a screening of ranks that its shares are theirs, and `own` what is left of the response."""
        check_is_fitted(self)
        self._plain, self._evidence = self._plain.by_ranks(own), self._evidence.by_ranks(own)
        self._judge_anew(shares_of="ranks", own_unexplained=own.unexplained)
        return self

    def weigh(self, shares: Sequence[SelectedShare]) -> Self:
        """Let these total indices say what is listed apart and what is open, and judge anew; returns itself.

        For a response screened on another scale than its own (`response_scale`); without any nothing changes.
        """
        if not shares:
            return self
        plain = self._plain.with_open(shares)
        apart = minor_inputs(shares, self.groups, resolved=judge(plain).state == "resolved")
        self._evidence = plain.with_shares(shares, apart, self.groups)
        self._judge_anew(shares=tuple(shares))
        self._list_apart(apart)
        return self

    def _judge_anew(self, **changed: Any) -> None:
        self.diagnosis_ = self.diagnosis_.judged_anew(self._evidence, judge(self._evidence), **changed)

    def _list_apart(self, minor: Sequence[int]) -> None:
        kept = [k for k in self._acting if k not in minor]
        self.selected_ = np.array(kept, dtype=np.intp)
        self.minor_ = np.array(minor, dtype=np.intp)

    def judgement(self, names: Sequence[str], place: Callable[[int, float], str] | None = None) -> Judgement:
        """The verdict with names (d,) for columns; `place` writes a value of a column in its own unit."""
        check_is_fitted(self)
        return judge(self._evidence, name=lambda k: names[k], place=place)

    def get_support(self, indices: bool = False) -> NDArray[Any]:
        """Mask of the selected inputs (d,), or their sorted indices."""
        check_is_fitted(self)
        at = np.sort(self.selected_)
        if indices:
            return at
        mask = np.zeros(self.n_features_in_, dtype=bool)
        mask[at] = True
        return mask

    def transform(self, X: ArrayLike) -> Array:
        """The selected columns of X in their given order, (m, k)."""
        return self.columns(X, self.get_support(indices=True))

    def columns(self, X: ArrayLike, columns: Sequence[int] | NDArray[np.intp]) -> Array:
        """Some columns of X as numbers, labels by their codes, (m, k)."""
        check_is_fitted(self)
        if len(self.categorical):
            X = self._codes(X)
        X = validate_data(self, X, reset=False, dtype=np.float64)
        return np.asarray(X, dtype=float)[:, list(columns)]

    def get_feature_names_out(self, input_features: ArrayLike | None = None) -> NDArray[Any]:
        """Names of the selected columns."""
        check_is_fitted(self)
        return np.asarray(_check_feature_names_in(self, input_features))[self.get_support()]

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.required = True
        tags.input_tags.categorical = bool(len(self.categorical))
        return tags


def _inputs(runs: CanonicalRuns, members: Sequence[int]) -> tuple[int, ...]:
    """The inputs of a set of units, ascending."""
    return tuple(sorted(k for u in members for k in runs.given(u)))
