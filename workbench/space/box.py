"""Parameters in order, with names, bounds, units and constraints: the box that a study is about.

Samplers and surrogates work in the unit cube, models get physical values by name; `Space` maps between
them. The map of one parameter stands in `workbench.space.parameter`.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import Any

import numpy as np

from workbench.errors import StudyError
from workbench.space.expression import Condition
from workbench.space.parameter import Distribution, Parameter, Response

__all__ = ["Distribution", "Parameter", "Response", "Space", "need_space"]

SHORT = 60  # characters of a value that is quoted
FORM = "Space([Parameter('k', lower=1, upper=5)])"


@dataclass(frozen=True)
class Space:
    """Parameters in order, with conditions on them.

    >>> space = Space([Parameter("k", lower=1, upper=5, unit="N/m"), Parameter("hands", kind="binary")])
    >>> space.rows([[0.25, 0.9]])
    [{'k': 2.0, 'hands': 1}]
    >>> space.unit([{"k": 2.0, "hands": 1}])
    array([[0.25, 1.  ]])
    """

    parameters: tuple[Parameter, ...]
    constraints: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", _listed_parameters(self.parameters))
        if isinstance(self.constraints, str):
            raise StudyError(
                f"constraints needs a list of conditions, got the text {self.constraints!r}; "
                "put it in brackets"
            )
        object.__setattr__(self, "constraints", tuple(self.constraints))
        if not self.parameters:
            raise StudyError("a space needs at least one parameter")
        seen: set[str] = set()
        for name in self.names:
            if name in seen:
                raise StudyError(f"parameter {name!r} is given twice; every name may stand once")
            seen.add(name)
        assert self.conditions is not None  # parsed now, so that a wrong one is refused here

    @cached_property
    def conditions(self) -> tuple[Condition, ...]:
        """The constraints, parsed."""
        return tuple(Condition(text, names=self.names) for text in self.constraints)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Parameter names in order."""
        return tuple(p.name for p in self.parameters)

    @property
    def units(self) -> tuple[str, ...]:
        """Units in the order of the names."""
        return tuple(p.unit for p in self.parameters)

    @property
    def dimension(self) -> int:
        """The number of parameters."""
        return len(self.parameters)

    @property
    def unit_levels(self) -> list[np.ndarray | None]:
        """Per parameter the admissible unit coordinates, None for a continuum."""
        return [p.unit_levels for p in self.parameters]

    @property
    def label_columns(self) -> tuple[int, ...]:
        """Places of the categorical parameters, whose values have no order."""
        return tuple(k for k, p in enumerate(self.parameters) if not p.is_numeric)

    def __getitem__(self, name: str) -> Parameter:
        for p in self.parameters:
            if p.name == name:
                return p
        raise StudyError(f"no parameter {name!r}; the parameters are {', '.join(self.names)}")

    def physical(self, unit_points: Any) -> np.ndarray:
        """Physical values (n, d) at unit points (n, d): floats; objects when one is categorical."""
        columns = self._columns(unit_points)
        return self._table([p.physical(c) for p, c in zip(self.parameters, columns, strict=True)])

    def unit(self, physical: Any) -> np.ndarray:
        """Unit points (n, d) of physical values: an array (n, d), or rows as mappings."""
        given = list(physical)
        table = [self._values(row) if isinstance(row, Mapping) else list(row) for row in given]
        for row in table:
            self._check_width(len(row))
        if not table:
            return np.empty((0, self.dimension))
        columns = [p.unit_of([row[j] for row in table]) for j, p in enumerate(self.parameters)]
        return np.ascontiguousarray(np.column_stack(columns))

    def rows(self, unit_points: Any) -> list[dict[str, Any]]:
        """What a model is called with: one mapping of plain Python values per unit point."""
        columns = self._columns(unit_points)
        values = [p.physical(c).tolist() for p, c in zip(self.parameters, columns, strict=True)]
        return [dict(zip(self.names, row, strict=True)) for row in zip(*values, strict=True)]

    def canonical(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """`row` in the space's order with checked values of the right type, untouched otherwise.

        >>> Space([Parameter("n", lower=0, upper=9, kind="integer")]).canonical({"n": 3.0})
        {'n': 3}
        """
        values = self._values(row)
        return {p.name: p.canonical(v) for p, v in zip(self.parameters, values, strict=True)}

    def canonical_rows(self, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
        """`canonical` for many rows, column by column."""
        columns = list(zip(*(self._values(row) for row in rows), strict=True))
        if not columns:
            return []
        checked = [p.canonical_values(c) for p, c in zip(self.parameters, columns, strict=True)]
        return [dict(zip(self.names, values, strict=True)) for values in zip(*checked, strict=True)]

    def snap(self, unit_points: Any) -> np.ndarray:
        """The unit points (n, d) with every levelled coordinate moved to the position of its level."""
        out = np.array(self._columns(unit_points)).T.copy()
        for j, p in enumerate(self.parameters):
            n = p.levels_count
            if n is not None:
                out[:, j] = np.minimum((out[:, j] * n).astype(int), n - 1) / max(n - 1, 1)
        return np.ascontiguousarray(out)

    def quantile(self, probabilities: Any) -> np.ndarray:
        """Physical values (n, d) distributed as the parameters are, at probabilities (n, d)."""
        columns = self._columns(probabilities)
        return self._table([p.quantile(c) for p, c in zip(self.parameters, columns, strict=True)])

    def violated(self, row: Mapping[str, Any]) -> str | None:
        """The first constraint that `row` does not meet, or None."""
        return next((c.text for c in self.conditions if not c.holds(row)), None)

    def feasible(self, unit_points: Any) -> np.ndarray:
        """Which of the unit points (n, d) meet all constraints: (n,) of bool."""
        if not self.conditions:
            return np.ones(len(unit_points), dtype=bool)
        return np.array([self.violated(row) is None for row in self.rows(unit_points)], dtype=bool)

    @property
    def hash(self) -> str:
        """A digest of names, bounds, units, kinds and constraints; labels do not enter."""
        data = self.to_dict()
        for p in data["parameters"]:
            p.pop("label", None)
        text = json.dumps(data, sort_keys=True, separators=(",", ":"))
        return blake2b(text.encode(), digest_size=16).hexdigest()

    def to_dict(self) -> dict[str, Any]:
        """Plain types for JSON and TOML; `Space.from_dict` takes them back."""
        out: dict[str, Any] = {"parameters": [p.to_dict() for p in self.parameters]}
        return {**out, "constraints": list(self.constraints)} if self.constraints else out

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "Space":
        """The space of a mapping as `to_dict` writes it."""
        return cls(
            tuple(Parameter.from_dict(p) for p in data["parameters"]), tuple(data.get("constraints", ()))
        )

    def _columns(self, unit_points: Any) -> list[np.ndarray]:
        u = np.asarray(unit_points, dtype=float)
        if u.ndim != 2:
            raise StudyError(
                f"unit points form a table (n, {self.dimension}), got an array of shape {u.shape}"
            )
        self._check_width(u.shape[1])
        return list(u.T)

    def _table(self, columns: list[np.ndarray]) -> np.ndarray:
        numeric = all(p.is_numeric for p in self.parameters)
        out = np.empty((len(columns[0]), self.dimension), dtype=float if numeric else object)
        for j, column in enumerate(columns):
            out[:, j] = column
        return out

    def _check_width(self, columns: int) -> None:
        if columns != self.dimension:
            names = ", ".join(self.names)
            raise StudyError(
                f"a row has {columns} columns but the space has {self.dimension} parameters: {names}"
            )

    def _values(self, row: Mapping[str, Any]) -> list[Any]:
        if tuple(row) == self.names:
            return list(row.values())
        missing = [n for n in self.names if n not in row]
        stray = [n for n in row if n not in self.names]
        if missing or stray:
            raise StudyError(f"a row needs every parameter once; missing {missing}, not in the space {stray}")
        return [row[n] for n in self.names]


def need_space(given: Any, *, name: str) -> None:
    """Refuse what is no space, under the name of its argument.

    Raises: StudyError.
    """
    if not isinstance(given, Space):
        raise StudyError(f"{name} needs a Space of parameters, such as {FORM}, got {_told(given)}")


def _listed_parameters(given: Any) -> tuple[Parameter, ...]:
    """The parameters as a tuple; a list of anything else is refused with its first stranger."""
    if isinstance(given, Parameter | str | Mapping) or not isinstance(given, Iterable):
        raise StudyError(f"a space needs a list of parameters, such as {FORM}, got {_told(given)}")
    parameters = tuple(given)
    for place, one in enumerate(parameters):
        if not isinstance(one, Parameter):
            raise StudyError(f"a space needs parameters, such as {FORM}, got {_told(one)} in place {place}")
    return parameters


def _told(given: Any) -> str:
    """What came, short: the type, and the value where it fits into a line."""
    return f"a {type(given).__name__}" + (f" {given!r}" if len(repr(given)) < SHORT else "")
