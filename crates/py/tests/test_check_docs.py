"""The check of the documentation finds the faults that it is for, and no others."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
SPEC = importlib.util.spec_from_file_location("check_docs", ROOT / "scripts/check_docs.py")
check_docs = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(check_docs)

TABLE = f"""
{check_docs.WORDS_HEADING}

| not used | instead | allowed | only in |
|---|---|---|---|
| `widget` | hinge | `Rust widget` | |
| `but for` | except | | |
| `marble`, `marbles` | sphere | `marble joint` | `crates/collide` |
"""


def words(name, text):
    faults = []
    check_docs.check_words(name, text, check_docs.rules_of(TABLE), faults)
    return faults


def sentences(text):
    faults = []
    check_docs.check_sentences("docs/some.md", text, faults)
    return faults


@pytest.mark.parametrize(
    ("name", "text", "line"),
    [
        ("docs/some.md", "one line\nA Widget joins two parts.", 2),
        ("docs/some.md", "all of them but\nfor one", 1),
        ("docs/some.md", "`widget` as code", 1),
        ("crates/core/src/some.rs", "fn f() {}\n/// A widget.\nfn g() {}", 2),
        ("crates/core/src/some.rs", '// no "quote here\nlet a = "the widget is open";', 2),
        ("crates/core/src/some.rs", 'let a = r#"kind = "widget""#;', 1),
        ("crates/core/src/some.rs", "let quote = '\"'; // widget", 1),
        ("crates/collide/src/some.rs", "/// A marble.", 1),
        ("some.py", 'def f():\n    """All\n    but for one."""\n', 3),
        ("some.py", "x = 1  # a widget\n", 1),
        ("some.toml", "[[widget]]", 1),
        ("some.sh", "echo widget", 1),
    ],
)
def test_a_word_that_is_ruled_out_is_found(name, text, line):
    assert [fault.split(": ")[0] for fault in words(name, text)] == [f"{name}:{line}"]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("docs/some.md", "A Rust widget, a\nRust widget, an unwidgeted, widgetry."),
        ("docs/some.md", "<!-- names of others -->\nwidget\n<!-- end -->"),
        ("crates/core/src/some.rs", "let widget = |x| x; // a marble"),
        ("crates/collide/src/some.rs", "/// A marble joint."),
        ("crates/core/src/some.rs", "fn f<'a>(widget: &'a str, c: char) -> bool { c == 'x' }"),
        ("some.py", "widget = 1\n"),
        ("some.json", '{"widget": 1}'),
    ],
)
def test_other_words_pass(name, text):
    assert words(name, text) == []


def test_every_row_of_the_glossary_is_a_rule():
    glossary = (ROOT / check_docs.GLOSSARY).read_text()
    rows = [line for line in glossary.partition(check_docs.WORDS_HEADING)[2].splitlines() if line.startswith("|")]
    rules = check_docs.rules_of(glossary)
    assert len(rules) == len(rows) - 2 > 20
    assert any(rule.words.search("as it was told here") for rule in rules)


def test_sentences_of_more_than_45_words_are_found():
    assert sentences("word " * 45 + "end.")[0].startswith("docs/some.md:1: a sentence of 46 words")
    assert len(sentences("- " + "word " * 23 + "\n  " + "word " * 23)) == 1
    assert len(sentences("| a | " + "word " * 46 + " |")) == 1
    assert sentences("Title\n\n" + "`code with many words` " * 46)[0].startswith("docs/some.md:3")


def test_shorter_sentences_pass():
    assert sentences("word " * 45 + ". " + "word " * 45) == []
    assert sentences("```sh\n" + "word " * 60 + "\n```") == []
    assert sentences("\n".join("- " + "word " * 30 for _ in range(3))) == []
    assert sentences("[" + "word " * 40 + "](" + "a/" * 60 + ")") == []


def test_a_name_that_is_in_no_source_is_found():
    faults = []
    check_docs.check_names("ARCHITECTURE.md", ["`World::step` and `World::leap`", "`Wurld`, `x`, `a b`"], {"World", "step"}, faults)
    assert [fault.split(":")[1] for fault in faults] == ["1", "2"]


def test_doc_comments_that_begin_with_a_clause_are_found():
    faults = []
    text = "//! What is read.\n\n/// Whatever. What is read\n/// Where it is.\nfn f() {}\n/// Of a body.\n// What for"
    check_docs.check_doc_comments("some.rs", text.split("\n"), faults)
    assert [fault.split(":")[1] for fault in faults] == ["1", "6"]


def test_a_page_that_cites_the_thesis_without_a_link_is_found():
    faults = []
    check_docs.check_sources("docs/some.md", ["Text.", "See thesis §IV.B."], faults)
    assert [fault.split(":")[1] for fault in faults] == ["2"]
    check_docs.check_sources("docs/some.md", ["[thesis](references.md#the-thesis) §IV.B"], faults)
    assert len(faults) == 1


def test_anchors_are_those_of_the_headings():
    assert check_docs.anchors("# One, `two` & three\n```sh\n# no\n```\n## [A b](c.md)") == {"one-two--three", "a-b"}


def test_a_link_to_a_heading_that_does_not_exist_is_found():
    faults = []
    check_docs.check_links("docs/x.md", ["[a](references.md#the-thesis) [b](references.md#nowhere)", "[c](nowhere.md)"], faults)
    assert [fault.split(":")[1] for fault in faults] == ["1", "2"]


def test_a_blank_at_the_end_of_a_line_is_found():
    faults = []
    check_docs.check_line_ends("docs/some.md", ["good", "", " indented", "blank ", "break  ", "tab\t"], faults)
    assert [fault.split(": ")[0] for fault in faults] == ["docs/some.md:4", "docs/some.md:5", "docs/some.md:6"]
