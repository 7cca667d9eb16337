"""The Python lines of the how-to pages on designs run as they stand."""

import re
from pathlib import Path

import pytest

HOWTO = Path(__file__).parents[3] / "docs" / "howto"


@pytest.mark.parametrize(
    ("page", "printed"),
    [
        ("get-a-d-optimal-design.md", ["D = 46.3 %", "15 True"]),
        ("use-real-factors.md", ["[6, 6, 6, 6]", "4"]),
        ("grow-a-design.md", ["12 r0018 24 ('r0003', 'r0007')", "True"]),
    ],
)
def test_a_page_prints_what_it_says(page, printed, capsys):
    text = (HOWTO / page).read_text()
    scope: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, page, "exec"), scope)
    assert capsys.readouterr().out.splitlines() == printed
