"""Text to document: reads a scene file line by line with the tables of keywords."""

import os

from relume.translator import checks, environment_variables
from relume.translator.blocks import TRANSFORMS, BlackHole, Transform, WormHole
from relume.translator.cursor import Cursor
from relume.translator.diagnostics import SceneError
from relume.translator.document import Document
from relume.translator.expressions import clip
from relume.translator.keyword_lines import assign, read_keyword
from relume.translator.keywords import by_word
from relume.translator.object_parser import ATTRIBUTES, REAL_BUT_IGNORED, read_object
from relume.translator.shapes import SHAPES
from relume.translator.source_text import read_lines, split

GLOBAL = by_word(Document)
GRAVITY = {"BLACKHOLE": BlackHole, "WORMHOLE": WormHole}
BLOCKS = ("OBJECT", "CAMERA_MATRIX", *GRAVITY)
OBJECT_WORDS = {*ATTRIBUTES, *SHAPES, *TRANSFORMS, "U", "V", "nromal"}
KNOWN = {*GLOBAL, *OBJECT_WORDS, *BLOCKS} - {"U", "V", "nromal"}


def read(path, environ=None):
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


def read_text(text, name="<text>", environ=None):
    """Read a scene from text (str, or bytes in UTF-8 or cp932); otherwise as `read`."""
    data = text.encode(errors="surrogatepass") if isinstance(text, str) else text
    document, problems = parse(split(data, name), name, environ)
    if problems:
        raise SceneError(name, problems)
    return document


def parse(lines, name, environ=None):
    """Parse the lines of a file.

    Returns:
        (document, problems): what could be read, and the errors in the order of the lines.
    """
    environ = os.environ if environ is None else environ
    document = Document(path=str(name))
    cursor = Cursor(lines, document.variables, document.lines.all, environ)
    _FileReader(cursor, document).run()
    problems = [
        *cursor.values.problems,
        *environment_variables.override(document, environ),
        *checks.check(document),
    ]
    return document, sorted(set(problems))


class _FileReader:
    """One pass over the lines of a file.

    A comment that holds a keyword switches that keyword off: what it leaves behind (the lines of a
    block, or a line of values) is passed over with a note (spec section 1.4).
    """

    def __init__(self, cursor, document):
        self.cursor = cursor
        self.document = document
        self.disabled_block = None
        self.disabled_word = ""

    def run(self):
        cursor = self.cursor
        while cursor.at < len(cursor.lines):
            line = cursor.line
            if not line.strip():
                self.enable()
            elif line.startswith("#"):
                self.comment(line)
            else:
                self.global_line()
            cursor.at += 1

    def enable(self):
        self.disabled_block = None
        self.disabled_word = ""

    def comment(self, line):
        word = (line.lstrip("#").split(None, 1) or [""])[0]
        if word in BLOCKS:
            self.disabled_block = (self.cursor.number, word)
        elif word in GLOBAL or word in ATTRIBUTES:
            self.disabled_word = word

    def global_line(self):
        cursor = self.cursor
        word = cursor.keyword_text()[0]
        if cursor.line[0] in " \t":
            self.stray(word)
        elif self.disabled_block and (word in OBJECT_WORDS or word not in (*GLOBAL, *BLOCKS)):
            self.in_disabled_block(word)
        elif word in BLOCKS and word != "CAMERA_MATRIX":
            self.enable()
            self.block(word)
        elif word in GLOBAL:
            self.enable()
            self.keyword(GLOBAL[word], word)
        else:
            self.stray(word)

    def in_disabled_block(self, word):
        line, opener = self.disabled_block
        report = self.cursor.report(clip(word), "disabled-block", opener=opener, line=line)
        if word in GLOBAL:
            report.becomes("disabled-block-keyword")

    def stray(self, word):
        """A line that belongs to no keyword: a value left over, a misspelling, or anything."""
        cursor = self.cursor
        if cursor.line[0] in " \t" and word in KNOWN:
            message = f"'{clip(cursor.line.strip())}': a keyword must start in the first column"
            cursor.error(1, message, "keyword")
        elif word in OBJECT_WORDS:
            cursor.report(word, "outside-object")
        elif word in REAL_BUT_IGNORED:
            cursor.report(word, REAL_BUT_IGNORED[word])
        elif self.disabled_word:
            cursor.report(clip(word), "disabled-value", word=self.disabled_word)
        elif word[0] in "0123456789+-.(%":
            cursor.report(clip(word), "value-without-keyword")
        else:
            cursor.unknown(word, KNOWN, "keyword")

    def keyword(self, row, word):
        if row.kind == "transforms":
            self.camera_matrix(row)
        elif row.kind == "variable":
            self.variable()
        else:
            read_keyword(self.cursor, row, word, self.document, self.document.lines)

    def block(self, word):
        if word != "OBJECT":
            self.gravity(word)
        elif rest := self.cursor.keyword_text()[1].strip():
            message = f"OBJECT stands alone on its line, found '{clip(rest)}' behind it"
            self.cursor.error(len(word) + 2, message)
        else:
            self.document.objects += read_object(self.cursor)

    def variable(self):
        cursor = self.cursor
        reports = [cursor.report("VAR")]
        _, rest, offset = cursor.keyword_text()
        name = rest.strip()
        if not (name.isascii() and name.isalnum() and name[0].isalpha()):
            message = f"VAR expects a name of letters and digits, found '{clip(rest)}'"
            cursor.error(offset + 1, message)
            name = ""
        line = cursor.value_line("VAR", "an expression")
        if line is None:
            return
        reports.append(cursor.report("VAR"))
        offset = len(line) - len(line.lstrip(" \t"))
        if line[offset] == "%":
            read = cursor.values.environment_value(line, cursor.number, offset)
        else:
            numbers = cursor.values.numbers("VAR", line[offset:], cursor.number, offset, (1,))
            read = numbers and (numbers[0][0][0], numbers[1])
        if read is None or not name:
            return
        for note in read[1]:
            reports[1].add(note)
        if name in self.document.variables:
            for report in reports:
                report.becomes("variable-defined-already", name=name)
        else:
            self.document.variables[name] = read[0]

    def camera_matrix(self, row):
        reports = [self.cursor.report(row.name)]
        matrix = []
        for _ in self.cursor.block_lines():
            word, rest, offset = self.cursor.keyword_text()
            if word not in TRANSFORMS:
                self.cursor.unknown(word, TRANSFORMS, "line of CAMERA_MATRIX")
                continue
            line = self.cursor.number
            read = self.cursor.values.numbers(word, rest, line, offset, (3,))
            if read is not None:
                reports.append(self.cursor.report(word))
                matrix.append(Transform(word, tuple(value for value, _ in read[0])))
        assign(self.document, self.document.lines, row.field, matrix, reports)

    def gravity(self, word):
        cursor = self.cursor
        block = GRAVITY[word]()
        first = len(cursor.reports)
        block.lines.reports[""] = [cursor.report(word)]
        _, rest, offset = cursor.keyword_text()
        if rest.strip():
            read = cursor.values.numbers(word, rest, cursor.number, offset, (3,))
            block.position = read and tuple(value for value, _ in read[0])
        table = by_word(GRAVITY[word])
        for _ in cursor.block_lines():
            name = cursor.keyword_text()[0]
            if name in table:
                read_keyword(cursor, table[name], name, block, block.lines)
            else:
                cursor.unknown(name, table, f"line of a {word} block")
        block.lines.all = cursor.reports[first:]
        self.document.gravity.append(block)
