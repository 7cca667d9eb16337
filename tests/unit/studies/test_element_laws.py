"""Elements on their rigs: what runs report beside the formulas of the records' docstrings."""

import numpy as np
import pytest

from studies.element_laws import AXES, GRIP, LOADS, figures, hmmwv_tyre, run

LAG = 0.01  # of the force: a slip that is swept reaches the tyre a tenth of a metre late


@pytest.fixture(scope="module")
def found():
    return run()


@pytest.mark.slow
@pytest.mark.parametrize("lateral", [True, False])
def test_pure_slips_give_pacejkas_forces(found, lateral):
    ds = found["lateral" if lateral else "longitudinal"]
    tyre = hmmwv_tyre()
    for load in LOADS:
        formula = np.array([tyre.force(float(s), load, lateral=lateral) for s in ds.slip])
        got = ds[f"{load / 1000:g} kN"].to_numpy()
        assert np.abs(got - formula).max() < LAG * formula.max()


@pytest.mark.slow
def test_small_slips_together_lie_on_an_ellipse_of_the_pure_ones(found):
    ds, tyre = found["combined"], hmmwv_tyre()
    along = tyre.force(0.03, 7000.0, lateral=False)
    across = tyre.force(0.03, 7000.0, lateral=True)
    size = (ds["along at 0.03"] / along) ** 2 + (ds["across at 0.03"] / across) ** 2
    assert float(abs(size - 1.0).max()) < 0.08  # stiffness falls a little to the peak
    for slip in ("0.08", "0.3"):
        force = np.hypot(ds[f"along at {slip}"], ds[f"across at {slip}"])
        assert float(force.max()) < 1.01 * tyre.force(tyre.peak(lateral=False), 7000.0, lateral=False)


@pytest.mark.slow
def test_a_relaxing_tyre_needs_a_way_and_not_a_time(found):
    slow, fast = (found["relaxation"][name].to_numpy() for name in ("5 m/s", "20 m/s"))
    assert np.abs(slow - fast).max() < 1e-3 * fast.max()
    way = found["relaxation"].way.to_numpy()
    share = np.interp(0.8, way, fast) / fast[-1]
    assert 0.6 < share < 0.7  # 1 - 1/e of the slip, and nearly of the force


@pytest.mark.slow
def test_contacts_push_and_lose_energy_by_damping(found):
    ds = found["contact"]
    loss = [np.trapezoid(ds[name], ds.depth) for name in ("0 s/m", "0.5 s/m", "2 s/m")]
    peak = 1e6 * 0.01**1.5
    assert abs(loss[0]) < 1e-6 * peak
    assert loss[0] < loss[1] < loss[2]
    assert all(float(ds[name].min()) >= 0.0 for name in ds if name != "depth")
    assert float(ds["0 s/m"].max()) == pytest.approx(peak, rel=0.01)


@pytest.mark.slow
def test_friction_is_against_the_slip_and_no_more_than_mu(found):
    ds = found["friction"]
    assert np.all(ds.share * ds.speed <= 1e-12)
    expected = -0.7 * ds.speed / np.hypot(ds.speed, 0.05)
    assert float(abs(ds.share - expected).max()) < 1e-9


@pytest.mark.slow
def test_bushings_saturate_on_their_side_and_let_go_for_good(found):
    ds = found["bushing"]
    assert float(abs(ds["capped"]).max()) < GRIP
    assert float(ds["capped where it opens"].max()) < GRIP
    assert float(ds["capped where it opens"].min()) < -2 * GRIP
    gone = found["breakage"]
    assert float(gone.damage[-1]) > 0.99
    assert float(abs(gone.force[gone.time > 0.6]).max()) < 0.02 * GRIP
    assert np.all(np.diff(gone.damage) >= 0.0)


@pytest.mark.slow
def test_stops_act_beyond_their_angles_sooner_where_they_are_wide(found):
    ds = found["stops"]
    angle = np.radians(ds.angle.to_numpy())
    for width in (0.01, 0.05, 0.15):

        def soft(x, width=width):
            return width * np.logaddexp(0.0, x / width)

        torque = 20.0 * angle + 1000.0 * (soft(angle - np.radians(142.0)) - soft(-angle))
        assert np.abs(ds[f"{width:g} rad"] - torque).max() < 1e-6 * np.abs(torque).max()


@pytest.mark.slow
def test_every_drawing_has_its_element(found):
    drawn = figures(found)["element_laws"]
    assert [ax.get_title() for ax in drawn.axes] == [title for title, *_ in AXES.values()]
