"""The trials of temperature and transport on real cells.

Chosen by physical reasoning from what the catalogue of recordings says of rates and temperatures;
none is left out for what came of it. h01 to h21 were written down before any was run; after a first
run (5 of 13 of temperature right) their twins were calibrated to more tests, so that these are not
blind. h22 to h28 were written down then, before any was run; of their recordings h22 and h28 share
one each with the first ones. A question is of one pack: of the LG M50 each rate was drawn from
another cell in another mount (`lg_m50.cools_s`), so that h05 to h07, which had asked of 2C what 1C
shows, and h08 (0.5C, 1C) are of one rate each since, and h29 to h31 of the others; these changes
were written down before any of them was run. h17 conceals no temperature,
but heats: it had 1C and 2C, and by the one cooling that it was told 2C is 6.8 K off, a second thing
that its truth does not name. It has 1C alone since that was found, its verdict being known.

h32 to h36 are blind: recordings that no trial had used but as tests of a base twin, written
down when the ways of calibrating were done, run once. No base of the trials above has changed for
them. In the file of h34 the first voltage is one under load: in that run its start was told wrong,
and the verdict, which said so, counted as wrong; the file is read right since (`lg_m50.rate`). What
counts as right:

Isothermal. The twin stays at the temperature the cell had at the start, the cell warmed by 8 to
40 K: `self_heating`. Given are current and voltage alone.

Misstated. The twin heats by its own losses, cooled as the cell was in the tests it was calibrated
to, but is told 25 degC where start and chamber were colder (once: warmer; once they drifted):
`cold_pack`. Where the cell had aged since, that may be named beside.

Transport. The twin heats by its own losses. Of its numbers only windows, capacity, resistance and
exchange currents were fitted, to a slow discharge and short pulses; diffusivities, radii, pores and
salt are those of the cell that was started from, another make (of the LG M50: a published set whose
diffusivity its own makers retuned). At several times the rate over minutes what such a twin lacks
is transport: `electrolyte_transport`, `solid_diffusion_negative` or `solid_diffusion_positive`; a
terminal voltage does not tell for certain which, so each is right.

Told right (h37 to h42, written down before any was run). As misstated, but the twin is told how
warm the cell was: nothing to be named. What a question looks like says nothing then.

Control. A twin measured on the cell by its publisher: nothing to be named; heat above all is not
there at a visible size in the pouch. In the phosphate cell is what no homogeneous model has.
"""

from dataclasses import dataclass
from enum import Enum


