"""The snippets of the how-tos on systems and layouts run as they stand."""

import re
from pathlib import Path

import pytest

HOWTO = Path(__file__).parents[3] / "docs" / "howto"


@pytest.mark.parametrize(
    "page",
    [
        "build-a-multibody-system.md",
        "optimise-a-layout.md",
        "simulate-a-spatial-mechanism.md",
        pytest.param("build-a-spatial-system.md", marks=pytest.mark.slow),  # compiles for a minute
    ],
)
def test_the_snippets_run(page, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # they write files
    blocks = re.findall(r"```python\n(.*?)```", (HOWTO / page).read_text(), re.DOTALL)
    assert len(blocks) >= 2
    space: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), space)
    assert capsys.readouterr().out
