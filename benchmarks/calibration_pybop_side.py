"""PyBOP's side of `benchmarks.calibration_pybop`, run there by a Python that has PyBOP.

    python calibration_pybop_side.py OPTIMISER problem.json trace.json

PyBaMM's DFN is built from the BPX file of the cell to start from. Each number that is calibrated is
an expression of a PyBOP parameter q with the prior N(0, 1), cut off at its bounds: the coordinate,
scale, bounds and start of the twin's own calibration. Electrode balance is given as there too: fill
of the charged negative electrode, of the discharged positive one, capacity, and voltage at the
start; what follows of the windows is interpolated in tables of the inverse potentials. Currents are
sums of steps, at which the integrator stops and starts anew.
"""

import json
import sys
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pybamm
import pybop

TABLE = 1500  # entries of an inverse potential
CLOSE_s = 1e-3  # times of samples that are the same
SPREADS = {"IRPropPlus": 0.2}
"""Standard deviation of the priors where it is not 1: IRPropPlus takes its first step from it, and
with 1 leaves at once for the bounds."""
SIDES = ("negative", "positive")


class OutOfTime(Exception):
    """The budget is used up."""


class Squares(pybop.SumSquaredError):
    """Weighted squares of one test, also where the cell is empty before its end.

    What is not come to counts as the twin counts it: as if the voltage stood at `beyond_V`. PyBOP's
    own measure is infinite there, as it would be at the start.
    """

    def __init__(self, test: dict[str, Any], beyond_V: float) -> None:
        time_s, voltage_V = np.array(test["time_s"]), np.array(test["voltage_V"])
        super().__init__(pybop.Dataset({"Time [s]": time_s, "Voltage [V]": voltage_V}))
        self.weighting = 1 / np.array(test["sigma_V"]) ** 2  # PyBOP 26.3 refuses it as an argument
        self.beyond_V = beyond_V

    def evaluate(self, solution: Any, *, calculate_sensitivities: bool = False, **_: Any) -> Any:
        """Cost, or cost and derivatives."""
        if isinstance(solution, pybop.FailedSolution):
            return self.failure(self.parameters.names, calculate_sensitivities)
        time_s, target_V = self.domain_data, self.target_data["Voltage [V]"]
        at = np.minimum(np.searchsorted(solution.t, time_s - CLOSE_s), solution.t.size - 1)
        met = np.abs(solution.t[at] - time_s) < CLOSE_s  # it also stops where the current jumps
        simulated = solution["Voltage [V]"]
        r = np.where(met, simulated.data[at], self.beyond_V) - target_V
        if not calculate_sensitivities:
            return self(r)
        slopes = {
            key: met * np.ravel(simulated.sensitivities[key])[at] for key in solution.all_inputs[0]
        }
        return self(r, slopes)


class Traced(pybop.MetaProblem):
    """Tests as one problem; keeps when which cost was reached, and stops in time."""

    def begin(self, budget_s: float) -> None:
        """The clock starts."""
        self.began, self.budget_s = time.perf_counter(), budget_s
        self.evaluations, self.trace = 0, []
        self.with_derivatives = False

    def evaluate_batch(
        self, inputs: list[dict[str, float]], *, calculate_sensitivities: bool = False
    ) -> Any:
        """As without a trace."""
        out = super().evaluate_batch(inputs, calculate_sensitivities=calculate_sensitivities)
        self.evaluations += len(inputs)
        values = np.asarray(out.values, dtype=float)
        at = int(np.nanargmin(values))
        now_s = time.perf_counter() - self.began
        self.with_derivatives |= calculate_sensitivities
        if np.isfinite(values[at]) and (not self.trace or values[at] < self.trace[-1][2]):
            self.trace.append((now_s, self.evaluations, float(values[at])))
        if now_s > self.budget_s:
            raise OutOfTime
        return out


