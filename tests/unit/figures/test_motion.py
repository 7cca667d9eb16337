"""Figures of a run of the engine."""

import pytest
from matplotlib.figure import Figure

from workbench.engine import Airbag, Body, Member, Motion, RevoluteJoint, Spring, System, simulate
from workbench.figures.motion import plot_histories, plot_storyboard
from workbench.motion.trajectories import dataset


@pytest.fixture(scope="module")
def run():
    bar = Body(name="bar", mass=1.0, inertia=0.1, position=(0.5, 0.0, 0.0))
    cart = Body(name="cart", motion=Motion(position=lambda t: (0.0, 0.2 * t**2, 0.0)))
    system = System(
        bodies=(bar, cart),
        joints=(RevoluteJoint(a="bar", b="cart", point_a=(-0.5, 0.0)),),
        members=(
            Member(a="bar", b="cart", point_a=(0.5, 0.0), point_b=(0.5, -1.0), law=Spring(k=20.0)),
            Member(a="bar", b="ground", point_a=(0.5, 0.1), point_b=(1.0, 0.5), law=Airbag()),
        ),
    )
    return simulate(system, [1.0, 1e-4], 0.5, 200)


def test_figures_carry_units_and_every_still(run):
    figure = Figure()
    ds = dataset(run)
    ax = plot_histories(
        {"x": ds.position.sel(body="bar", axis="x"), "y": ds.position.sel(body="bar", axis="y")},
        ds.time, label="position", unit="m", ax=figure.add_subplot(2, 1, 1),
    )  # fmt: skip
    assert ax.get_ylabel() == "position [m]"
    assert len(ax.get_lines()) == 2
    board = plot_storyboard(run, (0.0, 0.25, 0.5), ax=figure.add_subplot(2, 1, 2))
    assert [text.get_text() for text in board.texts] == ["0 s", "0.25 s", "0.5 s"]
    assert len(board.collections) == 3
