"""Intervals, ties and ranks against published examples and simulated coverage."""

import numpy as np
import pytest

from magsim.benchmark.statistics import (
    Interval,
    geometric_mean,
    holm,
    median,
    paired_p,
    power,
    sets_needed,
    standings,
)


def test_holms_steps():
    """Four p values, to be followed by hand; R: p.adjust(c(0.01, 0.04, 0.03, 0.005), "holm")."""
    assert holm([0.01, 0.04, 0.03, 0.005]).tolist() == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.9, 0.8]).tolist() == [1.0, 1.0]
    assert holm([]).tolist() == []


def test_power_is_cohens():
    """Paired t test, two-sided 5 %, d = 0.5: 34 pairs for a power of 0.8; d = 0.8: 15 (Cohen; G*Power)."""
    assert sets_needed(1.0, np.exp(0.5)) == 34
    assert sets_needed(1.0, np.exp(0.8)) == 15
    assert power(1.0, 15, np.exp(0.8)) == pytest.approx(0.8213, abs=2e-4)
    assert power(1.0, 12, 1.0) == pytest.approx(0.05)


def test_a_paired_test_is_scipys_on_logarithms():
    rng = np.random.default_rng(1)
    first, second = np.exp(rng.normal(size=(2, 12)))
    by_hand = np.log(first) - np.log(second)
    t = by_hand.mean() / (by_hand.std(ddof=1) / np.sqrt(12))
    from scipy import stats

    assert paired_p(first, second) == pytest.approx(2.0 * stats.t.sf(abs(t), 11))
    assert paired_p(first, first) == 1.0
    assert paired_p(first, 2.0 * first) < 1e-12
    assert np.isnan(paired_p(first[:3], second[:3]))


def test_intervals_cover_what_they_say():
    rng = np.random.default_rng(7)
    draws = np.exp(rng.normal(0.3, 0.5, (4000, 12)))
    found = [geometric_mean(one) for one in draws]
    assert 0.94 <= np.mean([one.low <= np.exp(0.3) <= one.high for one in found]) <= 0.96
    medians = [median(one) for one in draws]
    # order statistics cover at least what they say
    assert 0.95 <= np.mean([one.low <= np.exp(0.3) <= one.high for one in medians]) <= 0.975


def test_the_median_of_twelve_lies_between_the_third_and_the_tenth():
    """The classical interval of 12 values: ranks 3 and 10 cover 96.1 %."""
    assert median(np.arange(1.0, 13.0)) == Interval(6.5, 3.0, 10.0)
    assert median(np.array([0.0, 0.0, 4.0])) == Interval(0.0, 0.0, 4.0)
    assert np.isnan(median(np.array([np.nan])).value)


def table(**factors):
    rng = np.random.default_rng(3)
    world = np.exp(rng.normal(0.0, 0.3, 12))
    return {name: 0.1 * factor * world * np.exp(rng.normal(0.0, 0.05, 12)) for name, factor in factors.items()}


def test_methods_are_ranked_and_those_that_are_alike_tie():
    std_nt = table(tl16=1.0, good=0.5, better=0.49, bad=2.0)
    found = standings(std_nt, np.full(12, 10.0), np.full(12, 0.003), baseline="tl16")
    assert [one.method for one in found][2:] == ["tl16", "bad"]
    ranks = {one.method: (one.rank_low, one.rank_high) for one in found}
    assert ranks == {"good": (1, 2), "better": (1, 2), "tl16": (3, 3), "bad": (4, 4)}
    assert [one.rank for one in found] == [1, 2, 3, 4]
    assert [one.ties_leader for one in found] == [False, True, False, False]
    bad = found[-1]
    assert bad.over_baseline.value == pytest.approx(0.5, rel=0.05)
    assert bad.p_baseline < 1e-6
    assert bad.ir.value == pytest.approx(np.exp(np.mean(np.log(10.0 / std_nt["bad"]))))


def test_a_sure_difference_of_a_picotesla_is_a_tie():
    std_nt = {"tl16": np.linspace(0.0030, 0.0040, 12), "a": np.linspace(0.0025, 0.0034, 12)}
    found = standings(std_nt, np.ones(12), np.full(12, 0.001), baseline="tl16")
    assert found[1].p_leader < 0.001
    assert found[1].ties_leader
    assert (found[1].rank_low, found[1].rank_high) == (1, 2)


def test_what_fails_a_gate_leads_nothing():
    std_nt = table(tl16=1.0, cheat=1e-6, good=0.5)
    found = standings(
        std_nt, np.full(12, 10.0), np.full(12, 0.003), baseline="tl16", failed={"cheat": ("gain at 1 nT is 0",)}
    )
    assert [one.method for one in found] == ["good", "tl16", "cheat"]
    assert (found[-1].rank, found[-1].failed) == (0, ("gain at 1 nT is 0",))
    assert found[0].over_leader.value == 1.0


def test_few_sets_tell_nothing_for_sure():
    std_nt = {name: values[:3] for name, values in table(tl16=1.0, good=0.1).items()}
    found = standings(std_nt, np.full(3, 10.0), np.full(3, 0.003), baseline="tl16")
    assert np.isnan(found[0].p_baseline)
    assert {(one.rank_low, one.rank_high) for one in found} == {(1, 2)}
    one = standings({"tl16": np.array([0.1])}, np.ones(1), np.zeros(1), baseline="tl16")
    assert np.isnan(one[0].ir.low)


def test_sets_without_a_score_are_left_out_pairwise():
    std_nt = table(tl16=1.0, network=0.5)
    std_nt["network"][4:] = np.nan
    found = standings(std_nt, np.full(12, 10.0), np.full(12, 0.003), baseline="tl16")
    assert {one.method: one.sets for one in found} == {"network": 4, "tl16": 12}
    assert found[0].over_baseline.value == pytest.approx(2.0, rel=0.1)


def test_easy_sets_alone_make_no_better_rank():
    """A method that has been in the four easiest sets is ranked by its ratio to the baseline there."""
    world = np.linspace(1.0, 5.0, 12)
    std_nt = {"tl16": 0.1 * world, "good": 0.05 * world, "network": 0.08 * world}
    std_nt["network"] = np.where(np.arange(12) < 4, std_nt["network"], np.nan)
    assert np.nanmean(std_nt["network"]) < np.mean(std_nt["good"])
    found = standings(std_nt, np.full(12, 10.0), np.full(12, 0.003), baseline="tl16")
    assert [one.method for one in found] == ["good", "network", "tl16"]
