"""`explain`: recordings and a twin -> `Finding`."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from twin.mismatch.advice import advise
from twin.mismatch.allowed import open_V
from twin.mismatch.choose import ALIKE, Model, models, scale_of
from twin.mismatch.contradict import contradiction
from twin.mismatch.decide import LIKELY, NUMERICS_V, Decision, candidates, decide
from twin.mismatch.drift import beside_drift
from twin.mismatch.finding import Course, Errors, Finding, Span, Verdict
from twin.mismatch.fit import Data, Fitted
from twin.mismatch.flight import Flight, FloatArray
from twin.mismatch.hypothesis import HYPOTHESES, Hypothesis
from twin.mismatch.idle import spared_V, steadied
from twin.mismatch.left import never_full
from twin.mismatch.locate import Judged, drivers, shared, spans, terms
from twin.mismatch.noise import Whitener
from twin.mismatch.parts import parts
from twin.mismatch.pauses import pauses
from twin.mismatch.quantities import quantities
from twin.mismatch.search import again, search
from twin.mismatch.split import counted, sharpened, split
from twin.mismatch.started import started, starts_of
from twin.simulate import simulate

SHOWN_DRIVERS = 5
SHORT = 3
MOST_COMPARED = 3  # candidates between which a test is looked for
STRONG = np.exp(ALIKE)  # odds
FAR = 2.0  # standard deviations of a start, beyond which it is worth a word


def begun(flight: Flight) -> Flight:
    """As it is judged: its idle current steady, from the nearest start where nothing told it."""
    return started(steadied(flight))


def explain(  # noqa: PLR0913
    fitted: Sequence[Flight], held_out: Sequence[Flight] = (), *,
    hypotheses: Sequence[Hypothesis] = HYPOTHESES, slow_V: float | None = None,
    progress: Callable[[tuple[str, ...]], None] = lambda _: None, short: bool = False,
) -> Finding:  # fmt: skip
    """Where twin and recordings differ, what was left out, and how much better it then fits.

    Args:
        fitted: recordings of one pack, each with the twin as configured.
        held_out: others of it, on which all is judged; see `split` if there are none.
        hypotheses: what may be named.
        slow_V: the twin's own error, see `split`; None takes what the packs state of it, where that
            is more than NUMERICS_V.
        progress: told the ids of each model before it is fitted.
        short: only the SHORT effects that promise most by the linearised twin are fitted, each
            alone.

    Raises:
        MismatchError: too little to judge.
    """
    slow_V = _stated_V(fitted) if slow_V is None else slow_V
    given = (*fitted, *held_out)
    fitted, held_out = (list(map(begun, own)) for own in (fitted, held_out))
    data = split(fitted, held_out, slow_V=slow_V)
    stated = slow_V is not None
    most = {"most_effects": 1, "most_alone": SHORT} if short else {}
    data, found = search(data, hypotheses, stated=stated, progress=progress, **most)
    best = found[0].fitted
    if not short and (finer := sharpened(data, best, stated=stated)):
        data = again(finer, [m.fitted for m in found])
        found = models(data, hypotheses, progress=progress)
    scale = scale_of(m.fitted for m in found)
    null = next(m for m in found if not m.ids)
    decision, remarks = contradiction(
        decide(found, scale, stated_V=slow_V or 0.0), (*fitted, *held_out),
        hypotheses, slow_V=slow_V, progress=progress,
    )  # fmt: skip
    decision, drifts = beside_drift(decision, data, found, scale)
    best = decision.model.fitted
    start = np.zeros(null.fitted.problem.size)
    answers = _answers(null.fitted)
    unknown = decision.verdict is Verdict.UNKNOWN
    return Finding(
        verdict=decision.verdict,
        effects=decision.effects,
        spans=_located(data, unknown=unknown),
        drivers=drivers(*answers)[:SHOWN_DRIVERS],
        terms=terms(*answers) if unknown else (),
        errors=Errors(
            noise=data.noise_V,
            before=null.fitted.problem.rms_V(start),
            after=best.rms_V(),
            held_out_before=null.fitted.judge.rms_V(np.zeros(null.fitted.judge.size)),
            held_out_after=best.held_out_rms_V(),
        ),
        candidates=candidates(found),
        advice=_advice(decision, data.noise_V),
        courses=_courses(data, best),
        starts=starts_of(best),
        remarks=(
            *remarks,
            *drifts,
            *_untold(best),
            *_stated(slow_V),
            *(
                _starts(null.fitted)
                if decision.verdict is Verdict.NONE
                else _open(data, slow_V or 0.0)
            ),
            *_not_named(found, decision),
            *_noisy(data),
            *_idled(given, (*fitted, *held_out), data.noise_V),
            *_begun(data),
            *_paused((*fitted, *held_out)),
            *_left_out(data),
        ),
    )


def _stated_V(fitted: Sequence[Flight]) -> float | None:
    """Of the packs, if it is more than the error of the twin's numerics."""
    packs = [f.pack for f in fitted if f.pack.cell_error_V > NUMERICS_V]
    return max((p.series * p.cell_error_V for p in packs), default=None)


