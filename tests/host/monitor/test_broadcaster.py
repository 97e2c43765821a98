# SPDX-License-Identifier: MIT
"""Queues to the browsers are bounded, and nothing that matters is lost from them. Run by pytest; starts and writes
nothing.
"""

from __future__ import annotations

import asyncio
import json
from typing import Any

from hodograph.monitor.clients import EVENTS, HISTORY, QUEUE, Broadcaster, Client


async def taken(client: Client) -> list[Any]:
    found = []
    while True:
        try:
            found.append(json.loads(await asyncio.wait_for(client.get(), 0.01)))
        except TimeoutError:
            return found


def run(scenario: Any) -> Any:
    return asyncio.run(scenario())


def test_a_slow_browser_loses_the_oldest_rows_and_no_state() -> None:
    async def scenario() -> tuple[list[Any], int]:
        broadcaster = Broadcaster(asyncio.get_running_loop())
        client = broadcaster.join()
        for i in range(QUEUE + 50):
            broadcaster.publish({"type": "rows", "i": i})
            broadcaster.publish({"type": "status", "i": i})
        broadcaster.publish({"type": "path", "i": 0})
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        return await taken(client), client.dropped

    messages, dropped = run(scenario)
    rows = [m["i"] for m in messages if m["type"] == "rows"]
    assert rows == list(range(50, QUEUE + 50))
    assert dropped == 51  # the empty history too
    assert [m["i"] for m in messages if m["type"] == "status"] == [QUEUE + 49]
    assert any(m["type"] == "path" for m in messages)


def test_who_comes_later_gets_the_latest_and_a_bounded_past() -> None:
    async def scenario() -> list[Any]:
        broadcaster = Broadcaster(asyncio.get_running_loop())
        for i in range(HISTORY + 100):
            broadcaster.publish({"type": "rows", "i": i})
        for i in range(EVENTS + 10):
            broadcaster.publish({"type": "event", "text": str(i)})
        broadcaster.publish({"type": "path", "x": []})
        await asyncio.sleep(0)
        client = broadcaster.join()
        assert broadcaster.count == 1
        broadcaster.leave(client)
        assert broadcaster.count == 0
        return await taken(client)

    path, history = run(scenario)
    assert path["type"] == "path"
    assert len(history["messages"]) == HISTORY + EVENTS
    assert history["messages"][0]["i"] == 100


def test_a_restart_forgets_the_past() -> None:
    async def scenario() -> list[Any]:
        broadcaster = Broadcaster(asyncio.get_running_loop())
        client = broadcaster.join()
        broadcaster.publish({"type": "rows", "i": 1})
        broadcaster.publish({"type": "restart"})
        broadcaster.publish({"type": "rows", "i": 2})
        await asyncio.sleep(0)
        return await taken(client) + await taken(broadcaster.join())

    found = run(scenario)
    assert found[:2] == [{"type": "restart"}, {"type": "rows", "i": 2}]
    assert found[2]["messages"] == [{"type": "rows", "i": 2}]


def test_after_the_end_publishing_does_nothing() -> None:
    async def scenario() -> Broadcaster:
        return Broadcaster(asyncio.get_running_loop())

    run(scenario).publish({"type": "rows"})
