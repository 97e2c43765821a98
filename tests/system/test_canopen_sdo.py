# SPDX-License-Identifier: MIT
"""SDO on the bus: python canopen's transfers of all kinds, and faults of a client made by hand. Run by pytest; starts
controllers and drives, each on a local bus.
"""

from __future__ import annotations

import binascii
import struct
from collections.abc import Iterator

import canopen
import pytest
from canopen_bench import (
    BLOCK_SIZE,
    BUSY,
    COMMAND,
    CONTROLLER,
    CRC,
    DRIVE,
    SEQUENCE,
    TIMEOUT,
    TOGGLE,
    TOO_LONG,
    TOO_SHORT,
    VALUE,
    Hand,
    abort_code,
    controller_node,
    drive_node,
    hand,
    object_bytes,
    program,
)

from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub

IMAGES = ("line_tiny", "alpha_minimax", "star_minimax")
PROGRAM = object_bytes(0x2000, 1)
NAME = object_bytes(0x1008, 0)
SEGMENTS = 127
LAST = -1
"""Place of the last segment of a transfer."""
PROGRAM_TOO_SHORT = -1
CONTROLLER_PATIENCE_S, DRIVE_PATIENCE_S = 2.0, 1.0
"""Silence of a client after which a server gives up; a block that does not go on gets its answer after half of it."""
TICK_S = 0.001


@pytest.fixture
def controller(hub: LocalHub, clock: VirtualClock) -> Iterator[canopen.RemoteNode]:
    """With limits that the golden programs keep."""
    with controller_node(hub) as node:
        for sub, limit in ((2, 500_000), (3, 5_000_000), (4, 200_000)):
            node.sdo[0x2004][sub].raw = limit
        yield node


@pytest.fixture
def drive(hub: LocalHub, clock: VirtualClock) -> Iterator[canopen.RemoteNode]:
    with drive_node(hub) as node:
        yield node


@pytest.fixture
def by_hand(hub: LocalHub, controller: canopen.RemoteNode) -> Iterator[Hand]:
    """Nothing is under way, and line_tiny is the active program."""
    download(controller, program("line_tiny"))
    with hand(hub, CONTROLLER) as made:
        yield made


def own_crc(image: bytes) -> int:
    """The CRC-32 in the header of a program, which the controller has checked."""
    return int(struct.unpack_from("<I", image, 12)[0])


def is_active(node: canopen.RemoteNode, image: bytes) -> bool:
    """Whether this program is the active one."""
    return active(node) == (2, own_crc(image))


def download(node: canopen.RemoteNode, image: bytes) -> None:
    with node.sdo[0x2000][1].open(
        "wb", size=len(image), block_transfer=True, buffering=0
    ) as stream:
        for start in range(0, len(image), 7):
            stream.write(image[start : start + 7])


def upload(node: canopen.RemoteNode) -> bytes:
    with node.sdo[0x2000][1].open("rb", block_transfer=True) as stream:
        return bytes(stream.read())


def active(node: canopen.RemoteNode) -> tuple[int, int]:
    """State and CRC-32 of the active program."""
    return node.sdo[0x2000][2].raw, node.sdo[0x2000][5].raw


# -- transfers of python canopen -------------------------------------------------------------------


@pytest.mark.parametrize("name", IMAGES)
def test_block_download_and_upload(controller: canopen.RemoteNode, name: str) -> None:
    image = program(name)
    download(controller, image)
    assert active(controller)[0] == 2
    assert controller.sdo[0x2000][6].raw == len(image)
    assert upload(controller) == image


@pytest.mark.parametrize("name", ["line_tiny", "alpha_minimax"])
def test_segmented_download_and_upload(controller: canopen.RemoteNode, name: str) -> None:
    image = program(name)
    controller.sdo.download(0x2000, 1, image)
    assert controller.sdo.upload(0x2000, 1) == image


@pytest.mark.parametrize("size", [1, 4, 5, 7, 8, 14, 888, 889, 890, 1778])
@pytest.mark.parametrize("block", [True, False], ids=["block", "segmented"])
def test_a_download_of_any_size_is_judged_whole(
    controller: canopen.RemoteNode, size: int, block: bool
) -> None:
    """The beginning of a program is no program: refused, and the one that is there stays."""
    download(controller, program("line_tiny"))
    before = active(controller)
    image = program("alpha_quintic")[:size]
    if block:
        code = abort_code(lambda: download(controller, image))
    else:
        code = abort_code(lambda: controller.sdo.download(0x2000, 1, image, force_segment=True))
    assert code == VALUE
    assert active(controller) == before
    assert controller.sdo[0x2000][3].raw == PROGRAM_TOO_SHORT


