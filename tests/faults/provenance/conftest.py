"""A fresh copy of a small campaign of any kind for each case."""

import os
import shutil
import zipfile
from pathlib import Path

import pytest

from tests.faults.provenance.small_campaigns import KINDS, OLD, ROW, compiled, git
from workbench.models.protocol import Answer
from workbench.stages.campaign import Campaign


@pytest.fixture(scope="module")
def bases(tmp_path_factory):
    """Kind -> a campaign of it with one run, made when it is asked for."""
    made = {}

    def base(kind):
        if kind not in made:
            folder = tmp_path_factory.mktemp(kind) / "study"
            for name, text in KINDS[kind].items():
                path = folder / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text)
                path.chmod(0o755)
            if kind == "binary":
                compiled(folder)
            if kind == "committed":
                if shutil.which("git") is None:
                    pytest.skip("needs git")
                git(folder, "init")
                (folder / ".gitignore").write_text("s.holdfast\n")
                git(folder, "add", ".")
                git(folder, "commit", "-m", "first")
            for path in folder.rglob("*"):
                os.utime(path, (OLD, OLD))
            with Campaign.from_file(folder / "s.toml") as campaign:
                (key,) = campaign.enqueue([ROW], batch="design")
                names = [response.name for response in campaign.study.responses]
                campaign.store.finish(key, Answer(status="ok", outputs=dict.fromkeys(names, 2.0)), attempt=1)
                (campaign.folder / "kept").mkdir()
                with zipfile.ZipFile(campaign.folder / "kept" / f"{key}.zip", "w") as archive:
                    archive.writestr("o.csv", "t,h\n1,5\n2,6\n")
            made[kind] = folder
        return made[kind]

    return base


@pytest.fixture
def place(bases, tmp_path, monkeypatch):
    """A copy of the campaign of a kind."""
    monkeypatch.setenv("GAIN_OF_TEST", "1")

    def copied(kind):
        return Path(shutil.copytree(bases(kind), tmp_path / "study", symlinks=True))

    return copied
