"""The documentation site: it builds without a warning, needs no network, and lacks nothing."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

import relume
from relume.cli import main

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
FETCHED = re.compile(
    r"""<(?:script|img|iframe|source|video|audio)\b[^>]*\ssrc=["'](?:https?:)?//"""
    r"""|<link\b(?![^>]*rel=["'](?:canonical|license)["'])[^>]*\shref=["'](?:https?:)?//"""
    r"""|@import|url\(["']?(?:https?:)?//""",
)
"""What a browser would fetch from the network by itself."""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the site, built anew."""
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    built = subprocess.run(
        [*command, "-d", out / "doctrees", DOCS, out / "html"], capture_output=True, text=True
    )
    assert built.returncode == 0, built.stderr
    return out / "html"


def text_of(page):
    """The words of a page."""
    return re.sub(r"<[^>]+>", "", page.read_text(encoding="utf-8"))


def plugin_pages():
    """The extension that makes the pages of the plugins."""
    spec = importlib.util.spec_from_file_location("plugin_pages", DOCS / "_ext" / "plugin_pages.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_no_page_fetches_anything(site):
    pages = [*site.rglob("*.html"), *site.rglob("*.css")]
    found = {
        str(page.relative_to(site)): match[0]
        for page in pages
        if (match := FETCHED.search(page.read_text(encoding="utf-8")))
    }
    assert len(pages) > 40
    assert found == {}


def test_every_plugin_has_a_page_with_its_parameters(site):
    """A plugin is a module that defines one; its docstring begins with what it is and its name."""
    defined = {
        file.stem
        for kind in plugin_pages().KINDS
        for file in (ROOT / kind).glob("*.py")
        if re.search(r"^def define\(", file.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert {"ward", "pssmlt", "erpt", "screencamera"} <= defined
    assert set(plugin_pages().plugins()) == defined
    listed = text_of(site / "plugins" / "index.html")
    for name in defined:
        assert name in listed
        page = (site / "plugins" / f"{name}.html").read_text(encoding="utf-8")
        assert "<table" in page, f"{name} has no table of parameters"


def test_every_command_and_option_is_in_the_reference(site):
    text = text_of(site / "cli.html")
    for name, command in main.commands.items():
        assert f"relume {name}" in text
        for option in command.params:
            assert option.opts[0] in text or option.param_type_name == "argument"


def test_every_public_name_is_in_the_reference(site):
    page = (site / "api.html").read_text(encoding="utf-8")
    missing = [name for name in relume.__all__ if f'id="relume.{name}"' not in page]
    assert missing == []


def test_names_of_plugins_lead_to_their_pages(site):
    page = (site / "materials.html").read_text(encoding="utf-8")
    article = page[page.index("<article") : page.index("</article>")]
    assert article.count('href="plugins/ward.html"') == 1


def test_formulas_are_drawn_by_the_browser(site):
    page = (site / "plugins" / "pssmlt.html").read_text(encoding="utf-8")
    assert '<math xmlns="http://www.w3.org/1998/Math/MathML"' in page
    assert "MathJax" not in page


def test_comparisons_open_as_pages(site):
    page = (site / "compare" / "README.html").read_text(encoding="utf-8")
    assert re.search(r'<a class="[^"]*internal" href="ward.html">', page)
    assert (site / "compare" / "ward.html").exists()


def test_the_readme_is_short_and_its_links_lead_somewhere():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 100
    links = [link for link in re.findall(r"\]\(([^)#]+)", text) if "://" not in link]
    assert len(links) > 20
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_pictures_of_the_readme_are_small():
    pictures = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", (ROOT / "README.md").read_text("utf-8"))
    assert len(pictures) == 3
    assert max((ROOT / picture).stat().st_size for picture in pictures) < 200_000
