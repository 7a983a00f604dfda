"""MTL files: every key of the language, its rules over several keys, and located errors."""

import pytest

from relume.translator.mtl import MtlError, TextureMap, read_mtl
from relume.translator.mtl_names import library_names
from relume.translator.outcomes import make_note


def _read(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "m.mtl"
    path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
    return read_mtl(path)


def test_every_key_is_stored_with_its_line(tmp_path):
    """Proves: each key reaches its own attribute, typed, and the line is remembered."""
    text = """newmtl All
Kd 0.1 0.2 0.3
Ks 0.4 0.5 0.6
Ka 1 1 1
Ni 1.5
Ns 32
d 0.25
Tr 0.5
map_Kd wood.bmp
map_Bump bump.png
#REFLECTION 3
#EMISSION 4 5 6
#COLOR .7 .8 .9
#WARD 0.1 0.2
#SPECULAR 0.01 0.02 0.03
#ROUGHNESS 0.5
#SMOOTH 1
#REPEAT 4
"""
    found = _read(tmp_path, text)
    m = found["all"]
    expected = dict(
        kd=(0.1, 0.2, 0.3), ks=(0.4, 0.5, 0.6), ka=(1, 1, 1), ni=1.5, ns=32, d=0.25, tr=0.5,
        map_kd=TextureMap("wood.bmp"), map_bump=TextureMap("bump.png"), reflection=3,
        emission=(4, 5, 6), extra_color=(0.7, 0.8, 0.9), ward=(0.1, 0.2),
        extra_specular=(0.01, 0.02, 0.03), roughness=0.5, smooth=1, repeat=4,
    )
    # the attributes above stand in the order of the file's keys
    assert {name: getattr(m, name) for name in expected} == expected
    assert m.lines == {name: line for line, name in enumerate(expected, 2)}
    assert (m.name, m.line, found.notes) == ("All", 1, [])


def test_absent_keys_are_none(tmp_path):
    """Proves: nothing gets a default, so the caller sees what the file says."""
    m = _read(tmp_path, "newmtl a\n")["a"]
    assert m.lines == {}
    assert (m.kd, m.ks, m.ni, m.reflection, m.color, m.opacity, m.diffuse_weight) == (None,) * 7


@pytest.mark.parametrize(
    ("body", "name", "value"),
    [
        ("Kd 1 0 0\n#COLOR 0 1 0", "color", (0, 1, 0)),
        ("#COLOR 0 1 0\nKd 1 0 0", "color", (1, 0, 0)),
        ("Ks 1 0 0\n#SPECULAR 0 1 0", "specular", (0, 1, 0)),
        ("d 0.25\nTr 0.5", "opacity", 0.5),
        ("Tr 0.5\nd 0.25", "opacity", 0.25),
        ("Tr 0.125", "opacity", 0.875),
        ("Kd 1 0 0\nKd 0 0 1", "color", (0, 0, 1)),
    ],
)
def test_later_of_two_names_counts(tmp_path, body, name, value):
    """Proves: Kd and #COLOR, Ks and #SPECULAR, d and 1 - Tr are one thing each, the last counts."""
    assert getattr(_read(tmp_path, f"newmtl a\n{body}\n")["a"], name) == value


@pytest.mark.parametrize(
    ("body", "weight"),
    [
        ("#REFLECTION 0\nKd 1 1 1", 1.0),  # black Ks: diffuse, as the manual says
        ("#REFLECTION 0\nKd 0 0 0\nKs 1 1 1", 1.0),
        ("#REFLECTION 1\nKs 1 1 1", 0.0),
        ("#REFLECTION 0\nKd 1 0 0\nKs 0 2 0", 1 / 5),  # |Kd|² / (|Kd|² + |Ks|²) = 1 / (1 + 4)
        ("#REFLECTION 1\nKd 3 0 0\nKs 0 1 0", 9 / 10),
        ("#REFLECTION 1\n#ROUGHNESS 0.3\nKs 1 1 1", 0.3),
        ("#ROUGHNESS 0.3\n#REFLECTION 1\nKs 1 1 1", 0.0),  # 0 and 1 reset what came before
        ("#ROUGHNESS 0.3\n#REFLECTION 4\nKs 1 1 1", 0.3),  # the others do not
        ("#ROUGHNESS 0.3\nKd 1 1 1", None),
    ],
)
def test_diffuse_weight(tmp_path, body, weight):
    """Proves the roughness rule; values by hand from r = |Kd|² / (|Kd|² + |Ks|²)."""
    found = _read(tmp_path, f"newmtl a\n{body}\n")["a"].diffuse_weight
    assert found == (weight if weight is None else pytest.approx(weight, abs=1e-15))


def test_last_duplicate_wins_and_names_ignore_case(tmp_path):
    """Proves: a second newmtl of one name replaces the first altogether."""
    found = _read(tmp_path, "newmtl A\nKd 1 1 1\nNs 3\nnewmtl a\nKd 0 0 0\n")
    assert list(found) == ["a"]
    assert (found["a"].name, found["a"].kd, found["a"].ns) == ("a", (0, 0, 0), None)
    assert found.notes == [(4, make_note("mtl-defined-again", name="'a'"))]


def test_comments_are_comments(tmp_path):
    """Proves: only the exact words followed by a number are extensions."""
    text = "# by hand\nnewmtl a\n# REFLECTION 3\n#reflection 3\n#REFLECTIONS 3\n#COLOR of oak\n"
    found = _read(tmp_path, text)
    assert found["a"].lines == {}
    assert found.notes == [(6, make_note("mtl-comment", key="'#COLOR'"))]


def test_map_options(tmp_path):
    """Proves: options before the file name are read or noted, and names may hold blanks."""
    text = "newmtl a\nmap_Kd -s 2 3 -o 0.5 -mm 0.1 .5 -clamp on my wood 2.bmp\n"
    text += "bump -bm 0.25 b.bmp\n"
    found = _read(tmp_path, text)
    wood = TextureMap("my wood 2.bmp", (2, 3, 1), (0.5, 0, 0), 0.1, 0.5, clamp=True)
    assert found["a"].map_kd == wood
    assert found["a"].map_bump == TextureMap("b.bmp")
    assert found.notes == [(3, make_note("mtl-option-ignored", option="'-bm'"))]


def test_options_in_any_case_and_odd_ones(tmp_path):
    """Proves: options are told in any case; what cannot be followed is noted, for bumps all."""
    text = "newmtl a\nmap_Kd -S 2 -CLAMP ON a.bmp\nnewmtl b\nmap_Kd -clamp maybe -mm 1 a.bmp\n"
    text += "newmtl c\nmap_Kd -o 1 2 -clamp off a.bmp\nbump -s 2 2 -clamp on b.bmp\n"
    found = _read(tmp_path, text)
    assert found["a"].map_kd == TextureMap("a.bmp", (2, 1, 1), clamp=True)
    assert found["b"].map_kd == TextureMap("a.bmp")
    assert found["c"].map_kd == TextureMap("a.bmp", offset=(1, 2, 0))
    assert found["c"].map_bump == TextureMap("b.bmp")
    expected = [(4, "-clamp maybe"), (4, "-mm 1"), (7, "-s"), (7, "-clamp")]
    assert found.notes == [
        (line, make_note("mtl-option-ignored", option=repr(option))) for line, option in expected
    ]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp932"])
def test_encodings_and_line_ends(tmp_path, encoding):
    """Proves: names in UTF-8 (with or without BOM) and cp932, with CRLF and leading blanks."""
    text = "newmtl 木の表\r\n \tKd 1 1 1  \r\nmap_Kd 写真 表.bmp"
    m = _read(tmp_path, text, encoding)["木の表"]
    assert m.kd == (1, 1, 1)
    assert m.map_kd.file == "写真 表.bmp"


def test_names_with_comments(tmp_path):
    """Proves: a name is taken whole first, then without its comment, on both sides."""
    text = "newmtl red # one\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\nnewmtl no # 2\nKd 0 1 0\nnewmtl no\n"
    found = _read(tmp_path, text)
    for name, kd in (("red", (1, 0, 0)), ("RED # one", (1, 0, 0)), ("blue # two", (0, 0, 1)),
                     ("no # 2", (0, 1, 0)), ("no", None)):
        assert found.named(name).kd == kd
    assert found.named("green") is None
    assert found.notes == []


def test_a_material_without_a_name_is_left_out(tmp_path):
    """Proves: it is noted, and its lines reach no other material."""
    found = _read(tmp_path, "newmtl a\nKd 1 1 1\nnewmtl\nKd 0 0 0\nnewmtl b\nKd 0.5 0.5 0.5\n")
    assert list(found) == ["a", "b"]
    assert (found["a"].kd, found["b"].kd) == ((1, 1, 1), (0.5,) * 3)
    assert found.notes == [(3, make_note("newmtl-without-name"))]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("a.mtl b.mtl", ["a.mtl", "b.mtl"]),
        ("with blank.mtl", ["with blank.mtl"]),
        ("with\\ blank.mtl", ["with blank.mtl"]),
        ("a.mtl with\\ blank.mtl", ["a.mtl", "with blank.mtl"]),
        ("a.mtl # colours", ["a.mtl"]),
        ("a.mtl b.mtl # colours", ["a.mtl", "b.mtl"]),
        ("a #1.mtl", ["a #1.mtl"]),
        ("absent.mtl", ["absent.mtl"]),
        ("absent one.mtl", ["absent", "one.mtl"]),
    ],
)
def test_names_of_libraries(text, names):
    """Proves: one name with blanks, several, escaped blanks and comments, if such files are."""
    there = {"a.mtl", "b.mtl", "with blank.mtl", "a #1.mtl"}
    assert library_names(text, there.__contains__) == names


