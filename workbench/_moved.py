"""Modules of the time before the rooms: where each went. Old dotted names go on working, with a
DeprecationWarning that names the new place.

A module that is gone is found by `MovedFinder`, which Python asks last. A room that bears the name of an old
module, such as `workbench.space`, hands out that module's names by `moved_name` from its `__getattr__`.
"""

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

__all__ = ["MOVED", "MovedFinder", "moved_name"]

# old module -> the modules that its names are in now, the first that has a name wins; all below `workbench.`
MOVED = {
    "archive": "system.archive",
    "atomic": "system.atomic",
    "audit": "search.evidence.audit",
    "baselines": "search.evidence.baselines",
    "bounds": "space.bounds",
    "campaign": "campaign.runs stages.campaign",
    "case_layouts": "robust_layout.cases",
    "certificates": "search.evidence.certificates",
    "cli": "terminal.cli",
    "confined": "system.confined",
    "console": "terminal.console",
    "corner_runs": "search.proposals.corners",
    "cuts": "robust_layout.cuts",
    "dask_engine": "workers.dask_engine",
    "demonstration": "study.shipped",
    "design": "sampling.plan",
    "design_factors": "sampling.factors",
    "design_files": "sampling.files",
    "design_growth": "sampling.growth",
    "design_kinds": "sampling.kinds sampling.points",
    "design_plots": "figures.design",
    "design_stage": "stages.design",
    "doctor": "terminal.doctor",
    "enclosure": "search.evidence.enclosure",
    "engine.layout.aggregate": "engine.layout.formulation.aggregate",
    "engine.layout.approximations": "engine.layout.separable.presets",
    "engine.layout.central_path": "engine.layout.paths.central_path",
    "engine.layout.dual": "engine.layout.separable.dual",
    "engine.layout.gsao": "engine.layout.separable.sequence",
    "engine.layout.interior": "engine.layout.separable.interior",
    "engine.layout.min_max": "engine.layout.bound.min_max",
    "engine.layout.optimality": "engine.layout.outcome.optimality",
    "engine.layout.peaks": "engine.layout.formulation.peaks",
    "engine.layout.problem": "engine.layout.formulation.problem",
    "engine.layout.programme": "engine.layout.outcome.linear_programme",
    "engine.layout.purify": "engine.layout.outcome.purify",
    "engine.layout.quadratic": "engine.layout.bound.quadratic",
    "engine.layout.record": "engine.layout.outcome.history",
    "engine.layout.result": "engine.layout.outcome.result",
    "engine.layout.secant": "engine.layout.paths.secant",
    "engine.layout.secant_path": "engine.layout.paths.secant_path",
    "engine.layout.side_by_side": "engine.simulation.side_by_side",
    "engine.layout.transient": "engine.layout.formulation.transient",
    "engine.layout.verdicts": "engine.layout.outcome.verdicts",
    "engine.multibody": "engine",
    "engine.multibody.chart": "engine.integration.chart engine.planar.equations",
    "engine.multibody.compiled": "engine.planar.compiled",
    "engine.multibody.convergence": "engine.simulation.convergence",
    "engine.multibody.elements": "engine.elements.joint_spring engine.elements.bushing",
    "engine.multibody.equations": "engine.planar.equations engine.integration.equations",
    "engine.multibody.independent": "engine.integration.independent engine.integration.equations",
    "engine.multibody.joints": "engine.planar.joints",
    "engine.multibody.members": (
        "engine.elements.laws engine.elements.spring engine.elements.contact engine.elements.impulse "
        "engine.elements.belt engine.elements.airbag engine.planar.members"
    ),
    "engine.multibody.motion": "engine.elements.prescribed_motion",
    "engine.multibody.natural": "engine.natural.system",
    "engine.multibody.natural_compiled": "engine.natural.compiled",
    "engine.multibody.natural_elements": "engine.natural.rigid_elements",
    "engine.multibody.natural_quantities": "engine.objectives.point_coordinate",
    "engine.multibody.natural_simulation": "engine.natural.runs",
    "engine.multibody.natural_tables": "engine.natural.tables",
    "engine.multibody.objectives": "engine.objectives.reductions",
    "engine.multibody.planar_independent": "engine.planar.independent",
    "engine.multibody.quantities": "engine.objectives.quantities",
    "engine.multibody.runge_kutta": "engine.planar.runge_kutta engine.simulation.exact_peak",
    "engine.multibody.runge_kutta_tableau": "engine.integration.dop853_tableau",
    "engine.multibody.schemes": "engine.integration.schemes",
    "engine.multibody.simulation": "engine.planar.runs engine.simulation.simulate",
    "engine.multibody.start": "engine.planar.start engine.integration.redundancy",
    "engine.multibody.stepping": "engine.integration.loops",
    "engine.multibody.steps": "engine.simulation.steps",
    "engine.multibody.system": "engine.planar.system",
    "engine.multibody.tables": "engine.planar._kernels.tables",
    "engine.multibody.trajectory": "engine.planar.trajectory engine.integration.outcome",
    "evaluator": "models.evaluator",
    "exports": "campaign.results.exports",
    "expression": "space.expression",
    "failures": "campaign.results.failures",
    "feasibility": "search.surrogate.feasibility",
    "figure_parts": "figures.parts",
    "fit_plots": "figures.fit",
    "gain": "search.runs.noticeable_gain",
    "gap": "search.evidence.gap",
    "gap_history": "search.evidence.gap_history",
    "given_runs": "search.runs.given_runs",
    "gradients": "models.gradients",
    "hills": "search.proposals.other_peaks",
    "histories": "histories.stored",
    "infill": "search.surrogate.pattern_search search.surrogate.expected_improvement",
    "input_measures": "space.laws",
    "joint_prediction": "robust.joint_prediction",
    "joint_runs": "robust.joint_runs",
    "joint_trend": "robust.joint_trend",
    "layout": "stages.layout",
    "layout_model": "robust_layout.model",
    "layout_oracle": "robust_layout.oracle",
    "layout_plots": "figures.layout",
    "layout_runs": "robust_layout.runs",
    "lease": "system.lease",
    "lock": "campaign.lock",
    "loop_plots": "figures.loop",
    "minimax": "robust.minimax",
    "minimax_game": "robust.cycles",
    "minimax_oracle": "robust.worst_scenario",
    "minimax_problems": "robust.master robust.scenarios",
    "minimax_record": "robust.minimax_record",
    "model": "models.protocol models.opening models.histories",
    "model_command": "models.command",
    "model_fmu": "models.fmu",
    "model_python": "models.python",
    "model_table": "models.table",
    "motion": "motion.frames",
    "other_screenings": "stages.other_screenings report.lines.screening",
    "parameter": "space.parameter",
    "planning": "stages.planning",
    "plots": "figures.all",
    "polish": "search.proposals.gradient_ascent",
    "portfolio": "search.proposals.portfolio",
    "process_tree": "system.processes.process_tree",
    "processes": "workers.processes",
    "progress": "campaign.progress",
    "proposals": "search.proposals.best_point",
    "readers": "models.readers",
    "reading_rules": "models.readers",
    "readings": "models.readings",
    "report": "report.writing",
    "report_sections": "report.sections",
    "report_sections.answers": "report.sections.answers",
    "report_sections.blocks": "report.page.blocks",
    "report_sections.design": "report.sections.design",
    "report_sections.drawing": "report.page.drawing",
    "report_sections.effects": "report.sections.effects",
    "report_sections.findings": "report.sections.findings",
    "report_sections.fit": "report.sections.fit",
    "report_sections.folder": "report.page.folder",
    "report_sections.gap_figure": "report.worst_case.gap_figure",
    "report_sections.layout": "report.layout.section",
    "report_sections.motion": "report.sections.motion",
    "report_sections.parallel_figure": "report.worst_case.parallel_figure",
    "report_sections.profiler": "report.sections.profiler",
    "report_sections.reproduce": "report.sections.reproduce",
    "report_sections.robust": "report.sections.robust",
    "report_sections.robust_layout": "report.sections.robust_layout",
    "report_sections.runs": "report.sections.runs",
    "report_sections.screening": "report.sections.screening",
    "report_sections.worst_case": "report.worst_case.section",
    "report_sections.worst_case_figures": "report.worst_case.figures",
    "rescreening": "screening.rescreening",
    "robust": "robust.re_evaluation",
    "robust_failures": "robust.failures",
    "robust_layout": "robust_layout.loop robust_layout.record",
    "robust_layout_stage": "stages.robust_layout",
    "robust_record": "robust.record",
    "robust_scenarios": "space.common_ground",
    "robust_stage": "stages.robust",
    "robust_statistics": "robust.statistics",
    "robust_table": "study.robust_table",
    "run_planning": "screening.run_planning",
    "run_plots": "figures.runs",
    "scenarios": "space.scenarios",
    "screening": "screening.kriging screening.record",
    "screening_plots": "figures.screening",
    "search_arguments": "search.arguments",
    "search_ledger": "search.runs.ledger",
    "search_model": "search.surrogate.model search.surrogate.fitting",
    "search_space": "search.runs.unit_space",
    "search_start": "search.start",
    "selection": "space.groups",
    "space": "space.box",
    "stages": "stages.run_all stages.design stages.stored_runs",
    "stills": "motion.stills",
    "store": "campaign.store",
    "store_schema": "campaign.store_schema",
    "streams": "space.streams",
    "study": "study.loading",
    "study_messages": "study.messages",
    "study_schema": "study.schema",
    "summaries": (
        "report.lines.design report.lines.layout report.lines.robust report.lines.robust_layout "
        "report.lines.screening report.lines.statements report.lines.tables "
        "report.lines.worst_case stages.run_all"
    ),
    "supervisor": "campaign.supervisor",
    "telling": "campaign.telling",
    "template": "models.template",
    "thinning": "campaign.results.thinning",
    "toml_lines": "study.toml_lines",
    "trajectories": "motion.trajectories figures.motion",
    "unit_text": "space.units",
    "validation": "stages.validation",
    "watching": "terminal.watching",
    "worker": "workers.worker",
    "worst_case": "search.worst_case",
    "worst_case_plots": "figures.worst_case",
    "worst_case_record": "search.record",
    "worst_case_stage": "stages.worst_case",
    "worst_case_targets": "study.worst_case_targets",
    "worst_cases": "search.worst_cases",
    "worst_quantile": "search.worst_quantile",
}
HOUSE = "workbench."


