#!/usr/bin/env python3
"""Checks that relative links in the project's Markdown lead to files, that sources name docs pages that
exist, and that every [Key00] cited in sources and docs stands in docs/bibliography.md.

    tools/check_links.py [REPOSITORY]
"""

import pathlib
import re
import sys

LINK = re.compile(r"\]\(([^)\s#]+)(?:#[^)]*)?\)")
PAGE = re.compile(r"\bdocs/[\w-]+\.md\b")
KEY = re.compile(r"\[([A-Z][A-Za-z]+[0-9]{2}[a-z]?)\](?!\()")
ENTRY = re.compile(r"\*\*\[([A-Za-z0-9]+)\]\*\*")
SKIP = {"build", "shared", ".git", "demo", "node_modules"}


def files(root, *suffixes):
    for path in sorted(root.rglob("*")):
        if path.suffix in suffixes and not SKIP & set(path.relative_to(root).parts):
            yield path


def lines(path):
    return enumerate(path.read_text(encoding="utf-8").splitlines(), 1)


def broken_links(root):
    for path in files(root, ".md"):
        for number, line in lines(path):
            for target in LINK.findall(line):
                if "://" not in target and not (path.parent / target).exists():
                    yield f"{path.relative_to(root)}:{number}: no such file: {target}"


def missing_pages(root):
    for path in files(root, ".h", ".cc"):
        for number, line in lines(path):
            for page in PAGE.findall(line):
                if not (root / page).exists():
                    yield f"{path.relative_to(root)}:{number}: no such page: {page}"


def unknown_keys(root):
    known = set(ENTRY.findall((root / "docs/bibliography.md").read_text(encoding="utf-8")))
    for path in files(root, ".md", ".h", ".cc"):
        for number, line in lines(path):
            for key in KEY.findall(line):
                if key not in known:
                    yield f"{path.relative_to(root)}:{number}: [{key}] is not in docs/bibliography.md"


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent.parent)
    found = [*broken_links(root), *missing_pages(root), *unknown_keys(root)]
    print(*found, f"links: {len(found)} broken", sep="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
