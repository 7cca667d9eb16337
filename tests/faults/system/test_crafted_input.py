"""Crafted templates, decks, paths and links: refused, and nothing is written outside the study's folder."""

import json
import os

import pytest

from workbench.errors import EvaluationFailed, HoldfastError, StudyError
from workbench.models.readers import read_response
from workbench.models.template import compiled
from workbench.stages.campaign import Campaign
from workbench.study.loading import load_study
from workbench.system.confined import confined

TEMPLATES = [
    "{{ ''.__class__ }}",
    "{{ k.__class__.__mro__ }}",
    "{{ k.real }}",
    "{{ [].append(1) }}",
    "{{ cycler.__init__.__globals__ }}",
    "{{ lipsum() }}",
    "{{ range(10**9) }}",
    "{% for i in 'ab' %}{{ i }}{% endfor %}",
    "{% for i in [1] recursive %}{{ loop([1]) }}{% endfor %}",
    "{% include '/etc/passwd' %}",
    "{% import 'os' as os %}",
    "{% from 'os' import path %}",
    "{% extends 'base' %}",
    "{% macro m() %}{{ m() }}{% endmacro %}{{ m() }}",
    "{% block b %}{% endblock %}",
    "{{ 'a' * 10 }}",
    "{{ 9 ** 9 ** 9 }}",
    "{{ 'a' ~ 'b' }}",
    "{{ k|attr('__class__') }}",
    "{{ k|map('upper') }}",
    "{{ 'x'|fmt('%999999999s') }}",
    "{{ self }}",
    "{{ (k, k)[0] }}",
    "{{ {'a': 1} }}",
    "{% set x = k %}{{ x.imag }}",
    "{% filter upper %}a{% endfilter %}",
    "{{ k if" + " (" * 3000,
    "{%" * 5000,
]


@pytest.mark.parametrize("text", TEMPLATES, ids=[t[:40] for t in TEMPLATES])
def test_templates_that_want_more_than_names_and_arithmetic(text):
    with pytest.raises((StudyError, EvaluationFailed), match=r"deck|format"):
        compiled(text, ["k"], style="jinja", what="deck")({"k": 1.5})


PATHS = [
    "/etc/passwd",
    "../up.txt",
    "a/../../up.txt",
    "..\\up.txt",
    "C:\\up.txt",
    "c:up.txt",
    "~/up.txt",
    "",
    " ",
    "a\0b",
    "a\nb",
    "x" * 5000,
    "link/inside.txt",
    "link.txt",
    "loop/a",
]


@pytest.mark.parametrize("name", PATHS, ids=[repr(p[:20]) for p in PATHS])
def test_paths_that_lead_out(tmp_path, name):
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir()
    outside.mkdir()
    (outside / "secret.txt").write_text("1")
    (inside / "link").symlink_to(outside)
    (inside / "link.txt").symlink_to(outside / "secret.txt")
    (inside / "loop").symlink_to(inside / "loop")
    with pytest.raises(
        StudyError, match=r"needs to be a path inside inside|leads out of inside through a link"
    ):
        confined(inside, name, what="deck")


def test_paths_that_stay(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "alias").symlink_to(tmp_path / "real")
    for name in ("a.txt", "a/b.txt", "alias/c.txt", "..a/b", "a b"):
        assert confined(tmp_path, name, what="deck").is_relative_to(tmp_path)


STUDY = """
[study]
name = "s"
[model]
kind = "command"
command = ["{{python}}", "-c", {code}]
templates = [{{ from = {source}, to = {target} }}]
files = {files}
[[parameter]]
name = "k"
lower = 0
upper = 1
[[response]]
name = "y"
read = {{ kind = "json", file = {file}, key = "y" }}
"""


@pytest.mark.parametrize(
    ("source", "target", "files", "file"),
    [
        ("../secret.tmpl", "d", [], "o"),
        ("link.tmpl", "d", [], "o"),
        ("t.tmpl", "../d", [], "o"),
        ("t.tmpl", "/tmp/holdfast-outside", [], "o"),
        ("t.tmpl", "d", ["../secret.tmpl"], "o"),
        ("t.tmpl", "d", ["link.tmpl"], "o"),
        ("t.tmpl", "d", [], "../../../secret.json"),
        ("t.tmpl", "d", [], "/etc/passwd"),
        ("t.tmpl", "d", [], "out.json"),  # which the run makes a link to a file outside
    ],
)
def test_a_study_reaches_nothing_outside(tmp_path, source, target, files, file):
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.tmpl").write_text("secret")
    (tmp_path / "secret.json").write_text('{"y": 1}')
    (inside / "t.tmpl").write_text("{{ k }}")
    (inside / "link.tmpl").symlink_to(tmp_path / "secret.tmpl")
    code = f"import os; os.symlink({str(tmp_path / 'secret.json')!r}, 'out.json')"
    values = {"code": code, "source": source, "target": target, "files": files, "file": file}
    (inside / "s.toml").write_text(STUDY.format(**{k: json.dumps(v) for k, v in values.items()}))
    before = sorted(p.name for p in tmp_path.iterdir())
    said = ""
    try:
        with Campaign.from_file(inside / "s.toml") as campaign:
            (row,) = campaign.evaluate([{"k": 0.5}])
        said = row.error if row.status == "failed" else row.status
    except StudyError as exc:
        said = str(exc)
    assert "needs to be a path inside" in said or "leads out" in said
    assert sorted(p.name for p in tmp_path.iterdir()) == before
    assert not os.path.exists("/tmp/holdfast-outside")


def test_a_deck_does_not_follow_a_link_that_a_file_brought(tmp_path):
    """A run's folder starts empty: what an earlier run left there, links too, is gone."""
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "t.tmpl").write_text("{{ k }}")
    code = f"import os; os.remove('d'); os.symlink({str(tmp_path / 'written')!r}, 'd')"
    values = {"code": code, "source": "t.tmpl", "target": "d", "files": [], "file": "o"}
    (inside / "s.toml").write_text(STUDY.format(**{k: json.dumps(v) for k, v in values.items()}))
    with Campaign.from_file(inside / "s.toml") as campaign:
        campaign.evaluate([{"k": 0.5}])
        campaign.retry()
        campaign.evaluate([{"k": 0.5}])
    assert not (tmp_path / "written").exists()


def test_a_result_that_is_no_plain_file(tmp_path):
    rule = {"kind": "json", "key": "y", "file": "pipe"}
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(EvaluationFailed, match="or is no file"):
        read_response(rule, tmp_path, tmp_path, history=False)
    with pytest.raises(EvaluationFailed, match="or is no file"):
        read_response({**rule, "file": "."}, tmp_path, tmp_path, history=False)


def test_names_of_studies_do_not_lead_out(tmp_path):
    for name in ("../x", "/x", "a/b", "", ".hidden"):
        (tmp_path / "s.toml").write_text(f"[study]\nname = {json.dumps(name)}\n")
        with pytest.raises(HoldfastError, match=r"study.name needs"):
            load_study(tmp_path / "s.toml")
