"""Is the document of a stage still that of the study and its runs? Digests of what went into it.

They are kept in `stages.json` in the campaign's folder, one per stage.
"""

import json
from collections.abc import Mapping
from hashlib import blake2b
from typing import Any

from workbench.campaign.runs import CampaignRuns
from workbench.system.atomic import read_json, write_json

__all__ = ["current_document", "fingerprint", "record_fingerprint"]

FINGERPRINTS = "stages.json"


def fingerprint(campaign: CampaignRuns, table: Mapping[str, Any], inputs: str) -> str:
    """A digest of everything that a stage's document depends on.

    Args:
        table: of the stage in the study file.    inputs: what else decides the document, as text.
    """
    spec = campaign.spec
    if "responses" in table:
        table = {**table, "responses": list(table["responses"].items())}  # their order decides
    parts = [dict(table), campaign.study.seed, campaign.study.space.hash, spec.identity, spec.version, inputs]
    return blake2b(json.dumps(parts, sort_keys=True).encode(), digest_size=16).hexdigest()


def current_document(campaign: CampaignRuns, stage: str, document: str, digest: str) -> dict[str, Any] | None:
    """The stored `<document>.json` of a stage when its inputs had this digest; else None."""
    found = read_json(campaign.folder / f"{document}.json")
    known = read_json(campaign.folder / FINGERPRINTS) or {}
    return dict(found) if found is not None and known.get(stage) == digest else None


def record_fingerprint(campaign: CampaignRuns, stage: str, digest: str) -> None:
    """Remember from what a stage's document was made."""
    known = read_json(campaign.folder / FINGERPRINTS) or {}
    write_json(campaign.folder / FINGERPRINTS, {**known, stage: digest})
