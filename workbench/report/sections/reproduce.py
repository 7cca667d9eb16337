"""How to make this again: commands, seed, hashes, versions."""

from workbench.report.page.blocks import Column, Section, Table
from workbench.report.page.folder import CampaignFolder

__all__ = ["reproduce_section"]


def reproduce_section(folder: CampaignFolder) -> Section:
    """Always there; it says what is known."""
    lock, design = folder.lock, folder["design"] or {}
    model = lock.get("model") or {}
    facts = [
        ("study", folder.name),
        ("study file", "study.toml in the campaign's folder"),
        ("seed", lock.get("seed", design.get("seed"))),
        ("hash of the study", lock.get("study_hash")),
        ("hash of the parameters", lock.get("space_hash", design.get("space_hash"))),
        ("model", model.get("identity")),
        ("version of the model", model.get("version")),
        ("digest of the model's source", model.get("source") or None),
    ]
    versions = dict(lock.get("versions") or design.get("versions") or {})
    rows = [
        (name, value if isinstance(value, (str, int)) else str(value))
        for name, value in facts
        if value is not None
    ]
    return Section(
        id="reproduce",
        title="How to make this again",
        sentences=(
            "`holdfast run study.toml` in an environment with the versions below repeats every number; runs "
            "that are stored in runs.sqlite are not made again. `holdfast report study.toml --json` prints "
            "the numbers of this page. Every table here is also a CSV in the folder `tables`.",
        ),
        blocks=(
            Table(
                id="identity",
                title="What this was made from",
                columns=(Column(name="what"), Column(name="value")),
                rows=tuple(rows),
            ),
            Table(
                id="versions",
                title="Versions",
                columns=(Column(name="package"), Column(name="version")),
                rows=tuple(versions.items()),
            ),
        ),
        numbers={
            "seed": lock.get("seed", design.get("seed")),
            "versions": versions,
            "study_hash": lock.get("study_hash"),
        },
    )
