"""The embedded multibody and layout engine: SI numbers in; trajectories, gradients and layouts out.

It knows no design of experiments, no study file and no xarray; it needs numpy, scipy and numba alone.
Public names are loaded on first use.
"""

from importlib import import_module
from typing import Any

from .elements.table import ELEMENTS, LAWS

__distribution__ = "holdfast"

_ROOM = "workbench.engine."

# public name -> module that defines it
_PUBLIC: dict[str, str] = {
    name: _ROOM + module
    for module, names in {
        "layout.optimise": ("optimise_layout",),
        "errors": ("AssemblyError", "EngineError", "InvalidSystem", "NotConverged", "NotSupported"),
        "simulation.acting": ("acting_members",),
        "simulation.convergence": ("choose_scheme", "convergence"),
        "planar.joints": (
            "AngleJoint", "DistanceJoint", "DrivenJoint", "FixedJoint", "PointOnLine", "PrismaticJoint",
            "RevoluteJoint",
        ),
        "elements.impulse": ("Retractor",),
        "elements.compiled_law": ("CompiledLaw",),
        "elements.laws": ("UserLaw",),
        "elements.state_law": ("StateLaw",),
        "elements.prescribed_motion": ("Motion", "motion_from_acceleration"),
        "natural.system": (
            "Angle", "Distance", "NaturalPoint", "NaturalSystem", "PointMember", "PointOnLine3",
            "PointOnPlane", "RigidElement", "UnitVector",
        ),
        "objectives.filters": ("ChannelFilter", "WholeBodyFilter"),
        "objectives.injury": ("ClipLevel", "HeadInjury", "PointAcceleration"),
        "objectives.occupant": ("Filtered", "RideComfort"),
        "objectives.member_histories": ("MemberHistories", "member_histories"),
        "objectives.member_quantities": ("MemberElongation", "MemberForce"),
        "objectives.point_coordinate": ("PointCoordinate",),
        "objectives.point_quantities": ("PlaneClearance", "PointDistance", "PointSpeed"),
        "natural.runs": ("NaturalTrajectory",),
        "natural.start": ("moving",),
        "integration.schemes": (
            "BDF2", "GeneralisedAlpha", "IndependentAlpha", "RungeKutta8", "VelocityVerlet",
        ),
        "objectives.occurrence": ("FirstCrossing", "State"),
        "objectives.reductions": (
            "AtTime", "Integral", "LogSumExp", "Maximum", "Minimum", "PNorm", "Peak", "Terminal",
        ),
        "objectives.relative_speed": ("RelativeSpeed",),
        "objectives.quantities": ("Coordinate", "Deviation", "Scalar", "Slopes", "StoredEnergy"),
        "planar.members": ("Member", "dense_members"),
        "sensitivity.check": ("gradient_check",),
        "sensitivity.discrete_adjoint": ("parameter_gradient",),
        "sensitivity.gradient": ("gradient", "gradients"),
        "sensitivity.parameter_histories": ("parameter_histories",),
        "sensitivity.parameter_slopes": ("parameter_jacobian", "parameter_slopes"),
        "simulation.cases": ("Case", "CaseResult", "simulate_cases"),
        "simulation.exact_peak": ("locate_peak",),
        "simulation.simulate": ("simulate",),
        "planar.start": ("assembled",),
        "simulation.steps": ("choose_steps",),
        "planar.system": ("Body", "Load", "System"),
        "planar.trajectory": ("Trajectory",),
        "tree.elements": (
            "CoordinateDamper", "CoordinateSpring", "Coupling", "SpatialBushing", "SpatialLoad",
            "SpatialMember", "SpatialStrut", "SphericalSpring",
        ),
        "tree.joints": (
            "Cylindrical", "Floating", "Planar", "Prescribed", "Prismatic", "Revolute", "SpatialMotion",
            "Spherical", "Universal", "Welded",
        ),
        "tree.loops.cuts": ("CutJoint",),
        "tree.restart": ("close_loops", "restarted"),
        "tree.gradients": ("TreeGradient",),
        "tree.statics": ("equilibrium", "modes"),
        "tree.robot_files.mjcf": ("read_mjcf",),
        "tree.robot_files.mjcf_writing": ("write_mjcf",),
        "tree.robot_files.record": ("RobotFile",),
        "tree.robot_files.urdf": ("read_urdf", "write_urdf"),
        "tree.system": ("SpatialBody", "TreeSystem"),
        "tree.surfaces": (
            "Box", "Capsule", "Plane", "Ring", "Road", "Shape", "SpatialContact", "Sphere", "Tyre",
        ),
        "tree.trajectory": ("TreeTrajectory",),
    }.items()
    for name in names
} | {name: f"{_ROOM}elements.{file}" for name, file in {**LAWS, **ELEMENTS}.items()}  # fmt: skip

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'workbench.engine' has no attribute {name!r}")


def __dir__() -> list[str]:
    return list(__all__)
