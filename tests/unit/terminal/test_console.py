"""Progress of a campaign on files and terminals."""

import io

from workbench.terminal.console import PlainProgress, RichProgress, progress_for


def test_plain_progress_is_few_lines():
    out = io.StringIO()
    progress = progress_for(out)
    assert isinstance(progress, PlainProgress)
    progress.stage("worst_case", "max y")
    for k in range(1, 101):
        progress.runs(k, 100, {"ok": k - 1, "failed": 1})
    progress.search(3, 60, proposal="ei", value=2.0, best=2.0, name="y", unit="mm")
    progress.search(4, 60, proposal="ei", value=1.0, best=2.0, name="y", unit="mm")
    progress.search(10, 60, proposal="even", value=1.0, best=float("inf"), name="y", unit="mm")
    progress.search(20, 60, proposal="start", value=None, best=float("nan"), name="y", unit="mm")
    progress.note("odd")
    progress.finished()
    lines = out.getvalue().splitlines()
    assert lines[0] == "worst case  max y"
    assert lines[1].startswith("  100/100 runs, ")
    assert lines[1].endswith("; 1 failed")
    assert lines[2:] == [
        "  run 3 of at most 60: worst so far y = 2 mm",
        "  run 10 of at most 60: the worst so far is a run that failed",
        "  run 20 of at most 60: no run has given a value so far",
        "note: odd",
    ]


def test_the_pace_is_that_of_the_runs_made_since_the_stage_began(monkeypatch):
    clock = iter([0.0, 0.0, 0.0, 20.0, 40.0])
    monkeypatch.setattr("workbench.terminal.console.time.monotonic", lambda: next(clock))
    out = io.StringIO()
    progress = progress_for(out)
    progress.stage("evaluate", "1000 runs, 100 of them known")
    for done in (100, 300, 1000):
        progress.runs(done, 1000, {"ok": done})
    assert out.getvalue().splitlines()[1:] == [
        "  300/1000 runs, 10 runs/s, 70 s left",
        "  1000/1000 runs, 22.5 runs/s",
    ]


def test_no_time_left_is_told_from_the_first_answer_which_holds_the_start_of_the_workers(monkeypatch):
    clock = iter([0.0, 0.0, 0.0, 32.0, 38.0, 40.0])
    monkeypatch.setattr("workbench.terminal.console.time.monotonic", lambda: next(clock))
    out = io.StringIO()
    progress = progress_for(out)
    progress.stage("evaluate", "64 runs, 0 of them known")
    for done in (0, 1, 34, 64):
        progress.runs(done, 64, {"ok": done})
    assert out.getvalue().splitlines()[1:] == [
        "  1/64 runs, 1.88 runs/min",
        "  34/64 runs, 0.895 runs/s, 34 s left",
        "  64/64 runs, 1.6 runs/s",
    ]


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
    progress.search(1, 60, proposal="ei", value=2.0, best=2.0, name="y", unit="mm")
    progress.finished()
    text = out.getvalue()
    assert "5/10" in text
    assert "1 killed" in text
    assert "worst so far y = 2 mm" in text
