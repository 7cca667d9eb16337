"""Which uncertain parameters matter to each design, and what a new design changed about it.

A design that is robust against one parameter often hands the lead to another. The runs of a re-evaluation
are space-filling and the same for every design, so a difference between two screenings is a difference
between the designs, not between samples.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from workbench.screening.kriging import screen
from workbench.space.box import Space

__all__ = ["Rescreening", "re_screen"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rescreening:
    """The screening of one design beside that of the first one.

    `selected`: most active first. `appeared`, `vanished`: selected here and not for the first design, and the
    other way round. `verdict` says whether the selection is resolved.
    """

    design: str
    runs: int
    selected: tuple[str, ...]
    appeared: tuple[str, ...]
    vanished: tuple[str, ...]
    verdict: str

    @property
    def sentence(self) -> str:
        """What to tell a reader."""
        matter = ", ".join(self.selected) or "no parameter"
        changes = [f"{', '.join(self.appeared)} came up"] if self.appeared else []
        changes += [f"{', '.join(self.vanished)} no longer matters"] if len(self.vanished) == 1 else []
        changes += [f"{', '.join(self.vanished)} no longer matter"] if len(self.vanished) > 1 else []
        return f"{self.design}: {matter}" + (f" ({'; '.join(changes)})" if changes else "")

    def to_dict(self) -> dict[str, Any]:
        """For the JSON document."""
        plain = {
            key: list(value) if isinstance(value, tuple) else value for key, value in asdict(self).items()
        }
        return {**plain, "sentence": self.sentence}


def re_screen(
    scenarios: Sequence[Mapping[str, Any]],
    values: Mapping[str, np.ndarray],
    uncertainty: Space,
    *,
    seed: int = 0,
) -> tuple[Rescreening, ...]:
    """Screen every design on the same scenarios (n rows); `values` holds (n,) responses, NaN where failed.

    The first design is the reference. A design whose values are all equal selects nothing.

    Raises:
        NotEnoughRuns: a design has fewer than three values.
    """
    out: list[Rescreening] = []
    for name, y in values.items():
        rows = [{**row, "response": float(v)} for row, v in zip(scenarios, y, strict=True)]
        found = screen(rows, uncertainty, "response", transform="none", seed=seed, effects=False)
        first = out[0].selected if out else found.selected
        out.append(
            Rescreening(
                design=name,
                runs=found.n_runs,
                selected=tuple(n for n in found.ranking if n in found.selected),
                appeared=tuple(n for n in found.selected if n not in first),
                vanished=tuple(n for n in first if n not in found.selected),
                verdict=found.verdict,
            )
        )
    return tuple(out)
