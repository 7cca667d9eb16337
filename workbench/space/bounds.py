"""What bounds, levels and steps a parameter ends up with, from what was given; refusals say what to do."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from workbench.errors import StudyError
from workbench.space.units import told_apart

__all__ = ["Distribution", "finite", "settle_bounds", "settle_levels", "settle_step", "suffix"]

TAIL = 1e-3  # bounds left out are these quantiles of the distribution
MOST_LEVELS = 1_000_000
CALLED_ELSEWHERE = {  # a law in other programs -> in scipy.stats
    "normal": "norm",
    "gauss": "norm",
    "gaussian": "norm",
    "lognormal": "lognorm",
    "triangular": "triang",
    "exponential": "expon",
    "weibull": "weibull_min",
    "gumbel": "gumbel_r",
    "frechet": "invweibull",
    "student": "t",
}


@dataclass(frozen=True, slots=True)
class Distribution:
    """A continuous distribution of scipy.stats by name: `Distribution("norm", {"loc": 3, "scale": 1})`."""

    name: str
    parameters: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, given: Any, *, parameter: str) -> "Distribution":
        """A distribution as it is, or of a mapping as a study file has it: `name` and keywords beside it.

        Raises StudyError for anything else.

        >>> Distribution.of({"name": "norm", "loc": 3.0}, parameter="grip")
        Distribution(name='norm', parameters={'loc': 3.0})
        """
        if isinstance(given, cls):
            return given
        if not isinstance(given, Mapping) or not isinstance(given.get("name"), str):
            raise StudyError(
                f"parameter {parameter!r}: distribution needs a mapping with the name of a law, such as "
                f"{{'name': 'norm', 'loc': 80.0, 'scale': 10.0}}, got {given!r}"
            )
        return cls(given["name"], {key: value for key, value in given.items() if key != "name"})

    def frozen(self) -> Any:
        """The scipy.stats distribution."""
        from scipy import stats

        family = getattr(stats, self.name, None)
        if not isinstance(family, stats.rv_continuous):
            there = CALLED_ELSEWHERE.get(self.name.lower(), self.name.lower())
            is_there = isinstance(getattr(stats, there, None), stats.rv_continuous)
            cure = f"there it is called {there!r}" if is_there else "such as 'norm'"
            raise StudyError(f"distribution {self.name!r} is no continuous one of scipy.stats, {cure}")
        needed = [key.strip() for key in (family.shapes or "").split(",") if key.strip()]
        known = [*needed, "loc", "scale"]
        if not set(needed) <= set(self.parameters) <= set(known):
            must = f" and needs {' and '.join(needed)}" if needed else ""
            came = ", ".join(map(str, self.parameters)) or "none of them"
            raise StudyError(f"distribution {self.name!r} takes {', '.join(known)}{must}, got {came}")
        try:
            law = family(**{key: float(value) for key, value in self.parameters.items()})
        except (TypeError, ValueError) as exc:
            raise StudyError(f"distribution {self.name!r}: {exc}") from None
        if not math.isfinite(law.ppf(0.5)):
            given = ", ".join(f"{key} = {value}" for key, value in self.parameters.items()) or "no numbers"
            wrong = "a scale is > 0" if float(self.parameters.get("scale", 1.0)) <= 0 else "they do not fit"
            raise StudyError(f"distribution {self.name!r} has no median with {given}: {wrong}")
        return law


def suffix(unit: str) -> str:
    """The unit behind a number; nothing for 1."""
    return "" if unit == "1" else f" {unit}"


def finite(name: str, key: str, value: Any) -> float:
    """The value, or a refusal that names the parameter and the key."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not math.isfinite(value):
        raise StudyError(f"parameter {name!r}: {key} needs a finite number, got {value!r}")
    return value if isinstance(value, int) else float(value)