def _stated(slow_V: float | None) -> Iterator[str]:
    """What nobody sees in the noise that was estimated."""
    if slow_V is not None:
        yield (
            f"The twin is stated to err by {1e3 * slow_V:.3g} mV rms: what changes the voltage by "
            "less has no name, and what is left may be as much"
        )


def _open(data: Data, stated_V: float) -> Iterator[str]:
    """Of a twin whose tests leave more open than what is stated of it."""
    fitted_V, ahead_V = (open_V([f for f, _ in own]) for own in (data.fitted, data.held_out))
    if max(fitted_V, ahead_V) > max(stated_V, NUMERICS_V):
        yield (
            "Other cells that follow the calibration's tests as well differ from this one by "
            f"{1e3 * fitted_V:.3g} mV rms in what was fitted and {1e3 * ahead_V:.3g} mV in what "
            "was held out, more than is stated of it: what is missed may be the twin's own error, "
            "and so may what has a name. Tests as fast and as long as these recordings would tell"
        )


def _noisy(data: Data) -> Iterator[str]:
    """Of recordings that are not taken as they are."""
    told = {f.name: w.noise.current_A for f, w in (*data.fitted, *data.held_out)}
    if sizes := ", ".join(
        f"{noise_A:.2g} A in {name}" for name, noise_A in told.items() if noise_A
    ):
        yield (
            f"The recorded current has noise, {sizes}, to which the voltage does not answer: the "
            "likeliest current behind it is taken"
        )


def _idled(given: Sequence[Flight], taken: Sequence[Flight], noise_V: float) -> Iterator[str]:
    """Of recordings whose current is not taken as it is where little flows, if that shows."""
    both = [(before, f) for before, f in zip(given, taken, strict=True) if f.idle]
    if idle := [s for before, f in both if spared_V(before, f) > noise_V for s in f.idle]:
        yield (
            f"Where the pack idles, {sum(s.end_s - s.start_s for s in idle):.0f} s in all, the "
            "mean of the recorded current counts: its noise there, "
            f"{max(s.noise_A for s in idle):.2g} A, never flowed"
        )


def _begun(data: Data) -> Iterator[str]:
    """Of packs that had flown before."""
    every = (*data.fitted, *data.held_out)
    if names := ", ".join(dict.fromkeys(f.name for f, w in every if w.noise.flown)):
        yield (
            f"{names}: begins under load; its voltage says that the pack had flown before: what "
            "that left in the cells is not known, and counts as noise until it is forgotten; all "
            "errors are without it, at its likeliest"
        )


def _paused(flights: Sequence[Flight]) -> Iterator[str]:
    """Of recordings in which the logger paused, what that leaves open."""
    for flight in flights:
        load = flight.recorded_load
        if holes := pauses(load):
            off_C = np.sqrt(sum(hole.variance_C2(load) for hole in holes))
            yield (
                f"{flight.name}: pauses of the logger: {len(holes)}, "
                f"{sum(hole.length_s for hole in holes):.0f} s in all; by what flowed in stretches "
                f"as long, the charge drawn may be {off_C:.2g} C off, and that counts as noise"
            )


def _left_out(data: Data) -> Iterator[str]:
    whole = counted(data) + data.beyond + data.alone + data.unheard
    if data.beyond:
        yield (
            f"{data.beyond} of {whole} samples do not count: a cell is beyond its cut-off there, "
            "where a thousandth of its charge decides over a volt"
        )
    if data.unheard:
        yield (
            f"{data.unheard} of {whole} samples do not count: the clocks disagree, and what flowed "
            "then was recorded before the first sample or after the last"
        )
    if data.alone:
        yield (
            f"{data.alone} of {whole} samples do not count: each stands alone, far from the "
            "voltages before and after it"
        )


def _not_named(found: Sequence[Model], decision: Decision) -> Iterator[str]:
    """Why less is named than has most of the evidence; of all that was looked at, best first."""
    likeliest, own = found[0], decision.model
    contradictory = bool(decision.effects) and not own.ids
    unknown = decision.verdict is Verdict.UNKNOWN or contradictory
    if unknown or not set(own.ids) < set(likeliest.ids):
        return
    if likeliest.probability > LIKELY:
        left_V, before_V = (m.fitted.held_out_rms_V() for m in (likeliest, own))
        says = f"{' + '.join(likeliest.ids)} has most of the evidence, but"
        among = next(m for m in found if m.ids == own.ids)  # `own` may be of fewer
        if (gain := likeliest.log_evidence - among.log_evidence) < ALIKE:
            rest = " + ".join(own.ids) or "nothing"
            says += f" is {np.exp(gain):.1f} times as likely as {rest}: strong is {STRONG:.0f}"
        else:
            says += f" leaves {1e3 * left_V:.2f} instead of {1e3 * before_V:.2f} mV of what was "
            worse = left_V > before_V
            says += f"held out: {'worse' if worse else 'no more than the twin may err by'}"
        more = [name for name in likeliest.ids if name not in own.ids]
        yield f"{says}, so {' + '.join(more)} is not named"


