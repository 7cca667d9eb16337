"""What a section is made of: sentences, notes, figures with their table twins; and how numbers read."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from workbench.space.units import DIGITS, number, raised

__all__ = [
    "Card",
    "Column",
    "Figure",
    "Note",
    "Panel",
    "Section",
    "Table",
    "names_of",
    "number",
    "percent",
    "quantity",
    "typeset",
]

Level = Literal["good", "fair", "poor", "plain"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One column of a table, with its unit ("1" for none)."""

    name: str
    unit: str = "1"

    @property
    def heading(self) -> str:
        """Name and unit."""
        return self.name if self.unit in ("", "1") else f"{self.name} [{self.unit}]"

    @property
    def shown(self) -> str:
        """The heading as it is read."""
        return self.name if self.unit in ("", "1") else f"{self.name} [{raised(self.unit)}]"


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Rows of raw values; `marked` rows are set off and say why in their cell of the column `mark`.

    A `folded` table is opened by a click and left out in print: for details that are long and told elsewhere.
    """

    id: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...]
    marked: frozenset[int] = frozenset()
    folded: bool = False

    @property
    def trimmed(self) -> "Table":
        """Without columns that say nothing: empty ones, and units when all are 1."""
        kept = [
            j
            for j, column in enumerate(self.columns)
            if not self.rows
            or (
                any(row[j] not in (None, "") for row in self.rows)
                and not (column.name == "unit" and all(row[j] == "1" for row in self.rows))
            )
        ]
        return replace(
            self,
            columns=tuple(self.columns[j] for j in kept),
            rows=tuple(tuple(row[j] for j in kept) for row in self.rows),
        )

    @property
    def numeric(self) -> list[bool]:
        """Which columns hold numbers and stand to the right."""
        columns = [
            [row[j] for row in self.rows if row[j] not in (None, "")] for j in range(len(self.columns))
        ]
        return [
            bool(values) and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values)
            for values in columns
        ]

    @property
    def cells(self) -> list[list[str]]:
        """The rows as they are read."""
        return [[number(value) for value in row] for row in self.rows]


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """One drawing of a figure: `draw` gets the axes. Sizes in inches."""

    draw: Callable[[Any], Any]
    width: float = 4.6
    height: float = 3.0
    title: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """Drawings with a sentence on what they show (`alt`), what to read off, and the numbers as table."""

    id: str
    title: str
    alt: str
    read_off: str
    panels: tuple[Panel, ...]
    table: Table


@dataclass(frozen=True, slots=True, kw_only=True)
class Note:
    """A sentence set off from the text."""

    text: str
    level: Level = "plain"


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """One answer on the first screen: question, answer, a sentence below, and the section it comes from."""

    question: str
    answer: str
    detail: str
    section: str
    level: Level = "plain"


@dataclass(frozen=True, slots=True, kw_only=True)
class Html:
    """A part of the page that a section brings itself; `text` stands for it in Markdown."""

    id: str
    markup: str
    text: str


Block = Figure | Table | Note | Html


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A heading with sentences and blocks, and the printed numbers under their names."""

    id: str
    title: str
    sentences: tuple[str, ...] = ()
    blocks: tuple[Block, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)

    @property
    def tables(self) -> list[Table]:
        """All tables, twins of figures included."""
        return [
            block.table if isinstance(block, Figure) else block
            for block in self.blocks
            if isinstance(block, (Figure, Table))
        ]


def quantity(value: Any, unit: str = "1", digits: int = DIGITS) -> str:
    """A value with its unit.

    >>> quantity(309.57559, "m^3/yr"), quantity(13.3125)
    ('309.576 m³/yr', '13.3125')
    """
    return number(value, digits) if unit in ("", "1") else f"{number(value, digits)} {raised(unit)}"


def percent(share: float, digits: int = 0) -> str:
    """A share of one as percent.

    >>> percent(0.953)
    '95\xa0%'
    """
    return f"{100.0 * share:.{digits}f}\N{NO-BREAK SPACE}%"


def typeset(sentence: str) -> str:
    """A sentence of a document as the page prints it: exponents raised, no line break before a percent sign.

    >>> typeset("at most 5 % or 2 m^3/yr")
    'at most 5\xa0% or 2 m³/yr'
    """
    return raised(sentence).replace(" %", "\N{NO-BREAK SPACE}%")


def names_of(names: Sequence[str], *, at_most: int = 12) -> str:
    """Names as a list in a sentence.

    >>> names_of(["x1", "x4", "x5"]), names_of(["x1"]), names_of([])
    ('x1, x4 and x5', 'x1', 'none')
    """
    if not names:
        return "none"
    if len(names) > at_most:
        return f"{', '.join(names[:at_most])} and {len(names) - at_most} more"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
