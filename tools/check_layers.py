#!/usr/bin/env python3
"""Checks that modules include only lower rows of the ladder (docs/architecture.md).

    tools/check_layers.py [REPOSITORY]

A module may include itself and any module of a lower row, not another one of its own row. Tests
(*_test.cc, *_test.h) may look up. OpenVDB and Ceres stay out of headers: they cost minutes of compile
time, and whoever uses roxel should not need them. No two headers define a type of the same name: both are in
namespace roxel, and the linker takes either one's functions for both.
"""

import pathlib
import re
import sys

LADDER = [
    ["base"],
    ["color", "camera"],
    ["image", "volume"],
    ["dataset", "march"],
    ["sky"],
    ["infer"],
    ["depth"],
    ["surface", "solve"],
    ["io", "eval", "synth"],
    ["report", "dist"],
    ["apps", "python"],
]
ROW = {module: row for row, modules in enumerate(LADDER) for module in modules}
INCLUDE = re.compile(r'^\s*#\s*include\s*["<]([^">]+)[">]')
TYPE = re.compile(r"^(?:struct|class)\s+(?:alignas\([^)]*\)\s*)?(\w+)\b(?!\s*<)[^;{]*\{", re.MULTILINE)
SOURCES = {".h", ".cc", ".cpp", ".inl"}
NOT_IN_HEADERS = {"openvdb": "OpenVDB", "nanovdb": "NanoVDB", "ceres": "Ceres"}


def module_of(path):
    """src/roxel/MODULE/... is MODULE; apps/ and python/ are modules themselves; None for anything else."""
    parts = path.parts
    if parts[:2] == ("src", "roxel") and len(parts) > 3:
        return parts[2]
    return parts[0] if parts[0] in ("apps", "python") else None


def is_test(path):
    return path.stem.endswith("_test")


def problem_with(path, module, included):
    """Why this file must not have this include, or None."""
    first, _, rest = included.partition("/")
    if first in NOT_IN_HEADERS and path.suffix == ".h" and not is_test(path):
        return f"{NOT_IN_HEADERS[first]} does not belong in a header"
    if first != "roxel" or is_test(path):
        return None
    target = rest.partition("/")[0]
    if target not in ROW:
        return f'"{target}" is not on the ladder (tools/check_layers.py, docs/architecture.md)'
    if target == module or ROW[target] < ROW[module]:
        return None
    relation = "a higher row" if ROW[target] > ROW[module] else "the same row"
    return f'"{target}" is on {relation} (row {ROW[target]}; {module} is on row {ROW[module]})'


def violations(root):
    """Yields "file:line: why" for every include and name that breaks the rules, and how many files were read."""
    found, count, headers = [], 0, {}
    for folder in ("src", "apps", "python"):
        for file in sorted((root / folder).rglob("*")):
            path = file.relative_to(root)
            module = module_of(path)
            if file.suffix not in SOURCES or module is None:
                continue
            count += 1
            if module not in ROW:
                found.append(f'{path}:1: module "{module}" is not on the ladder')
                continue
            text = file.read_text(encoding="utf-8")
            for match in TYPE.finditer(text) if file.suffix == ".h" and module != "apps" else ():
                line = text.count("\n", 0, match.start()) + 1
                other = headers.setdefault(match[1], f"{path}:{line}")
                if other != f"{path}:{line}":
                    found.append(f"{path}:{line}: {match[1]} is defined in {other}, too")
            for number, line in enumerate(text.splitlines(), 1):
                match = INCLUDE.match(line)
                problem = match and problem_with(path, module, match[1])
                if problem:
                    found.append(f"{path}:{number}: {problem}")
    return found, count


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent.parent)
    found, count = violations(root)
    for line in found:
        print(line)
    if count == 0:
        print(f"{root}: no sources found")
    else:
        print(f"layers: {count} files, {len(found)} violation{'' if len(found) == 1 else 's'}")
    return 1 if found or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
