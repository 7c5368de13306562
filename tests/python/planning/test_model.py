# SPDX-License-Identifier: Apache-2.0
"""Every equation of the cost model against values worked out by hand; arithmetic stands in the comments."""

from __future__ import annotations

import math

import numpy as np
import pytest
from deltalux import OptionError, model

ROOT3 = 1.7320508075688772

# function, arguments, value. Where t, u are given, t = 2 and u = 3 unless the form asks for t = u.
BY_HAND = [
    # the disc has two sides: 2 pi / 4 pi
    ("meeting_probability", (2 * math.pi, 4 * math.pi), {}, 0.5),
    ("meeting_probability", (3.0, 12.0), {}, 0.25),
    ("sphere_radius", (16.0, 0.5, 3), {}, 2.0),
    # 800 · (1/4)²
    ("rays_in_sphere", (800, 0.5, 2), {}, 50.0),
    # 0.6^18 = 0.046656³ = 1.0155996e-4, times 1,048,576; not 94.6
    ("rays_in_sphere", (1024**2, 0.6, 9), {}, 106.49333),
    # 2 · 800 · (1/2)^(2·3-2)
    ("rebuild_time", (800, 0.5, 3, 2.0), {}, 100.0),
    # S_1 is cut from all rays
    ("rebuild_time", (800, 0.5, 1, 2.0), {}, 1600.0),
    ("rebuilds", (0.5, 4), {}, 4096.0),
    # 2^k = 4096^(1/3) = 16
    ("levels", (4096, 0.5), {}, 4.0),
    # 8, 4, 2 are larger than 1.5; 1 is not
    ("levels_above_disc", (8.0, 1.5, 0.5), {}, 2.0),
    # 1 is not larger than 1, also where logarithms round: 10^-3 of 1
    ("levels_above_disc", (8.0, 1.0, 0.5), {}, 2.0),
    ("levels_above_disc", (1.0, 0.001, 0.1), {}, 2.0),
    ("levels_above_disc", (1.0, 1.0, 0.5), {}, 0.0),
    # three rays with p = 1/4: 3 · 1/16 · 3/4 + 1/64
    ("divided_share", (3, 0.5, 1, 2), {}, 0.15625),
    ("divided_share", (1, 0.5, 1, 2), {}, 0.0),
    ("divided_share", (5, 0.5, 0, 5), {}, 1.0),
    # min(4³, 10) times that share
    ("limited_rebuilds", (10, 3, 0.5, 2, 2), {}, 1.5625),
    ("limited_rebuilds", (1000, 3, 0.5, 2, 2), {}, 10.0),
    # eq. 1: 4/3 · 3 · 12 · 10 = 480 and eq. 3
    ("sphere_cache_cost", (1000, 12, 0.5, 2.0, 3.0), {}, 2208.0),
    # 27/4 · 9 + 40/3
    ("sphere_cache_cost", (1000, 1), {}, 74.083333333),
    # 4/3 · 3 · 12 · 9^(1/3) = 48 · 2.080083823 = 99.844023503, and 384
    ("sphere_cache_cost", (9, 12, 0.5, 2.0, 3.0, "printed"), {}, 483.844023503),
    # eq. 2: 3 · 100 · 40 · (1/10)²
    ("inner_cost", (100, 40, 0.5, 5.0, 3.0), {}, 120.0),
    # eq. 3: 2 · 12 · 4 · (10 - 1) · 2
    ("rebuild_cost", (1000, 12, 0.5, 2.0), {}, 1728.0),
    # 96 · (9 - 1)^(1/3) · 2; corrected 96 · (2.080083823 - 1) · 2
    ("rebuild_cost", (9, 12, 0.5, 2.0, "printed"), {}, 384.0),
    ("rebuild_cost", (9, 12, 0.5, 2.0), {}, 207.376094028),
    # 96 · (8.660254038 - 1) · 2
    ("rebuild_cost", (1000, 12, 0.5, 2.0, "spacing"), {}, 1470.768775),
    ("rebuild_cost", (1, 12, 0.5, 2.0), {"form": "spacing"}, 0.0),
    ("best_ratio", (), {}, 0.6666666667),
    ("best_ratio", ("surface",), {}, 0.6065306597),
    # eq. 4, 5: √3 · 2 · 3 / 2
    ("grid_radius", (27, 2.0), {}, 3 * ROOT3),
    ("grid_spacing", (27, 3 * ROOT3), {}, 2.0),
    # eq. 6: 4/3 · 2 · 5 · 3
    ("grid_inner_cost", (27, 5, 2.0), {}, 40.0),
    # eq. 7: 3 · 2 · 10 · 64 / 16; eq. 8: half of it
    ("deep_index_cost", (64, 10, 2, 3.0), {"traversal": True}, 240.0),
    ("deep_index_cost", (64, 10, 2, 3.0), {}, 120.0),
    # eq. 9: 2³ = 512^(1/3)
    ("index_depth", (512,), {}, 3.0),
    # eq. 10: 3 · 10 · 4
    ("disc_index_cost", (64, 10, 3.0), {}, 120.0),
    ("disc_index_cost", (64, 10, 3.0), {"traversal": True}, 240.0),
    # eq. 11: 900 / 9
    ("affected_rays", (900, 1.0, 3.0), {}, 100.0),
    # eq. 12: 12 rays, 1 · 12 · 4 · 18 + 4/3 · 3 · 12 · 10; printed (60 - 1) · 4 + 4/3 · 3 · 6 · 10
    ("static_cache_cost", (1000, 6, 0.5, 1.0, 3.0), {}, 1344.0),
    ("static_cache_cost", (1000, 6, 0.5, 1.0, 3.0, "printed"), {}, 476.0),
    # 48 · 7.660254038 · 2 + 480
    ("static_cache_cost", (1000, 6, 0.5, 1.0, 3.0, "spacing"), {}, 1215.384388),
    # 27/4 + 4/3 = 97/12; 2 / (1/4 · 1/2) + 4/3 · 3; 0.8660254 · 27/4 + 4/3; 8.08 · 2
    ("cache_constant", (), {}, 8.083333333),
    ("cache_constant", (0.5, 2.0, 3.0), {}, 20.0),
    ("cache_constant", (), {"form": "spacing"}, 7.179004809),
    ("cache_constant", (2 / 3, 2.0, 2.0, "printed"), {}, 16.16),
    # eq. 13: 8.08 · 2 · 6 · 10; corrected 2 · 97/12 · 2 · 6 · 10
    ("static_cache_limit", (1000, 6, 2 / 3, 2.0, 2.0, "printed"), {}, 969.6),
    ("static_cache_limit", (1000, 6, 2 / 3, 2.0, 2.0), {}, 1940.0),
    ("static_cache_limit", (1000, 6, 2 / 3, 2.0, 2.0, "spacing"), {}, 1722.961154),
    # eq. 14: 2 · 3 · 6 · 10
    ("static_index_cost", (1000, 6, 3.0), {}, 360.0),
    # eq. 15: 8.08 · 2 · 6 · 10; corrected 2 · 6 · 4 · 18 + 4 · 6 · 10, and 2 · 100 to find the rays
    ("moving_cache_cost", (1000, 6, 2 / 3, 2.0, 2.0, "printed"), {}, 969.6),
    ("moving_cache_cost", (1000, 6, 2 / 3, 2.0, 2.0, "printed", 100), {}, 1169.6),
    ("moving_cache_cost", (1000, 6, 0.5, 2.0, 3.0), {}, 1104.0),
    ("moving_cache_cost", (1000, 6, 0.5, 2.0, 3.0), {"ray_count": 100}, 1304.0),
    ("moving_cache_cost", (1000, 6, 0.5, 1.0, 3.0, "spacing"), {}, 607.692194),
    # right side of eq. 16: 3 · 100 · 10; with rejection 3 · 100 + 3 · 6 · 10
    ("moving_index_cost", (1000, 100, 3.0), {}, 3000.0),
    ("moving_index_cost", (1000, 100, 3.0), {"affected_count": 6}, 480.0),
    # eq. 16, 17: 20/3 · 1/4; 8.08 / 4
    ("moving_cost_ratio", (1.0, 2.0, 0.5, 2.0, 3.0), {}, 1.666666667),
    ("moving_cost_ratio", (1.0, 2.0), {"form": "printed"}, 2.02),
    # eq. 18: (12/97)^(1/2), (3/20)^(1/2), 7.179004809^(-1/2)
    ("crossover", (), {"form": "printed"}, 0.35),
    ("crossover", (), {}, 0.351726233),
    ("crossover", (0.5, 2.0, 3.0), {}, 0.387298335),
    ("crossover", (), {"form": "spacing"}, 0.3732226),
    # 8 · 4³; 2 · 4³
    ("surface_rebuilds", (0.5, 3), {}, 512.0),
    ("surface_rebuilds", (0.5, 3, 2.0), {}, 128.0),
    # r_0 / d = (32768 / 8)^(1/2) = 2^6
    ("surface_levels", (32768, 0.5), {}, 6.0),
    ("surface_levels", (4, 0.5), {}, 0.0),
    # 8 · 6 · 3 · 10 · 4; and at Q = e^(-1/2), n_P = 8 e: one level, 8 e
    ("surface_rebuild_cost", (32768, 10, 0.5, 3.0), {}, 5760.0),
    ("surface_rebuild_cost", (21.74625463, 1), {}, 21.74625463),
    # 8 · 3 · 10; two discs are two tests
    ("surface_inner_cost", (32768, 10, 3.0), {}, 240.0),
    ("surface_inner_cost", (2, 10, 3.0), {}, 60.0),
    ("surface_cache_cost", (32768, 10, 0.5, 3.0, 3.0), {}, 6000.0),
    # 3/4 · 8 · 3 · 10; 24576 · 4/3 / 8 = 4^6 cells
    ("surface_index_cost", (24576, 10, 3.0), {}, 180.0),
    ("surface_index_cost", (24576, 10, 3.0), {"traversal": True}, 1080.0),
    ("surface_index_cost", (1, 10, 3.0), {}, 30.0),
    # 6 / (8 + 8 · 6 · 4)
    ("surface_crossover", (32768, 0.5), {}, 0.173205081),
    # 5 · (8/π · 2 · 1 + 16.20544 · 2/π · 3 · 2), 16.20544 by quadrature over the normals
    ("ray_map_cost", (8, 5, 2.0, 3.0), {}, 334.965897),
    # 28.1 · 10 - 53 = 228; 48 · ln 10^4 = 48 · 9.210340372 = 442.096337856, less 164
    ("measured_cache_tests", (1000, 5), {}, 1140.0),
    ("measured_cache_tests", (10_000, 5, "surface"), {}, 1390.481689),
    # (10 / 228)^(1/2)
    ("measured_crossover", (1000,), {}, 0.209426955),
]