def test_notes(tmp_path):
    """Proves: everything that is read otherwise than written leaves a note with its line."""
    text = "Kd 1 1 1\nnewmtl a\nillum 2\nillum 2\nKd 0.5\nKs 1 1 1 1\nd 2\nd -halo 0.5\nKa xyz 1\n"
    found = _read(tmp_path, text)
    assert [line for line, _ in found.notes] == [1, 3, 5, 6, 7, 8, 9]
    assert (found["a"].kd, found["a"].d) == ((0.5,) * 3, 0.5)


@pytest.mark.parametrize(
    ("body", "line", "column"),
    [
        ("Kd 1 x 1", 2, 6),
        ("Kd 1 nan 1", 2, 6),
        ("\tKd 1 1 1e999", 2, 9),
        ("Kd 1 1", 2, 1),
        ("Kd", 2, 1),
        ("Ns", 2, 1),
        ("Ni 1,5", 2, 4),
        ("d 1_0", 2, 3),
        ("#WARD 0.1", 2, 1),
        ("#WARD 0.1 ?", 2, 11),
        ("#REFLECTION 9", 2, 1),
        ("#REFLECTION 1.5", 2, 1),
        ("#REFLECTION -1", 2, 1),
        ("#EMISSION 1 2", 2, 1),
        ("#ROUGHNESS nan", 2, 12),
        ("map_Kd", 2, 1),
        ("map_Kd -mm x 1 a.bmp", 2, 12),
    ],
)
def test_located_errors(tmp_path, body, line, column):
    """Proves: broken values are errors with path, line and column."""
    with pytest.raises(MtlError) as caught:
        _read(tmp_path, f"newmtl a\n{body}\n")
    error = caught.value
    assert (error.line, error.column) == (line, column)
    assert str(error).startswith(f"{tmp_path / 'm.mtl'}:{line}:{column}: ")


def test_files_that_are_none(tmp_path):
    """Proves: missing files, directories, binary data and monsters are errors of this module."""
    with pytest.raises(MtlError, match="does not exist"):
        read_mtl(tmp_path / "absent.mtl")
    with pytest.raises(MtlError, match="not a regular file"):
        read_mtl(tmp_path)
    with pytest.raises(MtlError, match="binary"):
        _read(tmp_path, b"newmtl a\n\x00\x01")
    with open(tmp_path / "m.mtl", "wb") as file:
        file.truncate((16 << 20) + 1)
    with pytest.raises(MtlError, match="larger than 16 MiB"):
        read_mtl(tmp_path / "m.mtl")
