"""Every row of the table of features shows the feature: a name of its column "here" stands in a program or a block of code of each link in "shown in"."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
TABLE = ROOT / "docs" / "features.md"
LINK = re.compile(r"\]\(([^)#]+)(?:#([^)]+))?\)")
FENCE = re.compile(r"^```\w+\n(.*?)^```", re.M | re.S)
COMMAND = re.compile(r"`(tumble [^`]+|--[\w-]+[^`]*)`")


def rows():
    """The rows of all tables: feature, column "here", column "shown in"."""
    for line in TABLE.read_text().splitlines():
        cells = [cell.strip() for cell in line.removeprefix("|").removesuffix("|").split("|")]
        if len(cells) == 7 and cells[0] != "feature" and set(line) - set("|- "):
            yield cells[0], cells[5], cells[6]


def slug(heading):
    """The anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def code_of(path, anchor):
    """The program of a link, or the blocks of code of a page or of the section of its anchor."""
    text = path.read_text()
    if path.suffix != ".md":
        return text
    if anchor:
        headings = list(re.finditer(r"^(#+) (.*)$", FENCE.sub(lambda block: "\n" * block.group().count("\n"), text), re.M))
        # the same lines, so headings are found again by their numbers
        lines, starts = text.splitlines(keepends=True), []
        blank = FENCE.sub(lambda block: "\n" * block.group().count("\n"), text)
        for heading in headings:
            starts.append((blank[: heading.start()].count("\n"), len(heading[1]), slug(heading[2])))
        found = [k for k, start in enumerate(starts) if start[2] == anchor]
        assert found, f"{path.name} has no heading #{anchor}"
        first, depth, _ = starts[found[0]]
        last = next((line for line, level, _ in starts[found[0] + 1 :] if level <= depth), len(lines))
        text = "".join(lines[first:last])
    return "\n".join(FENCE.findall(text))


def names(here):
    """The names in backticks of a cell; the last part of a path, without arguments and values."""
    return [re.split(r"[ =(]", re.split(r"::|\.", name)[-1])[0].strip("[]") for name in re.findall(r"`([^`]+)`", here)]


@pytest.mark.parametrize("row", list(rows()), ids=lambda row: row[0])
def test_what_shows_a_feature_uses_it(row):
    feature, here, shown = row
    links = LINK.findall(shown)
    assert links, feature
    commands = COMMAND.findall(here)
    for target, anchor in links:
        code = code_of((TABLE.parent / target).resolve(), anchor)
        used = [name for name in names(here) if re.search(rf"(?<!\w){re.escape(name)}(?!\w)", code)]
        used += [command for command in commands if command in code]
        assert used or not names(here), f"{target}#{anchor} has none of {names(here)}"


def test_the_table_has_all_of_its_rows():
    lines = [line for line in TABLE.read_text().splitlines() if line.startswith("| ") and "---" not in line and not line.startswith("| feature")]
    assert len(lines) == len(list(rows())) > 80
