"""A sample beyond the bound sends the loop back: it goes on with its rounds, layouts and cases."""

import json

import pytest

from tests.sample_layout import changed, run
from workbench.robust_layout.loop import RESTARTS, _Loop
from workbench.stages import robust_layout as robust_layout_stage

SHORT = changed("rounds = 5", "rounds = 2", changed("evaluations = 30", "evaluations = 10"))
SAMPLES = [{"u": -0.95, "v": 0.25}, {"u": 0.85, "v": 0.75}, {"u": 0.5, "v": 0.5}]


def broken_by(samples, monkeypatch, results):
    """Let these samples break the result, one after the other, and keep every result."""
    left = iter(samples)

    def broken(compared, found, tolerance):
        results.append(found)
        return next(left, None)

    monkeypatch.setattr(robust_layout_stage, "_broken", broken)


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 3])
def test_rounds_go_on_and_every_layout_that_was_made_judges_and_is_judged(tmp_path, monkeypatch, count):
    results = []
    broken_by(SAMPLES[:count], monkeypatch, results)
    found, folder = run(tmp_path, SHORT)
    assert len(results) == 1 + min(count, RESTARTS)
    assert found["broken_by_samples"] == (count > RESTARTS)
    numbers = [r["number"] for r in found["rounds"]]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) > len(results[0].rounds)
    for sample in SAMPLES[: min(count, RESTARTS)]:
        assert sample in found["cases"]
    named = {tuple(kept["density"]) for kept in found["layouts"].values()}
    for earlier in results:
        assert {tuple(density.tolist()) for density in earlier.layouts.values()} <= named
    assert all(len(kept["values"]) == len(found["cases"]) for kept in found["layouts"].values())
    best = min(kept["worst"] for kept in found["layouts"].values())
    assert found["worst"] <= best * 1.01  # half of the tolerance
    kept = [json.loads(file.read_text())["density"] for file in (folder / "layouts").glob("*.json")]
    assert {tuple(density) for density in kept} <= named


@pytest.mark.slow
def test_as_many_rounds_are_left_again_and_no_more(tmp_path, monkeypatch):
    """No layout ever holds."""
    results, begun = [], []
    broken_by(SAMPLES, monkeypatch, results)
    again = _Loop.again
    monkeypatch.setattr(_Loop, "limit", lambda loop, bound: 0.5 * bound)
    monkeypatch.setattr(
        _Loop, "again", lambda loop, case: begun.append(len(loop.rounds)) or again(loop, case)
    )
    found, _ = run(tmp_path, SHORT)
    assert begun == [2, 4]
    assert len(found["rounds"]) == 6
    assert [len(one.rounds) for one in results] == [2, 4, 6]  # an earlier result stays what it was
