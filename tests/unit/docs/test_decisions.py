"""The index of decisions names every record once, with its title, a date and a status."""

import re
from datetime import date
from pathlib import Path

FOLDER = Path(__file__).parents[3] / "docs" / "decisions"
ROW = re.compile(
    r"^\| (\d{4}) \| \[(.+)\]\((\S+\.md)\) \| (\S+) \| (\w+) \| (?:\[(\d{4})\]\((\S+\.md)\))? *\|$"
)


def rows(text):
    return [match.groups() for line in text.splitlines() if (match := ROW.match(line))]


def offences(folder):
    """What is wrong with the index of a folder of records, one line each."""
    index = (folder / "README.md").read_text()
    records = sorted(path.name for path in folder.glob("[0-9]*.md"))
    found = rows(index)
    wrong = [] if [row[2] for row in found] == records else ["the rows are not the records, in their order"]
    for number, title, file, day, status, later, later_file in found:
        if file in records and (folder / file).read_text().splitlines()[0] != f"# {number} {title}":
            wrong.append(f"{file} has another number or title")
        if date.fromisoformat(day) > date.today():
            wrong.append(f"{file} is dated in the future")
        if (status == "accepted") != (later is None) or status not in ("accepted", "refined", "superseded"):
            wrong.append(f"{file} has status {status}, by {later}")
        if later and (later_file not in records or not later_file.startswith(later) or later <= number):
            wrong.append(f"{file} gives way to {later_file}, which is no later record")
    return wrong


def test_the_index_of_decisions_is_complete():
    assert offences(FOLDER) == []


def test_what_an_index_lacks_is_found(tmp_path):
    (tmp_path / "0001-first.md").write_text("# 0001 First\n")
    (tmp_path / "0002-second.md").write_text("# 0002 Second\n")
    rows = [
        "| 0001 | [First](0001-first.md) | 2026-01-01 | refined | [0002](0002-second.md) |",
        "| 0002 | [Second](0002-second.md) | 2026-01-01 | accepted | |",
    ]

    def found(*lines):
        (tmp_path / "README.md").write_text("\n".join(lines))
        return offences(tmp_path)

    assert found(*rows) == []
    assert found(rows[0]) == ["the rows are not the records, in their order"]
    assert found(rows[0].replace("[First]", "[Last]"), rows[1]) == [
        "0001-first.md has another number or title"
    ]
    assert found(rows[0].replace("refined", "accepted"), rows[1]) == [
        "0001-first.md has status accepted, by 0002"
    ]
    assert found(rows[0].replace("0002-second", "0003-third"), rows[1]) == [
        "0001-first.md gives way to 0003-third.md, which is no later record"
    ]
    assert found(rows[0], rows[1].replace("2026", "9999")) == ["0002-second.md is dated in the future"]
