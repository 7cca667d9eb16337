"""The checker of the colours of the answers: no green over a record that speaks against it."""

from collections.abc import Mapping
from typing import Any

from workbench.errors import Contradiction

__all__ = ["refuse_green"]


def refuse_green(
    levels: Mapping[str, str],
    *,
    screening: str,
    layout: Mapping[str, Any] | None,
    loop: Mapping[str, Any] | None,
) -> None:
    """Check the colours of the answers on the page against the records that they speak of.

    Args:
        levels: section -> level of its card, "good" for green.    screening: its state in words, "" without.
        layout, loop: `layout.json` and `robust_layout.json`, None without.

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
    for name, why in against:
        if levels.get(name) == "good":
            raise Contradiction(
                f"the answer of the section '{name}' is not written: it is green although {why}. Please "
                "report this with the campaign's folder"
            )
