"""One uncertain input or one output of a model: name, unit, bounds, kind; and its map to [0, 1].

    continuous            p = lower + u (upper - lower), or geometric between the bounds (scale = "log")
    N ordered levels      p = level[floor(N u)]          equal shares of [0, 1) for every level
                          u = k/(N - 1) for level k      back: the first level at 0, the last at 1

so p -> u -> p is the identity, and corners of the cube are corners of the box. Levels are the whole numbers
of an integer, the multiples of a step, the two states of a binary, or the words of a categorical parameter.
"""

import keyword
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, fields
from typing import Any

import numpy as np

from workbench.errors import StudyError
from workbench.space.bounds import (
    Distribution,
    finite,
    settle_bounds,
    settle_levels,
    settle_step,
    suffix,
)
from workbench.space.units import told_apart

__all__ = ["KINDS", "SCALES", "Distribution", "Parameter", "Response"]

KINDS = ("continuous", "integer", "discrete", "binary", "categorical")
SCALES = ("linear", "log")
SLACK = 1e-9  # of the range: rounding allowed in a value that stands on a bound


@dataclass(frozen=True, slots=True)
class Parameter:
    """One uncertain input: name, bounds, unit and kind.

    Bounds come as `lower` and `upper`, as `baseline` with `factor` (two multipliers), or from the 0.1 % and
    99.9 % quantiles of `distribution`, which may be a mapping as a study file has it. Discrete and
    categorical ones have `levels` instead; a continuous one with `step` takes only the values lower,
    lower + step, ...

    >>> Parameter("grip", lower=350, upper=700, unit="N", step=7).levels_count
    51
    >>> stiffness = Parameter("k", baseline=12738.9, factor=(0.5, 2.0), unit="N/rad")
    >>> stiffness.lower, stiffness.upper
    (6369.45, 25477.8)
    """

    name: str
    _: KW_ONLY
    lower: float | None = None
    upper: float | None = None
    unit: str = "1"
    kind: str = "continuous"
    levels: tuple[Any, ...] = ()
    step: float | None = None
    scale: str = "linear"
    baseline: Any = None
    factor: tuple[float, float] | None = None
    label: str | None = None
    distribution: Distribution | None = None

    def __post_init__(self) -> None:
        check_name("parameter", self.name)
        for key, allowed in (("kind", KINDS), ("scale", SCALES)):
            if getattr(self, key) not in allowed:
                came = f"{key} is one of {', '.join(allowed)}, got {getattr(self, key)!r}"
                raise StudyError(f"parameter {self.name!r}: {came}")
        if self.distribution is not None:
            law = Distribution.of(self.distribution, parameter=self.name)
            object.__setattr__(self, "distribution", law)
        if self.kind in ("binary", "discrete", "categorical"):
            self._has_levels()
        else:
            self._has_bounds()

    @property
    def is_numeric(self) -> bool:
        """Whether the values are numbers (all kinds but categorical)."""
        return self.kind != "categorical"

    @property
    def levels_count(self) -> int | None:
        """The number of admissible values, None for a continuum."""
        if self.levels:
            return len(self.levels)
        if self.kind == "integer":
            return int(self._high - self._low) + 1
        return None if self.step is None else round((self._high - self._low) / self.step) + 1

    @property
    def unit_levels(self) -> np.ndarray | None:
        """The admissible unit coordinates k/(N - 1), None for a continuum."""
        n = self.levels_count
        return None if n is None else np.linspace(0.0, 1.0, n)

    def physical(self, u: np.ndarray) -> np.ndarray:
        """Values at the unit coordinates u (n,): numbers, or words of a categorical parameter."""
        u = np.asarray(u, dtype=float)
        outside = ~((u >= 0) & (u <= 1))
        if outside.any():
            raise StudyError(
                f"parameter {self.name!r}: unit coordinates lie in [0, 1], got {u[outside][0]:g}"
            )
        n = self.levels_count
        if n is not None:
            return self._level(np.minimum((u * n).astype(int), n - 1))
        low, high = self._low, self._high
        inside = low * (high / low) ** u if self.scale == "log" else low + u * (high - low)
        return np.where(u == 1, high, np.clip(inside, low, high))

    def unit_of(self, values: Iterable[Any]) -> np.ndarray:
        """Unit coordinates (n,) of physical values; the inverse of `physical`."""
        given = list(values)
        if self.levels:
            place = {level: k for k, level in enumerate(self.levels)}
            for value in given:
                if value not in place:
                    raise StudyError(f"parameter {self.name!r} takes {list(self.levels)}, got {value!r}")
            return np.array([place[v] for v in given], dtype=float) / (len(self.levels) - 1)
        p = self.check_inside(given)
        low, high, n = self._low, self._high, self.levels_count
        if n is not None:
            width = (high - low) / (n - 1)
            k = (p - low) / width
            astray = np.abs(k - np.rint(k)) > 1e-6
            if astray.any():
                steps = f"{low:g}, {low + width:g}, ..., {high:g}{suffix(self.unit)}"
                raise StudyError(f"parameter {self.name!r} takes {steps}, got {p[astray][0]:g}")
            return np.asarray(np.rint(k) / (n - 1))
        if self.scale == "log":
            return np.asarray(np.clip(np.log(p / low) / math.log(high / low), 0.0, 1.0))
        return np.asarray((p - low) / (high - low))

    def canonical(self, value: Any) -> Any:
        """The value as a model gets it: checked, of the right type, not rounded."""
        return self.canonical_values([value])[0]

    def canonical_values(self, values: Sequence[Any]) -> list[Any]:
        """`canonical` for many values."""
        plain = [value.item() if isinstance(value, np.generic) else value for value in values]
        self.unit_of(plain)
        if self.levels:
            own = {level: level for level in self.levels}
            return [own[value] for value in plain]
        return [round(value) for value in plain] if self.kind == "integer" else [float(v) for v in plain]

    def quantile(self, probability: np.ndarray) -> np.ndarray:
        """Values at probabilities (n,): by the distribution cut off at the bounds, else as `physical`."""
        if self.distribution is None:
            return self.physical(probability)
        law = self.distribution.frozen()
        a, b = law.cdf(self._low), law.cdf(self._high)
        inside: np.ndarray = law.ppf(a + np.asarray(probability, dtype=float) * (b - a))
        return np.asarray(np.clip(inside, self._low, self._high))

    def check_inside(self, given: Sequence[Any]) -> np.ndarray:
        """The values of a parameter with bounds as floats (n,); a hair outside counts as the bound.

        Raises: StudyError where one is no number, or lies outside.
        """
        for value in given:
            if isinstance(value, bool) or not isinstance(value, int | float | np.number):
                raise StudyError(f"parameter {self.name!r} needs numbers, got {value!r}")
        p = np.array(given, dtype=float)
        slack = SLACK * (self._high - self._low)
        outside = ~((p >= self._low - slack) & (p <= self._high + slack))
        if outside.any():
            low, high, came = told_apart(self._low, self._high, p[outside][0])
            raise StudyError(
                f"parameter {self.name!r} lies between {low} and {high}{suffix(self.unit)}, got {came}"
            )
        return np.asarray(np.clip(p, self._low, self._high))

    def to_dict(self) -> dict[str, Any]:
        """Plain types for JSON and TOML; `Parameter.from_dict` takes them back."""
        derived = (
            {"lower", "upper"} if self.factor is not None else {"levels"} if self.kind == "binary" else set()
        )
        out: dict[str, Any] = {}
        for f in fields(self):
            value = getattr(self, f.name)
            if value is None or value == f.default or f.name in derived:
                continue
            if isinstance(value, Distribution):
                value = {"name": value.name, **value.parameters}
            out[f.name] = list(value) if isinstance(value, tuple) else value
        return out

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "Parameter":
        """The parameter of a mapping as `to_dict` writes it."""
        given = dict(data)
        for name in ("levels", "factor"):
            if given.get(name) is not None:
                given[name] = tuple(given[name])
        try:
            return cls(**given)
        except TypeError as exc:
            raise StudyError(f"parameter {given.get('name')!r}: {exc}") from None

    @property
    def _low(self) -> float:
        assert self.lower is not None
        return self.lower

    @property
    def _high(self) -> float:
        assert self.upper is not None
        return self.upper

    def _level(self, k: np.ndarray) -> np.ndarray:
        if self.levels:
            return np.asarray(np.array(self.levels, dtype=None if self.is_numeric else object)[k])
        if self.kind == "integer":
            return np.asarray(k + int(self._low))
        assert self.step is not None
        # twelve digits: 0.1 + 2 * 0.1 is 0.3 for the user and for the key of the run
        used, place = np.unique(k, return_inverse=True)
        values = np.array([float(f"{self._low + i * self.step:.12g}") for i in used])
        return np.asarray(np.minimum(values, self._high)[place])

    def _has_levels(self) -> None:
        for name in ("lower", "upper", "step", "factor", "distribution"):
            if getattr(self, name) is not None:
                raise StudyError(f"parameter {self.name!r} of kind {self.kind!r} takes no {name}")
        if self.scale != "linear":
            raise StudyError(f"parameter {self.name!r} of kind {self.kind!r} takes no scale")
        object.__setattr__(self, "levels", settle_levels(self.name, self.kind, self.levels))
        if self.baseline is not None and self.baseline not in self.levels:
            came = f"baseline is one of {list(self.levels)}, got {self.baseline!r}"
            raise StudyError(f"parameter {self.name!r}: {came}")

    def _has_bounds(self) -> None:
        if self.levels:
            raise StudyError(f"parameter {self.name!r}: levels belong to kind 'discrete' or 'categorical'")
        if self.distribution is not None and (self.kind != "continuous" or self.step is not None):
            raise StudyError(f"parameter {self.name!r}: a distribution goes with 'continuous' without step")
        lower, upper = settle_bounds(
            self.name,
            unit=self.unit,
            lower=self.lower,
            upper=self.upper,
            baseline=self.baseline,
            factor=self.factor,
            distribution=self.distribution,
        )
        settle_step(
            self.name,
            unit=self.unit,
            kind=self.kind,
            scale=self.scale,
            lower=lower,
            upper=upper,
            step=self.step,
        )
        if self.kind == "integer":
            lower, upper = int(lower), int(upper)
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)
        if self.baseline is not None:
            self._check_baseline()

    def _check_baseline(self) -> None:
        """A value of the parameter, but where `factor` says how far the bounds lie from it."""
        given = finite(self.name, "baseline", self.baseline)
        if self.factor is not None:
            return
        try:
            self.check_inside([given])
        except StudyError as exc:
            raise StudyError(f"baseline = {given!r}: {exc}. Correct it, or widen the bounds") from None


