"""Texts in CSV files for people who open them in a spreadsheet, which takes some for formulas."""

from typing import Any

__all__ = ["plain_cell", "spreadsheet_cell"]

BEGIN_FORMULAS = ("=", "+", "-", "@", "\t", "\r")


def spreadsheet_cell(value: Any) -> Any:
    """A cell that no spreadsheet computes: a text that begins like a formula gets an apostrophe in front.

    >>> spreadsheet_cell("=1+1"), spreadsheet_cell("steel"), spreadsheet_cell(-1.0), spreadsheet_cell("-1.5")
    ("'=1+1", 'steel', -1.0, '-1.5')
    """
    if not isinstance(value, str) or not value.startswith(BEGIN_FORMULAS):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value


def plain_cell(text: str) -> str:
    """The text of a cell as it was before `spreadsheet_cell`.

    >>> plain_cell("'=1+1"), plain_cell("'tis")
    ('=1+1', "'tis")
    """
    return text[1:] if text.startswith("'") and text[1:].startswith(BEGIN_FORMULAS) else text
