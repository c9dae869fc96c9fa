#!/usr/bin/env python3
"""Checks the documentation and the words of the project.

Looks at every file that git tracks or would track, and prints each fault as `file:line: what`. The exit code is 1 if there is any.

- Paths, links, commands and names of tests in pages exist, and so do types named in ARCHITECTURE.md. No path of one machine stands anywhere.
- No doc comment of Rust begins with "What", "Who", "Whose", "Where" or "Of".
- No word that `docs/glossary.md` rules out stands in a page, a comment, a string of Rust or Python, a TOML file or a script.
- No line ends in a blank.
- No sentence of the README, ARCHITECTURE.md, CONTRIBUTING.md or `docs/` has more than 45 words.
"""

import io
import re
import subprocess
import sys
import tokenize
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent

# Roots of places that exist on one machine only.
MACHINE = re.compile(r"(?<![\w.~})$*-])/(?:work|root|home|Users|tmp)(?=[/\s\"'`)\]]|$)")
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)[^)]*\)")
CODE = re.compile(r"`([^`\n]+)`")
# Text in backticks that is a path of this repository: it begins with one of its folders, or is one of its root files.
PATHLIKE = re.compile(r"^[\w.@-]+(?:/[\w.@*-]+)*/?$")
RUN = re.compile(r"^(?:cargo run --release(?: --quiet)?(?: --locked)? -- |tumble |target/release/tumble )(.*)$")
TEST = re.compile(r"^[a-z]\w*::([a-z0-9]+(?:_[a-z0-9]+){2,})$")
MADE = ("out/", "target/")  # written by builds and runs
BUILT = {".git", "target", "out", "__pycache__", ".venv"}
GLOSSARY = "docs/glossary.md"
WORDS_HEADING = "## Words that are not used"
LONGEST = 45  # words in a sentence
HEADLESS = re.compile(r"\s*//[/!]\s+(What|Who|Whose|Where|Of)\s")
BOOK = re.compile(r"(README|ARCHITECTURE|CONTRIBUTING)\.md|docs/[\w.-]+\.md")
# Pages whose names of types and functions must occur in the sources.
NAMING = ("ARCHITECTURE.md", "CONTRIBUTING.md")
# These hold former names and words of others by their nature.
FORMER = (
    "scripts/migrate_0_1.py",
    "scripts/check_docs.py",
    "crates/py/tests/test_check_docs.py",
    "crates/py/tests/test_migrate.py",
    "tests/migrate/",
    "crates/scene/src/parse/renamed.rs",
    "crates/scene/tests/it/bad_input.rs",
)


def tracked():
    """Every file of the project, as paths relative to its root."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    try:
        listing = subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout.decode()
        names = [name for name in listing.split("\0") if name]
    except (OSError, subprocess.CalledProcessError):  # no git, or not a clone
        paths = [path.relative_to(ROOT) for path in ROOT.rglob("*")]
        names = sorted(str(path) for path in paths if not BUILT.intersection(path.parts))
    return [name for name in names if (ROOT / name).is_file()]


def text_of(name):
    """The text of a file; None where it is not text."""
    data = (ROOT / name).read_bytes()
    try:
        return None if b"\0" in data else data.decode()
    except UnicodeDecodeError:
        return None


def without_fences(lines):
    """Lines of a Markdown file, those inside code fences made empty."""
    inside = False
    for line in lines:
        fence = line.lstrip().startswith("```")
        inside ^= fence
        yield "" if inside or fence else line


def commands(lines):
    """(number, command) of each line of the code blocks marked sh."""
    inside = False
    for number, line in enumerate(lines, 1):
        if line.lstrip().startswith("```"):
            inside = not inside and line.strip() in ("```sh", "```console", "```")
        elif inside:
            yield number, line.split("#")[0].strip()


def folders():
    """Folders and files at the root of the project, and those of its crates: where paths in backticks may begin."""
    return {path.name for path in ROOT.iterdir() if path.name not in ("target", "out", ".git")}


class Rule(NamedTuple):
    """A row of the table of words that are not used."""

    words: re.Pattern
    instead: str
    allowed: re.Pattern | None
    places: tuple[str, ...]


def pattern(words):
    """Matches any of these words, as whole words; `_` separates words, and a space stands for any white space."""
    each = "|".join(re.escape(word).replace(r"\ ", r"\s+").replace(r"\-", "[- ]") for word in sorted(words, key=len, reverse=True))
    return re.compile(rf"(?<![A-Za-z0-9])(?:{each})(?![A-Za-z0-9])", re.I)


def rules_of(glossary):
    """The rules in the glossary's table."""
    table = glossary.partition(WORDS_HEADING)[2]
    rules = []
    for line in table.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if not line.startswith("| `") or len(cells) < 2:
            continue
        words, allowed, places = CODE.findall(cells[0]), CODE.findall(cells[2] if len(cells) > 2 else ""), CODE.findall(cells[3] if len(cells) > 3 else "")
        rules.append(Rule(pattern(words), cells[1], pattern(allowed) if allowed else None, tuple(places)))
    return rules


