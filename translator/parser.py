"""Text to document: reads a scene file line by line with the tables of keywords."""

from __future__ import annotations

import os
from collections.abc import Mapping

from relume.translator import checks, environment_variables
from relume.translator.cursor import Cursor
from relume.translator.diagnostics import Problem, SceneError
from relume.translator.document import Document
from relume.translator.expressions import clip
from relume.translator.forms.transforms import TRANSFORMS
from relume.translator.gravity import GRAVITY_BLOCKS, OF_THE_SCENE, BlackHole, WormHole
from relume.translator.keywords import BLOCK, Keyword, by_word
from relume.translator.object_parser import ATTRIBUTES, LOOKALIKES, read_object
from relume.translator.shapes import SHAPES
from relume.translator.source_text import FileName, decode_lines, read_lines

OBJECT_WORDS = {*ATTRIBUTES, *SHAPES, *TRANSFORMS, "U", "V", "nromal"}


def read(path: FileName, environ: Mapping[str, str] | None = None) -> Document:
    """Read a scene file.

    Args:
        path: the scene file.
        environ: environment variables that override the file (spec section 3); by default those
            of the process.

    Returns:
        The `Document`; its `lines` tell what each line became.

    Raises:
        SceneError: with every error in the file.
    """
    document, problems = parse(read_lines(path), path, environ)
    if problems:
        raise SceneError(path, problems)
    return document


def read_text(
    text: str | bytes, name: FileName = "<text>", environ: Mapping[str, str] | None = None
) -> Document:
    """Read a scene from text (str, or bytes in UTF-8 or cp932); otherwise as `read`."""
    data = text.encode(errors="surrogatepass") if isinstance(text, str) else text
    document, problems = parse(decode_lines(data, name), name, environ)
    if problems:
        raise SceneError(name, problems)
    return document


def parse(
    lines: list[str], name: FileName, environ: Mapping[str, str] | None = None
) -> tuple[Document, list[Problem]]:
    """Parse the lines of a file.

    Returns:
        (document, problems): what could be read, and the errors in the order of the lines.
    """
    document = Document(path=str(name))
    return document, fill(document, lines, os.environ if environ is None else environ)


def fill(document: Document, lines: list[str], environ: Mapping[str, str]) -> list[Problem]:
    """Read the lines of a file, and environment variables, into a document.

    Args:
        document: its fields and its `lines` are set; its class declares the keywords.
        lines: lines without line ends.
        environ: environment variables by name.

    Returns:
        The errors in the order of the lines.
    """
    cursor = Cursor(lines, document.variables, document.lines.all, environ)
    _FileReader(cursor, document).run()
    document.taken = cursor.context.taken
    problems = [
        *cursor.problems,
        *environment_variables.override(document, environ),
        *checks.check(document),
    ]
    return sorted(set(problems))


