"""The list of injected errors fits the program, and what is tested with one is the changed copy."""

import ast
import functools

import pytest

from studies import ROOT
from studies.error_injection import Copy
from studies.injected_errors import MUTATIONS


@functools.cache
def text_of(file):
    return (ROOT / file).read_text(encoding="utf-8")


@functools.cache
def functions_of(file):
    return {n.name for n in ast.walk(ast.parse(text_of(file))) if isinstance(n, ast.FunctionDef)}


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda m: m.says)
def test_an_error_replaces_one_text_and_names_tests_that_exist(mutation):
    assert text_of(mutation.file).count(mutation.old) == 1
    assert mutation.new != mutation.old
    for test in mutation.tests:
        file, _, name = test.partition("::")
        assert (ROOT / "tests" / file).is_file()
        assert not name or name in functions_of(f"tests/{file}"), test


def test_errors_have_words_of_their_own():
    """The table is kept by them."""
    said = [mutation.says for mutation in MUTATIONS]
    assert len(set(said)) == len(said)


def test_the_copy_is_what_is_tested(tmp_path):
    """In a package that stands at the top of the checkout, where an installed one is near by."""
    copy = Copy.of(ROOT, tmp_path)
    (mutation,) = (m for m in MUTATIONS if m.says == "infinity light 2 % too bright")
    tests = [f"tests/{name}" for name in mutation.tests]
    found = copy.finds(mutation.file, mutation.old, mutation.new, tests)
    assert found and found.startswith("translator/test_lights.py::")
    assert (copy.root / mutation.file).read_text(encoding="utf-8") == text_of(mutation.file)
    with pytest.raises(ValueError, match="holds 'no such text' 0 times"):
        copy.finds(mutation.file, "no such text", "", tests)
