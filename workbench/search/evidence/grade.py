"""The three grades of evidence behind a worst case."""

from enum import Enum

from workbench.search.evidence.attack.record import Attack
from workbench.search.evidence.gap import Gap

__all__ = ["ARRIVED", "BEYOND", "FOR_THE_WORD", "Grade", "fewest_runs", "grade_of"]

FEWEST_RUNS, PER_INPUT = 100, 25  # of an attack, before its silence says anything; fewer of few inputs
SILENT = 0.5  # share of an attack's runs that must have followed the last noticeable gain
ARRIVED = 2  # climbs from elsewhere that must have met the worst value known: peaks met once have sisters
BEYOND = 0.01  # of the uncertainty: more may not lie beyond a worst case that is called attacked
FOR_THE_WORD = 1200  # runs of an attack, a quarter of them independent: none of 300 beyond is less than that


class Grade(Enum):
    """What stands behind a claim that nothing is worse."""

    PROVED = "every case was run, or a bound that holds for every case was given"
    ATTACKED = "true runs of an adversary that shares nothing with the search found nothing worse"
    SEARCHED = "only the search has looked, by its own surrogate"


def fewest_runs(dimension: int) -> int:
    """Runs that an attack over so many inputs needs before its silence says anything.

    >>> fewest_runs(2), fewest_runs(14)
    (50, 100)
    """
    return min(PER_INPUT * dimension, FEWEST_RUNS)


def grade_of(gap: Gap, attack: Attack | None, *, beyond: float = 1.0) -> Grade:
    """The grade of a worst case with this gap after this attack.

    beyond: the independent cases of the attack must say, with 95 % confidence, that no more of the
    uncertainty lies beyond the value.

    A certificate or an enumeration without failures proves. An attack counts when it had runs enough, found
    nothing noticeably worse in the second half of them, and climbs from other places arrived at the same
    worst value: where each ends at a peak of its own, the next may end at a worse one.
    """
    if gap.kind != "model-based" and not gap.failed:
        return Grade.PROVED
    if attack is None:
        return Grade.SEARCHED
    if attack.is_exhaustive:
        return Grade.SEARCHED if attack.failures else Grade.PROVED
    is_silent = attack.since >= SILENT * attack.runs
    is_long = attack.runs >= fewest_runs(attack.dimension)
    is_repeated = attack.arrived >= ARRIVED
    is_rare = attack.share.high <= beyond
    return Grade.ATTACKED if is_long and is_silent and is_repeated and is_rare else Grade.SEARCHED
