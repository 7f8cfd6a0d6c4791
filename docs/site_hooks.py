"""What the site has beside docs/: README and CONTRIBUTING, and a page for each file that a page links to elsewhere.

MkDocs calls the two functions `on_*`; see mkdocs.yml.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from posixpath import dirname, normpath, relpath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
OWN_NAMES = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "LICENSE": "license.md"}
LANGUAGES = {".py": "python", ".yaml": "yaml"}
LINK = re.compile(r"(?<=\]\()(?![a-z]+:|#)([^)#\s]+)")


def page_of(path: str) -> str:
    """Where the site has a file or folder of the repository, by its path there."""
    if path.startswith("docs/"):
        return path.removeprefix("docs/") + ("/README.md" if (ROOT / path).is_dir() else "")
    return OWN_NAMES.get(path) or f"source/{path.removesuffix('.md')}.md"


def text_of(path: str) -> str:
    """The Markdown of the page that shows a file or folder of the repository."""
    place = ROOT / path
    if place.is_dir():
        inside = sorted(one.name for one in place.iterdir() if one.suffix in {".py", ".md", ".yaml"})
        return "\n".join([f"# {path}/", "", *(f"- [{one}]({place.name}/{one})" for one in inside)])
    text = place.read_text(encoding="utf-8")
    if place.suffix == ".md":
        return text
    return f"# {path}\n\n````{LANGUAGES.get(place.suffix, 'text')}\n{text}````\n"


def linked(path: str) -> list[str]:
    """The files and folders of the repository that a page links to, by their paths there."""
    return [normpath(f"{dirname(path)}/{one}".lstrip("/")) for one in LINK.findall(text_of(path))]


SHOWN: dict[str, str] = {}
"""Of each page that is not a file in docs/, the file of the repository that it shows."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds README and CONTRIBUTING, and, link by link, each file outside docs/ that a page links to."""
    to_read = ["README.md", "CONTRIBUTING.md", *(f"docs/{one.src_uri}" for one in files.documentation_pages())]
    seen = set(to_read)
    while to_read:
        path = to_read.pop()
        if not path.startswith("docs/"):
            SHOWN[page_of(path)] = path
            files.append(File.generated(config, page_of(path), content=text_of(path)))
        if path.endswith(".md") or (ROOT / path).is_dir():
            new = {one for one in linked(path) if one not in seen and not one.startswith("docs/")}
            to_read += sorted(one for one in new if (ROOT / one).exists())
            seen |= new
    return files


def on_page_markdown(markdown: str, *, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turns links between files of the repository into links between pages of the site."""
    uri = page.file.src_uri
    path = SHOWN.get(uri, f"docs/{uri}")
    if path.endswith(tuple(LANGUAGES)):
        return markdown  # its code may hold what looks like a link

    def on_site(link: re.Match[str]) -> str:
        target = normpath(os.path.join(dirname(path), link[0]))
        return relpath(page_of(target), dirname(uri) or ".")

    return LINK.sub(on_site, markdown)
