"""Reports in another language: what a file of translations does, what is refused, and that no text is forgotten."""

import ast
import gettext
import re
import subprocess
import sys
from pathlib import Path

import pytest
from babel.messages.pofile import read_po

import tdacoustic
from tdacoustic.errors import MissingFileError, TemplateError
from tdacoustic.reporting.document import Column, Document, Fact, FigureBlock, Notice, Paragraph, Section, Table
from tdacoustic.reporting.figure import Axis, Figure, Line
from tdacoustic.reporting.html import render_html
from tdacoustic.reporting.language import ENGLISH, mark, read_language, say, say_count, speaking, spoken
from tdacoustic.reporting.shown import cell_text
from tdacoustic.reporting.template import load_template

REPORTING = Path(tdacoustic.__file__).parent / "reporting"
ROOT = Path(__file__).resolve().parents[2]
HEAD = """msgid ""
msgstr ""
"Language: {code}\\n"
"Plural-Forms: {forms}\\n"
"Content-Type: text/plain; charset=utf-8\\n"
"""
POLISH = "nplurals=3; plural=(n==1 ? 0 : n%10>=2 && n%10<=4 && (n%100<10 || n%100>=20) ? 1 : 2);"


def po(tmp_path, texts, code="de", forms="nplurals=2; plural=(n != 1);"):
    path = tmp_path / "other.po"
    path.write_text(HEAD.format(code=code, forms=forms) + "\n" + texts, encoding="utf-8")
    return path


def one(english, other):
    return f'msgid "{english}"\nmsgstr "{other}"\n\n'


# ---------------------------------------------------------------- what is said


def test_a_text_is_said_in_the_language_that_is_spoken(tmp_path):
    language = read_language(po(tmp_path, one("Level at {distance:g} m", "Pegel in {distance:g} m")))
    assert say("Level at {distance:g} m", distance=4.0) == "Level at 4 m"
    with speaking(language):
        assert say("Level at {distance:g} m", distance=4.0) == "Pegel in 4 m"
        assert say("What has no translation") == "What has no translation"
        assert spoken().code == "de"
    assert spoken() is ENGLISH


def test_the_order_of_words_is_the_translator_s(tmp_path):
    text = "the {source} dominates at {speed:.0f} km/h"
    language = read_language(po(tmp_path, one(text, "{speed:.0f} km/h: {source}")))
    with speaking(language):
        assert say(text, source="motor", speed=40.0) == "40 km/h: motor"


def test_braces_of_data_stay_as_they_are(tmp_path):
    language = read_language(po(tmp_path, one("Channel {name}", "Kanal {name}")))
    with speaking(language):
        assert say("Channel {name}", name="{0} {distance:g} {{") == "Kanal {0} {distance:g} {{"
    assert say("no values, so {these} stay") == "no values, so {these} stay"


def test_forms_of_a_number_are_those_of_the_language(tmp_path):
    """Against gettext itself, reading the same forms: Polish has three."""
    texts = 'msgid "{count} line"\nmsgid_plural "{count} lines"\n'
    texts += 'msgstr[0] "{count} linia"\nmsgstr[1] "{count} linie"\nmsgstr[2] "{count} linii"\n'
    language = read_language(po(tmp_path, texts, "pl", POLISH))
    form = gettext.c2py(POLISH.partition("plural=")[2].strip(";"))
    words = ["linia", "linie", "linii"]
    with speaking(language):
        for count in [*range(30), 101, 112, 122]:
            assert say_count("{count} line", "{count} lines", count) == f"{count} {words[form(count)]}"
    assert [say_count("{count} line", "{count} lines", count) for count in (0, 1, 2)] == [
        "0 lines",
        "1 line",
        "2 lines",
    ]


def test_an_unfinished_translation_stays_english(tmp_path):
    texts = one("Summary", "") + "#, fuzzy\n" + one("Contents", "Vielleicht") + one("Conditions", "Bedingungen")
    with speaking(read_language(po(tmp_path, texts))):
        assert [say("Summary"), say("Contents"), say("Conditions")] == ["Summary", "Contents", "Bedingungen"]