RUST = re.compile(r"""(//[^\n]*)|(/\*.*?\*/)|b?r(#*)"(.*?)"\3|b?"((?:\\.|[^"\\])*)"|'(?:\\.[^']*|[^'\\\n])'""", re.S)


def spoken(name, text):
    """Pairs of a line's number and its words: comments and strings of Rust and Python, all of other text. Empty for formats without prose."""
    if name.endswith(".rs"):
        for found in RUST.finditer(text):
            words = next((found.group(each) for each in (1, 2, 4, 5) if found.group(each)), "")
            first = text.count("\n", 0, found.start()) + 1
            yield from enumerate(words.split("\n"), first)
    elif name.endswith((".py", ".pyi")):
        parts = {"COMMENT", "STRING", "FSTRING_MIDDLE"}
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if tokenize.tok_name[token.type] in parts:
                yield from enumerate(token.string.split("\n"), token.start[0])
    elif name.endswith(".md"):
        others = False
        for number, line in enumerate(text.splitlines(), 1):
            others = line.startswith("<!-- names of others -->") or others and not line.startswith("<!-- end -->")
            if name == GLOSSARY and line == WORDS_HEADING:
                return
            if not others:
                yield number, line
    elif name.endswith((".toml", ".sh", ".wgsl")) or name == "Makefile":
        yield from enumerate(text.splitlines(), 1)


def check_words(name, text, rules, faults):
    """Refuses words that the glossary rules out, also where a line ends between them."""
    lines = list(spoken(name, text))
    for at, (number, line) in enumerate(lines):
        following = lines[at + 1][1].strip().lstrip("/#!* ") if at + 1 < len(lines) and lines[at + 1][0] == number + 1 else ""
        for rule in rules:
            if rule.places and not name.startswith(rule.places):
                continue
            joined = f"{line} {following}"
            spans = [found.span() for found in rule.allowed.finditer(joined)] if rule.allowed else []
            for found in rule.words.finditer(joined):
                inside = any(begin <= found.start() and found.end() <= end for begin, end in spans)
                if found.start() < len(line) and not inside:
                    faults.append(f"{name}:{number}: not '{found.group()}' but: {rule.instead}")


def check_doc_comments(name, lines, faults):
    """Refuses doc comments of Rust that begin with a relative clause or a genitive instead of a noun or a verb."""
    for number, (before, line) in enumerate(zip(["", *lines], lines), 1):
        found = HEADLESS.match(line)
        if found and not before.lstrip().startswith(("///", "//!")):
            faults.append(f"{name}:{number}: a doc comment begins with '{found.group(1)}': begin with a noun, or a verb in the third person")


def check_line_ends(name, lines, faults):
    """Refuses blanks at the end of a line. A line break in Markdown is a backslash."""
    for number, line in enumerate(lines, 1):
        if line != line.rstrip(" \t"):
            faults.append(f"{name}:{number}: the line ends in a blank")


