"""Docstrings that a re-wrap has torn: a word or two left alone in the middle of a paragraph."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[3]
FULL, ORPHAN = 92, 3
"""A line this long went to the margin; so few words on the next one were left over by a narrower wrap."""


def torn_lines(source: str) -> list[int]:
    """Numbers of the lines of docstrings that hold what was left of the line before, amid a paragraph."""
    found, rows = [], source.splitlines()
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        if ast.get_docstring(node, clean=False) is None:
            continue
        text = node.body[0].value  # type: ignore[attr-defined]
        lines = rows[text.lineno - 1 : text.end_lineno]
        found += [
            text.lineno + k
            for k, (before, line, after) in enumerate(zip(lines, lines[1:], lines[2:], strict=False), 1)
            if _is_torn(before, line, after)
        ]
    return found


def _is_torn(before: str, line: str, after: str) -> bool:
    words, margins = line.split(), [len(row) - len(row.lstrip()) for row in (before, line, after)]
    table_or_code = line.strip().startswith(("|", ">>>", "...")) or ":" in line or "=" in line
    goes_on = bool(after.strip()) and after.strip() != '"""'
    return (
        len(before) >= FULL
        and len(set(margins)) == 1
        and 0 < len(words) <= ORPHAN
        and goes_on
        and not table_or_code
    )


def test_no_docstring_is_torn():
    offences = [
        f"{path.relative_to(ROOT)}:{number}"
        for folder in ("workbench", "surrogates", "doe", "studies", "tests")
        for path in sorted((ROOT / folder).rglob("*.py"))
        for number in torn_lines(path.read_text(encoding="utf-8"))
    ]

    assert not offences, f"words left alone in the middle of a paragraph, wrap it anew: {offences}"


def test_a_torn_docstring_is_found_and_a_wrapped_one_is_not():
    full = "Error is relative to the continuous truth where the system has no joint, and to the discrete one,"
    torn = f'"""Title.\n\n{full}\nfor the\nothers.\n"""\n'
    wrapped = f'"""Title.\n\n{full}\nfor the others.\n"""\n'

    assert torn_lines(torn) == [4]
    assert torn_lines(wrapped) == []
