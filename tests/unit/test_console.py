"""What is printed: the screening path like Table 3.1, the worst case, progress on files and terminals."""

import io

from workbench.console import (
    PlainProgress,
    RichProgress,
    format_number,
    progress_for,
    screening_lines,
    worst_case_lines,
)

MANY = [f"x{k}" for k in range(1, 31)]
PATH = {
    "response": "y",
    "unit": "mm",
    "method": "forward",
    "n_left_out": 2,
    "verdict": "",
    "selected": ["x12", "x19"],
    "path": [
        dict(step=1, selected=["x12"], theta_common=0.3883, sigma2=2.2305, log_likelihood=-50.1679),
        dict(step=2, selected=MANY, theta_common=0.1211, sigma2=2.5108, log_likelihood=-44.1308) | {"accepted": False},
    ],
}  # fmt: skip


def test_the_screening_path_has_the_form_of_table_3_1():
    text = screening_lines(PATH)
    assert text[0] == "Screening of y [mm]: forward"
    assert text[1].split() == [
        "step",
        "selected",
        "so",
        "far",
        "theta",
        "sigma^2",
        "restricted",
        "log-likelihood",
    ]
    assert text[3].split() == ["1", "x12", "0.3883", "2.2305", "-50.1679"]
    assert max(map(len, text)) <= 80
    assert "selected: x12, x19" in text
    assert any("(not accepted)" in line for line in text)
    assert text[-1] == "2 runs without a value were left out"


def test_the_worst_case_says_what_it_rests_on():
    document = {
        "response": "y", "unit": "mm", "sense": "max", "value": 13.31251, "label": "confirmed by a true run",
        "evaluations": 41, "budget": 60, "parameters": {"k": 2.0, "road": "bump"}, "failures": {"failed": 2},
        "gap": {"upper": 14.2, "width": 0.9, "kind": "model-based"},
    }  # fmt: skip
    text = "\n".join(worst_case_lines(document))
    assert "Worst case (largest y): 13.3125 mm" in text
    assert "confirmed by a true run; 41 runs of at most 60" in text
    assert "could be as far as 14.2 mm (model-based bound, not a proof)" in text
    assert "runs without a value: 2 failed" in text
    assert "  road = bump" in text


def test_plain_progress_is_few_lines():
    out = io.StringIO()
    progress = progress_for(out)
    assert isinstance(progress, PlainProgress)
    progress.stage("worst_case", "max y")
    for k in range(1, 101):
        progress.runs(k, 100, {"ok": k - 1, "failed": 1})
    progress.search(3, 60, "ei", 2.0, 2.0, "y", "mm")
    progress.search(4, 60, "ei", 1.0, 2.0, "y", "mm")
    progress.note("odd")
    progress.finished()
    lines = out.getvalue().splitlines()
    assert lines[0] == "worst case  max y"
    assert lines[1].startswith("  100/100 runs, ")
    assert lines[1].endswith("; 1 failed")
    assert lines[2:] == ["  run 3 of at most 60: worst so far y = 2 mm", "note: odd"]


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_terminal_gets_a_bar(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    out = Terminal()
    progress = progress_for(out)
    assert isinstance(progress, RichProgress)
    progress.stage("evaluate", "10 runs")
    progress.runs(1, 10, {"ok": 1})
    progress.runs(5, 10, {"ok": 4, "killed": 1})
    progress.finished()
    progress.search(1, 60, "ei", 2.0, 2.0, "y", "mm")
    progress.finished()
    text = out.getvalue()
    assert "5/10" in text
    assert "1 killed" in text
    assert "worst so far y = 2 mm" in text


def test_numbers_are_short():
    assert [format_number(x) for x in (13.3125, -1e-9, 123456.7, 0.0)] == [
        "13.312",
        "-1e-09",
        "1.2346e+05",
        "0",
    ]
