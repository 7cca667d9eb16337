"""What a design costs that is poor for its size: one line, for the terminal and the report."""

from collections.abc import Mapping
from typing import Any

from workbench.sampling.kinds import KINDS, Way

__all__ = ["cost_of_design"]

# two columns that correlate more than this share their effects: 16 % of each other's variance
CORRELATED = 0.4
HALF = 50.0
# kinds that fill the space; the others are made for a regression and may lie anywhere
SPREAD: tuple[Way, ...] = ("spread", "sequence", "arranged", "within")
COSTS = {
    "max_correlation": "effects of two parameters are hard to tell apart",
    "phi_p": "runs close together say nearly the same",
    "cd2": "parts of the space stay empty",
}


def cost_of_design(document: Mapping[str, Any]) -> str | None:
    """The sentence about the design of a `design.json`, None where there is nothing to say.

    A design is poor whose largest correlation is above 0.4, or which is worse than half of the random designs
    of its kind in correlation, spread (phi_p) or evenness (CD2).

    >>> quality = {"max_correlation": {"value": 0.68, "percentile": 99.0, "better": "low"}}
    >>> cost_of_design({"algorithm": "ihs", "quality": quality})[:53]
    'the design is poor for its size: max correlation 0.68'
    """
    kind = str(document.get("algorithm"))
    if kind not in KINDS or KINDS[kind].way not in SPREAD:
        return None
    quality = document.get("quality") or {}
    constrained = bool((document.get("space") or {}).get("constraints"))
    poor, costs = [], []
    for name, cost in COSTS.items():
        entry = quality.get(name) or {}
        value, worse = entry.get("value"), entry.get("percentile")
        if value is None or (name == "cd2" and constrained):  # evenness in the cube, not in its feasible part
            continue
        behind = worse is not None and worse > HALF
        if behind or (name == "max_correlation" and value > CORRELATED):
            place = f" ({worse:.0f} % of random designs on its levels are better)" if behind else ""
            poor.append(f"{name.replace('_', ' ')} {value:.3g}{place}")
            costs.append(cost)
    if not poor:
        return None
    sentence = f"the design is poor for its size: {', '.join(poor)}; {', '.join(costs)}"
    if KINDS[kind].way == "arranged":
        return f"{sentence}. More runs, wider constraints or more swaps would mend it"
    return f"{sentence}. It is kept as kind = '{kind}'; without kind it is optimised"
