# SPDX-License-Identifier: MIT
"""Permissions of the live page: who may see it, who may command. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import socket

import pytest

from hodograph.errors import InputError
from hodograph.monitor.security import Guard, is_loopback, make_token

TOKEN = "a-token-for-these-tests"


def test_made_up_tokens_are_long_and_differ() -> None:
    tokens = {make_token(None) for _ in range(20)}
    assert len(tokens) == 20
    assert min(map(len, tokens)) >= 32


@pytest.mark.parametrize(
    "text", ["", "short", "x" * 15, "has a blank in it!", "ümlaut-is-no-good-here"]
)
def test_poor_tokens_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="--token"):
        make_token(text)


@pytest.mark.parametrize(
    "given", [None, 5, "", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), [TOKEN], "é"]
)
def test_only_the_token_is_the_token(given: object) -> None:
    guard = Guard("127.0.0.1", TOKEN)
    assert guard.knows_token(TOKEN)
    assert not guard.knows_token(given)


@pytest.mark.parametrize(
    ("host", "loopback"),
    [
        ("127.0.0.1", True),
        ("127.9.9.9", True),
        ("::1", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("::", False),
        ("192.168.1.5", False),
        ("robot", False),
    ],
)
def test_loopback(host: str, loopback: bool) -> None:
    assert is_loopback(host) is loopback
    assert Guard(host, TOKEN).open_to_see is loopback


@pytest.mark.parametrize(
    ("header", "known"),
    [
        ("127.0.0.1:8402", True),
        ("localhost:9", True),
        ("[::1]:8402", True),
        ("LOCALHOST", True),
        ("evil.example:8402", False),
        ("127.0.0.1.evil.example", False),
        ("192.168.1.5:8402", False),
        (None, False),
        ("", False),
        ("[::1", False),
        ("localhost@evil.example", False),
        ("evil.example@localhost", False),
        ("user:word@127.0.0.1:8402", False),
        ("127.0.0.1:8402/x", False),
    ],
)
def test_hosts_of_a_loopback_server(header: str | None, known: bool) -> None:
    assert Guard("127.0.0.1", TOKEN).knows_host(header) is known


@pytest.mark.parametrize(
    ("header", "known"),
    [
        ("192.168.1.5:8402", True),
        ("[fe80::1]:8402", True),
        ("evil.example", False),
        (f"{socket.gethostname()}:8402", True),
        ("localhost:8402", True),
    ],
)
def test_hosts_of_an_open_server(header: str, known: bool) -> None:
    assert Guard("0.0.0.0", TOKEN).knows_host(header) is known


@pytest.mark.parametrize(
    ("origin", "known"),
    [
        ("http://127.0.0.1:8402", True),
        ("HTTP://127.0.0.1:8402", True),
        (None, False),
        ("null", False),
        ("http://127.0.0.1:8403", False),
        ("http://localhost:8402", False),
        ("", False),
        ("http://evil.example", False),
        ("http://127.0.0.1:8402.evil.example", False),
        ("http://[", False),
    ],
)
def test_only_our_own_page_is_an_origin(origin: str | None, known: bool) -> None:
    assert Guard("127.0.0.1", TOKEN).knows_origin(origin, "127.0.0.1:8402") is known
