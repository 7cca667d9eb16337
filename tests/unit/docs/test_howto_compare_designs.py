"""The snippet of the how-to on comparing designs runs and says what is claimed."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[3] / "docs" / "howto" / "compare-designs.md"


def test_the_snippet_runs(capsys):
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    exec(compile(code, str(PAGE), "exec"), {})
    text = capsys.readouterr().out
    assert "stiff gave no value in 30 of 100 scenarios" in text
    assert "and fails where soft is bad" in text
