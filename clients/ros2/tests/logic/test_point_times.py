"""Times of points, in the units in which drivers write them."""

import numpy as np
import pytest

from mrol_ros.clouds import Cloud
from mrol_ros.point_times import NoTimes, TimesRule, find_rule, parse_times, times_s

STAMP_NS = 1_700_000_000_123_456_789
COUNT = 100
SWEEP_S = np.linspace(0, 0.1, COUNT)


def cloud(times, field="t"):
    points = np.ones((COUNT, 3), np.float32)
    return Cloud(points, times, field)


@pytest.mark.parametrize(
    ("times", "unit", "origin", "expected_s"),
    [
        ((SWEEP_S * 1e9).astype(np.uint32), "ns", "stamp", SWEEP_S),
        ((SWEEP_S * 1e6).astype(np.uint32), "us", "stamp", SWEEP_S),
        (SWEEP_S.astype(np.float32), "s", "stamp", SWEEP_S),
        ((SWEEP_S - 0.1).astype(np.float32), "s", "stamp", SWEEP_S - 0.1),
        (SWEEP_S * 1e3, "ms", "stamp", SWEEP_S),
        (1_700_000_000.123456789 + SWEEP_S, "s", "epoch", SWEEP_S),
        (STAMP_NS + SWEEP_S * 1e9, "ns", "epoch", SWEEP_S),
        ((STAMP_NS + (SWEEP_S * 1e9).astype(np.int64)).astype(np.uint64), "ns", "epoch", SWEEP_S),
        (12345.0 + SWEEP_S, "s", "first", SWEEP_S),
    ],
)
def test_the_unit_follows_from_the_spread(times, unit, origin, expected_s):
    rule, doubt = find_rule(cloud(times), STAMP_NS)
    assert rule == TimesRule(unit, origin)
    assert ("another clock" in doubt) == (origin == "first")
    assert np.abs(times_s(rule, cloud(times), STAMP_NS) - expected_s).max() < 1.1e-6


def test_times_of_a_simulated_clock_count_from_where_they_lie():
    stamp_ns = 700_000_000
    assert find_rule(cloud(SWEEP_S), stamp_ns)[0].origin == "stamp"
    assert find_rule(cloud(0.7 + SWEEP_S), stamp_ns)[0].origin == "epoch"
    with pytest.raises(NoTimes, match="may count from the stamp or from the begin of the clock"):
        find_rule(cloud(SWEEP_S), 10_000_000)


def test_what_is_no_time_is_told():
    for times, words in [
        (np.full(COUNT, 7.0), "field t is 7.0 at all points"),
        (np.linspace(0, 3e9, COUNT) * 1e9, "in none of s, ms, us, ns"),
        (np.where(np.arange(COUNT) == 5, np.nan, SWEEP_S), "a time that is no number"),
        (None, "none of the fields t, time"),
    ]:
        with pytest.raises(NoTimes) as error:
            find_rule(cloud(times), STAMP_NS)
        assert words in str(error.value)
    with pytest.raises(NoTimes, match=r"1\.5 s are believed"):
        times_s(TimesRule("s", "stamp"), cloud(SWEEP_S * 100), STAMP_NS)
    empty = Cloud(np.full((COUNT, 3), np.nan, np.float32), SWEEP_S, "t")
    with pytest.raises(NoTimes, match="no point of the cloud is a return"):
        find_rule(empty, STAMP_NS)


def test_times_of_points_that_are_no_returns_are_not_looked_at():
    points = np.ones((COUNT, 3), np.float32)
    points[3], points[4] = np.nan, 0
    times = SWEEP_S.copy()
    times[3], times[4] = np.nan, 1e300
    found = Cloud(points, times, "time")
    rule, _ = find_rule(found, STAMP_NS)
    seconds = times_s(rule, found, STAMP_NS)
    assert np.isnan(seconds[[3, 4]]).all()
    assert np.isfinite(np.delete(seconds, [3, 4])).all()


def test_numbers_at_the_ends_are_no_times():
    ends = np.array([np.iinfo(np.int64).min, np.iinfo(np.int64).max] * (COUNT // 2))
    for unit in ("s", "ms", "us", "ns"):
        with pytest.raises(NoTimes):
            times_s(TimesRule(unit, "stamp"), cloud(ends), STAMP_NS)
        with pytest.raises(NoTimes):
            times_s(TimesRule(unit, "epoch"), cloud(np.full(COUNT, np.iinfo(np.uint64).max, np.uint64)), STAMP_NS)


def test_an_option_names_field_unit_and_origin():
    assert parse_times("") is None
    assert parse_times("t:ns:stamp") == ("t", TimesRule("ns", "stamp"))
    for text in ("t", "t:ns", "t:h:stamp", "t:ns:now", ":ns:stamp", "t:ns:stamp:x"):
        with pytest.raises(ValueError, match="FIELD:UNIT:FROM"):
            parse_times(text)
