"""Where a residual is more than noise, and what it follows."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from twin.mismatch.finding import Driver, Span, Term
from twin.mismatch.flight import Flight
from twin.mismatch.noise import Noise

FloatArray = npt.NDArray[np.float64]

BLOCKS = 400  # at most, into which a recording is cut for change points
LEAST_BLOCK_S = 1.0
MOST_PIECES = 80  # of a recording: a slope far beyond the noise would be cut into hundreds of steps
BEYOND = 4.0  # standard deviations of a span's mean: not chance
KNOTS = 4  # of the piecewise straight line through which a quantity may act
LEAST_EXPLAINED = 0.05
MOST_TERMS = 4
Judged = tuple[FloatArray, Mapping[str, FloatArray]]
"""Of a recording: residual (n,), NaN where it does not count, and `quantities` (m,), m <= n."""


def spans(flight: Flight, residual_V: FloatArray, noise: Noise) -> list[Span]:
    """Stretches of one mean residual each that noise does not explain; shares not yet of a whole.

    Change points by optimal partition: the sum of squares plus a price for each change is least
    (Jackson et al., IEEE Signal Process. Lett. 12, 105 (2005), doi:10.1109/LSP.2001.838216).
    """
    at = np.flatnonzero(flight.judged & np.isfinite(residual_V))
    if not at.size:
        return []
    blocks = _blocks(flight.time_s[at])
    means = np.array([residual_V[at[a:b]].mean() for a, b in pairwise(blocks)])
    counts = np.diff(blocks)
    period_s = float(np.median(np.diff(flight.time_s[at]))) if at.size > 1 else 1.0
    lasting_V = noise.lasting_V(period_s)
    weights = counts / lasting_V**2
    price = 3.0 * float(np.log(max(means.size, 2)))
    while len(borders := change_points(means, weights, price)) > MOST_PIECES + 1:
        price *= 2.0
    out = []
    for a, b in pairwise(borders):
        own = at[blocks[a] : blocks[b]]
        mean_V = float(residual_V[own].mean())
        if abs(mean_V) < BEYOND * lasting_V / np.sqrt(own.size):
            continue
        out.append(
            Span(
                flight=flight.name,
                start_s=float(flight.time_s[own[0]]),
                stop_s=float(flight.time_s[own[-1]]),
                motion=_usual(flight.motion[own]),
                mean_V=mean_V,
                share=float(np.sum(residual_V[own] ** 2) - own.size * noise.by_chance_V**2),
            )
        )
    return out


def shared(found: Sequence[Span]) -> tuple[Span, ...]:
    """The spans of all recordings, each with its share of the whole, the largest first."""
    total = sum(max(s.share, 0.0) for s in found) or 1.0
    each = [replace(s, share=max(s.share, 0.0) / total) for s in found]
    return tuple(sorted(each, key=lambda s: -s.share))


def change_points(means: FloatArray, weights: FloatArray, price: float) -> list[int]:
    """Borders of pieces of one level, 0 and n included, for n means with 1 / variance `weights`.

    `price` is what each further piece must explain, in squares over variance.
    """
    n = means.size
    w = np.concatenate([[0.0], np.cumsum(weights)])
    wx = np.concatenate([[0.0], np.cumsum(weights * means)])
    best, last = np.zeros(n + 1), np.zeros(n + 1, dtype=int)
    for k in range(1, n + 1):
        # what a piece i..k explains; the squares themselves are the same for all partitions
        gain = (wx[k] - wx[:k]) ** 2 / (w[k] - w[:k])
        cost = best[:k] - gain + price
        last[k] = int(np.argmin(cost))
        best[k] = cost[last[k]]
    borders = [n]
    while borders[-1]:
        borders.append(int(last[borders[-1]]))
    return borders[::-1]


def drivers(fitted: Sequence[Judged], held_out: Sequence[Judged]) -> tuple[Driver, ...]:
    """What residuals follow, by the share of their squares that a curve of one quantity explains.

    The curve (a piecewise straight line) is fitted to the first and judged on the second.
    """
    out = []
    for name in _shared_names([*fitted, *held_out]):
        x, y = _column(fitted, name)
        x_ahead, y_ahead = _column(held_out, name)
        if not x.size or not x_ahead.size:  # the twin was empty before
            continue
        knots = np.unique(np.quantile(x, np.linspace(0, 1, KNOTS)))
        if knots.size < 2:
            continue
        curve = np.linalg.lstsq(_hats(x, knots), y, rcond=None)[0]
        explained = _explained(y_ahead, _hats(x_ahead, knots) @ curve)
        if explained > LEAST_EXPLAINED:
            out.append(Driver(quantity=name, explained=explained))
    return tuple(sorted(out, key=lambda d: -d.explained))


def terms(fitted: Sequence[Judged], held_out: Sequence[Judged]) -> tuple[Term, ...]:
    """A sum of a few quantities that describes the residual: forward selection, judged held out.

    A term is kept if it explains at least LEAST_EXPLAINED more of what was not fitted. Sizes are
    volts per standard deviation of the quantity.
    """
    names = _shared_names([*fitted, *held_out])
    columns = {name: (_column(fitted, name), _column(held_out, name)) for name in names}
    columns = {name: c for name, c in columns.items() if c[0][0].size and c[1][0].size}
    chosen: list[str] = []
    explained, out = 0.0, []
    while len(chosen) < MOST_TERMS:
        trials = [(*_regressed([*chosen, n], columns), n) for n in columns if n not in chosen]
        if not trials:
            break
        best, sizes, name = max(trials, key=lambda t: t[0])
        if best < explained + LEAST_EXPLAINED:
            break
        chosen.append(name)
        out = [
            Term(quantity=n, size_V=float(s), explained=best)
            for n, s in zip(chosen, sizes, strict=True)
        ]
        explained = best
    return tuple(out)


def _regressed(
    names: Sequence[str],
    columns: dict[str, tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]],
) -> tuple[float, FloatArray]:
    """Share explained of what was held out, and the size of each term."""
    x = np.column_stack([columns[n][0][0] for n in names])
    ahead = np.column_stack([columns[n][1][0] for n in names])
    y, y_ahead = columns[names[0]][0][1], columns[names[0]][1][1]
    centre, spread = x.mean(axis=0), x.std(axis=0) + 1e-300
    whole = np.column_stack([(x - centre) / spread, np.ones(y.size)])
    sizes = np.linalg.lstsq(whole, y, rcond=None)[0]
    predicted = np.column_stack([(ahead - centre) / spread, np.ones(y_ahead.size)]) @ sizes
    return _explained(y_ahead, predicted), sizes[:-1]


def _explained(y: FloatArray, predicted: FloatArray) -> float:
    total = float(y @ y)
    return 1.0 - float(np.sum((y - predicted) ** 2)) / total if total > 0 else 0.0


def _hats(x: FloatArray, knots: FloatArray) -> FloatArray:
    """(n, knots) piecewise straight, flat beyond the ends."""
    return np.column_stack([np.interp(x, knots, row) for row in np.eye(knots.size)])


def _shared_names(judged: Sequence[Judged]) -> list[str]:
    sets = [set(own) for _, own in judged]
    return sorted(set.intersection(*sets)) if sets else []


def _column(judged: Sequence[Judged], name: str) -> tuple[FloatArray, FloatArray]:
    """Quantity and residual of all recordings, where the residual counts."""
    x, y = [], []
    for residual_V, quantities in judged:
        values = quantities[name]
        own = residual_V[: values.size]
        good = np.isfinite(own)
        x.append(values[good])
        y.append(own[good])
    return np.concatenate(x), np.concatenate(y)


def _blocks(time_s: FloatArray) -> list[int]:
    """Borders of blocks of about equal time, as positions in `time_s`."""
    period_s = max(LEAST_BLOCK_S, float(time_s[-1] - time_s[0]) / BLOCKS)
    number = ((time_s - time_s[0]) / period_s).astype(int)
    return [0, *(np.flatnonzero(np.diff(number)) + 1).tolist(), time_s.size]


def _usual(motion: npt.NDArray[np.str_]) -> str:
    names, counts = np.unique(motion, return_counts=True)
    return str(names[int(np.argmax(counts))])
