"""What an attack found, and what may be said after it."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workbench.models.evaluator import Outcome
from workbench.search.evidence.attack.ascents import NEAR
from workbench.search.evidence.attack.share import Share, at_most, counted_share
from workbench.space.units import digits_apart, significant

__all__ = ["Attack", "Attempt", "attackers"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Attempt:
    """One true run of an attack: its unit point (d,), its kind, its value in the response's own sign, None
    where the run gave none."""

    point: np.ndarray
    kind: str
    value: float | None
    outcome: Outcome


@dataclass(frozen=True, slots=True, kw_only=True)
class Attack:
    """An attack on the claim that nothing is worse than `value`.

    `raised_from`: the claim that the attack was made on, where what it found has become the `value`, see
    `raised_to`. `largest`: the worst value that it met, in the response's own sign, with the parameters and
    the key of its run; None where every run failed. `since`: runs made after the last that was noticeably
    worse than all before, the claim included. `independent`: values of the independent cases, None where
    there is none; `share` of them lie beyond `value`, with the exact 95 % interval, and `failing` gave no
    value. `arrived` of `climbs` that began at drawn cases, not at the claimed one, met the worst value known
    to within 2 %. `strata` of `strata_in_all` combinations of unordered levels were drawn from. `scouts`
    at a longer step, not among the true runs, chose some of the cases.
    """

    value: float
    sense: str
    budget: int
    seed: int
    attempts: tuple[Attempt, ...]
    largest: float | None
    parameters: Mapping[str, Any] | None
    run_key: str
    since: int
    independent: tuple[float | None, ...]
    share: Share
    failing: Share
    strata: int
    strata_in_all: int
    is_exhaustive: bool
    climbs: int = 0
    arrived: int = 0
    raised_from: float | None = None
    scouts: int = 0

    def raised_to(self, value: float) -> "Attack":
        """The same seen from a value at least as bad as all that was found: a search took up what the attack
        found, and may have gone on from there.

        The share beyond holds for that value, too: it is no less bad than the worst of the independent cases,
        and that less than 3/N of all cases lie beyond the worst of N is true of any law. Climbs arrived at
        the worst that the attack knew: where the value has left that by more than they may be off, none did.
        """
        sign = 1.0 if self.sense == "max" else -1.0
        met = [sign * a.value for a in self.attempts if a.value is not None]
        known = np.array([*met, sign * self.value])
        near = NEAR * min(float(np.ptp(known)), float(np.abs(known).max()))
        beyond = sum(v is not None and sign * v > sign * value for v in self.independent)
        share = counted_share(beyond, len(self.independent))
        first = self.value if self.is_beaten else None
        return replace(
            self,
            value=value,
            share=share,
            arrived=self.arrived if sign * value <= known.max() + near else 0,
            raised_from=first if self.raised_from is None else self.raised_from,
        )

    def and_then(self, later: "Attack") -> "Attack":
        """This attack and a later one on the same case, which began at the worst that this one had found.

        Climbs of this one count as arrived only where the later one found nothing noticeably worse.
        """
        sign = 1.0 if self.sense == "max" else -1.0
        both = [made for made in (self, later) if made.largest is not None]
        worst = max(both, key=lambda made: sign * (made.largest or 0.0), default=later)
        is_quiet = later.since == later.runs
        draws = self.independent + later.independent
        beyond = sum(v is not None and sign * v > sign * later.value for v in draws)
        return replace(
            later,
            budget=self.budget + later.budget,
            attempts=self.attempts + later.attempts,
            largest=worst.largest,
            parameters=worst.parameters,
            run_key=worst.run_key,
            since=self.since + later.runs if is_quiet else later.since,
            independent=draws,
            share=counted_share(beyond, len(draws)),
            failing=counted_share(sum(v is None for v in draws), len(draws)),
            strata=max(self.strata, later.strata),
            is_exhaustive=self.is_exhaustive or later.is_exhaustive,
            climbs=self.climbs + later.climbs,
            arrived=(self.arrived if is_quiet else 0) + later.arrived,
            raised_from=self.raised_from,
            scouts=self.scouts + later.scouts,
        )

    @property
    def dimension(self) -> int:
        """Number of uncertain parameters."""
        return len(self.attempts[0].point)

    @property
    def runs(self) -> int:
        """True runs made."""
        return len(self.attempts)

    @property
    def kinds(self) -> dict[str, int]:
        """Runs by kind."""
        return dict(Counter(attempt.kind for attempt in self.attempts))

    @property
    def failures(self) -> dict[str, int]:
        """Runs without a value, by status."""
        lost = (a.outcome.status for a in self.attempts if a.value is None)
        return dict(Counter("excluded" if status == "ok" else status for status in lost))

    @property
    def excess(self) -> float:
        """How far the largest value found lies beyond the claim, in the unit of the response."""
        if self.largest is None:
            return 0.0
        sign = 1.0 if self.sense == "max" else -1.0
        return max(sign * (self.largest - self.value), 0.0)

    @property
    def is_beaten(self) -> bool:
        """Whether a case beyond the claim was found."""
        return self.excess > 0

    @property
    def sentence(self) -> str:
        """What the attack says about the claim."""
        runs = attackers(self.runs, self.scouts)
        told = [self.value, self.raised_from, self._mildest, *([self.largest] if self.is_beaten else [])]
        digits = digits_apart(told)
        value = significant(self.value, digits)
        before = value if self.raised_from is None else significant(self.raised_from, digits)
        if before != value:  # less than the digits tell is not worth a sentence
            last = (
                f", and the last {self.since} of them" if self.since < self.runs else " in small steps, and"
            )
            runs += f" raised the worst from {before}{last}"
        if self.largest is not None and self.is_beaten:
            found = f"found {significant(self.largest, digits)}, beyond {value}"
            return f"{runs} {found}{self._share_words}{self._failed}"
        found = "every run failed" if self.largest is None else f"found nothing beyond {value}"
        if self.is_exhaustive and not self.failures:
            return f"{runs}, all cases that there are, {found}"
        return f"{runs} {found}{self._share_words}{self._climb_words}{self._failed}"

    @property
    def _mildest(self) -> float | None:
        """The value found that is least bad: how far values lie apart says how many digits tell them."""
        found = [attempt.value for attempt in self.attempts if attempt.value is not None]
        return (min if self.sense == "max" else max)(found, default=None)

    @property
    def _climb_words(self) -> str:
        if not self.climbs:
            return ""
        if self.climbs == 1:
            return f"; the one climb from elsewhere {'arrived' if self.arrived else 'did not arrive'} there"
        return f"; {self.arrived or 'none'} of {self.climbs} climbs from elsewhere arrived there"

    @property
    def _share_words(self) -> str:
        draws, hits, high = self.share.draws, self.share.hits, self.share.high
        if draws < 2:  # one says nothing worth a sentence
            return ""
        count = "none" if not hits else str(hits)
        lost = self.failing.hits
        lie = f"gave a value beyond ({lost} gave none)" if lost else "lie beyond"
        return (
            f"; {count} of {draws} independent cases {lie}, so with 95 % confidence less than "
            f"{at_most(high)} of the uncertainty does"
        )

    @property
    def _failed(self) -> str:
        lost = self.failures
        lost.pop("excluded", None)
        if not lost:
            return ""
        words = ", ".join(f"{count} {status}" for status, count in sorted(lost.items()))
        runs = "1 run" if (count := sum(lost.values())) == 1 else f"{count} runs"
        return f"; {runs} without a value ({words}) may be worse cases"

    def to_dict(self) -> dict[str, Any]:
        """For a JSON document; the runs themselves stand where the evaluator keeps them."""
        return {
            "value": self.value,
            "raised_from": self.raised_from,
            "sense": self.sense,
            "runs": self.runs,
            "kinds": self.kinds,
            "largest": self.largest,
            "parameters": None if self.parameters is None else dict(self.parameters),
            "run_key": self.run_key,
            "excess": self.excess,
            "since": self.since,
            "scouts": self.scouts,
            "climbs": self.climbs,
            "arrived": self.arrived,
            "share": self.share.to_dict(),
            "failing": self.failing.to_dict(),
            "failures": self.failures,
            "strata": self.strata,
            "strata_in_all": self.strata_in_all,
            "exhaustive": self.is_exhaustive,
            "seed": self.seed,
            "sentence": self.sentence,
        }


def attackers(runs: int, scouts: int) -> str:
    """Who looked: true runs, and what was sent ahead of them.

    >>> attackers(1516, 3000)
    '1516 true runs of an adversary and its 3000 scouts at a longer step'
    """
    ahead = f" and its {scouts} scouts at a longer step" if scouts else ""
    return f"{runs} true runs of an adversary{ahead}"
