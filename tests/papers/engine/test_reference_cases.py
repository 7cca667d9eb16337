"""Reference values of the two-body and three-body studies (DOP853 with variational equations, rtol 1e-12)."""

import numpy as np
import pytest

from studies import three_body, two_body
from workbench.engine import gradient, simulate

# energy and time of the peak in continuous time
REFERENCE = {"A": (48.353585307256, 0.2), "C": (76.164920995101, 0.150394437474)}
SECOND_ORDER = 1.1e-5  # relative error of generalised-alpha, rho 0.8, at 200 steps, halved with a margin
DIFFERENCES = 5e-8  # fourth-order differences of a converged run, their own rounding


def run(p, steps=None, density=None):
    return simulate(
        p.system, p.density if density is None else density, p.t_end, steps or p.steps, scheme=p.scheme
    )


@pytest.mark.parametrize("case", ["A", "C"])
def test_stored_energy_of_the_two_bodies(case):
    p = two_body.problem(case)
    height, time = REFERENCE[case]
    coarse, fine = (p.objective.peaks(run(p, steps))[0] for steps in (200, 400))
    assert abs(coarse.height / height - 1) < SECOND_ORDER
    assert abs(fine.time - time) < 2e-6
    # Richardson on two second-order values; the cubic's own error, fourth order, remains
    assert abs((4 * fine.height - coarse.height) / 3 / height - 1) < 1e-8


def test_displacement_and_joint_force_of_the_three_bodies():
    p = three_body.problem()
    coarse, fine = run(p, 200), run(p, 400)
    value = (4 * p.objective.value(fine) - p.objective.value(coarse)) / 3
    assert value == pytest.approx(0.0539103976313, rel=1e-8)
    force = (4 * fine.multiplier[-1] - coarse.multiplier[-1]) / 3
    np.testing.assert_allclose(force, (4.376756, 93.338974), rtol=1e-6)
    assert np.abs(fine.joint_residuals()).max() < 1e-14


@pytest.mark.parametrize(
    ("case", "value", "time"),
    [("short", 6.1879102e-4, 0.112), ("long", 6.1870520e-4, 0.1125), ("energy", 95.549272, 0.2)],
)
def test_start_values_of_the_layouts_on_the_grid_of_velocity_verlet(case, value, time):
    p = two_body.layout_problem(case)
    peak = p.objective.peaks(run(p))[0]
    assert peak.height == pytest.approx(value, rel=1e-7)
    assert peak.time == pytest.approx(time)


def test_the_long_window_has_five_peaks_within_two_percent():
    p = two_body.layout_problem("long")
    assert len(p.objective.peaks(run(p), within=0.02)) == 5


@pytest.mark.parametrize(
    "p",
    [two_body.problem("A"), two_body.problem("C"), three_body.problem(), two_body.layout_problem("short")],
    ids=["A", "C", "three bodies", "layout"],
)
def test_gradient_along_a_random_direction_is_the_difference_quotient(p):
    d = np.random.default_rng(0).normal(size=len(p.density))
    d /= np.linalg.norm(d)
    e = 1e-4
    g = {s: p.objective.value(run(p, density=p.density + s * e * d)) for s in (-2, -1, 1, 2)}
    quotient = (8 * (g[1] - g[-1]) - (g[2] - g[-2])) / (12 * e)
    found = gradient(p.system, p.density, run(p), p.objective) @ d
    assert found == pytest.approx(quotient, rel=DIFFERENCES)