class _FileReader:
    """One pass over the lines of a file.

    A comment that holds a keyword switches that keyword off: what it leaves behind (the lines of a
    block, or a line of values) is passed over with a note (spec section 1.4).
    """

    def __init__(self, cursor: Cursor, document: Document) -> None:
        self.cursor = cursor
        self.document = document
        self.keywords = by_word(type(document))
        blocks = [word for word, row in self.keywords.items() if row.place == BLOCK]
        self.blocks = {"OBJECT", *GRAVITY_BLOCKS, *blocks}
        self.known = {*self.keywords, *OBJECT_WORDS, *self.blocks} - {"U", "V", "nromal"}
        self.disabled_block: tuple[int, str] | None = None
        self.disabled_word = ""

    def run(self) -> None:
        cursor = self.cursor
        while cursor.index < len(cursor.lines):
            line = cursor.line
            if not line.strip():
                self.end_disabled()
            elif line.startswith("#"):
                self.comment(line)
            else:
                self.scene_line()
            cursor.index += 1

    def end_disabled(self) -> None:
        self.disabled_block = None
        self.disabled_word = ""

    def comment(self, line: str) -> None:
        word = (line.lstrip("#").split(None, 1) or [""])[0]
        if word in self.blocks:
            self.disabled_block = (self.cursor.number, word)
        elif word in self.keywords or word in ATTRIBUTES:
            self.disabled_word = word

    def scene_line(self) -> None:
        cursor = self.cursor
        word = cursor.word
        if cursor.line[0] in " \t":
            self.stray(word)
        elif self.disabled_block and (word in OBJECT_WORDS or not self.opens(word)):
            self.in_disabled_block(*self.disabled_block, word)
        elif word in self.keywords:
            self.end_disabled()
            self.keywords[word].read(cursor, word, self.document)
        elif word in self.blocks:
            self.end_disabled()
            self.block(word)
        else:
            self.stray(word)

    def opens(self, word: str) -> bool:
        """Whether a line that starts with the word belongs to the scene, not to a block."""
        if self.disabled_block and self.disabled_block[1] == "BLACKHOLE" and word in OF_THE_SCENE:
            return False
        return word in self.keywords or word in self.blocks

    def in_disabled_block(self, line: int, opener: str, word: str) -> None:
        report = self.cursor.report(clip(word), "disabled-block", opener=opener, line=line)
        if word in self.keywords:
            report.becomes("disabled-block-keyword")

    def stray(self, word: str) -> None:
        """A line that belongs to no keyword: a value left over, a misspelling, or anything."""
        cursor = self.cursor
        if cursor.line[0] in " \t" and word in self.known:
            message = f"'{clip(cursor.line.strip())}': a keyword must start in the first column"
            cursor.error(1, message, "keyword")
        elif word in OBJECT_WORDS:
            cursor.report(word, "outside-object")
        elif word in LOOKALIKES:
            cursor.report(word, LOOKALIKES[word])
        elif self.disabled_word:
            cursor.report(clip(word), "disabled-value", word=self.disabled_word)
        elif word[0] in "0123456789+-.(%":
            cursor.report(clip(word), "value-without-keyword")
        else:
            cursor.unknown(word, self.known, "keyword")

    def block(self, word: str) -> None:
        if word != "OBJECT":
            self.gravity(word)
        elif rest := self.cursor.beside().text.strip():
            message = f"OBJECT stands alone on its line, found '{clip(rest)}' behind it"
            self.cursor.error(len(word) + 2, message)
        else:
            self.document.objects += read_object(self.cursor)

    def gravity(self, word: str) -> None:
        cursor = self.cursor
        block = GRAVITY_BLOCKS[word]()
        first = len(cursor.reports)
        block.lines.reports[""] = [cursor.report(word)]
        table = dict(by_word(type(block)))
        if isinstance(block, BlackHole):
            self.position(block)
            table |= {n: self.keywords[n] for n in OF_THE_SCENE if n in self.keywords}
        elif rest := cursor.beside().text.strip():
            message = f"WORMHOLE stands alone on its line, found '{clip(rest)}' behind it"
            cursor.error(len(word) + 2, f"{message}; its places are 'in x y z' and 'out x y z'")
        for _ in cursor.block_lines():
            self.gravity_line(block, table)
        block.lines.all = cursor.reports[first:]
        self.document.gravity.append(block)

    def position(self, block: BlackHole) -> None:
        """The centre of a black hole, behind the word that opens its block."""
        values = self.cursor.beside()
        with self.cursor.noting_problems():
            if values.text.strip():
                x, y, z = values.numbers(3)
                block.position = x, y, z
                for note in values.notes:
                    block.lines.reports[""][0].add(note)

    def gravity_line(self, block: BlackHole | WormHole, table: Mapping[str, Keyword]) -> None:
        """A line of a block of general relativity."""
        cursor, word = self.cursor, self.cursor.word
        if cursor.line[0] in " \t" and word in table:
            message = f"'{clip(cursor.line.strip())}': a keyword must start in the first column"
            cursor.error(1, message, "keyword")
        elif word in OF_THE_SCENE and word in table:
            table[word].read(cursor, word, self.document)
        elif word in table:
            table[word].read(cursor, word, block)
        else:
            cursor.unknown(word, table, f"line of a {type(block).__name__.upper()} block")