def _untold(best: Fitted) -> Iterator[str]:
    """Of recordings whose start nothing tells."""
    if starts := starts_of(best):
        told = (f"{100 * soc:.1f} ± {100 * std:.1g} % in {f}" for f, (soc, std) in starts.items())
        yield (
            f"Nothing tells well how full the pack was at the start: {', '.join(told)} by a fit, "
            "and what moves the voltage as another start would cannot be told from that. Give "
            "recordings that begin at rest, best of all full; or start.soc in the pack file where "
            "all start with as much"
        )


def _starts(null: Fitted) -> tuple[str, ...]:
    """Of recordings in which nothing is missing but that they start off by more than usual."""
    return tuple(
        f"{flight.name} fits with {abs(flight.start_std * times):.2%} "
        f"{'more' if times > 0 else 'less'} charge at its start than stated, {abs(times):.1f} "
        "times what a start is usually off; with that nothing else is missing"
        for flight, times in zip(null.problem.flights, null.q.tolist(), strict=True)
        if flight.start_told and abs(times) > FAR
    )


def _located(data: Data, *, unknown: bool) -> tuple[Span, ...]:
    """Of the twin as configured, in every recording once.

    Where what is left is unknown, it is no noise of a filter: that was told by it.
    """
    whole: dict[str, tuple[Flight, Whitener]] = {}
    for flight, whiten in (*data.fitted, *data.held_out):
        if flight.name in whole:  # one recording, of which parts are fitted and parts held out
            flight = replace(flight, judged=flight.judged | whole[flight.name][0].judged)
        whole[flight.name] = flight, whiten
    found = [
        s
        for flight, whiten in whole.values()
        for s in spans(
            flight,
            _residual_V(flight),
            replace(whiten.noise, smooth=None) if unknown else whiten.noise,
        )
    ]
    return shared(found)


def _answers(null: Fitted) -> tuple[list[Judged], list[Judged]]:
    """Residuals of the twin as configured where they count, with what they may follow."""
    both: list[list[Judged]] = []
    for problem in (null.problem, null.judge):
        own: list[Judged] = []
        for k, flight in enumerate(problem.flights):
            counted = np.full(flight.time_s.size, np.nan)
            at = problem.judged(k)
            counted[at] = _residual_V(flight)[at]
            answer = simulate(never_full(flight.pack), flight.load)
            own.append((counted, quantities(flight.load, answer)))
        both.append(own)
    return both[0], both[1]


def _residual_V(flight: Flight) -> FloatArray:
    """(n,) recorded minus simulated by the twin as configured; NaN where there is none."""
    simulated_V = simulate(never_full(flight.pack), flight.load).voltage_V
    out = np.full(flight.time_s.size, np.nan)
    out[: simulated_V.size] = flight.voltage_V[: simulated_V.size] - simulated_V
    return out


def _advice(decision: Decision, noise_V: float) -> str:
    """For effects that look alike, or several that remain."""
    best = decision.model
    rivals = [
        m.fitted
        for m in decision.among
        if best.log_evidence - m.log_evidence < ALIKE and not set(best.ids) < set(m.ids)
    ]
    return advise(rivals[:MOST_COMPARED], noise_V) if best.ids else ""


def _courses(data: Data, best: Fitted) -> tuple[Course, ...]:
    """Every recording once, at the samples that were recorded."""
    ahead = {f.name for f, _ in data.held_out}
    out: dict[str, Course] = {}
    for problem, q in ((best.problem, best.q), (best.judge, best.ahead_q)):
        for k, flight in enumerate(problem.flights):
            counted = np.zeros(flight.time_s.size, dtype=bool)
            counted[problem.judged(k)] = True
            at = slice(None) if flight.recorded is None else flight.recorded
            counted, before = counted[at], out.get(flight.name)
            out[flight.name] = Course(
                name=flight.name,
                held_out=flight.name in ahead,
                time_s=flight.time_s[at],
                residual_V=_residual_V(flight)[at],
                after_V=problem.residual_V(q, k)[at],
                motion=flight.motion[at],
                judged=counted if before is None else counted | before.judged,
                judged_ahead=counted if problem is best.judge else np.zeros_like(counted),
                parts=tuple(
                    replace(part, voltage_V=part.voltage_V[at]) for part in parts(problem, q, k)
                ),
            )
    return tuple(out.values())
