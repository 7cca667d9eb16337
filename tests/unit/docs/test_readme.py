"""The README's lines run as they stand, and name what exists."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_it_opens_with_the_two_commands():
    first = blocks("")[0]
    assert [line.split("#")[0].strip() for line in first.strip().splitlines()] == ["make demo", "make test"]


@pytest.mark.slow
def test_the_python_lines_run(tmp_path):
    (code,) = blocks("python")
    assert len([line for line in code.splitlines() if line.strip()]) <= 16
    done = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning", "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr
    assert "confirmed by a true run" in done.stdout


def test_the_study_file_is_valid(tmp_path):
    from workbench.study.loading import load_study

    (text,) = blocks("toml")
    (tmp_path / "bracket.py").write_text("def peak_stress(load, clearance):\n    return load / clearance\n")
    (tmp_path / "bracket.toml").write_text(text)
    study = load_study(tmp_path / "bracket.toml")
    assert study.space["clearance"].upper == 0.4


def test_its_files_exist():
    for path in re.findall(r"\]\(([^)]+)\)", README):
        assert (ROOT / path).is_file(), path
