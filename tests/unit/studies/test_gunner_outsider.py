"""The outsider who tries the layouts of a finished loop, and who is counted as retained."""

from importlib.resources import files
from inspect import getsource
from shutil import copy

import numpy as np
import pytest

from studies import gunner_outsider as module
from studies.gunner_outsider import corners_at_once, lines, loop_of, main, tried
from studies.loop_rivals import drawn_case
from workbench.errors import StudyError
from workbench.robust_layout.model import load_layout_model
from workbench.study.loading import load_study
from workbench.system.atomic import write_json

FILE = files("studies.gunner.restraints") / "restraint_rollover.toml"
SPACE = load_study(str(FILE)).space
NOMINAL = load_study(str(FILE)).robust_layout["nominal"]


class Slope:
    """A deviation that grows with mass over what holds him; without hands and with a heavy man he leaves."""

    response, unit = "deviation", "m"

    def responses(self, density, case):
        heavy = (case["mass"] - 60.0) / 35.0
        leaves = case["hands"] == "none" and heavy > density[0]
        return {"deviation": 0.1 + heavy + 2.0 * leaves, "ejected": float(leaves)}


def a_loop(worst=1.1):
    held = {"robust": 0.99, "nominal only": 0.5, "uniform": 0.0}
    return {
        "cases": [dict(NOMINAL)],
        "layouts": {name: {"density": [a, 0.0], "worst": worst} for name, a in held.items()},
    }


def test_the_outsider_finds_the_cliff_and_counts_who_stays():
    found = {one.name: one for one in tried(Slope(), SPACE, a_loop(), budget=600, seed=6)}
    assert list(found) == ["robust", "nominal only", "uniform"]
    for one in found.values():  # all fall off somewhere, the robust one in its last hundredth
        assert one.over_all == pytest.approx(3.1, abs=0.02)
        assert one.beyond == pytest.approx(3.1 / 1.1 - 1.0, abs=0.03)
        assert one.of_the_box.draws == 150
    # a third of the box has no hands: of it a hundredth, half and all leave
    assert found["robust"].of_the_box.hits >= 147
    assert found["nominal only"].of_the_box.hits == pytest.approx(125, abs=15)
    assert found["uniform"].of_the_box.hits == pytest.approx(100, abs=18)
    assert found["robust"].cases[0] > found["uniform"].cases[0]
    told = lines(list(found.values()), "m")
    assert told[0].startswith("robust        stated 1.1000  outsider 3.")
    assert f"retained {found['uniform'].of_the_box.hits} of 150 (" in told[2]


def test_an_outsider_at_the_longer_step_is_believed_by_a_true_run_alone():
    """What the longer step exaggerates by a third is not told, and few true runs are made."""

    class Coarse(Slope):
        made = 0

        def responses(self, density, case):
            self.made += 1
            return super().responses(density, case)

        def coarsened(self, density, cases, *, threads):
            runs = [Slope.responses(self, density, case) for case in cases]
            return [{"deviation": 1.3 * run["deviation"]} for run in runs]

    model = Coarse()
    found = tried(model, SPACE, a_loop(), budget=600, seed=6, rivals=300, of_the_box=5, coarse=True)
    for one in found:
        assert one.met == pytest.approx(3.1, abs=0.02)
        assert one.over_all == pytest.approx(3.1, abs=0.02)
    assert model.made <= 3 * (5 + 1 + 4)  # of each layout the box, its own worst, and the cases of all


def test_a_run_that_fails_does_not_count_as_retained():
    class Fails(Slope):
        def responses(self, density, case):
            if case["hands"] == "both":
                raise ArithmeticError("no value")
            return {"deviation": 0.3, "ejected": 0.0}

    (one, *_) = tried(Fails(), SPACE, a_loop(worst=0.3), budget=200, seed=3)
    assert 20 <= one.of_the_box.hits <= 45  # of 50, a third fails
    assert one.beyond == 0.0


def test_corners_at_once_stand_beside_where_they_are_asked_for(monkeypatch):
    said = {}

    def made(model, space, loop, *, evaluations, seed):
        said.update(evaluations=evaluations, seed=seed)
        return np.array([0.7, 0.0]), 0.9

    monkeypatch.setattr(module, "corners_at_once", made)
    found = tried(Slope(), SPACE, a_loop(), budget=120, seed=6, rivals=30, of_the_box=20, corners=7)
    assert [one.name for one in found] == ["robust", "nominal only", "uniform", module.AT_ONCE]
    assert (said, found[-1].stated) == ({"evaluations": 7, "seed": 6}, 0.9)
    assert {one.of_the_box.draws for one in found} == {20}
    assert found[-1].runs <= 120 + 3 * 30 + 4 * (20 + 10)


@pytest.mark.slow
def test_corners_are_made_from_the_nominal_layout_and_are_no_worse(monkeypatch):
    model = load_layout_model(
        "studies.gunner.restraints.model:restraint",
        {"on": "rollover", "t_end": 0.4, "step": 1.25e-3, "airbags": 9.0},
    )
    monkeypatch.setattr(module, "CORNERS", 2)
    start = np.full(model.members, 9.0 / 180.0)
    loop = {"cases": [dict(NOMINAL)], "layouts": {"nominal only": {"density": start.tolist()}}}
    density, value = corners_at_once(model, SPACE, loop, evaluations=3, seed=2)
    rng = np.random.default_rng([2, 50])
    cases = [dict(NOMINAL), *(drawn_case(SPACE, rng, corner=True) for _ in range(2))]
    assert value == pytest.approx(
        max(model.responses(density, case)["deviation"] for case in cases), rel=1e-3
    )
    assert value <= max(model.responses(start, case)["deviation"] for case in cases) * (1 + 1e-9)


def test_the_outsider_shares_no_code_with_the_adversary():
    assert "adversary" not in getsource(module).replace("studies.adversary", "")


def test_a_loop_is_read_beside_its_study(tmp_path, monkeypatch, capsys):
    study = tmp_path / "mine.toml"
    copy(str(FILE), study)
    with pytest.raises(
        StudyError, match=r"no robust layout in .*mine\.holdfast: run `holdfast run mine.toml`"
    ):
        loop_of(study)
    bare = tmp_path / "bare.toml"
    bare.write_text(study.read_text().split("[robust_layout]")[0])
    with pytest.raises(StudyError, match=r"bare.toml has no \[robust_layout\]: there is no layout to try"):
        loop_of(bare)
    folder = tmp_path / "mine.holdfast"
    folder.mkdir()
    write_json(folder / "robust_layout.json", a_loop())
    model, space, loop = loop_of(study)
    assert (model.on, space.names) == ("rollover", SPACE.names)
    monkeypatch.setattr(module, "load_layout_model", lambda *a, **k: Slope())
    monkeypatch.setattr("sys.argv", ["outsider", str(study), "80", "5"])
    main()
    assert capsys.readouterr().out.count("uniform") == 2
    assert np.array(loop["layouts"]["robust"]["density"]).tolist() == [0.99, 0.0]


@pytest.mark.parametrize("runs", ["1", "many"])
def test_too_few_runs_of_an_outsider_are_refused(monkeypatch, capsys, runs):
    monkeypatch.setattr("sys.argv", ["outsider", "mine.toml", "3000", "--rivals", runs])
    with pytest.raises(SystemExit, match="2"):
        main()
    assert f"an outsider takes at least 3 runs, got {runs}" in " ".join(capsys.readouterr().err.split())
