"""Main effects are the Kriging's, and say how far it is to be believed."""

import pytest

from tests.sample_campaign import write_sample
from workbench.report.page.folder import CampaignFolder
from workbench.report.sections.effects import effects_section


@pytest.mark.parametrize(("q2", "is_guess"), [(0.95, False), (0.2, True)])
def test_effects_of_a_poor_kriging_are_called_a_guess(tmp_path, q2, is_guess):
    path = write_sample(tmp_path / "sample.holdfast", q2=q2)
    found = effects_section(CampaignFolder.opened(path, documents=["design", "screening", "worst_case"]))
    assert found.sentences[0].startswith("By the Kriging, averaged over all other parameters, ")
    assert f"(Q² = {q2:g})" in found.sentences[-1]
    notes = [block.text for block in found.blocks if hasattr(block, "text")]
    assert notes == (["The Kriging predicts poorly here: its effects are a guess."] if is_guess else [])
