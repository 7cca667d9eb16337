"""What a key of a study file needs, in words: one entry for every kind of refusal that pydantic has here.

pydantic speaks of strings, dictionaries and validation; whoever writes a study knows text, tables and lists.
"""

from collections.abc import Callable, Mapping
from typing import Any

__all__ = ["EXPECTED", "expected"]

Context = Mapping[str, Any]


def _items(most_or_least: str, key: str) -> Callable[[Context], str]:
    """Of a list, or of a table: how many entries it has to have."""

    def words(context: Context) -> str:
        count = context[key]
        one, many = ("entry", "entries") if context.get("field_type") == "Dictionary" else ("item", "items")
        return f"{most_or_least} {count} {one if count == 1 else many}"

    return words


def _pattern(context: Context) -> str:
    from workbench.study.schema import PATTERNS

    return PATTERNS[context["pattern"]]


# lists of tables, which are taken for one table of names or written with single brackets
ONE_EACH = (("parameter",), ("response",))
# type of an error of pydantic -> what was expected, from the context of the error
EXPECTED: dict[str, Callable[[Context], str]] = {
    "string_type": lambda c: "text in quotes",
    "string_too_short": lambda c: f"text of at least {c['min_length']} character{'s'[: c['min_length'] > 1]}",
    "string_too_long": lambda c: f"text of at most {c['max_length']} characters",
    "string_pattern_mismatch": _pattern,
    "int_type": lambda c: "a whole number",
    "int_from_float": lambda c: "a whole number",
    "float_type": lambda c: "a number",
    "finite_number": lambda c: "a finite number",
    "greater_than": lambda c: f"a number > {c['gt']:g}",
    "greater_than_equal": lambda c: f"a number >= {c['ge']}",
    "less_than": lambda c: f"a number < {c['lt']}",
    "less_than_equal": lambda c: f"a number <= {c['le']}",
    "bool_type": lambda c: "true or false",
    "list_type": lambda c: "a list in brackets",
    "too_short": _items("at least", "min_length"),
    "too_long": _items("at most", "max_length"),
    "dict_type": lambda c: "a table such as { name = value }",
    "model_type": lambda c: "a table such as { name = value }",
    "model_attributes_type": lambda c: "a table such as { name = value }",
    "literal_error": lambda c: str(c["expected"]),
    "value_error": lambda c: str(c["error"]),
}


def expected(error: Mapping[str, Any]) -> str:
    """What was expected where pydantic found an error; its own words where there are none of ours.

    >>> expected({"type": "too_short", "ctx": {"field_type": "List", "min_length": 2}, "msg": "..."})
    'at least 2 items'
    >>> expected({"type": "list_type", "loc": ("parameter",), "input": {"a": {}}, "msg": "..."})
    'a table [[parameter]] for each, with its name inside'
    """
    place = error.get("loc", ())
    if error["type"] == "list_type" and place in ONE_EACH and isinstance(error.get("input"), Mapping):
        return f"a table [[{place[0]}]] for each, with its name inside"
    words = EXPECTED.get(error["type"])
    return str(error["msg"]) if words is None else words(error.get("ctx", {}))
