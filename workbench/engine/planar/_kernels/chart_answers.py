# mypy: ignore-errors
"""What planar systems answer to the motion in independent coordinates, compiled."""

from numba import njit
from numba.extending import overload

from ...compiler.options import INNER
from ...integration._kernels.chart import add_design, applied_forces, constraint_rates
from .equations import contract, evaluate, place
from .joint_rates import joint_rates
from .tables import SpringTables, Tables

PLANAR = (Tables, SpringTables)


@overload(constraint_rates, jit_options=INNER, strict=False)
def _constraint_rates(T, W, R, X, step, q, v, w):
    if T.instance_class in PLANAR:
        return lambda T, W, R, X, step, q, v, w: joint_rates(T, W, R, X, step, q, v, w)
    return None


@overload(applied_forces, jit_options=INNER, strict=False)
def _applied_forces(T, W, X, step, q, v, lam, tangent):
    if T.instance_class in PLANAR:
        return lambda T, W, X, step, q, v, lam, tangent: evaluate(
            T, W, step, q, v, lam, X.states, X.states, 0.0, tangent
        )
    return None


@njit(**INNER)
def _contract_placed(T, W, step, q, v, mu, gradient):
    place(T, W, step, q, v)
    contract(T, W, step, mu, gradient)


@overload(add_design, jit_options=INNER, strict=False)
def _add_design(T, W, step, q, v, mu, gradient):
    if T.instance_class in PLANAR:
        return lambda T, W, step, q, v, mu, gradient: _contract_placed(T, W, step, q, v, mu, gradient)
    return None