# ---------------------------------------------------------------- what is refused


@pytest.mark.parametrize(
    ("english", "other", "named"),
    [
        ("Level at {distance:g} m", "Pegel in {abstand:g} m", "abstand:g, distance:g"),
        ("Level at {distance:g} m", "Pegel", "distance:g"),
        ("Level at {distance:g} m", "Pegel in {distance:.3f} m", "distance:.3f, distance:g"),
        ("Level at {distance:g} m", "Pegel in {distance:g m", "unpaired braces"),
        ("Level at {distance:g} m", "Pegel in {distance.real:g} m", "distance.real:g, distance:g"),
    ],
)
def test_a_translation_that_fills_in_something_else_is_refused(tmp_path, english, other, named):
    path = po(tmp_path, one(english, other))
    with pytest.raises(TemplateError) as error:
        read_language(path)
    line = 1 + path.read_text(encoding="utf-8").splitlines().index(f'msgid "{english}"')
    assert f"{path}: line {line}: " in str(error.value) and str(error.value).endswith(named)


@pytest.mark.parametrize(
    "content",
    [
        b"\xff\xfe\x00",
        b'msgid "a\nmsgstr "b"\n',
        b"just words\n",
        b'msgid ""\nmsgstr ""\n"Plural-Forms: nplurals=2; plural=__import__(1);\\n"\n"Language: de\\n"\n',
        b'msgid ""\nmsgstr ""\n"Language: no-such-language-at-all\\n"\n',
        b'msgid "Summary"\nmsgstr "Antwort"\n',
        b"",
    ],
)
def test_what_is_no_file_of_translations_is_refused_by_name(tmp_path, content):
    path = tmp_path / "other.po"
    path.write_bytes(content)
    with pytest.raises(TemplateError, match=re.escape(str(path))):
        read_language(path)


def test_a_language_that_is_not_there_is_named(tmp_path):
    (tmp_path / "template.toml").write_text('schema = "tdacoustic-template/1"\nlanguage = "no.po"\n', encoding="utf-8")
    with pytest.raises(MissingFileError, match=re.escape("no.po: no such file")):
        load_template(tmp_path)


def test_another_translation_is_another_template(tmp_path):
    (tmp_path / "template.toml").write_text(
        'schema = "tdacoustic-template/1"\nlanguage = "other.po"\n', encoding="utf-8"
    )
    po(tmp_path, one("Summary", "Antwort"))
    first = load_template(tmp_path)
    po(tmp_path, one("Summary", "Zusammenfassung"))
    second = load_template(tmp_path)
    assert first.sha256 != second.sha256
    assert (first.language.texts["Summary"], second.language.texts["Summary"]) == ("Antwort", "Zusammenfassung")


# ---------------------------------------------------------------- a page and its language


def document():
    line = Line([1.0, 2.0], [3.0, 4.0], "mic")
    table = Table("t", "caption", [Column("origin", "O", kind="origin"), Column("ok", "V")], [["measured", True]])
    return Document(
        title="Title",
        subtitle="",
        origin="synthetic",
        summary=[Paragraph("text")],
        notices=[Notice("warning", "text")],
        facts=[Fact("key", "value", "assumed")],
        sections=[
            Section(
                "s", "Section", [FigureBlock(Figure("f", "F", "", Axis("x"), Axis("y"), [line]), "measured"), table]
            )
        ],
    )


def test_the_page_s_own_words_are_translated(tmp_path):
    words = {"Contents": "Inhalt", "Warning": "Achtung", "synthetic": "künstlich", "yes": "ja", "measured": "gemessen"}
    words |= {
        "Sort by this column": "Nach dieser Spalte ordnen",
        "Download CSV": "Als CSV",
        "Figure {number}.": "Bild {number}.",
    }
    with speaking(read_language(po(tmp_path, "".join(one(*pair) for pair in words.items())))):
        page = render_html(document())
    assert '<html lang="de">' in page
    for english, other in words.items():
        assert other.replace("{number}", "1") in page
        assert f">{english.replace('{number}', '1')}<" not in page


