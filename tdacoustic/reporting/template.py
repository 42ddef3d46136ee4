"""A company's template: its name, logo and lines on the report, its title and language, and the order of the sections.

It changes how a report is laid out, never a number in it; what it leaves out is said at the end of the report.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Final

from pydantic import AfterValidator, Field, ValidationError

from tdacoustic.errors import TdacousticError, TemplateError
from tdacoustic.reporting.document import Block, Document, House, Section, walk
from tdacoustic.reporting.language import ENGLISH, Language, read_language, say
from tdacoustic.toml_models import (
    TOP_LEVEL,
    PathText,
    Table,
    Text,
    Vocabulary,
    check_schema,
    each_once,
    file_error,
    file_or_inside,
    frozen,
    nearest,
    path_problem,
    problem_words,
    read_toml,
    small_file,
)

__all__ = ["SECTIONS", "TEMPLATE", "ReportTemplate", "files_of_template", "load_template"]

TEMPLATE: Final = "template.toml"
"""What a template is called in its folder."""
SCHEMA: Final = "tdacoustic-template/1"
TITLE: Final = "{title}"
"""Where the report's own title goes."""
MAX_LOGO_BYTES: Final = 500_000

SECTIONS: Final = frozenset(
    {
        *("recordings", "calibration", "prediction", "provenance", "side-by-side", "sources", "contributions"),
        *("coherence", "modes", "orders", "tones", "railway", "kinematics", "speed", "measured", "sensors"),
        *("clocks", "quality", "levels", "spectra", "gear-pair", "mesh-stiffness", "transmission-error"),
        *("bearing-forces", "speed-sweep", "meshing-noise", "housing", "coupling", "sound-field"),
        *("insertion-loss", "what-if", "directivity", "near-field", "helix-sweep", "references", "design-sweeps"),
        *("sensitivity", "model-parameters", "listening"),
        *("dominance", "parameters", "outliers", "data", "campaigns"),  # of the fleet view
    }
)
"""Sections of the reports on campaigns and fleets, and of the fleet view, that a template may order or leave out."""