@dataclass(frozen=True, slots=True)
class Response:
    """One output of a model: name and unit; `regimes` names the lower and the upper one where it switches."""

    name: str
    unit: str = "1"
    label: str | None = field(default=None, kw_only=True)
    regimes: tuple[str, str] | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        check_name("response", self.name)
        if self.regimes is not None and len(set(self.regimes)) != 2:
            raise StudyError(
                f"regimes of response {self.name!r} needs two different names, of the lower and of the upper "
                f"one, got {list(self.regimes)}"
            )

    def to_dict(self) -> dict[str, Any]:
        """Plain types."""
        out: dict[str, Any] = {"name": self.name, "unit": self.unit}
        if self.regimes is not None:
            out["regimes"] = list(self.regimes)
        return out if self.label is None else {**out, "label": self.label}


def check_name(what: str, name: Any) -> None:
    """Refuse a name that could not be a Python argument."""
    if isinstance(name, str) and keyword.iskeyword(name):
        raise StudyError(
            f"{what} name {name!r} is a word of Python's own, which no argument can be called; take another, "
            f"such as '{name}_'"
        )
    if not isinstance(name, str) or not name.isidentifier():
        raise StudyError(
            f"{what} name {name!r} needs letters, digits and underscores, not starting with a digit"
        )
