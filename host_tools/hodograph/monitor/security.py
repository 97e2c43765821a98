# SPDX-License-Identifier: MIT
"""Permissions of the live page: who may see it, and who may command (docs/guides/monitor.md, "Who may do what").

Three checks. The token, compared in constant time, makes a connection one that may command. The Host header must be a
name of this computer, so that the name of a foreign site cannot point here (DNS rebinding). The Origin header must be
this page, so that a foreign site cannot use the server through the browser (cross-site WebSockets).

Used by server, session and cli/monitor_command. Reads the name of this computer and random bits of the system.
"""

from __future__ import annotations

import hmac
import ipaddress
import re
import secrets
import socket
from dataclasses import dataclass
from urllib.parse import urlsplit

from ..errors import InputError

LEAST_TOKEN = 16
_TOKEN = re.compile(r"[A-Za-z0-9._~-]+")

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
"""Headers of each answer: the page loads no foreign content, and foreign pages cannot embed it."""


def make_token(given: str | None) -> str:
    """The given token, or a new one of 192 random bits. Raises InputError: it is easily guessed."""
    if given is None:
        return secrets.token_urlsafe(24)
    if len(given) < LEAST_TOKEN or not _TOKEN.fullmatch(given):
        raise InputError(
            f"--token: needs at least {LEAST_TOKEN} characters, letters, digits and . _ ~ - only: "
            "leave it out and one is made up"
        )
    return given


def is_loopback(host: str) -> bool:
    """Whether only this computer can reach a socket that is bound to `host`."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


@dataclass(frozen=True)
class Guard:
    """The checks of one server, bound to `host`."""

    host: str
    token: str

    @property
    def open_to_see(self) -> bool:
        """Whether the page may be seen, not used, without the token: on loopback."""
        return is_loopback(self.host)

    def knows_token(self, given: object) -> bool:
        """Compares the token in constant time."""
        if not isinstance(given, str):
            return False
        return hmac.compare_digest(given.encode(), self.token.encode())

    def knows_host(self, header: str | None) -> bool:
        """Whether a Host header names this computer. The name of a foreign page is never an address."""
        name = _host_name(header)
        if name is None:
            return False
        if self.open_to_see:
            return is_loopback(name)
        if _is_address(name):
            return True
        return name in {"localhost", self.host.lower(), *_own_names()}

    def knows_origin(self, origin: str | None, host_header: str | None) -> bool:
        """Whether a request comes from this page. Browsers always send the origin of a WebSocket."""
        if origin is None or host_header is None:
            return False
        try:
            parts = urlsplit(origin)
        except ValueError:
            return False
        return parts.scheme in ("http", "https") and parts.netloc.lower() == host_header.lower()


def _host_name(header: str | None) -> str | None:
    """The name of a Host header without the port, which may differ with port forwarding."""
    if not header or "@" in header or "/" in header:  # no browser sends user information, or a path
        return None
    try:
        return urlsplit(f"//{header}").hostname
    except ValueError:
        return None


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _own_names() -> set[str]:
    return {socket.gethostname().lower(), socket.getfqdn().lower()}
