# SPDX-License-Identifier: MIT
"""The check of linked images (tools/check_image.py) finds each kind of forbidden code, and its stack sizes agree with
those that the compiler reports. Run by pytest; starts compilers and `make`, reads build/firmware, and writes to
temporary folders.
"""

from __future__ import annotations

import re
import subprocess
from collections import Counter
from pathlib import Path

import pytest

import check_image
from analysis.forbidden import floats, forbidden
from analysis.image import Image
from analysis.stack import Rules, Stack, StackError, frame
from copied_tree import copied_tree

ROOT = Path(__file__).resolve().parents[2]
M0 = ("arm-none-eabi-gcc", "-mcpu=cortex-m0", "-mthumb")
M3 = ("arm-none-eabi-gcc", "-mcpu=cortex-m3", "-mthumb")
M4F = ("arm-none-eabi-gcc", "-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard")
RV32 = ("riscv64-unknown-elf-gcc", "-march=rv32imc", "-mabi=ilp32", "-fno-jump-tables")
CORES = [M0, M3, M4F, RV32]
CLEAN = "unsigned f(unsigned a, int b) { return a / 3u * (unsigned)b; }"
LONG = "long long f(long long a, long long b) { return "
HEAP = "#include <stdlib.h>\nvoid *f(unsigned n) { void *p = "


def compiled(folder: Path, core: tuple[str, ...], source: str) -> Image:
    """Compiles a source to an object file."""
    (folder / "x.c").write_text(source)
    command = [*core, "--specs=picolibc.specs", "-std=c99", "-O1", "-c", "-o"]
    subprocess.run([*command, folder / "x.o", folder / "x.c"], check=True)
    return Image(folder / "x.o")


def linked(folder: Path, core: tuple[str, ...], source: str) -> Image:
    """An image that begins with startup_reset() and has 256 bytes of stack."""
    (folder / "x.c").write_text(source)
    words = [*core, "-std=c99", "-O1", "-fno-inline", "-fno-optimize-sibling-calls", "-nostdlib"]
    words += ["-Wl,-e,startup_reset,--defsym=startup_stack_bottom=0x20000000"]
    words += ["-Wl,--defsym=startup_stack_top=0x20000100", "-o", str(folder / "x.elf")]
    subprocess.run([*words, folder / "x.c"], check=True)
    return Image(folder / "x.elf")


@pytest.mark.parametrize("core", CORES, ids=lambda core: core[1])
@pytest.mark.parametrize(
    ("kind", "source"),
    [
        (None, CLEAN),
        ("heap", HEAP + "malloc(n); return p; }"),
        ("heap", HEAP + "calloc(n, n); return p; }"),
        ("heap", HEAP + "realloc(0, n); return p; }"),
        ("heap", "#include <stdlib.h>\nvoid f(void *p) { free(p); }"),
        ("double", "double f(double a, double b) { return a + b; }"),
        ("double", "double f(double a, double b) { return a * b / 3.0; }"),
        ("double", "int f(double a, double b) { return a < b; }"),
        ("double", "double f(int a) { return a; }"),
        ("double", "unsigned long long f(double a) { return (unsigned long long)a; }"),
        ("double", "double f(float a) { return a; }"),
        ("double", "#include <math.h>\ndouble f(double a) { return sin(a); }"),
        ("64-bit division", LONG + "a / b; }"),
        ("64-bit division", LONG + "a % b; }"),
        ("64-bit division", LONG + "(long long)((unsigned long long)a / (unsigned)b); }"),
        ("64-bit division", LONG + "(long long)((unsigned long long)a % (unsigned)b); }"),
    ],
)
def test_classes(tmp_path: Path, core: tuple[str, ...], kind: str | None, source: str) -> None:
    found = forbidden(compiled(tmp_path, core, source))
    assert kind in found if kind else found == {}


@pytest.mark.parametrize("core", [M0, M3, RV32], ids=lambda core: core[1])
@pytest.mark.parametrize(
    "expression",
    [
        "float f(float a, float b) { return a + b; }",
        "float f(float a, float b) { return a - b / a; }",
        "int f(float a, float b) { return a > b; }",
        "int f(float a) { return (int)a; }",
        "float f(unsigned a) { return (float)a; }",
    ],
)
def test_soft_float(tmp_path: Path, core: tuple[str, ...], expression: str) -> None:
    assert list(forbidden(compiled(tmp_path, core, expression))) == ["soft float"]


def test_float_with_an_fpu(tmp_path: Path) -> None:
    assert forbidden(compiled(tmp_path, M4F, "float f(float a, int b) { return a * b; }")) == {}
    wide = "float f(long long a) { return (float)a; }"
    assert "soft float" in forbidden(compiled(tmp_path, M4F, wide))


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("int f(int a) { return (int)((float)a * 1.5f); }", ["f"]),
        ("unsigned f(unsigned a) { return (unsigned)(float)a; }", ["f"]),
        ("int f(float a, float b) { return a < b; }", ["f"]),
        ("float f(float a) { return -a; }", ["f"]),
        ("float f(void) { return 1.0f; }", ["f"]),
        ("float f(float a, float b) { return b; }", ["f"]),
        ("float kernel_float_f(float a, float b) { return a + b; }", []),
        ("struct s { long long a[4]; }; void f(struct s *p, const struct s *q) { *p = *q; }", []),
        ("void f(long long *p, const long long *q) { p[1] = q[0]; p[0] = q[1]; }", []),
        (CLEAN, []),
    ],
)
def test_floats_outside_the_float_kernel(tmp_path: Path, source: str, found: list[str]) -> None:
    assert floats(compiled(tmp_path, M4F, source)) == found