class Kind(Enum):
    """Of a trial: what the twin does not have."""

    ISOTHERMAL = "isothermal"
    MISSTATED = "misstated"
    TRANSPORT = "transport"
    TOLD = "told right"
    CONTROL = "control"
    FOREIGN = "foreign control"


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One trial.

    Attributes:
        name: no other has it.
        cell: key of `heat_bases.CELLS`.
        kind: what is concealed.
        fitted: names of the cell's recordings that effects are fitted to.
        held_out: and of those they are judged on; none: blocks of the fitted one.
        told_C: start and surroundings as the twin is told [degC]; None: as they were at the start.
        aged: the cell had aged since the tests that its twin is calibrated to.
    """

    name: str
    cell: str
    kind: Kind
    fitted: str
    held_out: str = ""
    told_C: float | None = None
    aged: bool = False


ISOTHERMAL, MISSTATED, TRANSPORT = Kind.ISOTHERMAL, Kind.MISSTATED, Kind.TRANSPORT

ENTRIES = (
    Entry(name="trial-h01", cell="samsung", kind=ISOTHERMAL, fitted="2C", held_out="3C"),
    Entry(name="trial-h02", cell="samsung", kind=ISOTHERMAL, fitted="3C", held_out="4C"),
    Entry(name="trial-h03", cell="samsung_2", kind=ISOTHERMAL, fitted="2C", held_out="3C"),
    Entry(name="trial-h04", cell="samsung_2", kind=ISOTHERMAL, fitted="3C", held_out="4C"),
    Entry(name="trial-h05", cell="lg_m50", kind=ISOTHERMAL, fitted="1C 25 degC"),
    Entry(name="trial-h06", cell="lg_m50", kind=ISOTHERMAL, fitted="1C 0 degC"),
    Entry(name="trial-h07", cell="lg_m50", kind=ISOTHERMAL, fitted="1C 10 degC"),
    Entry(name="trial-h08", cell="lg_m50", kind=MISSTATED, fitted="0.5C 10 degC", told_C=25.0),
    Entry(name="trial-h09", cell="panasonic", kind=ISOTHERMAL, fitted="US06 25 degC"),
    Entry(name="trial-h10", cell="panasonic", kind=ISOTHERMAL, fitted="US06 10 degC"),
    Entry(name="trial-h11", cell="panasonic", kind=MISSTATED, fitted="US06 10 degC", told_C=25.0),
    Entry(name="trial-h12", cell="panasonic", kind=MISSTATED, fitted="US06 -20 degC", told_C=25.0,
          aged=True),
    Entry(name="trial-h13", cell="panasonic", kind=MISSTATED,
          fitted="mixed cycle, chamber 10 to 23 degC", told_C=25.0, aged=True),
    Entry(name="trial-h14", cell="melasta", kind=ISOTHERMAL, fitted="5C", held_out="9.1C"),
    Entry(name="trial-h15", cell="leaf", kind=ISOTHERMAL, fitted="2C", held_out="3C"),
    Entry(name="trial-h16", cell="samsung_slow", kind=TRANSPORT, fitted="2C", held_out="3C"),
    Entry(name="trial-h17", cell="lg_m50_slow", kind=TRANSPORT, fitted="1C 25 degC"),
    Entry(name="trial-h18", cell="panasonic_slow", kind=TRANSPORT, fitted="US06 25 degC"),
    Entry(name="trial-h19", cell="nmc", kind=Kind.CONTROL, fitted="1C", held_out="2C"),
    Entry(name="trial-h20", cell="nmc", kind=Kind.CONTROL, fitted="2C", held_out="drive cycle"),
    Entry(name="trial-h21", cell="lfp", kind=Kind.FOREIGN, fitted="1C", held_out="2C"),
    Entry(name="trial-h22", cell="leaf", kind=ISOTHERMAL, fitted="3C"),
    Entry(name="trial-h23", cell="lg_m50_2", kind=MISSTATED, fitted="0.5C 0 degC, 1",
          held_out="0.5C 0 degC, 2", told_C=25.0),
    Entry(name="trial-h24", cell="lg_m50_2", kind=MISSTATED, fitted="0.5C 10 degC, 1",
          held_out="0.5C 10 degC, 2", told_C=25.0),
    Entry(name="trial-h25", cell="lg_m50_2", kind=ISOTHERMAL, fitted="2C 25 degC"),
    Entry(name="trial-h26", cell="leaf", kind=MISSTATED, fitted="pulses 10 degC", told_C=25.0),
    Entry(name="trial-h27", cell="leaf", kind=MISSTATED, fitted="pulses 40 degC", told_C=25.0),
    Entry(name="trial-h28", cell="melasta", kind=ISOTHERMAL, fitted="2C", held_out="5C"),
    Entry(name="trial-h29", cell="lg_m50", kind=ISOTHERMAL, fitted="2C 25 degC"),
    Entry(name="trial-h30", cell="lg_m50", kind=ISOTHERMAL, fitted="2C 0 degC"),
    Entry(name="trial-h31", cell="lg_m50", kind=ISOTHERMAL, fitted="2C 10 degC"),
    Entry(name="trial-h32", cell="lg_m50", kind=MISSTATED, fitted="0.5C 45 degC", told_C=25.0),
    Entry(name="trial-h33", cell="lg_m50", kind=MISSTATED, fitted="1C 45 degC", told_C=25.0),
    Entry(name="trial-h34", cell="lg_m50", kind=MISSTATED, fitted="1.5C 45 degC", told_C=25.0),
    Entry(name="trial-h35", cell="samsung", kind=MISSTATED, fitted="pulses 40 degC", told_C=25.0),
    Entry(name="trial-h36", cell="panasonic", kind=MISSTATED, fitted="pulses 0 degC", told_C=25.0,
          aged=True),
    Entry(name="trial-h37", cell="lg_m50", kind=Kind.TOLD, fitted="0.5C 10 degC"),
    Entry(name="trial-h38", cell="lg_m50", kind=Kind.TOLD, fitted="1C 45 degC"),
    Entry(name="trial-h39", cell="lg_m50_2", kind=Kind.TOLD, fitted="0.5C 0 degC, 1",
          held_out="0.5C 0 degC, 2"),
    Entry(name="trial-h40", cell="leaf", kind=Kind.TOLD, fitted="pulses 10 degC"),
    Entry(name="trial-h41", cell="samsung", kind=Kind.TOLD, fitted="pulses 40 degC"),
    Entry(name="trial-h42", cell="panasonic", kind=Kind.TOLD, fitted="US06 10 degC"),
)  # fmt: skip
