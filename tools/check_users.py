#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check_users.py [ROOT]: each C file and Python module names its users and its effects in its first comment, and the
lists of users are right. Run by `make lint`. Reads the files of the tree; prints FILE:LINE and what is wrong, with exit
status 1 then.

Users are a sentence with one of the words of USERS ("Used by", "Started by", "A part of"), effects one with a word of
EFFECTS ("Main loop", "Pure", "No I/O", "Reads"). Both stand in the first FIRST_SCREEN lines of each file, tests
included. Whether the effects are true is for readers to check.

A list of users is a sentence in the first comment of a C file or in the docstring of a module:

    (Used|Called) by PART, PART and PART.           PART: NAME [words], or words that name no file

NAME is a module or a folder: the end of its path, with or without the file's ending (app/tick, tick.c, sim/node), or
one of the entries of WORDS. A NAME without "/" and "." stands alone in its part. A source and the header of its name
are one module. A folder stands for all modules in it. A name that several paths end with means the one in the list's
own folder, else all of them. A sentence without any NAME ("Used by the proofs of axis limits.") is not compared.

A C module uses a header when it includes it and contains a name that the header declares; it calls the header when one
of these names is a function or macro with arguments. A Python module uses another when it imports it or a name of it,
also through a package that exports the name. A list is right when each of its names contains a user, and each user is
in it. A user that includes a header through another one may be missing; so may tests, tools and benchmarks. A list has
at most MOST names. The list of a C source is that of the header that its comment names first.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

TREES = ("firmware", "sim", "host_tools", "tools", "benchmarks", "tests")
"""Folders whose files are read; lists in tests/ are not compared."""
INCLUDE_ROOTS = ("firmware", "sim", "host_tools", "tests/unit", "tests/support")
IMPORT_ROOTS = ("host_tools", "tools", "benchmarks", "benchmarks/support", "tests/support")
NATIVE = "host_tools/hodograph/native/"
"""build_native.py includes C headers for declarations.h of this folder."""
WORDS = {
    "host tools": "host_tools",
    "the host tools": "host_tools",
    "ports": "firmware/port",
    "the ports": "firmware/port",
}
MOST = 4
OPTIONAL = ("tests/", "tools/", "benchmarks/")
"""Users that may be missing, except in lists of the same folder."""

FIRST_SCREEN = 40
USERS = re.compile(
    r"\b(Used|Called|Started|Run|Included|Imported|Loaded|Executed|Analysed)\s+(\w+\s+){0,2}(by|as|when|only|in|on)\b"
    r"|\b[Pp]art\s+of\b",
)
EFFECTS = re.compile(
    r"\b(pure|main\s+loop|timer|contexts?|threads?|I/O|ticks?|interrupts?|lock|reset|constants?|plain\s+data|macros"
    r"|changes|reads?|writes?|receives?|sends?|starts|prints?|waits?|returns|ends|keeps|opens|draws|makes|measures"
    r"|executed|started|written)\b",
    re.IGNORECASE,
)

_LIST = re.compile(r"\b(?P<verb>Used|Called)\s+by\s(?P<names>.*?)(?:[.;:](?=\s|$)|$)", re.DOTALL)
_INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)
_QUOTED_HEADER = re.compile(r'"(\w+/[\w/]+\.h)"')
_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
_CALLABLE = re.compile(r"^(?:#\s*define\s|\w[\w *]*?)\b(\w+)\(", re.MULTILINE)
_DATA = re.compile(
    r"^#\s*define\s+(\w+)\s|\b(?:struct|union|enum)\s+(\w+)\s*{|^extern\b[^;]*?(\w+)[\[;]",
    re.MULTILINE,
)
_NAME = re.compile(r"(\w+)$|([\w./]*[/.][\w./]*)(?:\s|$)")
_ENUM = re.compile(r"\benum\b[^{;]*\{([^}]*)\}")


@dataclass(frozen=True)
class UserList:
    """One list: the line of its first word, Used or Called, and its names (without other words)."""

    path: str
    line: int
    verb: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class Users:
    """Modules that use a file: those that a list has to name, and all that it may name."""

    required: frozenset[str]
    allowed: frozenset[str]


def module_of(path: str) -> str:
    """The path without its ending; a package's __init__.py is the folder."""
    return re.sub(r"(/__init__)?\.\w+$", "", path)