def test_values_by_every_kind_of_transfer(controller: canopen.RemoteNode) -> None:
    for value in (0, 1, -1, 2**62 + 12345, -(2**63)):
        raw = struct.pack("<q", value)
        controller.sdo.download(0x2011, 0, raw)
        assert controller.sdo.upload(0x2011, 0) == raw
        with controller.sdo.open(
            0x2011, 0, "wb", size=8, block_transfer=True, buffering=0
        ) as stream:
            stream.write(raw[:7])
            stream.write(raw[7:])
        with controller.sdo.open(0x2011, 0, "rb", block_transfer=True) as stream:
            assert stream.read() == raw


def test_small_values_segmented(drive: canopen.RemoteNode) -> None:
    """A client need not send expedited what would fit."""
    for index, sub, raw in ((0x6040, 0, b"\6\0"), (0x607D, 1, b"\1\2\3\x84"), (0x6060, 0, b"\x08")):
        drive.sdo.download(index, sub, raw, force_segment=True)
        assert drive.sdo.upload(index, sub) == raw


def test_strings(drive: canopen.RemoteNode, controller: canopen.RemoteNode) -> None:
    for node, name in ((drive, "Hodograph simulated drive"), (controller, "Hodograph controller")):
        assert node.sdo[0x1008].raw == name
        with node.sdo.open(0x1008, 0, "rb", block_transfer=True) as stream:
            assert stream.read() == name.encode()


# -- faults of a client ----------------------------------------------------------------------------


def initiate_block(by_hand: Hand, size: int, crc: bool = True) -> int:
    """Begins a block download; segments a block."""
    answer = by_hand.ask(bytes([0xC2 | 4 * crc]) + PROGRAM + struct.pack("<I", size))
    assert answer[:4] == b"\xa4" + PROGRAM
    return answer[4]


def segments_of(image: bytes) -> list[bytes]:
    return [image[at : at + 7].ljust(7, b"\0") for at in range(0, len(image), 7)]


def places(lose: set[int], count: int) -> set[int]:
    """Places among so many segments, LAST taken for what it is."""
    return {place % count for place in lose}


def end_block(by_hand: Hand, image: bytes, crc: int) -> bytes:
    unused = -len(image) % 7
    return by_hand.ask(bytes([0xC1 | unused << 2]) + struct.pack("<H", crc))


def xmodem(data: bytes) -> int:
    """The CRC of block transfers."""
    return binascii.crc_hqx(data, 0)


def send_blocks(by_hand: Hand, image: bytes, size: int, lose: frozenset[int] = frozenset()) -> int:
    """Sends an image in blocks, without the segments `lose` the first time; the number of blocks."""
    segments, done, blocks, lost = segments_of(image), 0, 0, set(lose)
    while done < len(segments):
        block = segments[done : done + size]
        for number, data in enumerate(block, start=1):
            last = done + number == len(segments)
            if done + number - 1 in lost:
                lost.discard(done + number - 1)
                continue
            by_hand.send(bytes([number | 0x80 * last]) + data)
        answer = by_hand.answer()
        assert answer[0] == 0xA2, answer.hex(" ")
        done += answer[1]
        blocks += 1
    assert not lost
    return blocks


def blocks_needed(count: int, lose: set[int]) -> int:
    """Blocks of SEGMENTS for so many segments when these are lost once: each goes on after the last good one."""
    done, blocks, lost = 0, 0, set(lose)
    while done < count:
        block = range(done, min(done + SEGMENTS, count))
        done = min((place for place in block if place in lost), default=block.stop)
        lost -= set(block)
        blocks += 1
    return blocks


def test_block_download_by_hand(controller: canopen.RemoteNode, by_hand: Hand) -> None:
    image = program("line_slow")
    size = initiate_block(by_hand, len(image))
    assert size == SEGMENTS
    assert send_blocks(by_hand, image, size) == blocks_needed(len(segments_of(image)), set())
    assert end_block(by_hand, image, xmodem(image))[0] == 0xA1
    assert is_active(controller, image)


@pytest.mark.parametrize(
    "lose",
    [{0}, {1}, {63}, {125}, {126}, {0, 126}, {10, 11, 12}, {126, 127}, {LAST}, {5, 200, LAST}],
    ids=str,
)
def test_block_download_with_lost_segments(
    controller: canopen.RemoteNode, by_hand: Hand, lose: set[int]
) -> None:
    """The answer at the block's end names the last good segment; the client goes on after it."""
    image = program("line_slow")
    count = len(segments_of(image))
    assert count > 3 * SEGMENTS
    lost = places(lose, count)
    size = initiate_block(by_hand, len(image))
    assert send_blocks(by_hand, image, size, frozenset(lost)) == blocks_needed(count, lost)
    assert end_block(by_hand, image, xmodem(image))[0] == 0xA1
    assert is_active(controller, image)


