"""Pages show the tables of the code as they are."""

import pytest

from tests.tables import DOCS, TABLES, page_with_table


@pytest.mark.parametrize("page", TABLES)
def test_the_page_shows_the_table(page):
    assert (DOCS / page).read_text() == page_with_table(page), "run: python -m tests.tables --write"
