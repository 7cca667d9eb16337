"""IHS: its rule against a plain version, its options and what it refuses."""

import numpy as np
import pytest

import doe
from doe.portable import _kernels_draws
from doe.portable.draws import park_miller, splitmix


def plain_ihs(n, d, duplication, target, draws, pool=0):
    """The rule of Beachkofski & Grandhi as its description reads, one candidate after the other."""
    free = [list(range(1, n + 1)) for _ in range(d)]
    last = [int(_kernels_draws.below(draws, n)) + 1 for _ in range(d)]
    chosen = [last]
    for k, level in enumerate(last):
        free[k][level - 1] = n
    for count in range(n - 1, 1, -1):
        entries = duplication * count
        made = min(entries, pool) if pool else entries
        candidates = np.zeros((made, d), dtype=int)
        for k in range(d):
            stock = free[k][:count] * duplication
            for left in range(entries, entries - made, -1):
                j = int(_kernels_draws.below(draws, left))
                candidates[left - 1 - (entries - made), k] = stock[j]
                stock[j] = stock[left - 1]
        squares = ((candidates[:, None, :] - np.array(chosen)[None]) ** 2).sum(axis=2).min(axis=1)
        best = int(np.argmin(np.abs(np.sqrt(squares) - target)))
        chosen.append(candidates[best].tolist())
        for k, level in enumerate(chosen[-1]):
            free[k][free[k].index(level)] = free[k][count - 1]
    if n > 1:
        chosen.append([free[k][0] for k in range(d)])
    return np.array(chosen[::-1])


@pytest.mark.parametrize(
    ("n", "d", "duplication", "pool"),
    [(1, 2, 5, 0), (2, 3, 5, 0), (12, 1, 2, 0), (30, 2, 5, 0), (25, 7, 3, 0), (40, 20, 5, 0), (60, 5, 5, 40)],
)
@pytest.mark.parametrize("factor", [1.0, 1.6])
def test_the_kernel_agrees_with_the_plain_rule(n, d, duplication, pool, factor):
    spacing = factor * doe.published_spacing(n, d)
    ours = doe.ihs_cells(
        n,
        d,
        duplication=duplication,
        spacing=spacing,
        pool=pool or None,
        draws=splitmix(np.random.default_rng(n)),
    )
    plain = plain_ihs(n, d, duplication, spacing, splitmix(np.random.default_rng(n)), pool)
    np.testing.assert_array_equal(ours, plain)


def test_the_published_target_pulls_points_together_in_twenty_dimensions():
    rng = np.random.default_rng(4)
    random = np.median([doe.min_distance(doe.centred_lhs(50, 20, rng=rng)) for _ in range(15)])
    published = np.median([doe.min_distance(doe.ihs(50, 20, rng=rng)) for _ in range(15)])
    auto = np.median([doe.min_distance(doe.ihs(50, 20, target="auto", rng=rng)) for _ in range(15)])
    assert published < 0.92 * random < random < auto


def test_polishing_lowers_phi_p():
    raw = doe.ihs(30, 4, rng=np.random.default_rng(2))
    polished = doe.ihs(30, 4, polish=5_000, rng=np.random.default_rng(2))
    assert doe.phi_p(polished) < doe.phi_p(raw)
    np.testing.assert_allclose(np.sort(polished, axis=0), np.sort(raw, axis=0))


def test_random_placement_stays_in_the_cells_of_the_centred_design():
    centred = doe.ihs(20, 3, rng=np.random.default_rng(5))
    placed = doe.ihs(20, 3, placement="random", rng=np.random.default_rng(5))
    np.testing.assert_array_equal(np.floor(placed * 20), np.floor(centred * 20))
    assert not np.array_equal(placed, centred)


def test_the_spacings_are_functions_of_n_and_d_alone():
    assert doe.published_spacing(64, 3) == 16.0
    assert doe.auto_spacing(40, 6) == doe.auto_spacing(40, 6)
    assert doe.auto_spacing(1, 3) == 1.0
    assert doe.auto_spacing(6000, 2) < 6000


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"target": "best"}, "target needs one of published, auto, got 'best'"),
        ({"placement": "corner"}, "placement needs one of centred, random, got 'corner'"),
        ({"duplication": 0}, "duplication needs a whole number >= 1, got 0"),
        ({"pool": 0}, "pool needs at least one candidate per step, got 0"),
        ({"polish": -1}, "polish needs a number of swaps >= 0, got -1"),
    ],
)
def test_bad_options_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        doe.ihs(5, 2, **options, rng=np.random.default_rng(1))


def test_a_bad_seed_of_the_published_generator_is_refused():
    with pytest.raises(ValueError, match=r"seed of the Park-Miller generator needs 1\.\.2147483646, got 0"):
        park_miller(0)
