"""What plain ways found, by true runs: so that a reader sees what the search bought.

A search has such runs at no cost. The design that it was given fills the space as a plain study would; its
own start design does so where none was given; an attack begins with independent draws and random corners.
Nothing here is predicted, and no run is made for it. The ways have different numbers of runs, and say so.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from workbench.search.runs.given_runs import Run

__all__ = ["Baseline", "measured_baselines"]

# name of the way, and what proposed its runs
WAYS = {
    "the runs given": "given",
    "the start design": "start",
    "independent draws": "attack: interior",
    "random corners": "attack: corner",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Baseline:
    """The worst of the `runs` of a plain way, of which `failed` gave no value, and the key of its run."""

    runs: int
    value: float
    run_key: str
    failed: int = 0

    def to_dict(self) -> dict[str, float | int | str]:
        """For the JSON document."""
        return asdict(self)


def measured_baselines(runs: Sequence[Run], *, sign: float) -> dict[str, Baseline]:
    """The worst run of every plain way among the `runs` of a search; a way without a value is left out.

    sign: +1 where large is bad, -1 where small is.
    """
    found = {}
    for name, proposal in WAYS.items():
        made = [run for run in runs if run.proposal == proposal]
        values = [(sign * run.value, -i) for i, run in enumerate(made) if run.value is not None]
        if values:
            worst = made[-max(values)[1]]
            assert worst.value is not None  # it is among the values
            lost = len(made) - len(values)
            found[name] = Baseline(runs=len(made), value=worst.value, run_key=worst.key, failed=lost)
    return found
