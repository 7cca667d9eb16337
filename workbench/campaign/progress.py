"""What a campaign tells while it works; whoever listens decides how to show it."""

from collections.abc import Mapping
from typing import Protocol

__all__ = ["Progress", "Silent"]


class Progress(Protocol):
    """A listener. All calls come from the thread that runs the campaign."""

    def stage(self, name: str, detail: str) -> None:
        """A stage begins."""

    def runs(self, done: int, total: int, counts: Mapping[str, int]) -> None:
        """`done` of `total` runs are stored; `counts` by status."""

    def search(
        self, run: int, budget: int, *, proposal: str, value: float | None, best: float, name: str, unit: str
    ) -> None:
        """A search made its `run`-th of `budget` runs for `proposal`; `value` is None when it failed.

        `best`: the worst value so far; infinite once a run has failed where that counts as worse than any.
        """

    def note(self, text: str) -> None:
        """Something a person should know."""


class Silent:
    """Nobody listens."""

    def stage(self, name: str, detail: str) -> None:
        """Nothing."""

    def runs(self, done: int, total: int, counts: Mapping[str, int]) -> None:
        """Nothing."""

    def search(
        self, run: int, budget: int, *, proposal: str, value: float | None, best: float, name: str, unit: str
    ) -> None:
        """Nothing."""

    def note(self, text: str) -> None:
        """Nothing."""
