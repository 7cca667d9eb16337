"""The browser's check is itself checked: it must see what a bad page does."""

import pytest

from tests.browser import needs_browser, visit


@pytest.mark.browser
@needs_browser
def test_requests_and_messages_of_a_bad_page_are_seen(tmp_path):
    page = tmp_path / "bad.html"
    page.write_text(
        '<img src="http://picture.invalid/a.png"><script>console.warn("hello"); missing()</script>'
    )
    seen = visit(page)
    assert seen.asked == ["http://picture.invalid/a.png"]
    assert any("hello" in line for line in seen.console)
    assert any("missing is not defined" in line for line in seen.console)
