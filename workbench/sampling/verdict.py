"""What a design costs that is poor for its size, or grew: a line each, for the terminal and the report."""

from collections.abc import Mapping
from typing import Any

from workbench.sampling.kinds import KINDS, SPREAD

__all__ = ["cost_of_design", "cost_of_growth"]

# two columns that correlate more than this share their effects: 16 % of each other's variance
CORRELATED = 0.4
HALF = 50.0
COSTS = {
    "max_correlation": "effects of two parameters are hard to tell apart",
    "phi_p": "runs close together say nearly the same",
    "cd2": "parts of the space stay empty",
}


def cost_of_growth(document: Mapping[str, Any]) -> str | None:
    """The sentence about a design of a `design.json` that grew, or that is a part of a larger one; else None.

    >>> figures = {"phi_p": (3.3, 3.0), "cd2": (0.02, 0.01), "max_correlation": (0.011, 0.012)}
    >>> cost_of_growth({"n": 60, "beside_fresh": figures})
    'beside 60 runs drawn at once the grown design has 1.10 times phi_p, 2.00 times CD2 and a largest \
correlation of 0.011 (0.012); smaller is better'
    """
    later = len(document.get("later") or ())
    if later:
        n = document["n"]
        return f"these are {n} of {n + later} runs drawn at once; runs = {n + later} makes the other {later}"
    figures = document.get("beside_fresh")
    if not figures:
        return None
    (phi, phi_fresh), (cd2, cd2_fresh), (r, r_fresh) = (
        figures[name] for name in ("phi_p", "cd2", "max_correlation")
    )
    return (
        f"beside {document['n']} runs drawn at once the grown design has {phi / phi_fresh:.2f} times phi_p, "
        f"{cd2 / cd2_fresh:.2f} times CD2 and a largest correlation of {r:.3f} ({r_fresh:.3f}); "
        "smaller is better"
    )


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
