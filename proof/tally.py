"""How many verdicts are right, of how many: `Share`, by class of trial."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import sqrt

from proof.outcome import Judged, Outcome
from proof.truth import CONTROLS, FOREIGN, KINDS, RECORDED, SIMULATED

STRONG = 3.0  # times the noise, from which on an effect has to be named
NORMAL_95 = 1.959963984540054  # standard deviations either way that hold 95 % of a normal law


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """So many of so many."""

    count: int
    of: int

    @property
    def value(self) -> float | None:
        """From 0 to 1; None of none."""
        return self.count / self.of if self.of else None

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the share, if trials were independent and drawn anew.

        Source:
            Wilson, J. Am. Stat. Assoc. 22, 209 (1927), doi:10.1080/01621459.1927.10502953.
        """
        if not self.of:
            return 0.0, 1.0
        n, p, z2 = self.of, self.count / self.of, NORMAL_95**2
        middle = (p + z2 / (2 * n)) / (1 + z2 / n)
        half = NORMAL_95 * sqrt(p * (1 - p) / n + z2 / (4 * n * n)) / (1 + z2 / n)
        low = 0.0 if self.count == 0 else middle - half  # exact there, but for rounding
        return low, 1.0 if self.count == n else middle + half


@dataclass(frozen=True, slots=True, kw_only=True)
class Tally:
    """The outcomes of some trials.

    Attributes:
        id: of the class.
        what: is in it, in words.
        outcomes: how many of each.
    """

    id: str
    what: str
    outcomes: Mapping[Outcome, int]

    @property
    def right(self) -> Share:
        """Of all of them."""
        return Share(count=self.outcomes[Outcome.RIGHT], of=sum(self.outcomes.values()))


def tally(name: str, what: str, trials: Iterable[Judged]) -> Tally:
    """Of these trials."""
    outcomes = [t.outcome for t in trials]
    return Tally(id=name, what=what, outcomes={o: outcomes.count(o) for o in Outcome})


def simulated(trial: Judged) -> bool:
    """By PyBaMM."""
    return trial.truth.kind in SIMULATED


def recorded(trial: Judged) -> bool:
    """On a real cell."""
    return trial.truth.kind in RECORDED


def control(trial: Judged) -> bool:
    """There is nothing to be found."""
    return trial.truth.kind in CONTROLS


def strong(trial: Judged) -> bool:
    """An effect was put in that shows at STRONG times the noise or more."""
    return simulated(trial) and not control(trial) and trial.truth.strength >= STRONG


def weak(trial: Judged) -> bool:
    """An effect was put in that shows less."""
    return simulated(trial) and not control(trial) and not trial.truth.strength >= STRONG


def real_effect(trial: Judged) -> bool:
    """Recorded, and there is something to be found that has a name."""
    return recorded(trial) and not control(trial) and trial.truth.kind not in FOREIGN


def above(trial: Judged) -> bool:
    """Of these, what changes the voltage by as much as the calibrated twin errs, or more."""
    return real_effect(trial) and trial.truth.strength >= 1.0


def of_kind(kind: str, also: Callable[[Judged], bool] = lambda _: True) -> Callable[[Judged], bool]:
    """Trials of one kind, for which `also` holds."""
    return lambda trial: trial.truth.kind == kind and also(trial)


CLASSES: tuple[tuple[str, str, Callable[[Judged], bool]], ...] = (
    ("strong", f"simulated, effect at {STRONG:.0f} × noise or more", strong),
    ("strong single", "of these: one effect", of_kind("single", strong)),
    ("strong pair", "of these: two effects", of_kind("pair", strong)),
    ("strong foreign", "of these: an effect the library lacks", of_kind("foreign", strong)),
    ("weak", f"simulated, effect below {STRONG:.0f} × noise", weak),
    ("control", "simulated, nothing in it", of_kind("control")),
    ("real", "recorded, something in it", real_effect),
    ("real above", "of these: at the error of the calibrated twin or above", above),
    *(
        (kind, f"of these: {kind}", of_kind(kind))
        for kind in RECORDED
        if kind not in CONTROLS and kind not in FOREIGN
    ),
    ("real foreign", "recorded, an effect the library lacks", of_kind("real foreign")),
    ("real control", "recorded, nothing in it", of_kind("real control")),
)  # fmt: skip
"""Id, words and members, in the order they are shown in; a class may hold another one."""


def by_class(trials: Iterable[Judged]) -> tuple[Tally, ...]:
    """Of every class that has a trial."""
    trials = tuple(trials)
    made = (tally(name, what, filter(member, trials)) for name, what, member in CLASSES)
    return tuple(t for t in made if t.right.of)


def by_source(trials: Iterable[Judged]) -> tuple[Tally, ...]:
    """Of every cell or pack that something was recorded of which has a name, the most first."""
    own = [t for t in trials if real_effect(t)]
    made = (tally(s, s, (t for t in own if t.source == s)) for s in {t.source for t in own})
    return tuple(sorted(made, key=lambda t: (-t.right.of, t.id)))


def kinds_not_run(trials: Iterable[Judged]) -> tuple[str, ...]:
    """Kinds of which there is no trial."""
    run = {t.truth.kind for t in trials}
    return tuple(kind for kind in KINDS if kind not in run)