def sentences(text):
    """(line, words) of every sentence of a page: of paragraphs, items of lists, quotes and cells of tables."""
    paragraph, first = [], 0
    for number, line in enumerate([*without_fences(text.splitlines()), ""], 1):
        item = re.match(r"\s*(?:[-*+]|\d+\.)\s+", line)
        if paragraph and (item or not line.strip() or line.startswith(("|", "#"))):
            yield from split(" ".join(paragraph), first)
            paragraph = []
        if line.startswith("|"):
            for cell in re.split(r"(?<!\\)\|", CODE.sub("code", line)):
                yield from split(cell, number)
        elif line.startswith("#"):
            yield from split(line, number)
        elif line.strip():
            first = number if not paragraph else first
            paragraph.append(line[item.end() :] if item else line.strip())


def split(text, number):
    """Sentences of one paragraph. Code counts as one word, a link as its text."""
    text = CODE.sub("code", text)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"\b(e\.g|i\.e|cf|ch|vs|no|et al)\.", r"\1", text)
    for sentence in re.split(r"(?<=[.!?])[\"')*_]*\s+", text):
        words = [word for word in sentence.split() if re.search(r"\w", word)]
        if words:
            yield number, words


def check_sentences(name, text, faults):
    for number, words in sentences(text):
        if len(words) > LONGEST:
            faults.append(f"{name}:{number}: a sentence of {len(words)} words begins '{' '.join(words[:6])} …'; at most {LONGEST}")


def check_sources(name, lines, faults):
    """Refuses a page that cites a section of the thesis and does not link to the references."""
    cited = [number for number, line in enumerate(lines, 1) if re.search(r"thesis,? (?:§|fig\.)", line, re.I)]
    if cited and not any("references.md" in line for line in lines):
        faults.append(f"{name}:{cited[0]}: the page cites the thesis and does not link to references.md#the-thesis")


def anchors(page):
    """The anchors of the headings of a page."""
    titles = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", line.lstrip("#").strip()) for line in without_fences(page.splitlines()) if line.startswith("#")]
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def check_links(name, lines, faults):
    for number, line in enumerate(without_fences(lines), 1):
        for target in LINK.findall(line):
            if re.match(r"[a-z]+:", target):
                continue
            to, _, anchor = target.partition("#")
            path = (ROOT / name).parent / to if to else ROOT / name
            if not path.exists():
                faults.append(f"{name}:{number}: the link {target} leads nowhere")
            elif anchor and path.suffix == ".md" and anchor not in anchors(path.read_text()):
                faults.append(f"{name}:{number}: there is no heading for the link {target}")


def check_paths(name, lines, known, faults):
    for number, line in enumerate(without_fences(lines), 1):
        for code in CODE.findall(line):
            if not PATHLIKE.match(code) or "/" not in code or code.startswith(MADE):
                continue
            if code.split("/")[0] not in known:
                continue
            if not any(ROOT.glob(code.rstrip("/"))):
                faults.append(f"{name}:{number}: there is no {code}")


def check_tests(name, lines, functions, faults):
    for number, line in enumerate(without_fences(lines), 1):
        for code in CODE.findall(line):
            found = TEST.match(code)
            if found and found.group(1) not in functions:
                faults.append(f"{name}:{number}: there is no test {code}")


def check_names(name, lines, identifiers, faults):
    """Refuses names of types and functions in backticks that occur in no source file."""
    for number, line in enumerate(without_fences(lines), 1):
        for code in CODE.findall(line):
            if re.fullmatch(r"[A-Z]\w*[a-z]\w*(::\w+)*", code):
                missing = [part for part in code.split("::") if part not in identifiers]
                faults.extend(f"{name}:{number}: `{code}`: there is no {part} in the sources" for part in missing)


