"""What a screening is judged by: its likelihood, its second witness, its left-out runs and its shares."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from .hidden_share import HiddenShare, RoughSide
from .listed_apart import MINOR_SHARE, SelectedShare, at_the_border

__all__ = ["Evidence"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """What a screening is judged by.

    Attributes:
        n_runs, n_inputs, n_selected: sizes; inputs that vary.
        constant_response: nothing to screen.
        pool_gain: what one theta for all inputs adds to l over a response that depends on none (greedy
            methods).
        margin: see `verdict.ScreeningDiagnosis`; None for a greedy method, which knows no rival sets and
            therefore cannot be resolved.
        rest_gain, q2, starts_at_best, repeated, confirmed, disputed, open, open_share, rough_side, minor,
            border, own_unexplained: see `verdict.ScreeningDiagnosis`.
        is_by_ranks: whether the ranks of the response were screened.
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
    is_by_ranks: bool = False
    own_unexplained: float = 0.0

    @property
    def lists_all(self) -> bool:
        """Whether every input that varies is selected: none is left to hide."""
        return self.n_selected >= self.n_inputs

    @property
    def whole(self) -> str:
        """What shares are shares of."""
        return "the variance of the ranks" if self.is_by_ranks else "the variance"

    def by_ranks(self, own: HiddenShare) -> "Evidence":
        """The same of a screening by ranks, whose left-out runs say so much of the response itself."""
        return replace(self, is_by_ranks=True, own_unexplained=own.unexplained)

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
