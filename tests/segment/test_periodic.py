import dataclasses

import numpy as np
import pytest

from sample_logs.airframe import LIGHT, S500
from sample_logs.instruments import AutopilotFlaws
from sample_logs.recorded import to_recording
from sample_logs.synthetic import fly
from segment import Basis, Motion, PeriodicProfile, TooLittle, cut, periodic_profiles
from segment.fidelity import character, compare, ks_distance, periodic_character
from segment.periodic import PROFILED, ProfileMaker
from segment.ring import seam_costs, stitch, uniform, window, window_means
from tests.segment.test_cut import still

TEN_HZ = AutopilotFlaws(battery_period_s=0.1, jitter_s=0.002)


def made(airframe, seed, flaws=TEN_HZ):
    recording = to_recording(fly(airframe, seed=seed), seed=seed, flaws=flaws)
    segments = cut(recording)
    return recording, segments, periodic_profiles(recording, segments)


@pytest.mark.parametrize("airframe", [S500, LIGHT], ids=lambda a: a.name)
@pytest.mark.parametrize("seed", range(4))
def test_a_profile_keeps_what_the_damage_depends_on(airframe, seed):
    _, _, profiles = made(airframe, seed)
    for motion in PROFILED:
        profile = profiles[motion]
        f, mean = profile.fidelity, profile.current_A.mean()
        assert abs(f.mean_A) < 1e-9  # by construction
        assert abs(f.rms_A) < 0.005 * mean
        # a hover that begins with the end of a braking loses it to a seam that matches
        assert np.max(np.abs(f.percentile_A)) < 0.15 * mean
        assert f.ripple_spectrum < 0.25  # two halves of one flight differ by 0.1 to 0.2
        assert f.ramp_rate < 0.08
        assert f.seam_A <= 2 * f.usual_step_A
        assert abs(f.shift_A) < 0.05 * mean
        assert 20 <= profile.period_s <= 60


def test_the_stated_deviations_are_those_of_the_waveform():
    recording, segments, profiles = made(S500, 1)
    for motion, profile in profiles.items():
        inside = np.zeros(recording.time_s.size, dtype=bool)
        for s in segments:
            if s.motion is motion:
                inside |= (recording.time_s >= s.start_s) & (recording.time_s < s.stop_s)
        source = recording.current_A[inside]
        wave, f = profile.current_A, profile.fidelity
        assert f.mean_A == pytest.approx(wave.mean() - source.mean(), abs=0.02)
        rms = np.sqrt(np.mean(wave**2)) - np.sqrt(np.mean(source**2))
        assert f.rms_A == pytest.approx(rms, abs=0.02)
        percentiles = np.percentile(wave, (1, 50, 99)) - np.percentile(source, (1, 50, 99))
        assert f.percentile_A == pytest.approx(percentiles, abs=0.15)
        assert abs(wave[0] - wave[-1]) <= f.seam_A + 1e-9


def test_a_profile_is_made_of_recorded_samples_shifted_and_stretched():
    recording, _, profiles = made(LIGHT, 2)
    for profile in profiles.values():
        f = profile.fidelity
        mean = profile.current_A.mean()
        raw = (profile.current_A - mean) / f.gain + mean - f.shift_A
        nearest = np.min(np.abs(raw[:, None] - recording.current_A[None, :]), axis=1)
        assert nearest.max() < 1e-6


def test_profiles_do_not_depend_on_the_clock():
    recording, segments, profiles = made(S500, 3)
    later = dataclasses.replace(recording, time_s=recording.time_s + 1000.0)
    again = periodic_profiles(later, cut(later))
    for motion in PROFILED:
        assert again[motion].period_s == pytest.approx(profiles[motion].period_s, abs=0.3)
        assert again[motion].fidelity.ramp_rate < 0.08
    assert len(segments) == len(cut(later))


def test_a_motion_with_too_little_data_says_so_with_the_numbers():
    recording = still(n=90)
    profiles = periodic_profiles(recording, cut(recording))
    assert isinstance(profiles[Motion.HOVER], TooLittle)
    assert "8.9 s of hover" in profiles[Motion.HOVER].reason
    assert "10 s and 100 samples" in profiles[Motion.HOVER].reason
    assert profiles[Motion.VERTICAL].source_s == 0


def test_what_rests_on_no_velocity_gets_no_profile():
    recording = still(n=900, velocity_m_s=None)
    assert [s.basis for s in cut(recording)] == [Basis.NONE]
    profiles = periodic_profiles(recording, cut(recording))
    assert all(isinstance(p, TooLittle) for p in profiles.values())
    assert {m for m, p in profiles.items() if p.source_s} == {Motion.MIXED}
    assert "For 89.9 s neither" in profiles[Motion.MIXED].reason
    assert "0 segments" not in profiles[Motion.MIXED].reason


