"""Links to HTML pages that stand for themselves, such as comparisons, open instead of downloading.

Sphinx takes a link to a file that it does not make for a download. Such a page is copied to where
it stands among the sources instead, with the folder it stands in, which may hold what it needs.
"""

import shutil
from pathlib import Path, PurePosixPath

from docutils import nodes
from sphinx.addnodes import download_reference


def open_pages(app, doctree):
    """Turn downloads of HTML pages into links, and note their folders."""
    here = PurePosixPath(app.env.docname).parent
    for download in list(doctree.findall(download_reference)):
        target = PurePosixPath(download["reftarget"])
        if target.suffix != ".html":
            continue
        app.env.page_folders = {*getattr(app.env, "page_folders", ()), (here / target).parent}
        link = nodes.reference("", "", *download.children, internal=True, refuri=str(target))
        download.replace_self(link)


def copy_folders(app, error):
    """Copy the folders of such pages."""
    if error is None:
        for folder in getattr(app.env, "page_folders", ()):
            out = Path(app.outdir) / folder
            out.mkdir(parents=True, exist_ok=True)
            for file in (Path(app.srcdir) / folder).iterdir():
                if file.is_file() and file.suffix != ".md":
                    shutil.copy(file, out)


def setup(app):
    """Watch for links to pages."""
    # Before Sphinx collects downloads.
    app.connect("doctree-read", open_pages, priority=100)
    app.connect("build-finished", copy_folders)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