_LOGO_TYPES: Final[Mapping[bytes, str]] = MappingProxyType(
    {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
)


def _title(text: str) -> str:
    if text.count(TITLE) != 1 or "{" in text.replace(TITLE, "") or "}" in text.replace(TITLE, ""):
        raise ValueError(f"must have {TITLE} once, where the report's own title goes, and no other braces")
    return text


def _section(name: str) -> str:
    if name not in SECTIONS:
        near = nearest(name, sorted(SECTIONS), 0.5)
        raise ValueError(f"names no section: {name!r}" + (f"; the nearest is {near!r}" if near else ""))
    return name


SectionName = Annotated[str, AfterValidator(_section)]
SectionNames = Annotated[tuple[SectionName, ...], AfterValidator(each_once)]


class TemplateSections(Table):
    """``[sections]``: the first ones in their order, and those left out."""

    first: SectionNames = ()
    leave_out: SectionNames = ()


class TemplateFile(Table):
    """What a template file says."""

    company: Text | None = None
    title: Annotated[str, AfterValidator(_title)] = TITLE
    logo: PathText | None = None
    lines: Annotated[tuple[Text, ...], Field(max_length=6)] = ()
    footer: Annotated[tuple[Text, ...], Field(max_length=6)] = ()
    language: PathText | None = None
    sections: TemplateSections = TemplateSections()


VOCABULARY: Final = Vocabulary(
    MappingProxyType(
        {
            TOP_LEVEL: ("schema", *TemplateFile.model_fields),
            "[sections]": tuple(TemplateSections.model_fields),
        }
    )
)


@dataclass(frozen=True)
class ReportTemplate:
    """How a company wants its reports.

    Parameters
    ----------
    house : House
        Name, logo and lines.
    title : str
        With ``{title}`` where the report's own goes.
    footer : tuple of str
    first, leave_out : tuple of str
        Ids of sections.
    language : Language
        In which the report is written.
    sha256 : str
        Of the file, its logo and its language: another template is another report.
    """

    house: House
    title: str = TITLE
    footer: tuple[str, ...] = ()
    first: tuple[str, ...] = ()
    leave_out: tuple[str, ...] = ()
    language: Language = ENGLISH
    sha256: str = ""

    def applied(self, document: Document) -> Document:
        """Return a document as the template wants it.

        Parameters
        ----------
        document : Document
        """
        left_out: list[str] = []
        sections = [block for block in self._arranged(document.sections, left_out) if isinstance(block, Section)]
        there = {"summary", *(block.id for block in walk(sections) if isinstance(block, Section))}
        said = (
            [say("Left out by the template of this report: {left_out}.", left_out=", ".join(left_out))]
            if left_out
            else []
        )
        return replace(
            document,
            title=self.title.replace(TITLE, document.title),
            sections=sections,
            house=self.house,
            footer=[*self.footer, *said, *document.footer],
            lineage={id_: anchor for id_, anchor in document.lineage.items() if anchor in there},
        )

    def _arranged(self, blocks: Sequence[Block], left_out: list[str]) -> list[Block]:
        """Sections among blocks in the template's order, each in a place where a section stood."""
        kept = list(self._kept(blocks, left_out))
        sections = [block for block in kept if isinstance(block, Section)]
        rank = {name: place for place, name in enumerate(self.first)}
        ordered = iter(sorted(sections, key=lambda section: rank.get(section.id, len(rank))))
        return [next(ordered) if isinstance(block, Section) else block for block in kept]

    def _kept(self, blocks: Sequence[Block], left_out: list[str]) -> Iterator[Block]:
        for block in blocks:
            if not isinstance(block, Section):
                yield block
            elif block.id in self.leave_out:
                left_out.append(block.title)
            else:
                yield replace(block, blocks=self._arranged(block.blocks, left_out))


def files_of_template(path: Path) -> Iterator[Path]:
    """Yield what a template is read from: its folder where that is named, its file, its logo, its language."""
    yield path
    if path.is_dir():
        path /= TEMPLATE
        yield path
    try:
        raw = read_toml(path, TemplateError)
    except TdacousticError:
        return  # missing or wrong: the file itself tells whether it is still
    for key in ("logo", "language"):
        name = raw.get(key)
        if isinstance(name, str) and path_problem(name) is None:
            yield path.parent / name


def load_template(path: str | Path) -> ReportTemplate:
    """Read a template.

    Parameters
    ----------
    path : str or Path
        The file, or the folder with its ``template.toml``.

    Raises
    ------
    MissingFileError
        The file, its logo or its language does not exist.
    TemplateError
        It is no valid template, the logo no PNG or JPEG of at most 500 kB, or the language no file of translations.
    """
    path = file_or_inside(Path(path), TEMPLATE)
    raw = frozen(read_toml(path, TemplateError))
    check_schema(path, raw, SCHEMA, VOCABULARY, TemplateError)
    try:
        said = TemplateFile.model_validate(raw)
    except ValidationError as error:
        raise file_error(TemplateError, path, [_problem(one) for one in error.errors(include_url=False)]) from None
    digest = hashlib.sha256(path.read_bytes())
    logo, kind = b"", ""
    if said.logo is not None:
        logo, kind = _logo(path, said.logo)
        digest.update(logo)
    language = ENGLISH
    if said.language is not None:
        language = read_language(path.parent / said.language)
        digest.update((path.parent / said.language).read_bytes())
    house = House(said.company or "", said.lines, logo, kind)
    return ReportTemplate(
        house, said.title, said.footer, said.sections.first, said.sections.leave_out, language, digest.hexdigest()
    )


def _problem(error: object) -> str:
    loc = tuple(error["loc"])  # type: ignore[index]
    in_sections = bool(loc) and loc[0] == "sections" and len(loc) > 1
    key = str(loc[1] if in_sections else loc[0] if loc else "")
    words = problem_words(error, key, "[sections]" if in_sections else TOP_LEVEL, VOCABULARY)  # type: ignore[arg-type]
    return f"[sections]: {words}" if in_sections else words


def _logo(template: Path, name: str) -> tuple[bytes, str]:
    path = template.parent / name
    content = small_file(path, TemplateError)
    kind = next((kind for head, kind in _LOGO_TYPES.items() if content.startswith(head)), None)
    if kind is None:
        raise TemplateError(f"{path}: a logo has to be a PNG or a JPEG")
    if len(content) > MAX_LOGO_BYTES:
        raise TemplateError(f"{path}: a logo may have {MAX_LOGO_BYTES // 1000} kB, this one has {len(content) // 1000}")
    return content, kind
