"""What a store tells about its runs in numbers and short lists, each by one query."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

__all__ = ["StoreQueries"]


class StoreQueries(ABC):
    """Questions to a store, asked through its `select` alone."""

    @abstractmethod
    def select(self, query: str, values: Sequence[Any] = ()) -> list[Any]:
        """Rows of a query."""

    def attempts(self, key: str) -> list[tuple[int, str, str, str]]:
        """Answers of a run that are not its answer: attempt, status, reason (retried or late), error."""
        return self.select(
            "SELECT attempt, status, reason, COALESCE(error, '') FROM attempt WHERE key = ? ORDER BY id",
            [key],
        )

    def counts(self) -> dict[str, int]:
        """How many rows have each status."""
        return dict(self.select("SELECT status, COUNT(*) FROM evaluation GROUP BY status"))

    def rows_since(self, moment: float) -> int:
        """How many rows were finished after `moment`, in seconds since 1970."""
        query = "SELECT COUNT(*) FROM evaluation WHERE finished > ? AND status NOT IN ('queued', 'running')"
        return int(self.select(query, [moment])[0][0])

    def last_answer(self) -> float | None:
        """When the last answer was stored, in seconds since 1970; None without any."""
        query = "SELECT MAX(finished) FROM evaluation WHERE status NOT IN ('queued', 'running')"
        found: float | None = self.select(query)[0][0]
        return found

    def latest_failures(self, count: int) -> list[tuple[str, str, str]]:
        """Key, status and error of the last rows that failed."""
        return self.select(
            "SELECT key, status, COALESCE(error, '') FROM evaluation "
            "WHERE status IN ('failed', 'timeout', 'killed', 'nonfinite') ORDER BY finished DESC LIMIT ?",
            [count],
        )

    def extremes(self) -> dict[str, tuple[float, float]]:
        """Smallest and largest value of every response."""
        query = (
            "SELECT j.key, MIN(j.value), MAX(j.value) FROM evaluation, json_each(evaluation.outputs) AS j "
            "WHERE status = 'ok' GROUP BY j.key ORDER BY j.key"
        )
        return {name: (low, high) for name, low, high in self.select(query)}

    def check(self) -> list[str]:
        """What SQLite's own integrity check finds wrong; empty when nothing is."""
        return [text for (text,) in self.select("PRAGMA integrity_check") if text != "ok"]

    def suspects(self) -> set[str]:
        """Keys of unfinished runs that were under way when a coordinator went."""
        query = "SELECT key FROM evaluation WHERE unanswered > 0 AND status IN ('queued', 'running')"
        return {key for (key,) in self.select(query)}
