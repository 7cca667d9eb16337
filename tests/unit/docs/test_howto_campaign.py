"""The snippets of the how-tos on campaigns are what they say: studies that load, code that runs."""

import re
from pathlib import Path

from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.run_all import run_stage
from workbench.study.loading import parse_study
from workbench.study.worst_case_targets import targets

HOWTO = Path(__file__).parents[3] / "docs" / "howto"


def snippets(name, language):
    return re.findall(rf"```{language}\n(.*?)```", (HOWTO / name).read_text(), re.DOTALL)


def test_the_study_file_of_the_how_to_loads():
    text, screened, robust = snippets("write-a-study-file.md", "toml")
    study = parse_study(text.replace("# gradient", "gradient") + robust)
    axes = "".join(
        f'[[parameter]]\nname = "{name}"\nlower = 0\nupper = 1\n' for name in ("px", "py", "pz", "k")
    )
    head = '[study]\nname = "s"\n[model]\nkind = "ask"\n[[response]]\nname = "y"\n'
    more = parse_study(head + axes + screened)
    assert more.screen["groups"] == [["px", "py", "pz"]]
    assert study.model["gradient"] == "spring.py:slopes"
    assert study.robust["screened"] == 60
    assert study.robust["nominal"] == {"load": 25.0}
    assert study.space.names == ("k", "load")
    assert study.worst_case is not None
    table = (HOWTO / "write-a-study-file.md").read_text()
    rows = re.findall(r"`(lower = .*?)`, `(upper = .*?)`|`(kind = .*?)`, `(levels = .*?)`", table)
    assert len(rows) >= 3
    head = '[study]\nname = "s"\n[model]\nkind = "ask"\n[[response]]\nname = "y"\n[[parameter]]\nname = "p"\n'
    for row in rows:
        parse_study(head + "\n".join(part for part in row if part))


def test_histories_are_looked_at_as_the_how_to_says(tmp_path, monkeypatch, capsys):
    model, look, coarse = snippets("look-at-time-histories.md", "python")
    study, stages = snippets("look-at-time-histories.md", "toml")
    assert parse_study(study + stages).functional_names == ("pc1 of travel", "travel at 0.5")
    (tmp_path / "spring.py").write_text(model)
    (tmp_path / "spring.toml").write_text(study + '[evaluate]\nengine = "inline"\n')
    monkeypatch.chdir(tmp_path)
    with Campaign.from_file("spring.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
    exec(look + coarse, {})
    assert capsys.readouterr().out.splitlines() == ["20 2001 m", "(20,)", "(3, 2001)", "2001", "41"]


def test_the_searches_of_the_how_to_load():
    rows = re.findall(
        r"^\| the worst .*? \| (.*?) \|$", (HOWTO / "write-a-study-file.md").read_text(), re.MULTILINE
    )
    assert len(rows) == 4
    head = '[study]\nname = "s"\n[model]\nkind = "ask"\n[[response]]\nname = "y"\n'
    head += '[[response]]\nname = "travel"\n'
    head += '[[parameter]]\nname = "p"\nlower = 0\nupper = 1\n[worst_case]\n'
    for row in rows:
        keys = [code for code in re.findall("`(.*?)`", row) if " = " in code]
        assert targets(parse_study(head + "\n".join(keys)))


def test_the_models_of_the_how_to_load():
    rest = '[study]\nname = "s"\n[[parameter]]\nname = "stiffness"\nlower = 1\nupper = 2\n'
    responses = '[[response]]\nname = "peak"\n[[response]]\nname = "stress"\n'
    texts = snippets("bring-your-own-simulator.md", "toml")
    assert len(texts) == 5
    for text in texts:
        parse_study(rest + text + ("" if "[[response]]" in text else responses))


def test_the_store_is_read_as_the_how_to_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("m.py").write_text("def f(k):\n    if k > 1.5: raise ValueError('no')\n    return k / 3")
    Path("study.toml").write_text(
        '[study]\nname = "s"\n[model]\nkind = "python"\nfunction = "m.py:f"\n'
        '[[parameter]]\nname = "k"\nlower = 1\nupper = 2\nunit = "N"\n[[response]]\nname = "y"\n'
        '[design]\nkind = "sobol"\nruns = 4\n[evaluate]\nengine = "inline"\n'
    )
    with Campaign.from_file("study.toml") as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)
    first, second = snippets("read-the-store-elsewhere.md", "python")
    names = {}
    exec(first, names)
    assert list(names["table"].columns) == ["key", "status", "error", "k", "y"]
    assert names["table"]["y"].notna().sum() == (names["table"]["status"] == "ok").sum() == 2
    exec(second, names)
    assert names["data"]["k"].attrs["units"] == "N"
    names["db"].close()


def test_the_robust_loop_of_the_how_to_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (model,) = snippets("close-the-robust-loop.md", "python")
    (table,) = snippets("close-the-robust-loop.md", "toml")
    Path("springs.py").write_text(
        model + "\n\ndef bare(u):\n    return springs().responses((0, 0), {'u': u})\n"
    )
    Path("study.toml").write_text(
        '[study]\nname = "s"\n[model]\nkind = "python"\nfunction = "springs.py:bare"\n'
        '[[parameter]]\nname = "u"\nlower = -1\nupper = 1\n[[response]]\nname = "stretch"\nunit = "m"\n'
        '[design]\nkind = "sobol"\nruns = 4\n[evaluate]\nengine = "inline"\n'
        + table.replace("samples = 1000", "samples = 20")
    )
    with Campaign.from_file("study.toml") as campaign:
        found = campaign.run()["robust_layout"]
    assert found["closed"]
    assert found["layouts"]["robust"]["worst"] < found["layouts"]["uniform"]["worst"]
