"""Edits of a study between two commands never end in a traceback, and lose nothing that was answered."""

import sqlite3

import numpy as np
import pytest

from workbench.campaign.permissions import Permissions
from workbench.errors import HoldfastError
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.planning import plan_lines, plan_study
from workbench.stages.run_all import run_stage
from workbench.study.loading import load_study

MODEL = """
def f(**x):
    a = x.get("a", 1.0) or 0.0
    return {"y": 2 * a, "z": a - x.get("n", 0), "h": ([0, 1, 2], [a, -a, 3 * a])}
def g(**x):
    return sum(v for v in x.values() if not isinstance(v, str))
"""
SOLVER = """
import sys, json
a = float(sys.argv[1])
json.dump({"y": a, "z": 3 * a}, open("o.json", "w"))
open("o.csv", "w").write("t,h\\n" + "".join(f"{k},{k * a}\\n" for k in range(4)))
"""
READ = {
    "y": 'read = { kind = "json", file = "o.json", key = "y" }',
    "z": 'read = { kind = "json", file = "o.json", key = "z" }',
    "other": 'read = { kind = "regex", file = "o.json", pattern = "y.: (\\\\S+)," }',
    "h": 'read = { kind = "csv", file = "o.csv", column = "h" }',
}


class Edited:
    """A study as plain values, one of which changes at a time."""

    def __init__(self, rng):
        self.rng = rng
        self.kind, self.function, self.version, self.seed, self.keep = "python", "f", "1", 1, None
        self.design, self.runs = "lhs", 6
        self.bounds, self.unit = [0.0, 2.0], "m"
        self.parameters = {"n": 'kind = "integer"\nlower = 1\nupper = 3'}
        self.responses = {"y": ""}

    def edit(self):
        rng = self.rng
        pick = lambda *values: values[rng.integers(len(values))]  # noqa: E731
        edits = {
            "kind": lambda: setattr(self, "kind", pick("python", "python", "command", "ask", "table")),
            "function": lambda: setattr(self, "function", pick("f", "g")),
            "version": lambda: setattr(self, "version", pick("1", "2")),
            "seed": lambda: setattr(self, "seed", pick(1, 2)),
            "keep": lambda: setattr(self, "keep", pick(None, ["h"], [], ["o.json"])),
            "design": lambda: setattr(
                self,
                "design",
                pick("lhs", "ihs", "sobol", "grid", "factorial", "d_optimal_select", "nothing"),
            ),
            "runs": lambda: setattr(self, "runs", pick(3, 6, 9, 12)),
            "bounds": lambda: setattr(self, "bounds", pick([0.0, 2.0], [0.5, 1.5], [-1.0, 3.0], [5.0, 6.0])),
            "unit": lambda: setattr(self, "unit", pick("m", "mm", "N")),
            "parameter": lambda: self.parameter(pick("n", "c", "word")),
            "response": lambda: self.response(pick("y", "z", "h", "other")),
        }
        edits[pick(*edits)]()

    def parameter(self, name):
        if self.parameters.pop(name, None) is None:
            self.parameters[name] = {
                "n": 'kind = "integer"\nlower = 1\nupper = 3',
                "c": "lower = 0\nupper = 1\nbaseline = 0.5",
                "word": 'kind = "categorical"\nlevels = ["one", "two"]\nbaseline = "one"',
            }[name]

    def response(self, name):
        if name in self.responses and len(self.responses) > 1:
            del self.responses[name]
        else:
            reduce = self.rng.choice(["max", "min", "mean"])
            self.responses[name] = f'reduce = "{reduce}"' if name == "h" else ""

    def text(self):
        model = {
            "python": f'function = "m.py:{self.function}"\nversion = "{self.version}"',
            "command": 'command = ["{python}", "{study}/solver.py", "{a}"]\nversion = "%s"' % self.version,  # noqa: UP031
            "ask": f'version = "{self.version}"',
            "table": 'file = "t.csv"',
        }[self.kind]
        keep = f"keep = {self.keep}\n" if self.keep is not None and self.kind in ("python", "command") else ""
        text = f'[study]\nname = "s"\nseed = {self.seed}\n[model]\nkind = "{self.kind}"\n{model}\n{keep}'
        low, high = self.bounds
        text += f'[[parameter]]\nname = "a"\nlower = {low}\nupper = {high}\nunit = "{self.unit}"\n'
        text += "".join(f'[[parameter]]\nname = "{n}"\n{more}\n' for n, more in self.parameters.items())
        for name, more in self.responses.items():
            read = READ[name] if self.kind == "command" else ""
            text += f'[[response]]\nname = "{name}"\n{more}\n{read}\n'
        text += f'[evaluate]\nengine = "inline"\n[design]\nkind = "{self.design}"\n'
        return text + ("" if self.design in ("grid", "factorial") else f"runs = {self.runs}\n")


def answered(folder):
    """Answers on record: of runs, and of their attempts."""
    path = folder / "s.holdfast" / "runs.sqlite"
    if not path.exists():
        return 0
    db = sqlite3.connect(path)
    (runs,) = db.execute("SELECT COUNT(*) FROM evaluation WHERE status = 'ok'").fetchone()
    (others,) = db.execute("SELECT COUNT(*) FROM attempt WHERE status = 'ok'").fetchone()
    db.close()
    return runs + others


def walked(edited, folder, *, half):
    """One command after an edit; the words of a refusal, or nothing. All else that is raised is a fault."""
    (folder / "s.toml").write_text(edited.text())
    chance = edited.rng.random(4) < 0.25
    names = ("same_model", "new_version", "run_again", "at_baseline")
    allowed = Permissions(**dict(zip(names, chance.tolist(), strict=True)))
    try:
        plan_lines(plan_study(load_study(folder / "s.toml")))
        with Campaign.from_file(folder / "s.toml", permissions=allowed) as campaign:
            run_stage(campaign, "design")
            if not half:
                evaluate(campaign)
            campaign.frame()
            campaign.results()
    except HoldfastError as exc:
        return str(exc)
    return ""


def many_edits(folder, seed, count):
    rng = np.random.default_rng(seed)
    (folder / "m.py").write_text(MODEL)
    (folder / "solver.py").write_text(SOLVER)
    (folder / "t.csv").write_text(
        "a,n,c,word,y,z,h,other\n"
        + "".join(f"{k / 4},{1 + k % 3},{k / 8},one,{k},{2 * k},{k},{-k}\n" for k in range(1, 7))
    )
    edited = Edited(rng)
    refused = walked(edited, folder, half=False)
    assert refused == ""
    before = answered(folder)
    for _ in range(count):
        kept = dict(vars(edited), parameters=dict(edited.parameters), responses=dict(edited.responses))
        edited.edit()
        refused = walked(edited, folder, half=rng.random() < 0.3)
        now = answered(folder)
        assert now >= before, refused
        before = now
        if refused and rng.random() < 0.7:
            vars(edited).update(kept)
    return before


def test_edits_midway(tmp_path):
    assert many_edits(tmp_path, 1, 10) >= 6


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 8))
def test_many_edits_midway(tmp_path, seed):
    assert many_edits(tmp_path, seed, 50) >= 6
