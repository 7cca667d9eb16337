"""The embedded multibody and layout engine: SI numbers in; trajectories, gradients and layouts out.

It knows no design of experiments, no study file and no xarray; it needs numpy, scipy and numba alone.
Public names are loaded on first use.
"""

from importlib import import_module
from typing import Any

__distribution__ = "holdfast"

_ROOM = "workbench.engine."

# public name -> module that defines it
_PUBLIC: dict[str, str] = {
    name: _ROOM + module
    for module, names in {
        "layout.optimise": ("optimise_layout",),
        "errors": ("AssemblyError", "EngineError", "InvalidSystem", "NotConverged", "NotSupported"),
        "multibody.convergence": ("choose_scheme", "convergence"),
        "multibody.elements": ("Bushing", "JointSpring"),
        "multibody.joints": (
            "AngleJoint", "DistanceJoint", "DrivenJoint", "FixedJoint", "PointOnLine", "PrismaticJoint",
            "RevoluteJoint",
        ),
        "multibody.members": (
            "Airbag", "Belt", "Contact", "Impulse", "Member", "Retractor", "Spring", "UserLaw",
            "dense_members",
        ),
        "multibody.motion": ("Motion", "motion_from_acceleration"),
        "multibody.natural": (
            "Angle", "Distance", "NaturalPoint", "NaturalSystem", "PointMember", "PointOnLine3",
            "PointOnPlane", "RigidElement", "UnitVector",
        ),
        "multibody.natural_quantities": ("PointCoordinate",),
        "multibody.natural_simulation": ("NaturalTrajectory", "moving"),
        "multibody.runge_kutta": ("locate_peak",),
        "multibody.schemes": (
            "BDF2", "GeneralisedAlpha", "IndependentAlpha", "RungeKutta8", "VelocityVerlet",
        ),
        "multibody.objectives": ("AtTime", "Integral", "Maximum", "Minimum", "PNorm", "Peak", "Terminal"),
        "multibody.quantities": ("Coordinate", "Deviation", "Scalar", "Slopes", "StoredEnergy"),
        "multibody.simulation": ("simulate",),
        "sensitivity": ("gradient", "gradient_check", "gradients", "parameter_gradient"),
        "multibody.start": ("assembled",),
        "multibody.steps": ("choose_steps",),
        "multibody.system": ("Body", "Load", "System"),
        "multibody.trajectory": ("Trajectory",),
    }.items()
    for name in names
}  # fmt: skip

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'workbench.engine' has no attribute {name!r}")


def __dir__() -> list[str]:
    return list(__all__)
