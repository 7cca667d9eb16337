"""Derivatives that a model returns beside its responses.

A model with gradients returns a pair: its value and the derivatives by parameter, or its mapping of responses
and the derivatives by response and parameter,

    y, {"a": dy/da, "b": dy/db}         {"y": y, "z": z}, {"y": {"a": dy/da, "b": dy/db}}

each in units of the response per unit of the parameter.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from workbench.errors import EvaluationFailed

__all__ = ["WithGradient", "checked_gradients", "parted"]


@dataclass(frozen=True, slots=True)
class WithGradient:
    """What a function returned, and what came from that of its derivatives: a mapping or an exception."""

    values: Any
    slopes: Any


def parted(raw: Any) -> tuple[Any, Any]:
    """What a model returned as (values, derivatives or None).

    A pair whose second half is no mapping is a time history: values without derivatives.
    """
    if isinstance(raw, WithGradient):
        return raw.values, raw.slopes
    if isinstance(raw, tuple) and len(raw) == 2 and isinstance(raw[1], Mapping):
        return raw
    return raw, None


def checked_gradients(
    slopes: Any, names: Sequence[str], responses: Sequence[str]
) -> dict[str, dict[str, float]]:
    """Derivatives by response and parameter; a response with a derivative that is not finite is left out.

    Raises:
        EvaluationFailed: an exception came instead, an unknown response or parameter is named, or a
            derivative is no number.
    """
    if isinstance(slopes, Exception):
        raise EvaluationFailed(f"{type(slopes).__name__}: {slopes}")
    if not isinstance(slopes, Mapping):
        raise EvaluationFailed(f"a mapping of parameters to derivatives is needed, got {slopes!r:.200}")
    by_response = slopes
    if len(responses) == 1 and responses[0] not in slopes:
        by_response = {responses[0]: slopes}
    found: dict[str, dict[str, float]] = {}
    for response, by in by_response.items():
        if response not in responses:
            raise EvaluationFailed(
                f"derivatives of {response!r} came; the responses are {', '.join(responses)}"
            )
        if not isinstance(by, Mapping):
            raise EvaluationFailed(
                f"derivatives of {response!r} need a mapping by parameter, got {by!r:.200}"
            )
        unknown = sorted(str(name) for name in by if name not in names)
        if unknown:
            raise EvaluationFailed(
                f"a derivative by {unknown[0]!r} came; the parameters are {', '.join(names)}"
            )
        try:
            numbers = {name: float(value) for name, value in by.items()}
        except (TypeError, ValueError):
            raise EvaluationFailed(
                f"derivatives of {response!r} need numbers, got {dict(by)!r:.200}"
            ) from None
        if numbers and all(math.isfinite(value) for value in numbers.values()):
            found[response] = numbers
    return found
