"""Spatial mechanisms in natural coordinates: Bricard's with its redundant constraint, heavy top, governor."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.sample_spatial import bricard, governor, heavy_top
from workbench.engine import GeneralisedAlpha, IndependentAlpha, RungeKutta8, simulate

# P3 of Bricard's mechanism at whole seconds: another code (absolute coordinates, Euler parameters,
# generalised-alpha at h = 1e-3 and 5e-4, Richardson), good to about 2e-7; tests/peers runs it again
P3 = {
    1.0: (0.5105015, -1.6491676, 0.1401231),
    2.0: (-0.9693403, -1.2212469, 0.7542780),
    3.0: (-0.9671998, -1.2280202, 0.7459832),
    4.0: (0.5248996, -1.6438760, 0.1488359),
}


def test_bricard_keeps_its_energy_and_names_its_redundant_condition():
    run = simulate(bricard(), [], 10.0, 500, scheme=RungeKutta8())
    assert len(run.diagnosis.redundant_rows) == 1
    assert "set aside" in run.diagnosis.notices[0]
    energy = run.mechanical_energy()
    assert np.abs(energy - energy[0]).max() < 1e-11  # of 58.9 J exchanged
    assert np.abs(run.joint_residuals()).max() < 1e-13  # the redundant row included
    for time, place in P3.items():
        np.testing.assert_allclose(run.of("P3")[round(50 * time)], place, atol=1e-6)


def test_bricard_at_a_millisecond_step():
    exact = simulate(bricard(), [], 5.0, 250, scheme=RungeKutta8()).of("P3")
    errors = []
    for steps in (2500, 5000):
        run = simulate(bricard(), [], 5.0, steps, scheme=IndependentAlpha(rho=1.0))
        errors.append(np.abs(run.of("P3")[:: steps // 250] - exact).max())
    assert errors[1] < 1e-5
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.3)  # the splits differ
    energy = run.mechanical_energy()
    assert np.abs(energy - energy[0]).max() < 1e-4


def test_generalised_alpha_runs_spatial_systems_in_independent_coordinates():
    run = simulate(bricard(), [], 0.1, 50, scheme=GeneralisedAlpha(rho=0.7))
    assert run.scheme == IndependentAlpha(rho=0.7)
    assert set(run.splits.rank) == {run.position.shape[1] - 1}  # one degree of freedom throughout


def test_heavy_top_at_a_fifth_of_a_second():
    w, x, y, z = (-0.70827915, 0.43878109, 0.54572840, 0.08939975)  # Bruls, Cardona and Arnold, eight digits
    second = np.array([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)])
    run = simulate(heavy_top(), [], 0.2, 200, scheme=RungeKutta8())
    np.testing.assert_allclose(run.of("y")[-1], second, atol=1e-8)
    assert np.abs(np.linalg.norm(run.of("x"), axis=1) - 1.0).max() < 1e-13
    errors = [
        np.abs(simulate(heavy_top(), [], 0.2, n, scheme=IndependentAlpha()).of("y")[-1] - second).max()
        for n in (1000, 2000)
    ]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert errors[1] < 2.5e-4


def governor_in_three_coordinates(times):
    """Slider height s of the governor from rod angle b, s and the angular momentum about the shaft."""
    rod, tip, slider, k, c, g = 0.3, 5.0, 3.0, 8e5, 4e4, 9.81
    twist, slim = 0.3 * 2e-4 / 12, 0.3 * (1 + 1e-4) / 12
    base, swing = twist + slider * 0.02 / 12, slim + rod / 4 + tip

    def spin(b):
        cb, sb = np.cos(b), np.sin(b)
        inertia = slim * cb * cb + twist * sb * sb + rod * (0.05 + cb / 2) ** 2 + tip * (0.05 + cb) ** 2
        slope = 2 * (twist - slim) * sb * cb - rod * (0.05 + cb / 2) * sb - 2 * tip * (0.05 + cb) * sb
        return inertia, slope

    def rates(t, y):
        b, s, db, ds = y
        inertia, slope = spin(b)
        omega = momentum / (base + 2 * inertia)
        dx, dz = np.cos(b) / 2, 1 - np.sin(b) / 2 - s
        length = np.hypot(dx, dz)
        by_b, by_s = (-dx * np.sin(b) - dz * np.cos(b)) / (2 * length), -dz / length
        force = k * (length - 0.5) + c * (by_b * db + by_s * ds)
        turn = 0.5 * omega**2 * slope - force * by_b + (rod / 2 + tip) * g * np.cos(b)
        return [db, ds, turn / swing, (-2 * force * by_s - slider * g) / slider]

    momentum = (base + 2 * spin(np.pi / 6)[0]) * 2 * np.pi
    start = [np.pi / 6, 0.5, 0.0, 0.0]
    found = solve_ivp(rates, (0, times[-1]), start, method="Radau", rtol=1e-9, atol=1e-11, t_eval=times)
    return found.y[1]


def test_stiff_governor_against_three_coordinates():
    # A05 with the initial speed of 2 pi rad/s; damping rate 4e4/3 1/s against a step of a millisecond
    errors = []
    for steps in (500, 1000):
        run = simulate(governor(), [1.0, 1.0], 1.0, steps)
        height = run.of("S")[:: steps // 10, 2]
        errors.append(np.abs(height - governor_in_three_coordinates(run.times[:: steps // 10])).max())
    assert errors[1] < 2e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)
    assert np.ptp(height) > 0.1
    assert np.abs(run.joint_residuals()).max() < 1e-12
    assert len(run.diagnosis.redundant_rows) == 7
