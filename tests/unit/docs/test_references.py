"""Pages, docstrings and comments speak only of paths and names that exist."""

from pathlib import Path

import pytest

from tests.references import missing_names, missing_paths, said, texts

ROOT = Path(__file__).parents[3]
HERE = ROOT / "docs" / "index.md"


def test_every_path_and_name_that_is_written_exists():
    missing = [
        f"{file.relative_to(ROOT)}: {name}"
        for file, text in texts(ROOT)
        for name in (*missing_paths(text, file, ROOT), *missing_names(text, ROOT))
    ]
    assert missing == []


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        ("see `workbench/search/a.py` and tests/unit/attic.", ["workbench/search/a.py", "tests/unit/attic"]),
        ("[a](howto/attic.md), [b](notation.md#greek), [c](https://example.org/a.md)", ["howto/attic.md"]),
        ("workbench/search/worst_case.py, doe/latin/, tests/unit/space/test_*.py", []),
        ("workbench.search.attic.find, doe.lhs, workbench.engine.Body.name", ["workbench.search.attic.find"]),
        ("workbench.worst_case is a function, and no module hides it", []),
        ("the style `workbench.style`, a user's doe.py, my_study.holdfast/runs.sqlite", []),
    ],
)  # fmt: skip
def test_what_leads_nowhere_is_found(text, missing):
    assert [*missing_paths(text, HERE, ROOT), *missing_names(text, ROOT)] == missing


def test_docstrings_and_comments_are_read_and_code_is_not():
    code = '"""Module doe.a."""\nx = "doe.b"  # doe.c\nclass A:\n    """Class doe.d."""\n'
    assert [name for name in ("doe.a", "doe.b", "doe.c", "doe.d") if name in said(code)] == [
        "doe.a", "doe.c", "doe.d",
    ]  # fmt: skip
