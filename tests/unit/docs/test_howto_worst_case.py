"""The snippets of the how-to on worst cases run one after another and say what is claimed."""

import re
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).parents[3] / "docs" / "howto" / "how-sure-is-this-worst-case.md"


@pytest.mark.slow
def test_the_snippets_run_in_order(capsys):
    names: dict[str, Any] = {}
    first, gradients, enclosed, several = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    exec(first, names)
    assert names["result"].value == 6.25
    assert names["result"].parameters["load"] == 5.0
    exec(gradients, names)
    assert 1 - names["result"].value < 1e-8
    exec(enclosed, names)
    assert names["certain"].value == pytest.approx(0.25, abs=1e-3)
    assert names["certain"].gap.closed
    exec(several, names)
    assert names["found"]["force"].value == 4.0
    assert names["found"]["travel"].value == pytest.approx(1.4)
    assert "of all cases" in capsys.readouterr().out