def test_what_is_downloaded_stays_as_the_tables_have_it(tmp_path):
    """A tag is translated; the file that the page saves says what the CSV beside it says."""
    column = Column("origin", "Origin", kind="origin")
    with speaking(read_language(po(tmp_path, one("assumed", "angenommen")))):
        assert cell_text(column, "assumed") == "angenommen"
        page = render_html(
            Document(
                title="T",
                subtitle="",
                origin="measured",
                sections=[Section("s", "S", [Table("t", "c", [column], [["assumed"]])])],
            )
        )
    assert re.search(r'data-v="assumed"[^>]*><span[^>]*>angenommen</span>', page)


# ---------------------------------------------------------------- the texts themselves


def test_the_gathered_texts_are_those_of_the_code():
    done = subprocess.run(
        [sys.executable, ROOT / ".ci" / "texts", "--check"], capture_output=True, text=True, check=False, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr


def calls():
    """Calls of `say`, `say_count` and `mark` in the package, with their file."""
    for path in REPORTING.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            name = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
            if name in ("say", "say_count", "mark") and path.name != "language.py":
                yield path, node


def test_every_text_can_be_gathered():
    """A text put together before it is said is in no file of texts: f-strings, sums, formats."""
    wrong = [
        f"{path.name}:{node.lineno}"
        for path, node in calls()
        for text in node.args[: 2 if node.func.id == "say_count" else 1]
        if isinstance(text, (ast.JoinedStr, ast.BinOp))
        or (
            isinstance(text, ast.Call) and isinstance(text.func, ast.Attribute) and text.func.attr in ("format", "join")
        )
    ]
    assert not wrong


def test_no_text_is_said_inside_of_an_f_string():
    """Babel reads them from Python 3.12 on alone: with 3.11 they would be in no file of texts."""
    wrong = []
    for path in REPORTING.rglob("*.py"):
        for outer in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(outer, ast.JoinedStr):
                said = (node for node in ast.walk(outer) if isinstance(node, ast.Call))
                names = [(getattr(node.func, "id", ""), node.args) for node in said]
                wrong += [
                    f"{path.name}:{outer.lineno}"
                    for name, args in names
                    if name in ("say", "say_count", "mark") and args and isinstance(args[0], ast.Constant)
                ]
    assert not wrong


def test_every_text_is_filled_in_with_what_it_names():
    held = read_po((REPORTING / "languages" / "report.pot").open("rb"))
    assert len(list(held)) > 1000
    wrong = []
    for path, node in calls():
        if not (node.args and isinstance(node.args[0], ast.Constant)):
            continue
        texts = [arg.value for arg in node.args if isinstance(arg, ast.Constant) and isinstance(arg.value, str)]
        given = {keyword.arg for keyword in node.keywords}
        if not given and node.func.id != "say_count":
            continue
        named = set()
        for text in texts:
            named |= {name for found in re.findall(r"{(\w+)[^{}]*(?:{(\w+)}[^{}]*)?}", text) for name in found if name}
        more = None in given  # **values
        if given - named - {"count", None} or (not more and named - given - {"count"}):
            wrong.append((path.name, node.lineno, named ^ given))
    assert not wrong


def test_no_text_is_a_scrap_that_cannot_be_translated():
    """A text with blanks at its ends is glued to others in the order of English."""
    held = read_po((REPORTING / "languages" / "report.pot").open("rb"))
    texts = [text for message in held for text in ([message.id] if isinstance(message.id, str) else message.id) if text]
    assert not [text for text in texts if text != text.strip()]


def test_marked_texts_are_themselves():
    assert mark("a text") == "a text"
