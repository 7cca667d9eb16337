"""Numbers read off a time history by the words of their name, where no response of the study has that name.

    max of force, min of force, max_abs of force, mean of force, final of force, norm of force
    force at 0.2                the value at a time, on the straight line between samples
    pc1 of force                the score of the first principal component over the runs of the design

A study file may write them so; in documents and tables they are names like those of other responses, with
underscores for blanks and p for the point: max_of_force, force_at_0p2, pc1_of_force.
"""

import re
from dataclasses import dataclass

from workbench.models.histories import REDUCTIONS, Reduction

__all__ = ["Functional", "functional_of"]

OF = re.compile(rf"({'|'.join(kind for kind in REDUCTIONS if kind != 'at')})[ _]of[ _](\w+)")
AT = re.compile(r"(\w+?)[ _]at[ _]([-m]?\d+(?:[.p]\d+)?(?:e[-m]?\d+)?)")
MODE = re.compile(r"pc([1-9]\d?)[ _]of[ _](\w+)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Functional:
    """How `name` is read off the history `history`: by a reduction, or as the score of a mode from 1 on."""

    name: str
    history: str
    reduction: Reduction | None = None
    mode: int = 0


def functional_of(name: str) -> Functional | None:
    """What the words of a name say; None where they say nothing of the kind.

    >>> functional_of("pc2 of force").name, functional_of("force_at_0p2").reduction.at
    ('pc2_of_force', 0.2)
    """
    plain = name.replace(" ", "_").replace(".", "p").replace("-", "m")
    if found := MODE.fullmatch(name):
        return Functional(name=plain, history=found[2], mode=int(found[1]))
    if found := OF.fullmatch(name):
        return Functional(name=plain, history=found[2], reduction=Reduction(kind=found[1]))
    if found := AT.fullmatch(name):
        at = float(found[2].replace("p", ".").replace("m", "-"))
        return Functional(name=plain, history=found[1], reduction=Reduction(kind="at", at=at))
    return None
