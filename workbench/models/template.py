"""Decks with parameters: strict sandboxed Jinja2 (`{{ k }}`, `{{ k|fmt("%.8g") }}`) or Dakota's `{k}`.

A name that is no parameter is refused, and a template computes nothing but arithmetic: no functions, no
access to attributes, no repetition of text, no other files. Numbers are written with all their digits unless
a format says otherwise.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from workbench.errors import EvaluationFailed, StudyError

__all__ = ["Deck", "compiled", "format_value"]

LARGEST = 50_000_000  # characters of a deck, before and after
FORMAT = re.compile(r"%[-+ 0#]{0,3}[0-9]{0,3}(\.[0-9]{1,2})?[deEfgGs]")
OWN = frozenset({"self", "super", "loop", "caller", "varargs", "kwargs"})  # names that Jinja brings itself
BRACED = re.compile(r"(\\?)\{([^\W\d]\w*)\}")


@dataclass(frozen=True, slots=True)
class Deck:
    """A template that was read: called with the parameters it gives the deck, where those of `uses` stand."""

    render: Callable[[Mapping[str, Any]], str]
    uses: frozenset[str]

    def __call__(self, row: Mapping[str, Any]) -> str:
        """The deck of a run."""
        return self.render(row)


def compiled(text: str, names: Sequence[str], *, style: str, what: str) -> Deck:
    """A function from parameters to the deck.

    >>> compiled("K = {{ k|fmt('%.2e') }}", ["k"], style="jinja", what="deck")({"k": 1234.5})
    'K = 1.23e+03'

    Raises:
        StudyError: the template is malformed, or names what is no parameter.
    """
    if len(text) > LARGEST:
        raise StudyError(f"{what} has {len(text)} characters, at most {LARGEST}")
    return _dakota(text, names, what) if style == "dakota" else _jinja(text, names, what)


def format_value(value: Any, pattern: str = "") -> str:
    """A value in a deck: all digits, or by a printf pattern.

    >>> format_value(0.1), format_value(0.1, "%10.3f"), format_value("flat")
    ('0.1', '     0.100', 'flat')
    """
    if not pattern:
        return str(value) if isinstance(value, str | int) else repr(float(value))
    if not FORMAT.fullmatch(pattern):
        raise EvaluationFailed(f"format {pattern!r} is not of the form '%12.6g'")
    try:
        return pattern % value
    except (TypeError, ValueError) as exc:
        raise EvaluationFailed(f"format {pattern!r} does not fit {value!r}: {exc}") from None


def _dakota(text: str, names: Sequence[str], what: str) -> Deck:
    for escape, name in BRACED.findall(text):
        if not escape and name not in names:
            raise StudyError(
                f"{what} names {name!r}, which is no parameter{_near(name, names)}; \\{{{name}}} keeps it"
            )

    def render(row: Mapping[str, Any]) -> str:
        return BRACED.sub(lambda m: f"{{{m[2]}}}" if m[1] else format_value(row[m[2]]), text)

    return Deck(render, frozenset(name for escape, name in BRACED.findall(text) if not escape))


def _jinja(text: str, names: Sequence[str], what: str) -> Deck:
    import jinja2
    from jinja2 import meta, nodes
    from jinja2.exceptions import SecurityError
    from jinja2.sandbox import ImmutableSandboxedEnvironment

    environment = ImmutableSandboxedEnvironment(
        undefined=jinja2.StrictUndefined,
        autoescape=False,
        keep_trailing_newline=True,
        loader=None,
        finalize=_final,
    )
    environment.globals.clear()
    environment.filters = {"fmt": format_value, "abs": abs, "round": round, "int": int, "float": float}
    environment.tests = {k: environment.tests[k] for k in ("eq", "ne", "lt", "le", "gt", "ge", "equalto")}
    try:
        tree = environment.parse(text)
        used = meta.find_undeclared_variables(tree) | {
            n.name for n in tree.find_all(nodes.Name) if n.name in OWN
        }
        unknown = sorted(used - set(names))
        if unknown:
            raise StudyError(f"{what} names {unknown[0]!r}, which is no parameter{_near(unknown[0], names)}")
        _refuse(tree, what)
        template = environment.from_string(tree)
    except jinja2.TemplateSyntaxError as exc:
        raise StudyError(f"{what}, line {exc.lineno}: {exc.message}") from None
    except RecursionError:
        raise StudyError(f"{what} is nested too deeply") from None

    def render(row: Mapping[str, Any]) -> str:
        try:
            deck = template.render(row)
        except (jinja2.TemplateError, SecurityError, ArithmeticError, TypeError, ValueError) as exc:
            raise EvaluationFailed(f"{what}: {type(exc).__name__}: {exc}") from None
        return deck

    return Deck(render, frozenset(used))


def _refuse(tree: Any, what: str) -> None:
    """Refuse what could read elsewhere or grow without bound: names, arithmetic, filters and `if` remain."""
    from jinja2 import nodes

    refused: dict[Any, str] = {
        nodes.Getattr: "attributes",
        nodes.Getitem: "subscripts",
        nodes.Call: "calls",
        nodes.For: "loops",
        nodes.Macro: "macros",
        nodes.CallBlock: "call blocks",
        nodes.Import: "imports",
        nodes.FromImport: "imports",
        nodes.Include: "includes",
        nodes.Extends: "inheritance",
        nodes.Block: "blocks",
        nodes.Pow: "powers",
        nodes.Concat: "concatenation",
        nodes.List: "lists",
        nodes.Dict: "dictionaries",
    }
    for kind, word in refused.items():
        node = next(iter(tree.find_all(kind)), None)
        if node is not None:
            raise StudyError(
                f"{what}, line {node.lineno}: {word} are not for decks; compute in the model instead"
            )
    for node in tree.find_all(nodes.Mul):
        if any(
            isinstance(side, nodes.Const) and isinstance(side.value, str) for side in (node.left, node.right)
        ):
            raise StudyError(f"{what}, line {node.lineno}: text cannot be multiplied")


def _final(value: Any) -> Any:
    return format_value(value) if isinstance(value, float) else value


def _near(name: str, names: Sequence[str]) -> str:
    close = get_close_matches(name, names, n=1)
    return f". Did you mean {close[0]!r}?" if close else f"; the parameters are {', '.join(names)}"
