"""Runs of a study in its folder: store, lock, supervisor, ask and tell, exports, histories, failures."""

from typing import TYPE_CHECKING, Any

if not TYPE_CHECKING:  # for type checkers a room has no names of its own

    def __getattr__(name: str) -> Any:
        from workbench._moved import moved_name

        return moved_name(__name__, name)
