"""Edits of a study between two commands never end in a traceback, and lose nothing that was answered."""

import re
import sqlite3

import numpy as np
import pytest

from tests.counted import counted
from tests.faults.seeds import SHIFT
from workbench.campaign.permissions import Permissions
from workbench.campaign.results.failures import failure_document, failure_lines
from workbench.errors import HoldfastError, Interrupted, NotEnoughRuns
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate, queue_design
from workbench.stages.planning import plan_lines, plan_study
from workbench.stages.run_all import run_all, run_stage
from workbench.study.loading import load_study

MODEL = """
def f(**x):
    a = x.get("a", x.get("b", 1.0)) or 0.0
    return {"y": FACTOR * a, "z": a - x.get("n", 0), "h": ([0, 1, 2], [a, -a, 3 * a])}
def g(**x):
    return FACTOR * sum(v for v in x.values() if not isinstance(v, str))
"""
SOLVER = """
import sys, json
a = FACTOR * float(sys.argv[1])
json.dump({"y": a, "z": 3 * a}, open("o.json", "w"))
open("o.csv", "w").write("t,h\\n" + "".join(f"{k},{k * a}\\n" for k in range(4)))
"""
POST = """
import json
def peak(work):
    return OFFSET + json.loads((work / "o.json").read_text())["y"]
"""
READ = {
    "y": 'read = { kind = "json", file = "o.json", key = "y" }',
    "z": 'read = { kind = "json", file = "o.json", key = "z" }',
    "other": 'read = { kind = "regex", file = "o.json", pattern = "y.: (\\\\S+)," }',
    "h": 'read = { kind = "csv", file = "o.csv", column = "h" }',
    "peak": 'read = { kind = "python", function = "post.py:peak" }',
    "wrong": 'read = { kind = "csv", file = "o.csv", column = "nothing" }',
}
PARAMETERS = {
    "n": 'kind = "integer"\nlower = 1\nupper = 3',
    "c": "lower = 0\nupper = 1\nbaseline = 0.5",
    "word": 'kind = "categorical"\nlevels = ["one", "two"]\nbaseline = "one"',
    "d": "lower = 0\nupper = 1",
}
DESIGNS = ("lhs", "ihs", "optimised_lhs", "sobol", "grid", "factorial", "d_optimal_select", "nothing")
REDUCERS = ("max", "min", "mean", "final")