def inverse(potential: Any, volts: Any) -> pybamm.Symbol:
    """Stoichiometry at which `potential` has `volts`."""
    x = np.concatenate([np.geomspace(1e-4, 0.02, TABLE // 3), np.linspace(0.021, 0.999, TABLE)])
    u = np.array([float(potential(pybamm.Scalar(v)).evaluate()) for v in x])
    order = np.argsort(u)
    return pybamm.Interpolant(u[order], x[order], volts, interpolator="linear")


def parameter_values(problem: dict[str, Any], test: dict[str, Any]) -> pybamm.ParameterValues:
    """The BPX cell with expressions in place of what is calibrated."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        values = pybamm.ParameterValues.create_from_bpx(problem["bpx"])
    free, q = {}, {}
    for p in problem["parameters"]:
        low, high = p["bounds"]
        prior = pybop.Gaussian(0.0, problem["spread"], truncated_at=[low, high])
        free[p["name"]] = pybop.Parameter(prior, initial_value=0.0)
        coordinate = p["std"] * pybamm.Parameter(p["name"])
        q[p["name"]] = p["mean"] * pybamm.exp(coordinate) if p["log"] else p["mean"] + coordinate
    changed = {**electrolyte(values, q), **balance(values, q, problem["empty_V"])}
    for side in SIDES:
        changed |= electrode(values, side, q)
    current = sum(jump * (pybamm.t >= at_s) for at_s, jump in test["jumps"])
    changed |= {
        "Current function [A]": current,
        "Contact resistance [Ohm]": q["series_resistance_ohm"],
    }
    values.update({**changed, **free}, check_already_exists=False)
    return values


def electrolyte(values: pybamm.ParameterValues, q: dict[str, Any]) -> dict[str, Any]:
    """Salt, diffusivity and the separator's pores."""
    known = values["Electrolyte diffusivity [m2.s-1]"]
    factor = q["electrolyte.diffusivity_factor"]
    return {
        "Initial concentration in electrolyte [mol.m-3]":
            q["electrolyte.initial_concentration_mol_m3"],
        "Electrolyte diffusivity [m2.s-1]": lambda c, T: factor * known(c, T),
        "Separator porosity": q["separator.porosity"],
    }  # fmt: skip


def balance(values: pybamm.ParameterValues, q: dict[str, Any], empty_V: float) -> dict[str, Any]:
    """Active shares and concentrations at the start, from window ends, capacity and voltage."""
    negative, positive = (values[f"{s.capitalize()} electrode OCP [V]"] for s in SIDES)
    full, empty = q["negative.stoichiometry_max"], q["positive.stoichiometry_max"]
    ends = {
        "negative": (full, full - inverse(negative, positive(empty) - empty_V)),
        "positive": (start := inverse(positive, q["start_V"] + negative(full)), empty - start),
    }
    pairs = values["Number of electrodes connected in parallel to make a cell"]
    out = {}
    for side, (at_start, width) in ends.items():
        most = values[f"Maximum concentration in {side} electrode [mol.m-3]"]
        volume_m3 = (
            pairs
            * values["Electrode area [m2]"]
            * values[f"{side.capitalize()} electrode thickness [m]"]
        )
        holds_C = pybamm.constants.F.value * most * volume_m3
        share = f"{side.capitalize()} electrode active material volume fraction"
        out[share] = q["capacity_C"] / (width * holds_C)
        out[f"Initial concentration in {side} electrode [mol.m-3]"] = at_start * most
    return out


def electrode(values: pybamm.ParameterValues, side: str, q: dict[str, Any]) -> dict[str, Any]:
    """Transport and kinetics; numbers are those of the file times what has become of its mean."""
    name = side.capitalize()
    diffusivity = values[f"{name} particle diffusivity [m2.s-1]"]
    exchange = values[f"{name} electrode exchange-current density [A.m-2]"]
    salt = q["electrolyte.initial_concentration_mol_m3"]
    as_mixed = (values["Initial concentration in electrolyte [mol.m-3]"] / salt) ** 0.5
    return {
        f"{name} electrode conductivity [S.m-1]": q[f"{side}.conductivity_S_m"],
        f"{name} electrode porosity": q[f"{side}.porosity"],
        f"{name} particle diffusivity [m2.s-1]":
            lambda s, T: q[f"{side}.diffusivity_factor"] * diffusivity(s, T),
        f"{name} electrode exchange-current density [A.m-2]":
            lambda ce, cs, most, T:
                q[f"{side}.exchange_factor"] * as_mixed * exchange(ce, cs, most, T),
    }  # fmt: skip


def problem_of(problem: dict[str, Any]) -> Traced:
    """Weighted squares of all tests."""
    parts = []
    points = dict.fromkeys(("x_n", "x_s", "x_p", "r_n", "r_p"), problem["points"])
    for test in problem["tests"]:
        model = pybamm.lithium_ion.DFN({"contact resistance": "true"})
        left = model.variables["Voltage [V]"] - problem["beyond_V"]
        model.events = [pybamm.Event("empty", left)]  # PyBOP removes those named by their voltage
        simulator = pybop.pybamm.Simulator(
            model, parameter_values(problem, test), protocol=np.array(test["time_s"]),
            var_pts=points,
        )  # fmt: skip
        cost = Squares(test, problem["beyond_V"])
        parts.append(pybop.Problem(simulator, cost))
    return Traced(*parts)


def optimiser(name: str, problem: Traced) -> pybop.BaseOptimiser:
    """By name, to run until the budget is used up or it has converged."""
    if name == "SciPyMinimize":  # with derivatives: L-BFGS-B
        options = {"maxfun": 10**6}
        return pybop.SciPyMinimize(
            problem, pybop.SciPyMinimizeOptions(maxiter=10**6, solver_options=options)
        )
    patient = pybop.PintsOptions(max_iterations=10**6, max_unchanged_iterations=200)
    return getattr(pybop, name)(problem, patient)


def main() -> None:
    """Run and leave the trace."""
    name, given, wanted = sys.argv[1:]
    problem = json.loads(Path(given).read_text()) | {"spread": SPREADS.get(name, 1.0)}
    np.random.seed(problem["seed"])  # noqa: NPY002 - PINTS draws from the global generator
    began = time.perf_counter()
    traced = problem_of(problem)
    built_s = time.perf_counter() - began
    traced.begin(problem["budget_s"])
    try:
        ended = str(optimiser(name, traced).run().message)
    except OutOfTime:
        ended = "budget used up"
    out = {
        "built_s": built_s, "trace": traced.trace, "ended": ended,
        "derivatives": traced.with_derivatives,
    }  # fmt: skip
    Path(wanted).write_text(json.dumps(out))


if __name__ == "__main__":
    main()
