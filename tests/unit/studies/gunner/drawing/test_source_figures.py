"""The source's figures with our gunner: every panel has its curves, and lines say what is read off them."""

import numpy as np
import pytest

from studies.gunner.cases import Case
from studies.gunner.drawing.source_figures import (
    figure,
    mass_centre,
    relative_head_speed,
    ridden,
    told,
)
from studies.gunner.proving_grounds import rough


@pytest.mark.long
def test_every_panel_has_its_curves_and_every_run_its_line():
    made, lines = figure(t_end=0.02, amplitudes=(0.03, 0.05))
    titles = {ax.get_title(loc="left").split(":")[0]: len(ax.get_lines()) for ax in made.get_axes()}
    assert titles == {"8.5": 1, "8.6, 8.12, 8.13": 5, "8.7": 1, "8.8": 2, "8.9": 2, "8.11": 2}
    assert len(lines) == 4 + 1 + 2
    assert lines[0].startswith("braking, hands on, L0: rise 0 mm")


def test_what_is_drawn_is_what_the_responses_say():
    run = ridden(Case(on=rough(amplitude=0.2)), 0.5)
    height = mass_centre(run)[:, 2]
    assert f"rise {1e3 * np.ptp([height[0], height.max()]):.0f} mm" in told("waves", run)
    assert relative_head_speed(run)[0] == pytest.approx(0.0, abs=1e-9)
    assert relative_head_speed(run).max() > 0.1