def test_block_download_with_a_segment_lost_anywhere(
    controller: canopen.RemoteNode, by_hand: Hand
) -> None:
    image = program("line_tiny")
    count = len(segments_of(image))
    for place in (*range(0, count, 12), count - 2, count - 1):
        size = initiate_block(by_hand, len(image))
        blocks = send_blocks(by_hand, image, size, frozenset({place}))
        assert blocks == blocks_needed(count, {place}), place
        assert end_block(by_hand, image, xmodem(image))[0] == 0xA1, place
    assert is_active(controller, image)


def test_block_download_with_a_wrong_crc(controller: canopen.RemoteNode, by_hand: Hand) -> None:
    image = program("line_slow")
    send_blocks(by_hand, image, initiate_block(by_hand, len(image)))
    assert by_hand.aborted(end_block(by_hand, image, xmodem(image) ^ 1)) == CRC
    assert is_active(controller, program("line_tiny"))


def test_block_download_without_crc(controller: canopen.RemoteNode, by_hand: Hand) -> None:
    image = program("line_slow")
    send_blocks(by_hand, image, initiate_block(by_hand, len(image), crc=False))
    assert end_block(by_hand, image, 0)[0] == 0xA1
    assert is_active(controller, image)


def test_block_download_out_of_sequence(controller: canopen.RemoteNode, by_hand: Hand) -> None:
    initiate_block(by_hand, 2000)
    by_hand.send(b"\0" + bytes(7))
    assert by_hand.aborted(by_hand.answer()) == SEQUENCE
    assert is_active(controller, program("line_tiny"))


def test_block_download_of_more_than_announced(
    controller: canopen.RemoteNode, by_hand: Hand
) -> None:
    image = program("line_tiny")
    initiate_block(by_hand, 100)
    for number, data in enumerate(segments_of(image)[:126], start=1):
        by_hand.send(bytes([number]) + data)
    assert by_hand.aborted(by_hand.answer()) == TOO_LONG
    by_hand.silence()
    assert is_active(controller, image)


@pytest.mark.parametrize(("wrong", "code"), [(0, TOO_SHORT), (1, CRC)])
def test_block_download_of_less_than_announced(
    controller: canopen.RemoteNode, by_hand: Hand, wrong: int, code: int
) -> None:
    """The CRC is checked first."""
    image = program("line_tiny")
    begun = image[: SEGMENTS * 7]
    initiate_block(by_hand, 5000)
    for number, data in enumerate(segments_of(begun), start=1):
        by_hand.send(bytes([number | 0x80 * (number == SEGMENTS)]) + data)
    assert by_hand.answer()[:2] == b"\xa2\x7f"
    assert by_hand.aborted(end_block(by_hand, begun, xmodem(begun) ^ wrong)) == code
    by_hand.silence()
    assert is_active(controller, image)


@pytest.mark.parametrize("sent", [0, 1, 2, 50])
def test_a_client_aborts_in_mid_transfer(
    controller: canopen.RemoteNode, by_hand: Hand, sent: int
) -> None:
    image = program("line_slow")
    parts = segments_of(image)
    begun = by_hand.ask(b"\x21" + PROGRAM + struct.pack("<I", len(image)))
    assert begun[0] == 0x60
    for number in range(sent):
        assert by_hand.ask(bytes([number % 2 << 4]) + parts[number])[0] == 0x20 | number % 2 << 4
    by_hand.send(b"\x80" + PROGRAM + struct.pack("<I", 0x08000000))
    by_hand.silence()
    assert by_hand.aborted(by_hand.ask(bytes([sent % 2 << 4]) + parts[sent])) == COMMAND
    initiate_block(by_hand, len(image))
    for number in range(1, sent + 1):
        by_hand.send(bytes([number]) + parts[number - 1])
    by_hand.send(b"\x80" + PROGRAM + struct.pack("<I", 0x08000000))
    by_hand.silence()
    assert is_active(controller, program("line_tiny"))
    download(controller, image)
    assert is_active(controller, image)


