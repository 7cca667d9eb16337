"""The three grades of evidence behind a worst case."""

from enum import Enum

from workbench.search.evidence.attack.record import Attack
from workbench.search.evidence.gap import Gap

__all__ = ["ARRIVED", "Grade", "fewest_runs", "grade_of", "shortcoming"]

FEWEST_RUNS, PER_INPUT = 100, 25  # of an attack, before its silence says anything; fewer of few inputs
SILENT = 0.5  # share of an attack's runs that must have followed the last noticeable gain
ARRIVED = 2  # climbs from elsewhere that must have met the worst value known: peaks met once have sisters


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


def shortcoming(attack: Attack) -> str:
    """Why an attack that found nothing worse does not make a value attacked; "" where it does.

    An attack counts when it had runs enough, found nothing noticeably worse in the second half of them, and
    climbs from other places arrived at the same worst value: where each ends at a peak of its own, the next
    may end at a worse one. One that ran every case counts unless some of them failed.
    """
    if attack.is_exhaustive:
        lost = sum(attack.failures.values())
        return f"{lost} of all {attack.runs} cases gave no value" if lost else ""
    if attack.runs < fewest_runs(attack.dimension):
        return (
            f"{attack.runs} runs over {attack.dimension} parameters say too little, it takes "
            f"{fewest_runs(attack.dimension)}"
        )
    if attack.since < SILENT * attack.runs:
        return f"it found something noticeably worse only {attack.since} runs before its end"
    if attack.arrived < ARRIVED:
        return (
            f"{attack.arrived or 'none'} of {attack.climbs} climbs from elsewhere arrived at the worst case, "
            f"{ARRIVED} are asked for"
        )
    return ""


def grade_of(gap: Gap, attack: Attack | None) -> Grade:
    """The grade of a worst case with this gap after this attack.

    A certificate or an enumeration without failures proves; so does an attack that ran every case. Any other
    attack counts where it has no `shortcoming`.
    """
    if gap.kind != "model-based" and not gap.failed:
        return Grade.PROVED
    if attack is None or shortcoming(attack):
        return Grade.SEARCHED
    return Grade.PROVED if attack.is_exhaustive else Grade.ATTACKED
