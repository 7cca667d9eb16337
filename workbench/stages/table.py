"""The stages of a study, in the order in which they are walked: one table.

`holdfast run`, the commands, `holdfast plan` and `holdfast validate`, what is printed and what counts as up
to date are all made from it. Loading the table loads none of the stages: the command line needs their names
alone. What a stage does stands in the file of its name as a record `WORK`.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from workbench.stages.work import Work
    from workbench.study.record import Study

__all__ = ["STAGES", "Stage", "asked_stages", "stage_named"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """The names that a stage goes by.

    name: of its table in a study file, of what it found and of its file in this folder.
    document: what it writes into the campaign's folder, without ".json".
    help: what its command does.
    runs_model: whether it has the study's model run; then failed runs are told when it ends.
    workers: whether it shares its runs among worker processes.
    needs_design: whether it can do nothing without the runs of a design.
    first_key: of its table, what a table cannot do without.
    """

    name: str
    document: str
    help: str
    runs_model: bool = False
    workers: bool = False
    needs_design: bool = False
    first_key: str = "response"

    @property
    def command(self) -> str:
        """The word behind `holdfast`."""
        return self.name.replace("_", "-")

    @property
    def work(self) -> "Work":
        """What it does; loads its file."""
        work: Work = import_module(f"workbench.stages.{self.name}").WORK
        return work


STAGES = (
    Stage(
        name="design",
        document="design",
        help="Make the design and queue its rows. It lists those that somebody else is to run.",
        runs_model=True,
        workers=True,
    ),
    Stage(
        name="screen",
        document="screening",
        help="Which parameters matter, from the runs that are stored.",
        needs_design=True,
    ),
    Stage(
        name="worst_case",
        document="worst_case",
        help="Where the worst case lies. Every candidate is confirmed by a true run.",
        runs_model=True,
        workers=True,
    ),
    Stage(
        name="layout",
        document="layout",
        help="Optimise the layout of the multibody problem. Run it again to continue.",
        first_key="problem",
    ),
    Stage(
        name="robust",
        document="robust",
        help="Compare designs over the whole uncertainty. All at the same points.",
        runs_model=True,
        workers=True,
    ),
    Stage(
        name="robust_layout",
        document="robust_layout",
        help="Layout for the worst cases, and attacks on it, in turn. Run it again to continue.",
        workers=True,
        first_key="model",
    ),
)


def stage_named(name: str) -> Stage:
    """The stage of that name; KeyError when there is none."""
    return {stage.name: stage for stage in STAGES}[name]


def asked_stages(study: "Study") -> list[Stage]:
    """The stages whose tables stand in the study file."""
    return [stage for stage in STAGES if getattr(study, stage.name) is not None]
