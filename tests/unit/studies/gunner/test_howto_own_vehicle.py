"""The snippets of the how-to on an own vehicle run as they stand."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[4] / "docs" / "howto" / "put-your-own-vehicle.md"


def test_the_snippets_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) == 3
    space: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, PAGE.name, "exec"), space)
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].startswith("20.0 ")
    assert "vehicle.front.anti_roll" in printed[1]
    assert 0.0 < float(printed[-1]) < 10.0