class MovedModule(ModuleType):
    """What stands under an old name: it hands out what the new places hold."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") and name != "__all__":
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        place, value = found(self.__name__, name)
        if "__path__" in vars(self):  # of an old package nobody was warned yet
            warn(f"{self.__name__}.{name}", f"{place}.{name}")
        return value


class MovedFinder:
    """A finder and loader of modules that moved, for `sys.meta_path`."""

    @staticmethod
    def find_spec(name: str, _path: Sequence[str] | None, _target: ModuleType | None = None) -> Any:
        """A specification for a name of the table; None for all others."""
        old = name.removeprefix(HOUSE)
        if old == name or old not in MOVED:
            return None
        is_package = any(other.startswith(f"{old}.") for other in MOVED)
        return ModuleSpec(name, MovedFinder, is_package=is_package)  # type: ignore[arg-type]

    @staticmethod
    def create_module(spec: ModuleSpec) -> ModuleType:
        """The stand-in."""
        return MovedModule(spec.name)

    @staticmethod
    def exec_module(module: ModuleType) -> None:
        """Say where the module went; a package is quiet, since importing its modules imports it, too."""
        if "__path__" not in vars(module):
            warn(module.__name__, " and ".join(places(module.__name__)))


def moved_name(room: str, name: str) -> Any:
    """The value of a name that a room's namesake, the old module, had.

    Raises:
        AttributeError: the old module had no such name, or it is a file of the room.
    """
    files = sys.modules[room].__path__
    if name.startswith("_") or any((Path(folder) / f"{name}.py").exists() for folder in files):
        raise AttributeError(f"module {room!r} has no attribute {name!r}")
    place, value = found(room, name)
    warn(f"{room}.{name}", f"{place}.{name}", stacklevel=4)
    return value


def warn(old: str, new: str, *, stacklevel: int = 3) -> None:
    """The warning, at the line that uses the old name."""
    warnings.warn(f"{old} moved to {new}", DeprecationWarning, stacklevel=stacklevel)


def places(old: str) -> list[str]:
    """The modules that hold the names of an old one."""
    return [HOUSE + place for place in MOVED[old.removeprefix(HOUSE)].split()]


def found(old: str, name: str) -> tuple[str, Any]:
    """Where a name of an old module is, and its value; AttributeError when nowhere."""
    for place in places(old):
        module = import_module(place)
        if hasattr(module, name):
            return place, getattr(module, name)
    raise AttributeError(f"module {old!r} has no attribute {name!r}")
