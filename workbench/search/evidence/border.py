"""Does the worst case border on failures: which, in the solver's own words, and how much of the box fails.

A worst run borders on failures when, within a tenth of the box in every input, a run is likelier to fail than
not, by the classifier of `surrogates.analysis.success` or by the one whose border may lie across a slope of
the response, which needs fewer failures in many inputs. Such a value is the worst of the cases that
give one, and the failures beyond it may be the answer.

The share of the box that fails is counted in the even runs alone, those that fill the space or are drawn from
it: k of n with the exact interval of Clopper and Pearson (1934). Runs that a search placed say nothing of it,
and of n that fill the space evenly k scatters less than of independent ones, so the interval holds. The
classifier learns from all runs, most of them near the border, and calls too much of the box failing: its
share is stated only where no even run was made, and not where it finds no region of failures: of the runs
themselves it then expects fewer to fail than did, by more than chance. A run that `within` excludes is no
failure.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import reduce
from typing import Any

import numpy as np

from surrogates.analysis.success import SuccessChance
from workbench.models.stored.causes import cause_of, shared_words, without_numbers
from workbench.search.evidence.attack.share import Share, at_least, at_most, counted_share
from workbench.search.runs.given_runs import Run
from workbench.search.runs.ledger import Ledger, distinct
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.growing_failures import GrowingFailures, growth_of
from workbench.search.surrogate.model import SearchModel

__all__ = ["EVEN", "Border", "border_of", "has_failed"]

NEAR = 0.1  # of the box in every input
CLOSE = "within a tenth of the box of the worst case in every input"
PROBES, SHARED = 400, 4000  # points near the worst run, and of the box, at which the chance is asked
UNLIKELY = 0.5
EVEN = (
    "given",
    "start",
    "even",
    "attack: interior",
)  # they fill the box
MOST_KINDS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Border:
    """Failures of a search, and where its worst run lies to them.

    `borders`: whether the worst run does; `grows`: whether the Kriging expects more beyond the border.
    `words` of the failed run nearest to the worst one, with its `parameters` and `run_key`; `kinds`: words,
    without the numbers that differ, -> runs. `near`: other runs within a tenth of the box of the worst case
    in every input. `chance`: share of the even runs that failed, by the classifier where there is none;
    `counted`: its interval. `scattered`: failed runs and all runs where there is no even one and the
    classifier finds no region of failures; `chance` is their share then. `is_answer`: a failed run counts as
    worse than any value, by `failures="worst"`.
    """

    borders: bool
    grows: bool
    words: str
    parameters: Mapping[str, Any]
    run_key: str
    kinds: Mapping[str, int]
    near: int
    chance: float
    counted: Share
    is_answer: bool = False
    scattered: tuple[int, int] | None = None

    @property
    def sentence(self) -> str:
        """What to tell a reader."""
        quoted = f'"{self.words}"' if self.words else "without a word of the solver"
        if self.is_answer:
            return f"The worst case is a failure, {quoted}, as a failed run counts as worse; {self._share}."
        if self.borders:
            more = ", and the Kriging expects worse beyond" if self.grows else ""
            return f"The worst case borders on failures of this kind: {quoted}{more}; {self._share}."
        if not self.near:
            known = f"no other run lies {CLOSE} to tell whether they do there"
        elif self.near == 1:
            known = f"the only other run {CLOSE} does not"
        else:
            known = f"none of the {self.near} other runs {CLOSE} does"
        return f"Runs fail, {quoted}; {known}; {self._share}."

    @property
    def _share(self) -> str:
        n, hits = self.counted.draws, self.counted.hits
        if self.scattered is not None:
            lost, known = self.scattered
            return (
                f"{lost} of {known} runs failed and the classifier finds no region where they do, so what "
                "share of the box fails is not known"
            )
        if not n:
            share = f"{100 * self.chance:.2g} %"
            return f"about {share} of the box fails, by the classifier alone, as no even sample was run"
        high = at_most(self.counted.high)
        if not hits:
            return f"none of {n} even runs failed: less than {high} of the box with 95 % confidence"
        low = at_least(self.counted.low)
        return f"{hits} of {n} even runs failed: between {low} and {high} of the box with 95 % confidence"

    def to_dict(self) -> dict[str, Any]:
        """For the JSON document."""
        return {**asdict(self), "sentence": self.sentence}


def has_failed(run: Run) -> bool:
    """Whether a run failed; one that `within` excludes did not."""
    return run.value is None and run.status != "excluded"


def border_of(
    ledger: Ledger,
    model: SearchModel | None,
    success: SuccessChance,
    *,
    worst: np.ndarray | None = None,
    unseen: Sequence[Run] = (),
    is_answer: bool = False,
    given_are_even: bool = True,
    rng: np.random.Generator,
) -> Border | None:
    """The border of the failures among the runs of a ledger, None where none failed.

    `success`: the classifier of a search, to which excluded runs are as good as failed. `worst`: the point
    (d,) that is reported, where it is not that of the worst run. `unseen`: runs of an attack that the ledger
    does not hold. `given_are_even`: whether given runs are of a design that fills the space, which those of
    another search are not.
    """
    where = ledger.where
    runs = [run for run in (*ledger.runs, *unseen) if run.status != "excluded"]
    lost = [run for run in runs if has_failed(run)]
    if not lost:
        return None
    if worst is None:
        worst = ledger.incumbent
    points = where.unit([dict(run.parameters) for run in lost])
    nearest = lost[int(np.argmin(np.abs(points - worst).max(axis=1)))]
    told = np.array([run.status != "excluded" for run in ledger.runs], dtype=bool)
    if not told.all():
        success = SuccessChance.of(where.features(ledger.u[told]), ledger.ok[told])
    signs = rng.choice([-1.0, 0.0, 1.0], (PROBES, where.dimension))
    around = where.snap(worst + NEAR * signs * rng.random((PROBES, 1)) ** 0.5)
    beyond = success.probability(where.features(around)) < UNLIKELY
    if model is not None:
        beyond |= _growing(ledger, model, told).probability(where.features(around)) < UNLIKELY
    near = _is_near(points, worst)
    borders = bool(beyond.any() or near.any())
    outside = np.vstack([around[beyond], points[near]])
    grows = model is not None and len(outside) > 0
    if grows and model is not None:
        grows = bool(model.mean(where.features(outside)).max() > float(ledger.v.max()))
    proposals = EVEN if given_are_even else EVEN[1:]
    even = [run for run in (*ledger.runs, *unseen) if run.proposal in proposals]
    counted = counted_share(sum(has_failed(run) for run in even), len(even))
    scattered = None if even else _scattered(ledger, success, told)
    share = counted.hits / counted.draws if even else _failing(where, success, rng)
    others = distinct(where.unit([dict(run.parameters) for run in runs]), worst[None])
    return Border(
        borders=borders,
        grows=grows,
        words=_words(nearest),
        parameters=dict(nearest.parameters),
        run_key=nearest.key,
        kinds=_kinds(lost),
        near=int(_is_near(others, worst).sum()),
        chance=share if scattered is None else scattered[0] / scattered[1],
        counted=counted,
        is_answer=is_answer,
        scattered=scattered,
    )


def _growing(ledger: Ledger, model: SearchModel, told: np.ndarray) -> GrowingFailures:
    """The classifier of failures that grow out of the response, of the runs `told` (n,): not excluded."""
    features = ledger.where.features(ledger.u)
    grows = growth_of(lambda at: model.predict(at)[0], features[ledger.ok])
    return GrowingFailures.of(features[told], ledger.ok[told], grows)


def _scattered(ledger: Ledger, success: SuccessChance, told: np.ndarray) -> tuple[int, int] | None:
    """How many of how many runs `told` (n,) failed where the classifier expects fewer of them; else None."""
    lost, known = int((~ledger.ok[told]).sum()), int(told.sum())
    expected = 1.0 - float(success.probability(ledger.where.features(ledger.u[told])).mean())
    return (lost, known) if expected < counted_share(lost, known).low else None


def _failing(where: SearchSpace, success: SuccessChance, rng: np.random.Generator) -> float:
    """The share of the box that the classifier calls failing."""
    box = where.snap(rng.random((SHARED, where.dimension)))
    box = box[where.allowed(box)]
    return 1.0 - float(success.probability(where.features(box)).mean()) if len(box) else 0.0


def _is_near(points: np.ndarray, worst: np.ndarray) -> np.ndarray:
    """Whether points (n, d) lie within a tenth of the box of the worst run (d,) in every input."""
    near: np.ndarray = np.abs(points - worst).max(axis=1) <= NEAR
    return near


def _kinds(lost: Sequence[Run]) -> dict[str, int]:
    """The most frequent words of failed runs: those that differ in their numbers alone are one kind."""
    kinds: dict[str, list[str]] = {}
    for words in map(_words, lost):
        kinds.setdefault(without_numbers(words), []).append(words)
    most = sorted(kinds.values(), key=len, reverse=True)[:MOST_KINDS]
    return {reduce(shared_words, words): len(words) for words in most}


def _words(run: Run) -> str:
    """What the solver said, in a line; the status of a run that said nothing."""
    return cause_of(run.error, "") if run.error.strip() else run.status