def test_a_float_in_the_fixed_kernel_fails_the_build(tmp_path: Path) -> None:
    tree = copied_tree(tmp_path, "an386")
    kernel = tree / "firmware/core/kernel_fixed.c"
    body = re.compile(r"(\bkernel_fixed_segment_at\([^)]*\)\n\{\n)")
    planted, count = body.subn(
        r"\1    volatile float planted = 1.5f;\n    planted *= 2.0f;\n", kernel.read_text()
    )
    assert count == 1
    kernel.write_text(planted)
    words = ["make", "build/firmware/an386/setpoints.elf"]
    built = subprocess.run(words, cwd=tree, capture_output=True, text=True, check=False)
    assert built.returncode != 0
    assert "float: kernel_fixed_segment_at (" in built.stdout
    assert not (tree / words[1]).exists()


TAKE = "__attribute__((noinline)) static int take(volatile char *p) { return p[3]; }\n"
DEEP = TAKE + "int deep(void) { volatile char c[100]; c[3] = 1; return take(c) + 1; }\n"
RESET = "void startup_reset(void) { volatile int x = deep(); (void)x; for (;;) { } }\n"


@pytest.mark.parametrize("core", CORES, ids=lambda core: core[1])
def test_stack_of_calls(tmp_path: Path, core: tuple[str, ...]) -> None:
    stack = Stack(linked(tmp_path, core, DEEP + RESET), Rules())
    assert 100 < stack.bytes < 180
    assert stack.room == 256
    assert stack.parts["main"].path[:2] == ("startup_reset", "deep")


@pytest.mark.parametrize("core", CORES, ids=lambda core: core[1])
def test_stack_that_does_not_fit(tmp_path: Path, core: tuple[str, ...]) -> None:
    image = linked(tmp_path, core, DEEP.replace("100", "1000") + RESET)
    assert any("bytes needed, 256 there" in text for text in check_image.breaches(image, Rules()))


@pytest.mark.parametrize("core", CORES, ids=lambda core: core[1])
def test_recursion(tmp_path: Path, core: tuple[str, ...]) -> None:
    source = "int deep(void); int other(void) { return deep() + 1; }\n"
    source += "int deep(void) { return other() + 1; }\n" + RESET
    with pytest.raises(StackError, match="recursion: deep -> other -> deep"):
        _ = Stack(linked(tmp_path, core, source), Rules()).bytes


@pytest.mark.parametrize("core", CORES, ids=lambda core: core[1])
def test_pointers(tmp_path: Path, core: tuple[str, ...]) -> None:
    source = DEEP.replace("deep", "shown") + "int (*volatile pointer)(void) = shown;\n"
    source += "int deep(void) { return pointer() + 1; }\n" + RESET
    image = linked(tmp_path, core, source)
    with pytest.raises(StackError, match=r"deep calls through a pointer"):
        _ = Stack(image, Rules()).bytes
    assert Stack(image, Rules({"deep": ["shown"]})).bytes > 100


@pytest.mark.parametrize("core", CORES, ids=lambda core: core[1])
def test_stack_of_a_size_that_nobody_knows(tmp_path: Path, core: tuple[str, ...]) -> None:
    source = "void use(volatile char *p) { p[0] = 1; }\n"
    source += "int deep(void) { volatile int n = 3; volatile char c[n]; use(c); return c[0]; }\n"
    with pytest.raises(StackError, match="cannot judge"):
        _ = Stack(linked(tmp_path, core, source + RESET), Rules()).bytes


def test_frames_are_those_of_the_compiler() -> None:
    """-fstack-usage leaves out up to 8 bytes of arguments that a function stores beside its caller's."""
    compared = 0
    for name in ("an386/controller.elf", "microbit/setpoints.elf", "rv32/setpoints.elf"):
        file = ROOT / "build" / "firmware" / name
        image = Image(file)
        names = Counter(function.name for function in image.functions)
        usage = _usage(file.parent / "obj")
        for function in image.functions:
            said = usage.get(function.name, [])
            if names[function.name] == len(said) == 1:
                compared += 1
                more = frame(image, function).most - said[0]
                assert more in (0, 8), (file, function.name)
                assert more == 0 or not image.is_riscv
    assert compared > 500


def _usage(folder: Path) -> dict[str, list[int]]:
    usage: dict[str, list[int]] = {}
    for file in folder.rglob("*.su"):
        for line in file.read_text().splitlines():
            place, size, _ = line.split("\t")
            usage.setdefault(place.split(":")[-1], []).append(int(size))
    return usage
