"""Which cases of those that break a layout join the next optimisation.

The worst one alone makes a slow loop: the next layout holds it and breaks somewhere else. All of them make
dear optimisations, and most say the same. So the worst comes first, then the worst of those far from it.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from workbench.models.evaluator import Outcome
from workbench.space.box import Space

__all__ = ["distinct", "spread_out_worst"]

FAR = 0.35  # root mean square distance in the unit cube: two flips of fourteen parameters are far enough


def spread_out_worst(
    space: Space, outcomes: Sequence[Outcome], *, response: str, number: int
) -> list[tuple[float, Outcome]]:
    """At most `number` of the outcomes with their values, largest first, no two of them close together.

    Cases with different words (hands on, hands off) are never close. Outcomes that failed are left out.
    """
    ranked = sorted(
        ((o.outputs[response], o) for o in outcomes if o.status == "ok"), key=lambda found: -found[0]
    )
    if not ranked:
        return []
    words = [p.name for p in space.parameters if not p.is_numeric]
    numeric = [j for j, p in enumerate(space.parameters) if p.is_numeric]
    rows = [tuple(o.parameters[name] for name in space.names) for _, o in ranked]
    unit = space.unit(np.array(rows, dtype=object))[:, numeric]
    kept: list[int] = []
    for k in range(len(ranked)):
        if len(kept) == number:
            break
        if all(
            any(ranked[k][1].parameters[w] != ranked[i][1].parameters[w] for w in words)
            or np.linalg.norm(unit[k] - unit[i]) >= FAR * np.sqrt(max(len(numeric), 1))
            for i in kept
        ):
            kept.append(k)
    return [ranked[k] for k in kept]


def distinct(cases: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Cases in order, repeated ones once."""
    seen: dict[str, dict[str, Any]] = {}
    for case in cases:
        seen.setdefault(repr(sorted(case.items())), dict(case))
    return list(seen.values())
