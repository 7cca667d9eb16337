"""Which responses have slopes, by which parameters, and what is said of the others."""

import numpy as np
import pytest

from studies.gunner.occupant_responses import responses_of
from studies.gunner.slopes.responses import NO_SLOPES, PARAMETERS, SLOPED, response_slopes, value_of
from studies.gunner.uncertain import NOMINAL, case_of
from workbench.engine import simulate


def test_every_response_has_slopes_or_a_reason():
    from studies.gunner.cases import system

    run = simulate(system(case_of("braking", {})), np.zeros(0), 0.02, 20)
    assert set(responses_of(run)) <= set(SLOPED) | set(NO_SLOPES)
    assert not set(SLOPED) & set(NO_SLOPES)
    assert set(PARAMETERS) == set(NOMINAL) - {"hands", "posture", "level", "start", "fires_late"}


@pytest.mark.parametrize(
    ("response", "reason"),
    [
        ("ejected", "'ejected' has no slopes: it is 0 or 1; take the slopes of the time at which"),
        ("rise_at", "'rise_at' has no slopes: the place of a maximum, not its height; take rise"),
        ("grip_force", "'grip_force' has no slopes: the largest of two bushings' forces at nodes"),
        ("first_wheel_lift", "forces of tyres are known without slopes; take peak_roll"),
        ("height", "'height' has no slopes: no such response; with slopes are deviation, g1"),
    ],
)
def test_what_has_no_slopes_says_why(response, reason):
    with pytest.raises(ValueError, match=reason):
        response_slopes("braking", {}, [response], ["grip"])


def test_a_time_of_what_does_not_happen_has_no_slopes():
    for response in ("ejected_at", "grip_lost_at", "seat_lost_at"):
        with pytest.raises(
            ValueError, match=rf"'{response}' has no slopes: it does not happen within 0.01 s"
        ):
            response_slopes("braking", {}, [response], ["grip"], t_end=0.01)
    # a hand that never held has lost nothing
    with pytest.raises(ValueError, match="'grip_lost_at' has no slopes: it does not happen"):
        response_slopes("braking", {"hands": "none"}, ["grip_lost_at"], ["grip"], t_end=0.01)


def test_parameters_that_are_choices_or_do_nothing_are_refused():
    with pytest.raises(
        ValueError, match="'hands' is a choice: no slopes; with slopes are grip, k_shoulder_tx"
    ):
        response_slopes("braking", {}, ["rise"], ["hands"])
    with pytest.raises(ValueError, match="'fires_late' is no parameter; those with slopes are grip"):
        response_slopes("braking", {}, ["rise"], ["fires_late"])
    with pytest.raises(ValueError, match="'turn' does nothing in braking: no slopes"):
        response_slopes("braking", {}, ["rise"], ["turn"])


def test_values_are_those_that_run():
    assert value_of("braking", {}, "mass") == pytest.approx(77.0)
    assert value_of("rollover", {}, "seat_rate") == 20_000.0
    assert value_of("braking", {}, "seat_rate") == 10_000.0
    assert value_of("step steer", {}, "turn") == pytest.approx(360.0)
    assert value_of("rollover", {"friction": 1.1}, "friction") == 1.1
    assert value_of("braking", {}, "deceleration") == 7.0
    assert value_of("braking", {"k_elbow": 0.5}, "k_elbow") == 0.5
    assert value_of("braking", {"grip": 371.0}, "grip") == 371.0