class Edited:
    """A study as plain values, one of which changes at a time."""

    def __init__(self, rng):
        self.rng = rng
        self.kind, self.function, self.version, self.seed, self.keep = "python", "f", "1", 1, None
        self.design, self.runs, self.stages = "lhs", 6, ()
        self.first, self.bounds, self.unit, self.response_unit = "a", [0.0, 2.0], "m", "N"
        self.parameters = {"n": PARAMETERS["n"]}
        self.responses = {"y": ("y", "")}  # name -> how it is read, its reducer
        self.factor, self.offset = 2.0, 0.0

    def copy(self):
        return dict(vars(self), parameters=dict(self.parameters), responses=dict(self.responses))

    def pick(self, *values):
        return values[self.rng.integers(len(values))]

    def edit(self):
        """Change one thing; its name."""
        pick = self.pick
        plain = {
            "kind": ("python", "python", "command", "command", "ask", "table"),
            "function": ("f", "g"),
            "version": ("1", "2"),
            "seed": (1, 2),
            "keep": (None, ["h"], [], ["o.json"], ["*"]),
            "design": DESIGNS,
            "runs": (3, 6, 9, 12),
            "bounds": ([0.0, 2.0], [0.5, 1.5], [-1.0, 3.0], [5.0, 6.0]),
            "unit": ("m", "mm", "N"),
            "response_unit": ("N", "kN"),
            "first": ("a", "b"),  # the first parameter under another name
            "stages": ((), ("screen",), ("worst_case",), ("screen", "worst_case")),
            "factor": (2.0, 3.0),
            "offset": (0.0, 1.0, float("nan")),
        }
        others = {
            "parameter": lambda: self.parameter(pick(*PARAMETERS)),
            "response": lambda: self.response(pick(*READ)),
            "reader": lambda: self.replace_one(lambda name, how: (name, (pick(*READ), how[1]))),
            "rename": lambda: self.replace_one(lambda name, how: (pick("y", "force", "z", "end"), how)),
            "reducer": lambda: self.replace_one(lambda name, how: (name, (how[0], pick("", *REDUCERS)))),
        }
        what = pick(*plain, *others)
        if what in plain:
            setattr(self, what, pick(*plain[what]))
        else:
            others[what]()
        return what

    def parameter(self, name):
        if self.parameters.pop(name, None) is None:
            self.parameters[name] = PARAMETERS[name]

    def response(self, name):
        if name in self.responses and len(self.responses) > 1:
            del self.responses[name]
        else:
            self.responses[name] = (name, self.pick(*REDUCERS) if name == "h" else "")

    def replace_one(self, other):
        """One response in its place under another name, or read otherwise."""
        old = self.pick(*self.responses)
        name, how = other(old, self.responses[old])
        pairs = [(name, how) if n == old else (n, h) for n, h in self.responses.items()]
        self.responses = dict(pairs)

    def write(self, folder):
        (folder / "m.py").write_text(MODEL.replace("FACTOR", str(self.factor)))
        (folder / "solver.py").write_text(SOLVER.replace("FACTOR", str(self.factor)))
        (folder / "post.py").write_text(POST.replace("OFFSET", f'float("{self.offset}")'))
        (folder / "s.toml").write_text(self.text())

    def text(self):
        model = {
            "python": f'function = "m.py:{self.function}"\nversion = "{self.version}"',
            "command": f'command = ["{{python}}", "{{study}}/solver.py", "{{{self.first}}}"]\n'
            f'version = "{self.version}"',
            "ask": f'version = "{self.version}"',
            "table": 'file = "t.csv"',
        }[self.kind]
        keep = f"keep = {self.keep}\n" if self.keep is not None and self.kind in ("python", "command") else ""
        text = f'[study]\nname = "s"\nseed = {self.seed}\n[model]\nkind = "{self.kind}"\n{model}\n{keep}'
        low, high = self.bounds
        text += f'[[parameter]]\nname = "{self.first}"\nlower = {low}\nupper = {high}\nunit = "{self.unit}"\n'
        text += "".join(f'[[parameter]]\nname = "{n}"\n{more}\n' for n, more in self.parameters.items())
        for name, (how, reducer) in self.responses.items():
            text += f'[[response]]\nname = "{name}"\nunit = "{self.response_unit}"\n'
            text += f'reduce = "{reducer}"\n' if reducer else ""
            text += f"{READ[how]}\n" if self.kind == "command" else ""
        text += f'[evaluate]\nengine = "inline"\n[design]\nkind = "{self.design}"\n'
        text += "" if self.design in ("grid", "factorial") else f"runs = {self.runs}\n"
        first = next(iter(self.responses))
        more = {"screen": "", "worst_case": "budget = 3\nattack = 0\n"}
        return text + "".join(f'[{stage}]\nresponse = "{first}"\n{more[stage]}' for stage in self.stages)


def answered(folder):
    """Keys of runs with an answer on record: their own, or among their attempts."""
    path = folder / "s.holdfast" / "runs.sqlite"
    if not path.exists():
        return set()
    db = sqlite3.connect(path)
    runs = db.execute("SELECT key FROM evaluation WHERE status IN ('ok', 'nonfinite')").fetchall()
    runs += db.execute("SELECT key FROM attempt WHERE status IN ('ok', 'nonfinite')").fetchall()
    db.close()
    return {key for (key,) in runs}


