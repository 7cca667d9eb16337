"""The snippets of the how-tos on screening and Kriging run, and print what the pages say."""

import re
from pathlib import Path

import pytest

HOWTO = Path(__file__).parents[3] / "docs" / "howto"
PAGES = {
    "choose-a-screening-method.md": r"\[2 4 7\] resolved: ",
    "read-a-screening-report.md": r"3 \(1, 5, 6\) 0\.0000 .* True",
    "when-it-says-not-resolved.md": r"16 runs are few for 10 inputs[\s\S]*\n\[0 1 3 4\] resolved",
    "fit-a-kriging-model.md": r"leave-one-out Q2 is 1\.000 \(good\)",
    "read-a-diagnosis.md": r"Runs run-3 and run-7 have equal inputs",
}


@pytest.mark.parametrize("page", PAGES)
def test_snippets_run_and_print(page, capsys):
    scope: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", (HOWTO / page).read_text(), re.DOTALL):
        exec(compile(block, page, "exec"), scope)
    assert re.search(PAGES[page], capsys.readouterr().out)