def settle_levels(name: str, kind: str, levels: Sequence[Any]) -> tuple[Any, ...]:
    """The admissible values of a binary, discrete (sorted) or categorical parameter."""
    if isinstance(levels, str):
        raise StudyError(f"parameter {name!r} needs a list of levels, got the text {levels!r}")
    if kind == "binary":
        if levels and tuple(levels) != (0, 1):
            raise StudyError(
                f"parameter {name!r} of kind 'binary' has levels 0 and 1; for words use 'categorical'"
            )
        return (0, 1)
    if len(levels) < 2 or len(set(levels)) < len(levels):
        raise StudyError(f"parameter {name!r} needs at least two different levels, got {list(levels)}")
    if kind == "discrete":
        return tuple(sorted(finite(name, "levels", level) for level in levels))
    if not all(isinstance(level, str) for level in levels):
        raise StudyError(
            f"parameter {name!r} of kind 'categorical' needs words as levels, got {list(levels)}"
        )
    return tuple(levels)


def settle_bounds(
    name: str,
    *,
    unit: str,
    lower: float | None,
    upper: float | None,
    baseline: float | None,
    factor: Sequence[float] | None,
    distribution: Distribution | None,
) -> tuple[float, float]:
    """The bounds as given, or baseline x factor, or the tails of the distribution."""
    if factor is not None:
        if lower is not None or upper is not None:
            raise StudyError(f"parameter {name!r}: factor goes with baseline and without lower and upper")
        lower, upper = _multiples(name, baseline, factor)
    if distribution is not None:
        law = distribution.frozen()
        lower = float(f"{law.ppf(TAIL):.12g}") if lower is None else lower
        upper = float(f"{law.ppf(1 - TAIL):.12g}") if upper is None else upper
    if lower is None or upper is None:
        missing = "lower" if lower is None else "upper"
        raise StudyError(f"parameter {name!r} has no {missing}; give lower and upper, or baseline and factor")
    lower, upper = float(finite(name, "lower", lower)), float(finite(name, "upper", upper))
    if not lower < upper:
        low, high = told_apart(lower, upper)
        came = f"lower={low} and upper={high}{suffix(unit)}"
        raise StudyError(f"parameter {name!r} needs lower < upper, got {came}")
    if not math.isfinite(upper - lower):
        raise StudyError(f"parameter {name!r}: the range from {lower:g} to {upper:g} is too wide for a float")
    return lower, upper


def settle_step(
    name: str, *, unit: str, kind: str, scale: str, lower: float, upper: float, step: float | None
) -> None:
    """Refuse bounds that are not whole (integer), not positive (log) or no whole number of steps apart."""
    if kind == "integer":
        if lower != int(lower) or upper != int(upper):
            raise StudyError(
                f"parameter {name!r} is 'integer' and needs whole bounds, got {lower:g} and {upper:g}"
            )
        if step is not None:
            raise StudyError(
                f"parameter {name!r} is 'integer' and takes no step; list its values as 'discrete'"
            )
        count = upper - lower
    elif step is not None:
        finite(name, "step", step)
        count = (upper - lower) / step if step > 0 else math.nan
        if not count > 0.5 or abs(count - round(count)) > 1e-6:
            came = f"lower={lower:g}, upper={upper:g} and step={step:g}{suffix(unit)}"
            raise StudyError(f"parameter {name!r}: whole steps must lead from lower to upper, got {came}")
    else:
        count = 0
    if scale == "log":
        if count:
            raise StudyError(f"parameter {name!r}: scale 'log' goes with kind 'continuous' without step")
        if lower <= 0:
            raise StudyError(f"parameter {name!r}: scale 'log' needs lower > 0, got {lower:g}{suffix(unit)}")
    if count > MOST_LEVELS:
        raise StudyError(
            f"parameter {name!r} has {count:.0f} levels, at most {MOST_LEVELS}; make it continuous"
        )


def _multiples(name: str, baseline: float | None, factor: Sequence[float]) -> tuple[float, float]:
    """The bounds of the multiplier form, in rising order."""
    if baseline is None or len(factor) != 2:
        raise StudyError(f"parameter {name!r} needs a baseline and two factors, such as [0.5, 2.0]")
    low, high = (finite(name, "factor", f) for f in factor)
    finite(name, "baseline", baseline)
    if not low < high or baseline == 0:
        came = f"factor=[{low:g}, {high:g}] and baseline={baseline:g}"
        raise StudyError(
            f"parameter {name!r} needs factor[0] < factor[1] and a baseline other than 0, got {came}"
        )
    first, second = (float(f"{baseline * f:.15g}") for f in (low, high))
    return min(first, second), max(first, second)
