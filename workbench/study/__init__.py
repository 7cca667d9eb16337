"""study.toml as one typed file: schema, messages, tables."""

from typing import TYPE_CHECKING, Any

if not TYPE_CHECKING:  # for type checkers a room has no names of its own

    def __getattr__(name: str) -> Any:
        from workbench._moved import moved_name

        return moved_name(__name__, name)
