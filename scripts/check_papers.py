#!/usr/bin/env python3
"""Checks what the papers promise: paths and links that exist, commands that would run, no path of one machine.

Looks at every file that git tracks or would track. Prints each fault as `file:line: what`; exit code 1 if there is any.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# Roots of places that exist on one machine only.
MACHINE = re.compile(r"(?<![\w.~})$*-])/(?:work|root|home|Users|tmp)(?=[/\s\"'`)\]]|$)")
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)[^)]*\)")
CODE = re.compile(r"`([^`\n]+)`")
# What in backticks is meant as a path of this repository: it begins with one of its folders, or is one of its root files.
PATHLIKE = re.compile(r"^[\w.@-]+(?:/[\w.@*-]+)*/?$")
RUN = re.compile(r"^(?:cargo run --release(?: --quiet)?(?: --locked)? -- |tumble |target/release/tumble )(.*)$")
TEST = re.compile(r"^[a-z]\w*::([a-z0-9]+(?:_[a-z0-9]+){2,})$")
MADE = ("out/", "target/")  # what builds and runs leave behind
BUILT = {".git", "target", "out", "__pycache__", ".venv"}


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


def check_links(name, lines, faults):
    for number, line in enumerate(without_fences(lines), 1):
        for target in LINK.findall(line):
            if re.match(r"[a-z]+:|#", target):
                continue
            path = (ROOT / name).parent / target.split("#")[0]
            if not path.exists():
                faults.append(f"{name}:{number}: the link {target} leads nowhere")


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


def check_rust(name, lines, pages, faults):
    """Rust in a paper must stand, line for line, in the documentation of a crate, where it is compiled and run."""
    for block in re.findall(r"^```rust\n(.*?)^```", "\n".join(lines) + "\n", re.S | re.M):
        if not any(block in page for page in pages):
            faults.append(f"{name}: this is in no crate's documentation, so nobody compiles it:\n{block}")


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
            shown = scene.startswith("my/") or scene.isupper()  # a stand-in for the reader's own
            if not (scene in scenes or shown or (ROOT / scene).exists() and scene):
                faults.append(f"{name}:{number}: there is no scene '{scene}'")


def main():
    names = tracked()
    faults = []
    known = folders()
    scenes = {path.parent.name for path in ROOT.glob("scenes/*/scene.toml")}
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.M))
    source = (ROOT / "crates/tumble/src/args.rs").read_text()
    enum = re.search(r"pub enum Command \{(.*?)\n\}", source, re.S)
    subcommands = {word.lower() for word in re.findall(r"^    (\w+)", enum.group(1), re.M)} if enum else set()
    sources = [text for text in (text_of(name) for name in names if name.endswith(".rs")) if text]
    functions = {found for text in sources for found in re.findall(r"\bfn (\w+)", text)}
    pages = [documentation(text) for text in sources]
    papers = 0
    for name in names:
        text = text_of(name)
        if text is None:
            continue
        lines = text.splitlines()
        for number, line in enumerate(lines, 1):
            for path in MACHINE.findall(line) if name != "scripts/check_papers.py" else ():
                faults.append(f"{name}:{number}: the path {path or line.strip()} is of one machine")
        if name.endswith(".md"):
            papers += 1
            check_links(name, lines, faults)
            check_paths(name, lines, known, faults)
            check_tests(name, lines, functions, faults)
            check_rust(name, lines, pages, faults)
            check_commands(name, lines, scenes, targets, subcommands, faults)
    for scene in sorted(scenes):
        if not (ROOT / "scenes" / scene / "README.md").exists():
            faults.append(f"scenes/{scene}: no README.md")
    print("\n".join(faults) if faults else f"{papers} papers and {len(names)} files: paths, links and commands are right.")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
