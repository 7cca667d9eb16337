"""The checker of the colours of the answers: no green over a record that speaks against it."""

from collections.abc import Iterator, Mapping
from typing import Any

from workbench.errors import Contradiction

__all__ = ["GREEN_GRADES", "refuse_green"]

GREEN_GRADES = ("proved", "attacked")  # of evidence: what only the search has looked at is not green


def refuse_green(
    levels: Mapping[str, str],
    *,
    screening: str,
    layout: Mapping[str, Any] | None,
    loop: Mapping[str, Any] | None,
    robust: Mapping[str, Any] | None = None,
    worst: Mapping[str, Mapping[str, Any]] | None = None,
) -> None:
    """Check the colours of the answers on the page against the records that they speak of.

    Args:
        levels: section -> level of its card, "good" for green.    screening: its state in words, "" without.
        layout, loop, robust: `layout.json`, `robust_layout.json` and `robust.json`, None without.
        worst: section -> its worst case of `worst_case.json`.

    Raises:
        Contradiction: a card is green where a record speaks against it.
    """
    against = []
    if screening == "not resolved":
        against += [(name, "the screening is not resolved") for name in ("screening", "fit")]
    if loop is None and layout is not None and layout.get("converged") is False:
        against.append(("layout", "its optimiser stopped at its limit"))
    if loop is not None and loop.get("verdict", "green") != "green":
        against += [(name, loop["reasons"][0]) for name in ("layout", "robust")]
    if robust is not None and (robust["summaries"][-1].get("beyond_limit") or [0.0])[0] > 0:
        against.append(("robust", "scenarios exceed the limit"))
    for name, found in (worst or {}).items():
        against += [(name, why) for why in _against_worst(found)]
    for name, why in against:
        if levels.get(name) == "good":
            raise Contradiction(
                f"the answer of the section '{name}' is not written: it is green although {why}. Please "
                "report this with the campaign's folder"
            )


def _against_worst(worst: Mapping[str, Any]) -> Iterator[str]:
    """What speaks against green over a worst case."""
    if not worst["confirmed"]:
        yield "no run was made there"
    if worst.get("grade") not in GREEN_GRADES:
        yield "only the search has looked"
    border = worst.get("border") or {}
    if border.get("borders") or border.get("is_answer"):
        yield "it borders on failures, which may be worse"