def test_toggle_bits_that_do_not_toggle(controller: canopen.RemoteNode, by_hand: Hand) -> None:
    assert by_hand.ask(b"\x21" + PROGRAM + struct.pack("<I", 2000))[0] == 0x60
    assert by_hand.ask(b"\x00" + bytes(7))[0] == 0x20
    assert by_hand.aborted(by_hand.ask(b"\x00" + bytes(7))) == TOGGLE
    assert by_hand.ask(b"\x40" + NAME)[0] == 0x41
    assert by_hand.ask(b"\x60")[1:] == b"Hodogra"
    assert by_hand.aborted(by_hand.ask(b"\x60")) == TOGGLE
    assert by_hand.aborted(by_hand.ask(b"\x70")) == COMMAND
    assert is_active(controller, program("line_tiny"))


def awaits_timeout(by_hand: Hand, patience_s: float, since_s: float | None = None) -> None:
    """The server aborts after this time of silence, and says nothing more."""
    clock = by_hand.bus.clock
    begun_s = clock.now_s() if since_s is None else since_s
    assert by_hand.aborted(by_hand.answer(10.0)) == TIMEOUT
    assert clock.now_s() - begun_s == pytest.approx(patience_s, abs=TICK_S)
    by_hand.silence(3.0)


@pytest.mark.parametrize("sent", [0, 1, 2, 50])
def test_a_client_falls_silent_in_a_download(
    controller: canopen.RemoteNode, by_hand: Hand, sent: int
) -> None:
    """The server gives up by itself and is ready for the next transfer; so in all tests that follow."""
    assert by_hand.ask(b"\x21" + PROGRAM + struct.pack("<I", 2000))[0] == 0x60
    for number in range(sent):
        toggle = number % 2 << 4
        assert by_hand.ask(bytes([toggle]) + bytes(7))[0] == 0x20 | toggle
    awaits_timeout(by_hand, CONTROLLER_PATIENCE_S)
    assert is_active(controller, program("line_tiny"))


@pytest.mark.parametrize("taken", [0, 1, 2, 50])
def test_a_client_falls_silent_in_an_upload(
    controller: canopen.RemoteNode, by_hand: Hand, taken: int
) -> None:
    parts = segments_of(program("line_tiny"))
    assert by_hand.ask(b"\x40" + PROGRAM)[0] == 0x41
    for number in range(taken):
        toggle = number % 2 << 4
        assert by_hand.ask(bytes([0x60 | toggle])) == bytes([toggle]) + parts[number]
    awaits_timeout(by_hand, CONTROLLER_PATIENCE_S)
    assert is_active(controller, program("line_tiny"))


@pytest.mark.parametrize("sent", [1, 2, 50, 126])
def test_a_client_falls_silent_in_a_block_download(
    controller: canopen.RemoteNode, by_hand: Hand, sent: int
) -> None:
    """The block first gets its answer."""
    clock = by_hand.bus.clock
    initiate_block(by_hand, 2000)
    for number in range(1, sent + 1):
        by_hand.send(bytes([number]) + bytes(7))
    begun_s = clock.now_s()
    assert by_hand.answer(10.0)[:2] == bytes([0xA2, sent])
    transmission_s = 0.00014 * sent
    silent_s = clock.now_s() - begun_s - transmission_s
    assert silent_s == pytest.approx(CONTROLLER_PATIENCE_S / 2, abs=2 * TICK_S)
    awaits_timeout(by_hand, CONTROLLER_PATIENCE_S / 2)
    assert is_active(controller, program("line_tiny"))


@pytest.mark.parametrize("begun", [False, True])
def test_a_client_falls_silent_in_a_block_upload(
    controller: canopen.RemoteNode, by_hand: Hand, begun: bool
) -> None:
    assert by_hand.ask(b"\xa4" + PROGRAM + bytes([SEGMENTS]))[0] == 0xC6
    since_s = by_hand.bus.clock.now_s()  # the server hands over a block at once
    if begun:
        by_hand.send(b"\xa3")
        assert [by_hand.answer()[0] for _ in range(SEGMENTS)] == list(range(1, SEGMENTS + 1))
    awaits_timeout(by_hand, CONTROLLER_PATIENCE_S, since_s)
    assert is_active(controller, program("line_tiny"))


def test_a_client_that_lost_the_first_answer_may_begin_again(
    controller: canopen.RemoteNode, by_hand: Hand
) -> None:
    """The same object, and nothing moved yet; a client that asks for another one is a second client."""
    assert by_hand.ask(b"\x21" + PROGRAM + struct.pack("<I", 2000))[0] == 0x60
    assert abort_code(lambda: controller.sdo[0x1000].raw) == BUSY
    assert by_hand.ask(b"\xa4" + PROGRAM + b"\x7f")[0] == 0xC6
    by_hand.send(b"\x80" + PROGRAM + struct.pack("<I", TIMEOUT))
    by_hand.silence(0.01)
    assert controller.sdo[0x1000].raw == 0
    assert is_active(controller, program("line_tiny"))