@pytest.mark.parametrize(("name", "arguments", "options", "value"), BY_HAND)
def test_by_hand(name, arguments, options, value):
    assert getattr(model, name)(*arguments, **options) == pytest.approx(value, rel=1e-6, abs=1e-12)


def test_every_function_and_equation_is_covered():
    functions = {name for name in model.__all__ if name != "EQUATIONS"}
    assert {name for name, *_ in BY_HAND} == functions
    assert sorted(model.EQUATIONS) == list(range(1, 19))
    for number, function in model.EQUATIONS.items():
        assert function.__name__ in functions
        assert f"eq. {number}" in function.__doc__ or f"equation {number}" in function.__doc__


def test_rebuilding_is_the_sum_over_levels():
    """Eq. 3 against its left side: Q = 1/2, k = 5 and so n_P = 8^5, term by term."""
    level = np.arange(1, 6)
    assert model.levels(8**5, 0.5) == pytest.approx(5)
    terms = model.rebuilds(0.5, level) * model.rebuild_time(7, 0.5, level, 2.0)
    assert terms == pytest.approx([112, 224, 448, 896, 1792])  # 8^i · 2 · 7 · 4^(1-i)
    assert terms.sum() == pytest.approx(model.rebuild_cost(8**5, 7, 0.5, 2.0))
    assert terms.sum() != pytest.approx(model.rebuild_cost(8**5, 7, 0.5, 2.0, "printed"), rel=1e-3)


