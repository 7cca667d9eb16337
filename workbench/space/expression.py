"""Arithmetic conditions on named parameters, `"rw < 0.1 * r"`: parsed, never evaluated as Python code.

Allowed: numbers, quoted words, parameter names, + - * / **, parentheses, comparisons (chains too), and, or,
not, and the functions abs, min, max, sqrt, exp, log. Nothing else gets past the parser.
"""

import ast
import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from workbench.errors import StudyError

__all__ = ["Condition"]

_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": abs,
    "min": min,
    "max": max,
    "sqrt": math.sqrt,
    "exp": math.exp,
    "log": math.log,
}
LONGEST = 1000  # characters; a condition is a line, not a program


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition that admissible parameters meet.

    >>> Condition("a + b <= 1", names=("a", "b")).holds({"a": 0.25, "b": 0.5})
    True
    """

    text: str
    names: tuple[str, ...] = field(kw_only=True)
    _tree: ast.expr = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if len(self.text) > LONGEST:
            raise StudyError(f"a constraint may have {LONGEST} characters, this one has {len(self.text)}")
        try:
            tree = ast.parse(self.text.strip(), mode="eval").body
            self._check(tree)
        except (SyntaxError, ValueError, RecursionError, MemoryError) as exc:
            if isinstance(exc, StudyError):
                raise
            raise StudyError(f"constraint {self.text!r} is not a condition such as 'a + b <= 1'") from None
        if not isinstance(tree, ast.Compare | ast.BoolOp) and not _is_not(tree):
            raise StudyError(f"constraint {self.text!r} has no comparison; write one such as 'a + b <= 1'")
        object.__setattr__(self, "_tree", tree)

    def holds(self, row: Mapping[str, Any]) -> bool:
        """Whether `row` meets the condition; where the arithmetic has no value (log of 0) it does not."""
        try:
            return bool(_value(self._tree, row))
        except (ArithmeticError, ValueError, TypeError):
            return False

    @property
    def used(self) -> frozenset[str]:
        """The parameters that the condition is about.

        >>> sorted(Condition("max(a, b) <= 1", names=("a", "b", "c")).used)
        ['a', 'b']
        """
        nodes = list(ast.walk(self._tree))
        called = {id(node.func) for node in nodes if isinstance(node, ast.Call)}
        return frozenset(node.id for node in nodes if isinstance(node, ast.Name) and id(node) not in called)

    def _check(self, node: ast.expr) -> None:
        match node:
            case ast.Constant(value=bool()):
                pass
            case ast.Constant(value=int() | float() | str()):
                return
            case ast.Name(id=name):
                if name in self.names:
                    return
                raise StudyError(
                    f"constraint {self.text!r} names {name!r}; the parameters are {', '.join(self.names)}"
                )
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY or isinstance(op, ast.Pow):
                return self._check_all(left, right)
            case ast.UnaryOp(op=ast.USub() | ast.UAdd() | ast.Not(), operand=operand):
                return self._check(operand)
            case ast.BoolOp(values=values):
                return self._check_all(*values)
            case ast.Compare(left=left, ops=ops, comparators=others) if all(type(o) in _COMPARE for o in ops):
                return self._check_all(left, *others)
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in _FUNCTIONS and args:
                return self._check_all(*args)
        raise StudyError(
            f"constraint {self.text!r} contains {ast.unparse(node)!r}; only numbers, parameter names, "
            f"+ - * / **, comparisons, and/or/not and {', '.join(sorted(_FUNCTIONS))} are allowed"
        )

    def _check_all(self, *nodes: ast.expr) -> None:
        for node in nodes:
            self._check(node)


def _is_not(node: ast.expr) -> bool:
    return isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not)


def _value(node: ast.expr, row: Mapping[str, Any]) -> Any:
    match node:
        case ast.Constant(value=value):
            return value
        case ast.Name(id=name):
            return row[name]
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return math.pow(_value(left, row), _value(right, row))  # floats: no astronomically long integers
        case ast.BinOp(left=left, op=op, right=right):
            return _BINARY[type(op)](_value(left, row), _value(right, row))
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return not _value(operand, row)
        case ast.UnaryOp(op=op, operand=operand):
            value = _value(operand, row)
            return -value if isinstance(op, ast.USub) else value
        case ast.BoolOp(op=op, values=values):
            test = all if isinstance(op, ast.And) else any
            return test(_value(v, row) for v in values)
        case ast.Compare(left=left, ops=ops, comparators=others):
            terms = [_value(n, row) for n in (left, *others)]
            return all(_COMPARE[type(o)](a, b) for o, a, b in zip(ops, terms[:-1], terms[1:], strict=True))
        case ast.Call(func=ast.Name(id=name), args=args):
            return _FUNCTIONS[name](*(_value(a, row) for a in args))
    raise AssertionError(f"the parser let {ast.dump(node)} through")
