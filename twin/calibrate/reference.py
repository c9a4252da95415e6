"""A reference test of one cell, with the sign of its current, and what it leaves unknown."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from twin.at_rest import soc_at_rest
from twin.calibrate.single_cell import labelled_C
from twin.calibrate.switched import mixed_rows
from twin.calibrate.table import CalibrationError, MeasuredTable
from twin.load import Between, Load
from twin.pack import Pack
from twin.sign import discharge_sign

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

OUTSIDE_V = 0.15  # a cell's sensor may err, and a pulse may go beyond a cut-off, by so much
NEAR_V = 0.02  # of a cut-off: reached
QUIET = 1e-3  # of the capacity in an hour: a smaller current is none
PERCENTILES = (1.0, 99.0)  # of the voltage: a spike is no wrong series count
SLOW = 0.2  # of the capacity in an hour: what the voltage loses to it does not hide the charge
MOST_DRAWN = 2.0  # of the label: a fit goes to 1.6
LEAST_DRAWN = 0.2  # of what the open-circuit curve says was drawn
FELL = 0.3  # of the charge, by the open-circuit curve: enough to tell


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReferenceTest:
    """One test of the mean cell of a pack.

    Attributes:
        name: of the test.
        time_s: (n,) strictly increasing, from 0.
        current_A: (n,) of one cell, discharge positive.
        voltage_V: (n,) of one cell, at the same times as the current.
        between: how the current runs between the samples.
        ambient_K: temperature of the surroundings; the cell has it at the start.
        temperature_K: (n,) measured on the cell, NaN where it was not; None if nowhere.
        mount: what held the cell: it cools alike in all tests with this name; empty if the test
            had one of its own.
        remarks: what was detected, and what this test leaves unknown.
        cells_V: (series, n) of each cell of the pack; None where they were not measured.
        unheard: (n,) rows with a current but no voltage of their own, that of a row beside them
            instead; None if there are none.
    """

    name: str
    time_s: FloatArray
    current_A: FloatArray
    voltage_V: FloatArray
    between: Between = Between.HOLD
    ambient_K: float = 298.15
    temperature_K: FloatArray | None = None
    mount: str = ""
    remarks: tuple[str, ...] = ()
    cells_V: FloatArray | None = None
    unheard: BoolArray | None = None

    def drawn_C(self) -> FloatArray:
        """(n,) charge drawn from the cell up to each sample."""
        return self.load().drawn_C()

    def load(self) -> Load:
        """What it draws, in its surroundings."""
        return Load(
            time_s=self.time_s, current_A=self.current_A, between=self.between,
            ambient_K=self.ambient_K,
        )  # fmt: skip

    def mixed(self) -> BoolArray:
        """(n,) rows without a voltage of their own, or with that of another current: `switched.py`.

        They are not to be compared.
        """
        out = (
            np.zeros(self.time_s.size, dtype=bool) if self.unheard is None else self.unheard.copy()
        )
        out[mixed_rows(self.current_A, self.voltage_V)] = True
        return out


def reference_test(
    table: MeasuredTable, pack: Pack, *, between: Between = Between.HOLD, ambient_K: float = 298.15
) -> ReferenceTest:
    """The test of the mean cell of `pack` that `table` holds, at pack level.

    The sign of the current is that which makes a discharge lower the voltage. The first value of
    a column of the battery's temperature is that of the surroundings, or else of one of theirs.

    Raises:
        CalibrationError: no current flows, the voltage is not that of so many cells in series, or
            the charge is not that of such a pack.
    """
    voltage_V = table.voltage_V / pack.series
    _check_series(table, pack)
    if table.cells_V is not None and len(table.cells_V) != pack.series:
        raise CalibrationError(
            f"{table.name}: voltages of {len(table.cells_V)} cells, but {pack.series} in series: "
            "expected a column for each, or none"
        )
    sign = _sign(table)
    meaning = "discharge" if sign > 0 else "charge"
    for told_K in (table.ambient_K, table.temperature_K):
        if told_K is not None:
            ambient_K = float(told_K[np.isfinite(told_K)][0])
    warm_K = table.temperature_K
    if warm_K is not None and np.isfinite(warm_K).sum() < 2:
        warm_K = None  # tells where it starts and nothing more
    test = ReferenceTest(
        name=table.name,
        time_s=table.time_s,
        current_A=sign * table.current_A / pack.parallel,
        voltage_V=voltage_V,
        between=between,
        ambient_K=ambient_K,
        temperature_K=warm_K,
        remarks=(*table.remarks, f"positive current is {meaning}: the voltage says so"),
        cells_V=table.cells_V,
    )
    _check_charge(test, pack)
    mixed = test.mixed()
    if not mixed.any():
        return test
    left_out = (
        "rows left out at changes of the current, whose voltage is of the other side of it: "
        f"{mixed.sum()} (the first at {test.time_s[mixed][0]:.6g} s)"
    )
    return replace(test, remarks=(*test.remarks, left_out))


def _sign(table: MeasuredTable) -> float:
    """Of the current, see `discharge_sign`; CalibrationError where nothing shows it."""
    if not table.current_A.any():
        raise CalibrationError(
            f"{table.name}: the current is zero throughout: nothing to calibrate from"
        )
    sign = discharge_sign(table.time_s, table.current_A, table.voltage_V)
    if not sign:
        raise CalibrationError(
            f"{table.name}: the voltage does not answer the current: is the column the cell's "
            "voltage?"
        )
    return sign


def _check_series(table: MeasuredTable, pack: Pack) -> None:
    low, high = np.percentile(table.voltage_V, PERCENTILES) / pack.series
    least, most = pack.cell.lower_cut_off_V - OUTSIDE_V, pack.cell.upper_cut_off_V + OUTSIDE_V
    if least <= low and high <= most:
        return
    total = float(np.percentile(table.voltage_V, PERCENTILES[1]))
    fits = [
        n
        for n in range(1, round(total / pack.cell.lower_cut_off_V) + 1)
        if least <= low * pack.series / n and total / n <= most
    ]
    hint = f"; it fits {' or '.join(map(str, fits))} in series" if fits else ""
    raise CalibrationError(
        f"{table.name}: {low:.3f} to {high:.3f} V a cell with {pack.series} in series, but "
        f"{pack.cell.name} works from {pack.cell.lower_cut_off_V} to "
        f"{pack.cell.upper_cut_off_V} V: "
        f"check series in the pack file and the unit of the voltage{hint}"
    )


def _check_charge(test: ReferenceTest, pack: Pack) -> None:
    rated_C = labelled_C(pack)
    drawn_C = float(np.ptp(test.drawn_C()))
    least_V, most_V = np.percentile(test.voltage_V, PERCENTILES).tolist()
    fell = soc_at_rest(pack.cell, most_V) - soc_at_rest(pack.cell, least_V)
    slow = np.abs(test.current_A).max() <= SLOW * rated_C / 3600
    missing = slow and fell > FELL and drawn_C < LEAST_DRAWN * fell * rated_C
    if drawn_C <= MOST_DRAWN * rated_C and not missing:
        return
    beside = f" while its voltage goes through {fell:.0%} of its charge" if missing else ""
    raise CalibrationError(
        f"{test.name}: a cell gives {drawn_C / 3600:.3g} Ah{beside}, but is labelled "
        f"{rated_C / 3600:.3g} Ah: check units and sign of the current, the unit of the time, and "
        "capacity_ah and parallel in the pack file"
    )


def left_unknown(tests: tuple[ReferenceTest, ...], pack: Pack) -> tuple[str, ...]:
    """What all `tests` together cannot tell for want of reaching a cut-off, in words."""
    cell = pack.cell
    lowest = min(float(t.voltage_V.min()) for t in tests)
    highest = max(float(t.voltage_V[: _begin(t)].max()) for t in tests)
    out = []
    if lowest > cell.lower_cut_off_V + NEAR_V:
        out.append(
            f"no test reaches the lower cut-off of {cell.lower_cut_off_V} V (lowest: "
            f"{lowest:.3f} V): the empty end of the stoichiometry windows and the capacity rest "
            "on the shape of the curve above it"
        )
    if highest < cell.upper_cut_off_V - 5 * NEAR_V:
        out.append(
            f"no test starts near the upper cut-off of {cell.upper_cut_off_V} V (highest at a "
            f"start: {highest:.3f} V): the full end of the stoichiometry windows is extrapolated"
        )
    return tuple(out)


def _begin(test: ReferenceTest) -> int:
    """Samples before the first discharge, one at least."""
    return max(1, int(np.argmax(test.current_A > QUIET * np.abs(test.current_A).max())))