def walked(edited, folder, *, how_far):
    """One command after an edit; the words of a refusal by the campaign, or nothing. All else is a fault.

    `how_far`: "planned", "half" of the runs, "runs", "stages" or their "report".
    """
    edited.write(folder)
    chance = edited.rng.random(4) < 0.25
    names = ("same_model", "new_version", "run_again", "at_baseline")
    allowed = Permissions(**dict(zip(names, chance.tolist(), strict=True)))
    try:
        study = load_study(folder / "s.toml")
    except HoldfastError:
        return ""  # the file itself is refused
    try:
        plan_lines(plan_study(study))
        if how_far == "planned":
            return ""
        with Campaign.from_file(folder / "s.toml", permissions=allowed) as campaign:
            document = run_stage(campaign, "design")
            if how_far == "half":
                queue_design(campaign, document)
                rows = [row.parameters for row in campaign.ask(2)]
                campaign.evaluate(rows)
            else:
                evaluate(campaign)
            if how_far in ("stages", "report"):
                run_all(campaign)
            runs = campaign.runs()
            assert {row.key for row in runs} == {campaign.key(row.inputs) for row in runs}, "of one model"
            campaign.frame()
            campaign.results()
            failure_lines(failure_document(campaign.runs(), campaign.study.space))
    except HoldfastError as exc:
        return "" if isinstance(exc, Interrupted | NotEnoughRuns) else str(exc)
    return ""


WAYS = ("planned", "half", "runs", "runs", "stages", "stages", "stages", "stages")
# a refusal that is about the study alone, whatever is stored
OF_THE_STUDY = re.compile(
    r"design kind '\w+' needs|design kind needs one of|^budget=|offers \d+ rows|^response '\w+' is .* in all"
    r"|never reach(es)? the solver"
)
AT_STAKE = re.compile(r"\b\d+ (?:stored )?runs?\b")


def many_edits(folder, seed, count, ways=WAYS):
    rng = np.random.default_rng(seed)
    (folder / "t.csv").write_text(
        "a,b,n,c,d,word,y,z,h,other,peak,force,end,wrong\n"
        + "".join(
            f"{k / 4},{k / 4},{1 + k % 3},{k / 8},{k / 9},one,{k},{2 * k},{k},{-k},{k},{k},{k},{k}\n"
            for k in range(1, 7)
        )
    )
    edited = Edited(rng)
    refused = walked(edited, folder, how_far="runs")
    assert refused == ""
    before = answered(folder)
    refusals = []
    for _ in range(count):
        kept = edited.copy()
        what = edited.edit()
        refused = walked(edited, folder, how_far=edited.pick(*ways))
        now = answered(folder)
        assert before <= now, (what, refused)
        before = now
        if refused:
            assert AT_STAKE.search(refused) or OF_THE_STUDY.search(refused), (what, refused)
            assert "cannot be made from" not in refused, (what, refused)
            refusals.append((what, refused))
            if rng.random() < 0.85:
                vars(edited).update(kept)
    return before, refusals


def test_edits_midway(tmp_path):
    keys, _ = many_edits(tmp_path, 1, 10, ways=("planned", "half", "runs"))
    assert len(keys) >= 6


@pytest.mark.slow
def test_what_a_stage_left_that_is_asked_for_no_more_stops_nothing(tmp_path):
    edited = Edited(np.random.default_rng(1))
    edited.stages = ("screen", "worst_case")
    assert walked(edited, tmp_path, how_far="stages") == ""
    edited.stages = ()
    for first, parameters in (("b", {"n": PARAMETERS["n"]}), ("a", {}), ("a", dict(PARAMETERS))):
        edited.first, edited.parameters, edited.version = first, parameters, edited.version + "1"
        assert "cannot be made from" not in walked(edited, tmp_path, how_far="stages")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [SHIFT + 2, SHIFT + 3, SHIFT + 4, *counted(range(SHIFT + 5, SHIFT + 12))])
def test_many_edits_midway(tmp_path, seed):
    keys, refusals = many_edits(tmp_path, seed, 50)
    assert len(keys) >= 6
    assert refusals