@pytest.mark.parametrize("command", [0x00, 0x10, 0x60, 0x70, 0xA1, 0xA2, 0xA3, 0xC1, 0xE0, 0xFF])
def test_commands_that_begin_nothing(
    controller: canopen.RemoteNode, by_hand: Hand, command: int
) -> None:
    assert by_hand.aborted(by_hand.ask(bytes([command]) + PROGRAM)) == COMMAND
    assert controller.sdo[0x1000].raw == 0


@pytest.mark.parametrize("length", range(8))
def test_short_requests_are_no_requests(by_hand: Hand, length: int) -> None:
    by_hand.send((b"\x40" + NAME)[:length], length=length)
    by_hand.silence()


def test_expedited_without_a_size(hub: LocalHub, drive: canopen.RemoteNode) -> None:
    """The dictionary knows how many of the four bytes count (CiA 301, 7.2.4.3.3)."""
    with hand(hub, DRIVE) as by_hand:
        assert by_hand.ask(b"\x22" + object_bytes(0x6065, 0) + b"\1\2\3\4")[0] == 0x60
        assert by_hand.ask(b"\x22" + object_bytes(0x6066, 0) + b"\5\6\7\x08")[0] == 0x60
    assert drive.sdo[0x6065].raw == 0x04030201
    assert drive.sdo[0x6066].raw == 0x0605


def read_blocks(by_hand: Hand, size: int, lose: frozenset[int]) -> tuple[bytes, int]:
    """A block upload by hand that loses segments the first time; the bytes and the end's CRC."""
    answer = by_hand.ask(b"\xa4" + PROGRAM + bytes([size]))
    assert answer[:4] == b"\xc6" + PROGRAM
    total = struct.unpack_from("<I", answer, 4)[0]
    by_hand.send(b"\xa3")
    data, lost, last = b"", set(lose), False
    while not last:
        good, number = 0, 0
        while True:
            segment = by_hand.answer()
            number = segment[0] & 0x7F
            ended = bool(segment[0] & 0x80)
            position = len(data) // 7
            if number == good + 1 and position in lost:
                lost.discard(position)
            elif number == good + 1:
                data += segment[1:]
                good = number
                last = ended
            if ended or number == size:
                break
        by_hand.send(bytes([0xA2, good, size]))
    answer = by_hand.answer()
    assert answer[0] & 0xE3 == 0xC1, answer.hex(" ")
    assert not lost
    unused = answer[0] >> 2 & 7
    by_hand.send(b"\xa1")
    assert len(data) - unused == total
    return data[: len(data) - unused], struct.unpack_from("<H", answer, 1)[0]


@pytest.mark.parametrize("size", [1, 2, 7, 126, 127])
def test_block_upload_in_blocks_of_any_size(by_hand: Hand, size: int) -> None:
    image = program("line_tiny")
    assert read_blocks(by_hand, size, frozenset()) == (image, xmodem(image))


@pytest.mark.parametrize("lose", [{0}, {5}, {126}, {127}, {LAST}, {0, 100, LAST}], ids=str)
def test_block_upload_with_lost_segments(by_hand: Hand, lose: set[int]) -> None:
    """The server repeats from after the last good segment, and its CRC counts each byte once."""
    image = program("line_tiny")
    count = len(segments_of(image))
    assert count > SEGMENTS
    assert read_blocks(by_hand, SEGMENTS, frozenset(places(lose, count))) == (image, xmodem(image))


@pytest.mark.parametrize("size", [0, 128, 255])
def test_block_upload_with_impossible_blocks(by_hand: Hand, size: int) -> None:
    assert by_hand.aborted(by_hand.ask(b"\xa4" + PROGRAM + bytes([size]))) == BLOCK_SIZE


def test_block_upload_with_an_answer_beyond_the_block(by_hand: Hand) -> None:
    assert by_hand.ask(b"\xa4" + PROGRAM + b"\x04")[0] == 0xC6
    by_hand.send(b"\xa3")
    assert [by_hand.answer()[0] for _ in range(4)] == [1, 2, 3, 4]
    assert by_hand.aborted(by_hand.ask(b"\xa2\x05\x04")) == SEQUENCE


def test_a_late_client_finds_the_drive_ready(hub: LocalHub, drive: canopen.RemoteNode) -> None:
    """After the time-out the same dialogue works again."""
    with hand(hub, DRIVE) as by_hand:
        assert by_hand.ask(b"\x40" + NAME)[0] == 0x41
        awaits_timeout(by_hand, DRIVE_PATIENCE_S)
    assert drive.sdo[0x1008].raw == "Hodograph simulated drive"
