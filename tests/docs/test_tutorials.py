"""The pages that teach do what they say, and show the pictures that they make."""

import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]
PAGES = ("start.md", "tutorials/old-file.md", "tutorials/mitsuba.md")
RUNNER = Path(__file__).with_name("tutorials.py")


def run(page, folder):
    """Run a page as its reader would, in a process of its own."""
    command = [sys.executable, RUNNER, "--check", page, folder]
    return subprocess.run(command, capture_output=True, text=True)


@pytest.mark.parametrize("page", PAGES)
def test_a_page_does_what_it_says(page, tmp_path):
    done = run(ROOT / "docs" / page, tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("```python\nprint(1)\n```\n\n```output\n2\n```\n", "expected\n2"),
        ("```python\n1 / 0\n```\n", "ZeroDivisionError"),
        ("```console\n$ relume check nothing.txt\n...\n```\n", "exit status 1"),
        ("```console\n$ relume check nothing.txt\n...\n$ echo $?\n0\n```\n", "expected\n0"),
        ("```console\n$ relume --version\nversion -1\n```\n", "version -1"),
        ("```console\n$ rm -r everything\n```\n", "is not run"),
    ],
)
def test_what_is_not_as_a_page_says_is_found(text, why, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(text, encoding="utf-8")
    (tmp_path / "run").mkdir()
    done = run(page, tmp_path / "run")
    assert done.returncode != 0
    assert why in done.stderr


def test_a_picture_that_the_page_does_not_make_is_found(tmp_path):
    code = "from PIL import Image\nImage.new('L', (8, 8), 200).save('grey.png')\n"
    page = tmp_path / "page.md"
    (tmp_path / "images").mkdir()
    (tmp_path / "run").mkdir()
    page.write_text(f"```python\n{code}```\n\n![grey](images/grey.png)\n")
    for level, status in ((201, 0), (255, 1)):
        Image.new("L", (8, 8), level).save(tmp_path / "images" / "grey.png")
        (tmp_path / "run" / "scenes").unlink(missing_ok=True)
        assert run(page, tmp_path / "run").returncode == status