def check_rust(name, lines, pages, faults):
    """Refuses Rust on a page that does not stand, line for line, in the documentation of a crate, where it is compiled and run."""
    for block in re.findall(r"^```rust\n(.*?)^```", "\n".join(lines) + "\n", re.S | re.M):
        if not any(block in page for page in pages):
            faults.append(f"{name}: this is in no crate's documentation, so it is not compiled:\n{block}")


def documentation(text):
    """The documentation of a source file as a reader sees it, without hidden lines."""
    page = [line.lstrip()[4:] for line in text.splitlines() if line.lstrip().startswith(("//!", "///"))]
    return "".join(line + "\n" for line in page if not line.startswith("# "))


def check_commands(name, lines, scenes, targets, subcommands, faults):
    for number, command in commands(lines):
        if command.startswith("make "):
            unknown = [word for word in command.split()[1:] if word not in targets]
            faults.extend(f"{name}:{number}: the Makefile has no target {word}" for word in unknown)
        found = RUN.match(command)
        if not found:
            continue
        words = found.group(1).split()
        if not words or words[0].startswith("-"):
            continue
        if words[0] not in subcommands:
            faults.append(f"{name}:{number}: tumble has no command {words[0]}")
        elif words[0] in ("run", "check"):
            scene = words[1] if len(words) > 1 else ""
            shown = scene.startswith(("my/", "measured/")) or scene.isupper()  # a stand-in for the reader's own
            if not (scene in scenes or shown or (ROOT / scene).exists() and scene):
                faults.append(f"{name}:{number}: there is no scene '{scene}'")


def main():
    names = tracked()
    faults = []
    known = folders()
    scenes = {path.parent.name for path in ROOT.glob("scenes/*/scene.toml")}
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.M))
    source = (ROOT / "crates/tumble/src/args/mod.rs").read_text()
    enum = re.search(r"pub enum Command \{(.*?)\n\}", source, re.S)
    subcommands = {word.lower() for word in re.findall(r"^    (\w+)", enum.group(1), re.M)} if enum else set()
    sources = [text for text in (text_of(name) for name in names if name.endswith(".rs")) if text]
    identifiers = {found for text in sources for found in re.findall(r"\b[A-Za-z_]\w*", text)}
    functions = {found for text in sources for found in re.findall(r"\bfn (\w+)", text)}
    pages = [documentation(text) for text in sources]
    # pages that a crate includes in its documentation are compiled whole
    included = {page for text in sources for page in re.findall(r'#\[doc = include_str!\("(?:\.\./)+(docs/[\w.-]+)"\)\]', text)}
    pages += [text_of(page) for page in sorted(included) if page in names]
    rules = rules_of((ROOT / GLOSSARY).read_text())
    pages_checked = 0
    for name in names:
        text = text_of(name)
        if text is None:
            continue
        lines = text.splitlines()
        for number, line in enumerate(lines, 1):
            for path in MACHINE.findall(line) if name != "scripts/check_docs.py" else ():
                faults.append(f"{name}:{number}: the path {path or line.strip()} is of one machine")
        check_line_ends(name, lines, faults)
        if not name.startswith(FORMER):
            check_words(name, text, rules, faults)
            if name.endswith(".rs"):
                check_doc_comments(name, lines, faults)
        if BOOK.fullmatch(name):
            check_sentences(name, text, faults)
            check_sources(name, lines, faults if name != "docs/references.md" else [])
        if name in NAMING:
            check_names(name, lines, identifiers, faults)
        if name.endswith(".md"):
            pages_checked += 1
            check_links(name, lines, faults)
            check_paths(name, lines, known, faults)
            check_tests(name, lines, functions, faults)
            check_rust(name, lines, pages, faults)
            check_commands(name, lines, scenes, targets, subcommands, faults)
    for scene in sorted(scenes):
        if not (ROOT / "scenes" / scene / "README.md").exists():
            faults.append(f"scenes/{scene}: no README.md")
    print("\n".join(faults) if faults else f"{pages_checked} pages and {len(names)} files: paths, links, commands and words are right.")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
