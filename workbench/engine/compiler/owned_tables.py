"""Tables that are kept as long as the system they were made of, and that do not keep it."""

from dataclasses import dataclass
from typing import Generic, TypeVar
from weakref import ReferenceType

__all__ = ["OwnedTables"]

Owner = TypeVar("Owner")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OwnedTables(Generic[Owner]):
    """What stands in a weak dictionary by its system: if it held that, neither would ever go."""

    owner: ReferenceType[Owner]

    @property
    def system(self) -> Owner:
        """The system, as long as somebody holds it."""
        found = self.owner()
        assert found is not None, "the system of these tables is gone: hold it as long as they are used"
        return found
