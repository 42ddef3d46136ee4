"""What two programs that are not ours read in a PDF: pypdf its structure and text, pdfium its text and its ink."""

import io
import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pypdf
import pypdfium2
from pypdf.generic import ArrayObject, IndirectObject


def tight(text: str) -> str:
    """A text without the spaces and line ends that a layout puts into it."""
    return re.sub(r"\s+", "", text)


@dataclass
class ReadPdf:
    raw: bytes

    @cached_property
    def file(self) -> pypdf.PdfReader:
        return pypdf.PdfReader(io.BytesIO(self.raw), strict=True)

    @cached_property
    def texts(self) -> list[str]:
        """Text of each page."""
        return [page.extract_text() for page in self.file.pages]

    @cached_property
    def tight(self) -> str:
        """Text of all pages in one, without headers and page numbers between them, and without spaces."""
        kept = []
        for text in self.texts:
            lines = [line for line in text.splitlines() if not re.fullmatch(r"page \d+ of \d+", line.strip())]
            kept.append("\n".join(lines[2:] if lines[:2] and lines[1].startswith("data:") else lines))
        return tight("".join(kept))

    @cached_property
    def outline(self) -> list[tuple[int, str, int]]:
        """Depth, title and page from 1 of each bookmark."""
        found: list[tuple[int, str, int]] = []

        def inside(items: list, depth: int) -> None:
            for item in items:
                if isinstance(item, list):
                    inside(item, depth + 1)
                else:
                    found.append((depth, str(item.title), self.file.get_destination_page_number(item) + 1))

        inside(self.file.outline, 0)
        return found

    @cached_property
    def links(self) -> list[tuple[int, int | str]]:
        """Page from 1, and page from 1 that it leads to or else its address, of each link."""
        found: list[tuple[int, int | str]] = []
        for number, page in enumerate(self.file.pages, start=1):
            for annotation in page.get("/Annots") or ():
                entry = annotation.get_object()
                if "/Dest" in entry:
                    found.append((number, 1 + self.file.get_page_number(entry["/Dest"][0].get_object())))
                else:
                    found.append((number, str(entry["/A"]["/URI"])))
        return found

    def fonts(self) -> dict[str, bool]:
        """Whether each font is in the file, by its name."""
        found = {}
        for page in self.file.pages:
            for font in page["/Resources"].get_object().get("/Font", {}).values():
                font = font.get_object()
                below = font.get("/DescendantFonts")
                holder = below[0].get_object() if isinstance(below, ArrayObject | IndirectObject) else font
                descriptor = holder.get("/FontDescriptor")
                held = descriptor is not None and "/FontFile2" in descriptor.get_object()
                found[str(font["/BaseFont"])] = held
        return found

    def ink(self, page: int, dpi: float = 72.0) -> np.ndarray:
        """A page from 1 as a picture, shape (rows, columns), 0 for black to 255 for white."""
        document = pypdfium2.PdfDocument(self.raw)
        try:
            return np.asarray(document[page - 1].render(scale=dpi / 72.0).to_pil().convert("L"))
        finally:
            document.close()

    def pdfium_text(self) -> str:
        document = pypdfium2.PdfDocument(self.raw)
        try:
            return "".join(page.get_textpage().get_text_range() for page in document)
        finally:
            document.close()