def test_surface_rebuilding_is_the_sum_over_levels():
    level = np.arange(1, 7)
    terms = model.surface_rebuilds(0.5, level) * model.rebuild_time(7, 0.5, level, 2.0)
    assert terms == pytest.approx([448] * 6)  # 8 · 4^i · 2 · 7 · 4^(1-i)
    assert terms.sum() == pytest.approx(model.surface_rebuild_cost(8 * 4**6, 7, 0.5, 2.0))


def test_equations_follow_from_each_other():
    counts, lines = np.array([8.0, 1e3, 1e6]), 50.0
    spacing = model.grid_spacing(counts, 3.0)
    assert model.grid_radius(counts, spacing) == pytest.approx(np.full(3, 3.0))
    inner = model.inner_cost(counts, lines, spacing, 3.0, 2.0)
    assert inner == pytest.approx(model.grid_inner_cost(counts, lines, 2.0))
    depth = model.index_depth(counts)
    for traversal in (False, True):
        deep = model.deep_index_cost(counts, lines, depth, 2.0, traversal)
        assert deep == pytest.approx(model.disc_index_cost(counts, lines, 2.0, traversal))
    for form in ("corrected", "spacing"):
        assert model.moving_cost_ratio(model.crossover(0.5, 2, 3, form), 1, 0.5, 2, 3, form) == pytest.approx(
            1
        )
    many = 1e24  # so that n - 1 is n
    limit = model.static_cache_limit(many, lines, 0.5, 2.0, 3.0)
    assert model.static_cache_cost(many, lines, 0.5, 2.0, 3.0) == pytest.approx(limit, rel=1e-7)
    size = model.surface_crossover(1e5)
    cache = model.surface_cache_cost(1e5, size**2 * lines)
    assert cache == pytest.approx(model.surface_index_cost(1e5, lines))


