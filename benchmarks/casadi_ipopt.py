"""IPOPT with exact second derivatives, what our own interior-point method is compared with.

Drake's interface to IPOPT takes no second derivatives; the one of CasADi, of which nothing else is
used, does.

References
----------
A. Waechter and L. T. Biegler, "On the implementation of an interior-point filter line-search
algorithm for large-scale nonlinear programming", Mathematical Programming 106 (2006).
J. A. E. Andersson et al., "CasADi: a software framework for nonlinear optimization and optimal
control", Mathematical Programming Computation 11 (2019).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi
import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.newton.matrix import matrix_of
from human_gait.newton.nonlinear_program import Duals, End, NonlinearProgram

Evaluate = Callable[[Sequence[FloatArray | None], Sequence[FloatArray | None]], None]

OPTIONS: dict[str, Any] = {
    "tol": 1e-5,
    "constr_viol_tol": 1e-6,
    "dual_inf_tol": 1e-4,
    "compl_inf_tol": 1e-5,
    "acceptable_iter": 0,
    "max_iter": 300,
    "nlp_scaling_method": "none",
    "mu_strategy": "adaptive",  # quicker here than the default, as are the other choices
    "max_soc": 0,
    "perturb_inc_fact": 3.0,
    "perturb_dec_fact": 0.5,
    "print_level": 0,
    "sb": "yes",
}


def minimise(problem: NonlinearProgram, start: FloatArray) -> End:
    """Minimise from a start.

    Raises
    ------
    Exception
        What an evaluation raises ends the solve and is passed on.
    """
    oracle = _Oracle(problem)
    nlp = casadi.nlpsol("nlp", "ipopt", oracle.value, {**oracle.derivatives, "ipopt": OPTIONS})
    bounds = {"lbx": problem.lower, "ubx": problem.upper}
    bounds |= {"lbg": problem.row_lower, "ubg": problem.row_upper}
    found, stats = nlp(x0=start, **bounds), nlp.stats()
    if oracle.error:
        raise oracle.error
    x, by_row, by_variable = (np.array(found[key]).ravel() for key in ("x", "lam_g", "lam_x"))
    status = str(stats["return_status"])
    solved = status == "Solve_Succeeded"
    return End(x, Duals(by_row, by_variable), solved, status, stats["iter_count"])


class _Oracle:
    """The functions of a problem as CasADi asks for them."""

    def __init__(self, problem: NonlinearProgram) -> None:
        self.problem = problem
        self.error: BaseException | None = None
        n, m = len(problem.lower), len(problem.row_lower)
        jacobian, self._jacobian_place = _pattern(problem.jacobian_entries, (m, n))
        hessian, self._hessian_place = _pattern(np.triu_indices(n), (n, n))
        one, x, g = (casadi.Sparsity.dense(size, 1) for size in (1, n, m))
        at = [("x", x), ("p", casadi.Sparsity.dense(0, 0))]
        multipliers = [("lam_f", one), ("lam_g", g)]
        self.value = _Function("nlp", at, [("f", one), ("g", g)], self._value, self)
        gradient, rows = [("f", one), ("grad", x)], [("g", g), ("jac", jacobian)]
        second = [("hess", hessian)]
        self.derivatives: dict[str, Any] = {
            "grad_f": _Function("grad_f", at, gradient, self._gradient, self),
            "jac_g": _Function("jac_g", at, rows, self._jacobian, self),
            "hess_lag": _Function("hess_lag", at + multipliers, second, self._hessian, self),
            "no_nlp_grad": True,  # no derivatives in the parameters, of which there are none
            "calc_lam_p": False,
            "print_time": False,
            "error_on_fail": False,
        }

    def _value(self, given: Sequence[Any], wanted: Sequence[Any]) -> None:
        _put(wanted[0], self.problem.cost, given[0])
        _put(wanted[1], self.problem.rows, given[0])

    def _gradient(self, given: Sequence[Any], wanted: Sequence[Any]) -> None:
        _put(wanted[0], self.problem.cost, given[0])
        _put(wanted[1], self.problem.gradient, given[0])

    def _jacobian(self, given: Sequence[Any], wanted: Sequence[Any]) -> None:
        _put(wanted[0], self.problem.rows, given[0])
        if wanted[1] is not None:
            values = self.problem.jacobian(given[0])
            wanted[1][:] = np.bincount(self._jacobian_place, values, len(wanted[1]))

    def _hessian(self, given: Sequence[Any], wanted: Sequence[Any]) -> None:
        x, _, factor, multipliers = given
        if wanted[0] is not None:
            second = self.problem.hessian(x, float(factor[0]), multipliers, 0.0 * multipliers)
            upper = matrix_of(second).dense()[np.triu_indices(len(x))]
            wanted[0][self._hessian_place] = upper


class _Function(casadi.Callback):
    """A function of CasADi that reads and writes its arrays in place."""

    def __init__(
        self,
        name: str,
        inputs: list[tuple[str, Any]],
        outputs: list[tuple[str, Any]],
        evaluate: Evaluate,
        oracle: _Oracle,
    ) -> None:
        casadi.Callback.__init__(self)
        self._inputs, self._outputs = inputs, outputs
        self._evaluate, self._oracle = evaluate, oracle
        self.construct(name, {})

    def get_n_in(self) -> int:
        return len(self._inputs)

    def get_n_out(self) -> int:
        return len(self._outputs)

    def get_name_in(self, i: int) -> str:
        return self._inputs[i][0]

    def get_name_out(self, i: int) -> str:
        return self._outputs[i][0]

    def get_sparsity_in(self, i: int) -> Any:
        return self._inputs[i][1]

    def get_sparsity_out(self, i: int) -> Any:
        return self._outputs[i][1]

    def has_eval_buffer(self) -> bool:
        return True

    def eval_buffer(self, given: Sequence[Any], wanted: Sequence[Any]) -> int:
        """Evaluate; an error is kept for `minimise`, and from then on nothing is evaluated."""
        if self._oracle.error:
            return 1
        try:
            self._evaluate([_array(a) for a in given], [_array(a) for a in wanted])
        except BaseException as error:  # noqa: BLE001, CasADi would swallow it
            self._oracle.error = error
            return 1
        return 0


def _array(buffer: Any) -> FloatArray | None:
    """Return a buffer of CasADi as an array; None where nothing is wanted."""
    return None if buffer is None or not buffer.nbytes else np.frombuffer(buffer, dtype=float)


def _put(wanted: FloatArray | None, function: Callable[[FloatArray], Any], x: FloatArray) -> None:
    if wanted is not None:
        wanted[:] = function(x)


def _pattern(entries: tuple[IntArray, IntArray], shape: tuple[int, int]) -> tuple[Any, IntArray]:
    """Return a pattern of CasADi, column by column, and the place of every entry in it."""
    rows, columns = entries
    places, place = np.unique(columns * shape[0] + rows, return_inverse=True)
    columns, rows = np.divmod(places, shape[0])
    return casadi.Sparsity.triplet(*shape, rows.tolist(), columns.tolist()), place