class Tree:
    """The files below a root and who uses whom."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.texts = {
            path.relative_to(root).as_posix(): path.read_text(encoding="utf-8")
            for tree in TREES
            for path in sorted((root / tree).rglob("*"))
            if path.suffix in {".c", ".h", ".py"} and path.is_file()
        }
        self.modules = {module_of(path) for path in self.texts}
        parents = {parent.as_posix() for path in self.texts for parent in Path(path).parents}
        self.folders = parents - {"."}
        self.includes = {path: self._includes(path) for path in self.texts if path[-2:] != "py"}
        self.words = {
            path: set(re.findall(r"\w+", _code(self.texts[path]))) for path in self.includes
        }
        self._exports: dict[str, dict[str, str]] = {}
        self.imports = {path: self._imports(path) for path in self.texts if path[-2:] == "py"}

    def lists(self) -> Iterator[UserList]:
        """All lists to compare."""
        for path, text in self.texts.items():
            if path.startswith("tests/"):
                continue
            start, comment = _first_comment(path, text)
            for found in _LIST.finditer(comment):
                line = text.count("\n", 0, start + found.start()) + 1
                names = _names(found["names"])
                if names:
                    yield UserList(path, line, found["verb"], names)

    def users(self, item: UserList) -> Users | None:
        """The modules that use the file of the list; None for a C source without a header."""
        if item.path.endswith(".py"):
            return self._users_of_module(item.path)
        header = item.path if item.path.endswith(".h") else self._header_of(item.path)
        return self._users_of_header(header, item.verb == "Called") if header else None

    def _header_of(self, source: str) -> str | None:
        """The header that the first comment of a C source names first."""
        named = re.search(r"[\w/]+\.h\b", _first_comment(source, self.texts[source])[1])
        paths = [f"{root}/{named[0]}" for root in INCLUDE_ROOTS] if named else []
        return next((path for path in paths if path in self.texts), None)

    def named(self, name: str, path: str) -> set[str]:
        """Modules that `name` in a list of the file at `path` means; empty if there is none."""
        end = re.sub(r"\.(c|h|py)$", "", WORDS.get(name, name)).rstrip("/")
        own = f"{Path(path).parent.as_posix()}/{end}"
        paths = self.modules | self.folders
        ends = {own} if own in paths else {p for p in paths if f"/{p}".endswith(f"/{end}")}
        return {m for m in self.modules if any(m == e or m.startswith(e + "/") for e in ends)}

    def _users_of_header(self, header: str, called: bool) -> Users:
        declared = _declared(self.texts[header], called)
        required, allowed = set(), set()
        for path, words in self.words.items():
            if module_of(path) == module_of(header) or not declared & words:
                continue
            if header in self.includes[path]:
                required.add(module_of(path))
            elif header in self._all_includes(path):
                allowed.add(module_of(path))
        return Users(frozenset(required), frozenset(required | allowed))

    def _users_of_module(self, path: str) -> Users:
        module = module_of(path)
        inside = f"{module}/" if path.endswith("/__init__.py") else path
        users = {
            module_of(source)
            for source, targets in self.imports.items()
            if not source.startswith(inside)
            and any(module_of(t) == module or t.startswith(inside) for t in targets)
        }
        packages = {m for m in users if f"{m}/__init__.py" in self.texts}
        return Users(frozenset(users - packages), frozenset(users))

    def _includes(self, path: str) -> set[str]:
        named = _INCLUDE.findall(self.texts[path])
        if path == NATIVE + "declarations.h":
            named = _QUOTED_HEADER.findall(self.texts.get(NATIVE + "build_native.py", ""))
        folders = (Path(path).parent.as_posix(), *INCLUDE_ROOTS)
        return {p for name in named for f in folders if (p := f"{f}/{name}") in self.texts}

    def _all_includes(self, path: str) -> set[str]:
        reached: set[str] = set()
        ahead = [path]
        while ahead:
            new = self.includes[ahead.pop()] - reached
            reached |= new
            ahead += new
        return reached

    def _imports(self, path: str) -> set[str]:
        """Files that the Python file at `path` imports."""
        found: set[str] = set()
        for node in ast.walk(ast.parse(self.texts[path], path)):
            if isinstance(node, ast.Import):
                found |= {f for name in node.names if (f := self._file(name.name.split(".")))}
            elif isinstance(node, ast.ImportFrom):
                parts = _absolute(path, node)
                found |= {f for name in node.names if (f := self._origin(path, parts, name.name))}
        return found - {path}

    def _origin(self, path: str, parts: list[str], name: str) -> str | None:
        """The file that defines `name` of the module `parts`; None outside of this tree."""
        file = self._file([*parts, name], path)
        if file is not None:
            return file
        file = self._file(parts, path)
        if file is None or not file.endswith("/__init__.py") or file == path:
            return file
        return self._exported(file).get(name, file)

    def _exported(self, package: str) -> dict[str, str]:
        """Names that an __init__.py takes from other files, and those files."""
        if package not in self._exports:
            self._exports[package] = {}
            for node in ast.walk(ast.parse(self.texts[package], package)):
                if isinstance(node, ast.ImportFrom):
                    for name in node.names:
                        origin = self._origin(package, _absolute(package, node), name.name)
                        if origin is not None:
                            self._exports[package][name.asname or name.name] = origin
        return self._exports[package]

    def _file(self, parts: list[str], path: str = "") -> str | None:
        own = Path(path).parent.as_posix()
        for base in (*IMPORT_ROOTS, own):
            for ending in (".py", "/__init__.py"):
                file = f"{base}/{'/'.join(parts)}{ending}"
                if file in self.texts:
                    return file
        return None


def _first_comment(path: str, text: str) -> tuple[int, str]:
    """Where the comment of the file starts, and its text with blanks in place of its marks."""
    if path.endswith(".py"):
        found = re.match(r'(?:#[^\n]*\n|\s)*r?("""(?:.*?)""")', text, re.DOTALL)
        return (found.start(1), found[1].replace('"', " ")) if found else (0, "")
    found = re.match(r"/\*[^\n]*SPDX[^\n]*\*/\s*(/\*.*?\*/)", text, re.DOTALL)
    if not found:
        return 0, ""
    marks = re.compile(r"^ \*(?!/)|/\*|\*/", re.MULTILINE)
    return found.start(1), marks.sub(lambda mark: " " * len(mark[0]), found[1])


def _names(text: str) -> tuple[str, ...]:
    parts = re.split(r",\s*and\s+|,\s*|\s+and\s+", " ".join(text.split()).replace("`", ""))
    names = []
    for part in (part.removeprefix("by ") for part in parts):
        found = _NAME.match(part)
        if part in WORDS:
            names.append(part)
        elif found:
            names.append(found[1] or found[2])
    return tuple(names)


def _code(text: str) -> str:
    """C text without comments and includes."""
    return _INCLUDE.sub(" ", _COMMENT.sub(" ", text))


def _declared(header: str, called: bool) -> set[str]:
    """What a header declares: functions and macros with arguments; unless `called`, other macros, types, objects and
    constants of enumerations as well.
    """
    code = _code(header)
    names = set(_CALLABLE.findall(code))
    if not called:
        names |= {name for found in _DATA.findall(code) for name in found if name}
        for constants in _ENUM.findall(code):
            names |= set(re.findall(r"(?:^|,)\s*(\w+)", constants))
    return names


def _absolute(path: str, node: ast.ImportFrom) -> list[str]:
    """The parts of the module that an import names."""
    module = node.module.split(".") if node.module else []
    if not node.level:
        return module
    package = Path(path).parent.relative_to("host_tools").parts if "host_tools/" in path else ()
    return [*package[: len(package) - node.level + 1], *module]


def _optional(module: str, path: str) -> bool:
    return module.startswith(OPTIONAL) and module.split("/")[0] != path.split("/")[0]


def faults(tree: Tree, item: UserList) -> Iterator[str]:
    """What is wrong with a list."""
    users = tree.users(item)
    if users is None:
        return
    means = {name: tree.named(name, item.path) for name in item.names}
    covered = set().union(*means.values())
    missing = sorted(m for m in users.required - covered if not _optional(m, item.path))
    superfluous = [name for name in item.names if not means[name] & users.allowed]
    if missing:
        yield f"missing: {', '.join(missing)}"
    if superfluous:
        yield f"superfluous: {', '.join(superfluous)}"
    if len(item.names) > MOST:
        yield f"{len(item.names)} names, at most {MOST}: name a folder, or remove the list"


def missing_sentences(tree: Tree) -> Iterator[str]:
    """One line for each file that does not name its users, or its effects, in its first screen."""
    for path, text in tree.texts.items():
        if not text.strip():
            continue
        start, comment = _first_comment(path, text)
        screen = comment.split("\n")[: FIRST_SCREEN - text.count("\n", 0, start)]
        words = "\n".join(screen)
        if not USERS.search(words):
            yield f"{path}:1: the first comment does not name the users (Used by ...)"
        if not EFFECTS.search(words):
            yield f"{path}:1: the first comment does not name the effects (Main loop, No I/O, Reads ...)"


def wrong_lists(tree: Tree) -> Iterator[str]:
    """One line for each list that differs from the users."""
    for item in tree.lists():
        wrong = "; ".join(faults(tree, item))
        if wrong:
            yield f"{item.path}:{item.line}: {wrong}"


def main(arguments: list[str]) -> int:
    """Exit status."""
    root = Path(arguments[0]) if arguments else Path(__file__).resolve().parent.parent
    tree = Tree(root)
    wrong = [*missing_sentences(tree), *wrong_lists(tree)]
    for line in wrong:
        print(line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
