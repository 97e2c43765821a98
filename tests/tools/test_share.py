# SPDX-License-Identifier: MIT
"""Man page and shell completion, as `make share` writes them: shells complete by them, mandoc has nothing to say. Run
by pytest; starts tools/make_share.py and `mandoc`, and writes to temporary folders.
"""

from __future__ import annotations

import argparse
import os
import pty
import re
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from hodograph.cli.parser import make_parser
from hodograph.names import SHELLS

ROOT = Path(__file__).resolve().parents[2]
MAN = "man/man1/hodograph.1"
BASH = "bash-completion/completions/hodograph"
ZSH = "zsh/site-functions/_hodograph"
FISH = "fish/vendor_completions.d/hodograph.fish"


def made(folder: Path) -> Path:
    command = [sys.executable, str(ROOT / "tools/make_share.py"), str(folder)]
    subprocess.run(command, check=True)
    return folder


@pytest.fixture(scope="module")
def share(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("share"))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where completion finds one file and one folder."""
    (tmp_path / "drawing.toml").touch()
    (tmp_path / "drafts").mkdir()
    return tmp_path


def commands() -> dict[str, argparse.ArgumentParser]:
    parser = make_parser()
    subs = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    return dict(subs[0].choices)


def test_the_same_bytes_again(share: Path, tmp_path: Path) -> None:
    again = made(tmp_path)
    files = [file.relative_to(share) for file in share.rglob("*") if file.is_file()]
    assert sorted(map(str, files)) == sorted([MAN, BASH, ZSH, FISH])
    assert all((again / file).read_bytes() == (share / file).read_bytes() for file in files)


# -- man page ----------------------------------------------------------------------------------------


def test_mandoc_finds_no_error(share: Path) -> None:
    done = subprocess.run(
        ["mandoc", "-Tlint", "-W", "error", str(share / MAN)], capture_output=True, text=True
    )
    assert (done.returncode, done.stdout) == (0, "")


def shown(share: Path) -> str:
    """The page as a reader sees it, in one line."""
    command = ["mandoc", "-Tutf8", "-O", "width=200", str(share / MAN)]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return " ".join(re.sub(r".\x08", "", text).split())


def test_every_command_and_option_is_in_the_page(share: Path) -> None:
    text = shown(share)
    assert re.search(r"NAME hodograph [-–] From a control polygon", text)
    for name, parser in commands().items():
        assert f"hodograph {name} " in text
        for action in parser._actions:
            if action.dest != "help" and action.help not in (None, argparse.SUPPRESS):
                assert " ".join((action.help % vars(action)).split()) in text, (name, action.help)
                assert all(option in text for option in action.option_strings)
    assert "130 interrupted" in text
    assert "HODOGRAPH_BUS" in text
    assert ".RS" not in text


# -- bash --------------------------------------------------------------------------------------------


def by_bash(share: Path, folder: Path, *words: str) -> set[str]:
    script = f"""
        source {share / BASH}
        complete -p hodograph > /dev/null || exit 1
        entry=$(complete -p hodograph | sed 's/.* -F \\([^ ]*\\) .*/\\1/')
        COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=()
        "$entry"
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    done = subprocess.run(
        ["bash", "--norc", "-c", script, "bash", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    return set(done.stdout.split())


def by_fish(share: Path, folder: Path, *words: str) -> set[str]:
    line = " ".join(words)
    script = f"source {share / FISH}; complete -C '{line}'"
    done = subprocess.run(
        ["fish", "--no-config", "-c", script],
        cwd=folder,
        env={**os.environ, "HOME": str(folder / "drafts")},
        capture_output=True,
        text=True,
        check=True,
    )
    return {line.split("\t")[0] for line in done.stdout.splitlines()}


BY = {"bash": by_bash, "fish": by_fish}


@pytest.mark.parametrize("shell", BY)
class TestCompletion:
    def test_commands(self, shell: str, share: Path, folder: Path) -> None:
        assert BY[shell](share, folder, "hodograph", "sim") == {"simulate"}
        assert commands().keys() <= BY[shell](share, folder, "hodograph", "")

    def test_options(self, shell: str, share: Path, folder: Path) -> None:
        assert BY[shell](share, folder, "hodograph", "simulate", "--ker") == {"--kernel"}
        assert "--bandwidth" in BY[shell](share, folder, "hodograph", "tune", "--")
        assert "--bandwidth" not in BY[shell](share, folder, "hodograph", "feed", "--")

    def test_words(self, shell: str, share: Path, folder: Path) -> None:
        words = BY[shell](share, folder, "hodograph", "simulate", "--kernel", "")
        assert {"fixed", "float", "double"} <= words

    def test_files(self, shell: str, share: Path, folder: Path) -> None:
        found = BY[shell](share, folder, "hodograph", "feed", "dr")
        assert "drawing.toml" in found
        assert any(name.rstrip("/") == "drafts" for name in found)

    def test_folders(self, shell: str, share: Path, folder: Path) -> None:
        found = BY[shell](share, folder, "hodograph", "init", "dr")
        assert {name.rstrip("/") for name in found} == {"drafts"}


# -- zsh ---------------------------------------------------------------------------------------------


class Zsh:
    """An interactive zsh with the completion, on a terminal of its own."""

    def __init__(self, share: Path, folder: Path) -> None:
        self._leader, follower = pty.openpty()
        self._child = subprocess.Popen(
            ["zsh", "-f", "-i"],
            stdin=follower,
            stdout=follower,
            stderr=follower,
            cwd=folder,
            env={**os.environ, "TERM": "dumb", "HOME": str(folder)},
            start_new_session=True,
        )
        os.close(follower)
        self.type(f"fpath=({(share / ZSH).parent} $fpath); autoload -Uz compinit; compinit -u -D\n")
        self.type(
            "unsetopt zle_bracketed_paste; zstyle ':completion:*' menu no; PS1=; echo rea''dy\n"
        )
        self.until("ready")

    def type(self, text: str) -> None:
        os.write(self._leader, text.encode())

    def until(self, text: str, limit_s: float = 600.0) -> str:
        """What it says up to a text; fails when that does not come."""
        said, end = "", time.monotonic() + limit_s
        while text not in said:
            assert time.monotonic() < end, f"no {text!r} in {said!r}"
            if select.select([self._leader], [], [], 1.0)[0]:
                said += os.read(self._leader, 4096).decode(errors="replace")
        return said

    def close(self) -> None:
        self._child.kill()
        self._child.wait()
        os.close(self._leader)


@pytest.fixture
def zsh(share: Path, folder: Path) -> Iterator[Zsh]:
    shell = Zsh(share, folder)
    yield shell
    shell.close()


@pytest.mark.parametrize(
    ("typed", "completed"),
    [
        ("hodograph simu", "hodograph simulate"),
        ("hodograph simulate --ker", "hodograph simulate --kernel"),
        ("hodograph simulate --kernel dou", "hodograph simulate --kernel double"),
        ("hodograph feed draw", "hodograph feed drawing.toml"),
        ("hodograph init dr", "hodograph init drafts"),
    ],
)
def test_zsh_completes(zsh: Zsh, typed: str, completed: str) -> None:
    zsh.type(f"{typed}\t")
    zsh.until(completed)


def test_this_computer_has_the_shells() -> None:
    assert all(shutil.which(shell) for shell in SHELLS)


@pytest.mark.parametrize(("shell", "name"), [("bash", BASH), ("zsh", ZSH), ("fish", FISH)])
def test_the_command_prints_the_same(shell: str, name: str, share: Path) -> None:
    command = [sys.executable, "-m", "hodograph", "completion", shell]
    done = subprocess.run(command, capture_output=True, check=True)
    assert done.stdout == (share / name).read_bytes()
