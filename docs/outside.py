"""A preprocessor of mdBook: a site has no files from beside docs/. Links to them lead to the repository if book.toml
names it (`git-repository-url` under `[output.html]`, with the branch, as https://.../blob/main); else they are text.
"""

import json
import re
import sys
from posixpath import dirname, join, normpath

LINK = re.compile(r"(?<!!)\[([^][]*)\]\(([^()\s]+)\)")


def outside(text, page, repository):
    """The Markdown of a page, whose path is from docs/, without links that lead out of docs/."""

    def link(found):
        words, target = found.groups()
        path = normpath(join(dirname(page), target))
        if "://" in target or not path.startswith(".."):
            return found[0]
        return f"[{words}]({repository}/{path[3:]})" if repository else words

    return LINK.sub(link, text)


def chapters(of):
    """All chapters of a book, which are nested."""
    for value in of.values() if isinstance(of, dict) else of if isinstance(of, list) else []:
        if isinstance(value, dict) and value.get("path") and "content" in value:
            yield value
        yield from chapters(value)


if __name__ == "__main__" and sys.argv[1:2] != ["supports"]:
    context, book = json.load(sys.stdin)
    html = context["config"].get("output", {}).get("html", {})
    for chapter in chapters(book):
        chapter["content"] = outside(chapter["content"], chapter["path"], html.get("git-repository-url"))
    json.dump(book, sys.stdout)
