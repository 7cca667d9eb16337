"""What is searched when a model has several responses: a weighted sum, or one within limits of the others.

    weighted({"chest": 1.0, "head": 0.5})            sum of w_k y_k
    within("chest", {"travel": (None, 250.0)})       chest, of those runs whose travel is at most 250

Both are given to a search as `response=`. A run outside the limits is a run without a value: it is counted
as "excluded", and the search learns where such runs lie as it learns where runs fail.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isnan, nan
from numbers import Real

from workbench.errors import StudyError

__all__ = ["Weighted", "Within", "refuse_own_limit", "weighted", "within"]

Limits = tuple[float | None, float | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighted:
    """A sum of responses with weights in 1/unit of each."""

    weights: Mapping[str, float]

    def __call__(self, outputs: Mapping[str, float]) -> float:
        """The sum."""
        _present(self.weights, outputs)
        return sum(weight * outputs[name] for name, weight in self.weights.items())


@dataclass(frozen=True, slots=True, kw_only=True)
class Within:
    """One response where others keep their limits, NaN elsewhere."""

    response: str
    limits: Mapping[str, Limits]

    def __call__(self, outputs: Mapping[str, float]) -> float:
        """The response, or NaN outside the limits."""
        _present([self.response, *self.limits], outputs)
        for name, (low, high) in self.limits.items():
            if not (-inf if low is None else low) <= outputs[name] <= (inf if high is None else high):
                return nan
        return outputs[self.response]


def weighted(weights: Mapping[str, float]) -> Weighted:
    """The weighted sum of responses; weights by name.

    >>> weighted({"a": 2.0, "b": -1.0})({"a": 3.0, "b": 4.0})
    2.0

    Raises:
        StudyError: no weight.
    """
    if not weights:
        raise StudyError("weighted needs at least one response with its weight, got none")
    for name, weight in weights.items():
        if not _is_number(weight):
            raise StudyError(f"the weight of {name!r} needs a number, got {weight!r}")
    return Weighted(weights=dict(weights))


def within(response: str, limits: Mapping[str, Limits]) -> Within:
    """`response`, of the runs whose other responses lie between (low, high); None leaves a side open.

    >>> read = within("a", {"b": (None, 5.0)})
    >>> read({"a": 3.0, "b": 4.0}), read({"a": 3.0, "b": 6.0})
    (3.0, nan)

    Raises:
        StudyError: no limits, a side that is no number, or low above high.
    """
    if not limits:
        raise StudyError(f"within({response!r}, ...) needs at least one limit, got none")
    for name, sides in limits.items():
        if not isinstance(sides, Sequence) or len(sides) != 2:
            raise StudyError(f"limits of {name!r} need a pair, such as (None, 5.0), got {sides!r}")
        low, high = sides
        if any(side is not None and not _is_number(side) for side in (low, high)):
            raise StudyError(
                f"limits of {name!r} need numbers, or None for an open side, got ({low}, {high})"
            )
        if low is not None and high is not None and low > high:
            raise StudyError(f"limits of {name!r} need low <= high, got ({low:g}, {high:g})")
    return Within(response=response, limits=dict(limits))


def refuse_own_limit(response: str, limits: Mapping[str, Limits], sense: str) -> None:
    """Refuse a limit of the response on the side where its worst is searched: it would be the answer itself.

    On the other side a limit leaves runs out whose value is not to be believed, such as -999.

    Raises: StudyError.
    """
    low, high = limits.get(response, (None, None))
    limit, sign, words = (high, "<=", "largest") if sense == "max" else (low, ">=", "smallest")
    if limit is not None:
        raise StudyError(
            f"the limit {response} {sign} {limit:g} is put on the response whose worst is searched: the "
            f"{words} {response} within it is {limit:g} wherever the model comes that far. Leave the limit "
            f"out and compare the worst {response} with {limit:g}; or, if values beyond are wrong, let those "
            "runs give no value (nan)"
        )


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and not isnan(value)


def _present(names: "Mapping[str, float] | list[str]", outputs: Mapping[str, float]) -> None:
    missing = [name for name in names if name not in outputs]
    if missing:
        raise StudyError(f"response {missing[0]!r} is not among the model's outputs {sorted(outputs)}")
