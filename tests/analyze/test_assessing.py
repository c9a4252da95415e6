"""A flight's motions in the twin's terms, and what is said where there are none."""

from dataclasses import replace

import numpy as np
import pytest

from analyze.assessing import OTHERS, damage_of, manoeuvres_of, others_of, speed_m_s
from analyze.pack_choice import PackChoice
from segment.profile import PeriodicProfile, TooLittle
from segment.segment import Basis, Motion
from tests.analyze.calls import PACK as PACK_FILE
from tests.reports import example
from twin.builtin import load_cell
from twin.calibrate.doubt import Doubt
from twin.effects import Sei
from twin.load import Load
from twin.pack import Pack
from twin.pack_file import parse_pack_file

PROFILES = example.report().profiles
PACK = Pack(cell=load_cell("lipo_2200"), series=4)
LOAD = Load(time_s=example.T, current_A=example.CURRENT)


def test_a_profile_becomes_a_manoeuvre_with_its_segments() -> None:
    (hover,) = manoeuvres_of(example.recording(), example.segments(), PROFILES)
    profile = PROFILES[Motion.HOVER]
    assert isinstance(profile, PeriodicProfile)
    assert hover.name == "hover"
    np.testing.assert_array_equal(hover.waveform.current_A, profile.current_A)
    assert hover.waveform.period_s == pytest.approx(profile.period_s)
    (piece,) = hover.pieces
    (segment,) = [s for s in example.segments() if s.motion is Motion.HOVER]
    assert piece.current_A.size * piece.sample_s == pytest.approx(16.0)
    assert piece.current_A.mean() == pytest.approx(segment.load.mean_A)
    assert hover.speed_m_s == 0.0


def test_the_speed_is_that_over_the_motions_segments() -> None:
    across = [s for s in example.segments() if s.motion is Motion.HORIZONTAL]
    assert speed_m_s(example.recording(), across) == pytest.approx(4.0)
    assert speed_m_s(example.recording(velocity_m_s=None), across) is None
    unknown = np.full((example.T.size, 3), np.nan)
    assert speed_m_s(example.recording(velocity_m_s=unknown), across) is None


def test_a_motion_that_draws_nothing_is_left_out() -> None:
    profile = PROFILES[Motion.HOVER]
    assert isinstance(profile, PeriodicProfile)
    idle = {Motion.HOVER: replace(profile, current_A=0 * profile.current_A)}
    assert manoeuvres_of(example.recording(), example.segments(), idle) == ()


@pytest.mark.parametrize("fitted", ["cell_doubt", "life_doubt"])
def test_other_packs_differ_by_the_fit_that_stands_beside_the_pack_file(fitted: str) -> None:
    none = np.zeros(0)
    doubt = Doubt(names=(), value=none, std=none, correlations=np.eye(0))
    file = parse_pack_file(PACK_FILE, name="pack.toml")
    choice = PackChoice(file=file, cell="lipo_2200", sha256="", **{fitted: doubt})
    others = others_of(PACK, choice)
    assert (others.of_cell, others.of_life) == (fitted == "cell_doubt", fitted == "life_doubt")
    assert all(bool(p.moved) == others.of_cell for p in others.packs)
    constants = {next(e for e in p.effects if isinstance(e, Sei)) for p in others.packs}
    assert len(constants) == (1 if others.of_life else OTHERS)  # that fit left nothing open


def test_without_a_motion_the_reason_is_told() -> None:
    found, why = damage_of(
        example.recording(), example.segments(), {}, (PACK, LOAD), thorough=False
    )
    assert found is None
    assert why == "No motion can be repeated: none was flown that discharges the pack."


def test_slow_telemetry_is_said_to_be_slow_and_not_the_motion_short() -> None:
    """30 s of hover at 0.5 Hz are 15 samples."""
    said = "30.0 s of hover motion in 1 segments (15 samples); a profile needs 10 s and 100 samples"
    slow = {Motion.HOVER: TooLittle(motion=Motion.HOVER, source_s=30.0, reason=said)}
    *_, why = damage_of(example.recording(), example.segments(), slow, (PACK, LOAD), thorough=False)
    assert why == f"No motion can be repeated: {said}."


def test_a_flight_of_which_nothing_tells_the_motion_is_not_said_to_be_too_short() -> None:
    untold = [
        replace(s, motion=Motion.MIXED, basis=Basis.NONE) if s.motion is Motion.HOVER else s
        for s in example.segments()
    ]
    found, why = damage_of(example.recording(), untold, {}, (PACK, LOAD), thorough=False)
    assert found is None
    assert "for 16.0 s neither velocity nor command tells what was flown" in why


def test_a_pack_far_too_small_is_said_to_be_so() -> None:
    small = replace(PACK, capacity_C=0.02 * 3600)
    found, why = damage_of(
        example.recording(), example.segments(), PROFILES, (small, LOAD), thorough=False
    )
    assert found is None
    assert "cannot be flown like this" in why
    assert "flies this for" in why


def test_a_flight_that_begins_on_an_empty_pack_is_said_to_do_so() -> None:
    empty = replace(PACK, capacity_C=2.2 * 3600, initial_soc=0.0)
    found, why = damage_of(
        example.recording(), example.segments(), PROFILES, (empty, LOAD), thorough=False
    )
    assert found is None
    assert "the flight begins at 0.0 % of charge" in why
    assert "lower cut-off" in why