def test_a_constant_current_gives_a_constant_profile_without_any_deviation():
    recording = still(n=600)
    profile = periodic_profiles(recording, cut(recording))[Motion.HOVER]
    assert isinstance(profile, PeriodicProfile)
    assert set(profile.current_A.tolist()) == {10.0}
    f = profile.fidelity
    zeros = (f.mean_A, f.rms_A, *f.percentile_A, f.ripple_spectrum, f.ramp_rate, f.seam_A)
    assert max(np.abs(zeros)) == 0


def test_a_periodic_current_comes_back_as_whole_periods():
    n, wave_s = 944, np.pi  # 30 of them, never the same samples twice
    current = 10 + 2 * np.sin(2 * np.pi * np.arange(n) * 0.1 / wave_s)
    recording = still(n=n, current_A=current)
    profile = periodic_profiles(recording, cut(recording))[Motion.HOVER]
    whole = profile.period_s / wave_s
    assert whole == pytest.approx(round(whole), abs=0.02)  # of a sample
    assert profile.fidelity.ramp_rate < 0.03


def test_the_period_obeys_its_limits():
    recording, segments, _ = made(S500, 0)
    maker = ProfileMaker(shortest_s=12.0, longest_s=15.0)
    for profile in periodic_profiles(recording, segments, maker).values():
        assert 12.0 <= profile.period_s <= 15.0 + 1e-9


def test_stitching_finds_where_level_and_slope_match():
    t = np.arange(100) * 0.1
    before, after = np.sin(t[:60]), np.sin(t[50:] + 0.3)
    ring = stitch([before, after], trim=15)
    joint = int(ring.joints[1])
    x = ring.current_A
    assert abs(x[joint] - x[joint - 1]) < 0.15  # the sine's own step is at most 0.1
    slope = (x[joint - 1] - x[joint - 2], x[joint + 1] - x[joint])
    assert slope[0] * slope[1] > 0


def test_stitching_prefers_the_right_slope_to_the_very_same_level():
    rising = np.arange(41) * 0.1 - 2
    falls_then_rises = np.concatenate([1.5 - 0.1 * np.arange(6), 1.02 + 0.1 * np.arange(60)])
    ring = stitch([rising, falls_then_rises], trim=15)
    joint = int(ring.joints[1])
    assert np.diff(ring.current_A)[joint - 2 : joint + 5] == pytest.approx(0.1, abs=0.021)


def test_stitching_keeps_all_samples_when_told_to_trim_none():
    parts = [np.arange(5.0), np.arange(7.0)]
    assert stitch(parts, 0).current_A.tolist() == [*range(5), *range(7)]


def test_a_window_of_the_whole_ring_reports_every_joint():
    ring = stitch([np.zeros(10), np.ones(10), np.full(10, 3.0)], 0)
    wave, jump = window(ring, 5, 30)
    assert sorted(wave.tolist()) == [0.0] * 10 + [1.0] * 10 + [3.0] * 10
    assert jump == 3.0
    assert window(ring, 0, 5)[1] == 0.0
    assert window(ring, 0, 15)[1] == 1.0


def test_window_means_and_seams_agree_with_the_windows_themselves():
    rng = np.random.default_rng(0)
    ring = stitch([rng.normal(size=20), rng.normal(size=15)], 0)
    lengths = np.array([7, 20])
    x, n = ring.current_A, ring.current_A.size
    starts = np.arange(n)
    means, seams = window_means(x, lengths, starts), seam_costs(ring, lengths, starts)
    for row, length in enumerate(lengths):
        for start in range(n):
            wave, _ = window(ring, start, int(length))
            assert means[row, start] == pytest.approx(wave.mean(), abs=1e-12)
            follows = abs(x[(start + length) % n] - x[start])
            before = abs(x[(start + length - 1) % n] - x[start - 1])
            assert seams[row, start] == pytest.approx(follows + before, abs=1e-12)


def test_samples_are_put_on_a_uniform_clock_unchanged_and_missing_ones_are_held():
    t = np.array([0.0, 0.11, 0.19, 0.3, 0.6, 0.7])
    assert uniform(t, np.arange(6.0), 0.1).tolist() == [0, 1, 2, 3, 3, 4, 4, 5]


def test_ks_distance_of_disjoint_and_of_equal_samples():
    a = np.arange(10.0)
    assert ks_distance(a, a + 100) == 1.0
    assert ks_distance(a, a) == 0.0
    assert ks_distance(a, np.sort(np.concatenate([a[:5], a]))) == pytest.approx(1 / 6)


def test_the_spectrum_notices_a_missing_ripple_and_the_steps_a_slower_one():
    t = np.arange(600) * 0.1
    slow, fast = np.sin(2 * np.pi * 1.0 * t), np.sin(2 * np.pi * 4.0 * t)
    source = character([15 + slow + fast], 0.1)
    without = compare(periodic_character(15 + slow, 0.1), source, 0.0)
    same = compare(periodic_character(15 + slow + fast, 0.1), source, 0.0)
    assert without.ripple_spectrum > 0.5
    assert same.ripple_spectrum < 0.02
    assert without.ramp_rate > 0.2 > same.ramp_rate
