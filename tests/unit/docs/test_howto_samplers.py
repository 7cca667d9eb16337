"""The Python lines of the page on samplers run as they stand."""

import re
from pathlib import Path

HOWTO = Path(__file__).parents[3] / "docs" / "howto"


def test_the_page_runs_and_shows_what_it_says(capsys):
    text = (HOWTO / "choose-a-sampler.md").read_text()
    scope: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "choose-a-sampler.md", "exec"), scope)
    first, *rest = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"smallest distance 1\.6\d\d, beats 100 % of random designs", first)
    assert [line.split(":")[0] for line in rest] == ["phi_p", "cd2"]