@pytest.mark.parametrize("spread", ["volume", "surface"])
def test_best_ratio_costs_least(spread):
    cost = model.rebuild_cost if spread == "volume" else model.surface_rebuild_cost
    ratios = np.linspace(0.05, 0.95, 9001)
    assert ratios[np.argmin(cost(1e6, 1, ratios))] == pytest.approx(model.best_ratio(spread), abs=1e-4)


def test_printed_equation_12_is_not_that_of_8_08():
    """Without 1 / (1 - Q) it gives 9/4 + 4/3 = 3.58 and not the 8.08 printed next."""
    assert model.static_cache_cost(1e18, 1, form="printed") / 1e6 == pytest.approx(3.583333, rel=1e-5)


def test_no_size_at_which_the_cache_wins_against_an_index_that_rejects():
    size = np.linspace(0.01, 1, 100)
    met = model.affected_rays(1e6, size, 1.0)
    for count in (10, 1e3, 1e6):
        cache = model.moving_cache_cost(count, met, ray_count=1e6)
        assert (model.moving_index_cost(count, 1e6, affected_count=met) < cache).all()


def test_limited_rebuilds_peak_at_level_9_at_the_papers_sizes():
    level = np.arange(1, 14)
    for count in (1e4, 1e5, 1e6):
        rebuilds = model.limited_rebuilds(count, 1024**2, 0.6, level)
        assert (np.diff(rebuilds[:9]) > -1e-6 * count).all()
        assert 0.74 < rebuilds[9] / rebuilds[8] < 0.77
        assert (rebuilds[10:] < 1e-6 * count).all()


def test_arrays_broadcast_and_numbers_stay_numbers():
    table = model.sphere_cache_cost(np.array([[8], [27]]), np.array([1, 2, 3]))
    assert table.shape == (2, 3)
    assert table[1, 2] == pytest.approx(model.sphere_cache_cost(27, 3))
    for name, arguments, options, _ in BY_HAND:
        assert np.ndim(getattr(model, name)(*arguments, **options)) == 0
        assert isinstance(getattr(model, name)(*arguments, **options), np.floating)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: model.sphere_cache_cost(0, 1), "sample_count: found 0, expected at least 1"),
        (lambda: model.sphere_cache_cost([5, 0.5], 1), "sample_count: found 0.5, expected at least 1"),
        (lambda: model.sphere_cache_cost(1, -1), "ray_count: found -1, expected at least 0"),
        (lambda: model.sphere_cache_cost(1, math.nan), "ray_count: found nan, expected finite numbers"),
        (lambda: model.sphere_cache_cost("many", 1), "sample_count: found 'many', expected finite numbers"),
        (lambda: model.sphere_cache_cost(True, 1), "sample_count: found True, expected finite numbers"),
        (lambda: model.sphere_cache_cost([[1], [1, 2]], 1), "expected finite numbers"),
        (lambda: model.rebuild_cost(8, 1, 1.0), "ratio: found 1, expected a number between 0 and 1"),
        (lambda: model.rebuild_cost(8, 1, 0.5, 0.0), "sphere_test: found 0, expected a number above 0"),
        (lambda: model.rebuild_cost(8, 1, form="right"), "form: found 'right', expected one of"),
        (lambda: model.rebuild_time(8, 0.5, 0), "level: found 0, expected an integer of at least 1"),
        (lambda: model.rays_in_sphere(8, 0.5, 1.5), "level: found 1.5, expected an integer of at least 0"),
        (lambda: model.rebuilds(0.1, 200), "rebuilds: found a result beyond"),
        (lambda: model.inner_cost(8, 1, 2.0, 1.0), "radius: found 2.0, expected at most outer_radius, 1.0"),
        (lambda: model.affected_rays(8, 2.0, 1.0), "object_radius: found 2.0, expected at most"),
        (lambda: model.crossover(0.5, form="printed"), "form: found 'printed' with ratio 0.5"),
        (lambda: model.crossover(2 / 3, 1, 2, "printed"), "expected ratio 2/3 and sphere_test = disc_test"),
        (lambda: model.best_ratio("line"), "spread: found 'line', expected one of"),
        (lambda: model.measured_crossover(10), "sample_count: found 10, expected at least 1000"),
        (lambda: model.rebuild_cost([1, 2], [1, 2, 3]), "expected ones that broadcast"),
    ],
)
def test_refuses(call, text):
    with pytest.raises(OptionError) as caught:
        call()
    assert text in str(caught.value)
