# SPDX-License-Identifier: MIT
"""libhodograph as others use it: the example built from the installed files, the promised interface, modules. Run by
pytest; starts dist/install.py, compilers, CMake, `hodograph` and the programs built, and writes to temporary folders.
"""

from __future__ import annotations

import csv
import re
import sys
from pathlib import Path

import pytest

from dist.abi import differences, exported
from dist.library import PREFIX, Abi, make_library, version
from dist.program_page import PURPOSE, program_page
from hodograph.native import NativeProgram
from subprocesses import run

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = ROOT / "build/library"
ALPHA = ROOT / "examples/alpha.toml"
DAMAGED = "broken_backwards.hdgp"
STRICT = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Werror")


def place(action: str, prefix: Path, *options: object) -> None:
    script = ROOT / "tools/dist/install.py"
    run(sys.executable, script, action, "--build", ROOT / "build", "--prefix", prefix, *options)


def files(folder: Path) -> dict[str, str]:
    """Every file below a folder: its text, or where a link leads."""
    return {
        path.relative_to(folder).as_posix(): str(path.readlink())
        if path.is_symlink()
        else path.read_bytes().decode("latin-1")
        for path in sorted(folder.rglob("*"))
        if path.is_symlink() or path.is_file()
    }


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("installed")
    place("install", folder)
    return folder


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library's folder, as `make library` makes it."""
    folder = tmp_path_factory.mktemp("library")
    make_library(folder)
    return folder


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """The image of the alpha, and the setpoints that `hodograph simulate` gives."""
    folder = tmp_path_factory.mktemp("simulated")
    image, trace = folder / "alpha.hdgp", folder / "alpha.csv"
    run(sys.executable, "-m", "hodograph", "compile", ALPHA, "-o", image)
    run(sys.executable, "-m", "hodograph", "simulate", ALPHA, "--trace", trace)
    with trace.open(encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    return image, [f"{row['x_set_counts']} {row['y_set_counts']}" for row in rows]


def check_example(program: Path, simulated: tuple[Path, list[str]], *launcher: object) -> None:
    """It prints the setpoints, and refuses a damaged image with one message."""
    image, setpoints = simulated
    assert len(setpoints) > 1000
    assert run(*launcher, program, image).stdout.splitlines() == setpoints
    refused = run(*launcher, program, ROOT / "tests/data/programs" / DAMAGED, status=1)
    assert refused.stdout == ""
    assert re.fullmatch(r"refused at \d+: .*\n", refused.stderr)
    run(*launcher, program, "no-such-file", status=2)


@pytest.mark.parametrize("linked", ["shared", "static"])
def test_example_by_pkg_config(
    linked: str, prefix: Path, simulated: tuple[Path, list[str]], tmp_path: Path
) -> None:
    libraries = prefix / "lib"
    asked = ["env", f"PKG_CONFIG_PATH={libraries / 'pkgconfig'}", "pkg-config"]
    run(*asked, "--validate", "hodograph")
    assert run(*asked, "--modversion", "hodograph").stdout.strip() == version()
    options = run(*asked, "--cflags", "--libs", "hodograph").stdout.split()
    if linked == "static":
        options = [str(libraries / "libhodograph.a") if o == "-lhodograph" else o for o in options]
    source = prefix / "share/hodograph/examples/embed/setpoints.c"
    program = tmp_path / "setpoints"
    run("cc", "-std=c99", *STRICT, source, *options, "-o", program)
    check_example(program, simulated, "env", f"LD_LIBRARY_PATH={libraries}")
    needed = re.findall(r"NEEDED\s+(\S+)", run("objdump", "-p", program).stdout)
    assert (f"libhodograph.so.{Abi.read().number}" in needed) == (linked == "shared")


def test_example_by_its_makefile(
    prefix: Path, simulated: tuple[Path, list[str]], tmp_path: Path
) -> None:
    for name in ("Makefile", "setpoints.c"):
        (tmp_path / name).write_bytes(
            (prefix / "share/hodograph/examples/embed" / name).read_bytes()
        )
    run("env", "-u", "MAKEFLAGS", f"PKG_CONFIG_PATH={prefix}/lib/pkgconfig", "make", cwd=tmp_path)
    check_example(tmp_path / "setpoints", simulated, "env", f"LD_LIBRARY_PATH={prefix}/lib")


@pytest.mark.parametrize("static", ["OFF", "ON"])
def test_example_by_cmake(
    static: str, prefix: Path, simulated: tuple[Path, list[str]], tmp_path: Path
) -> None:
    source = prefix / "share/hodograph/examples/embed"
    settings = [f"-DCMAKE_PREFIX_PATH={prefix}", f"-DSTATIC={static}"]
    run("cmake", "-S", source, "-B", tmp_path, *settings)
    run("cmake", "--build", tmp_path)
    check_example(tmp_path / "setpoints", simulated)


@pytest.mark.parametrize(
    ("asked", "found"), [("0.1", True), (version(), True), ("0.0", False), ("1.0", False)]
)
def test_cmake_takes_a_version_that_serves(
    asked: str, found: bool, prefix: Path, tmp_path: Path
) -> None:
    """Below 1.0 another minor version is another interface."""
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.13)\nproject(asks NONE)\n"
        f"find_package(hodograph {asked} REQUIRED)\n"
    )
    run(
        "cmake",
        *("-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={prefix}"),
        status=0 if found else 1,
    )


@pytest.mark.parametrize("standard", ["c++11", "c++20"])
def test_from_cpp(standard: str, prefix: Path, tmp_path: Path) -> None:
    """All of the header, without a warning, and what it promises at run time."""
    source = tmp_path / "program.cpp"
    source.write_text(
        "#include <hodograph.h>\n#include <cstdio>\n"
        "int main()\n{\n    struct program program = {};\n"
        "    const int error = program_open(&program, nullptr, 0);\n"
        '    std::printf("%d %s %s\\n", error, program_error_text(error), HODOGRAPH_VERSION);\n'
        "    return counts_from_q40_mm((int64_t)3 << 40, 1000) == 3000 ? 0 : 1;\n}\n"
    )
    program = tmp_path / "program"
    options = [f"-I{prefix}/include", f"-L{prefix}/lib", "-lhodograph", f"-Wl,-rpath,{prefix}/lib"]
    run("g++", f"-std={standard}", *STRICT, source, *options, "-o", program)
    reported = run(program).stdout.split()
    assert reported[0] == "-1"
    assert reported[-1] == version()


def test_each_program_has_a_man_page(prefix: Path) -> None:
    """With all that its --help says, and nothing that mandoc calls an error."""
    programs = sorted((prefix / "bin").iterdir())
    assert [program.name for program in programs] == sorted(PURPOSE)
    for program in programs:
        page = prefix / f"share/man/man1/{program.name}.1"
        assert run("mandoc", "-Tlint", "-W", "error", page).stdout == ""
        shown = run("mandoc", "-Tutf8", "-O", "width=200", page).stdout
        words = re.sub(r".\x08", "", shown).split()
        help_words = run(program, "--help").stdout.removeprefix("usage:").split()
        assert set(help_words) <= set(words), program


def test_a_program_for_another_processor_has_no_page(tmp_path: Path) -> None:
    program = tmp_path / "hodograph-hub"
    program.write_bytes(b"\x7fELF of another kind")
    program.chmod(0o755)
    assert program_page(program, "1") is None


def test_install_below_destdir_and_away_again(prefix: Path, tmp_path: Path) -> None:
    """The same files as without, but for the prefix that they name; what is somebody else's stays."""
    root = tmp_path / "root"
    place("install", Path("/usr"), "--destdir", root)
    place("install", Path("/usr"), "--destdir", root)
    own, other = files(prefix), files(root / "usr")
    assert own.keys() == other.keys()
    assert [name for name in own if own[name] != other[name]] == ["lib/pkgconfig/hodograph.pc"]
    assert not [name for name, text in other.items() if str(tmp_path) in text]
    foreign = root / "usr/include/hodograph/foreign.h"
    foreign.write_text("")
    place("uninstall", Path("/usr"), "--destdir", root)
    assert list(files(root)) == ["usr/include/hodograph/foreign.h"]


def test_install_for_debian(tmp_path: Path, simulated: tuple[Path, list[str]]) -> None:
    """LIBDIR elsewhere, and a tree that is moved after that: CMake finds it where it is."""
    libraries = "/usr/lib/x86_64-linux-gnu"
    place("install", Path("/usr"), "--destdir", tmp_path / "a", "--libdir", libraries)
    (tmp_path / "a/usr").rename(tmp_path / "moved")
    moved = tmp_path / "moved"
    source = moved / "share/hodograph/examples/embed"
    config = moved / "lib/x86_64-linux-gnu/cmake/hodograph"
    run("cmake", "-S", source, "-B", tmp_path / "build", f"-Dhodograph_DIR={config}")
    run("cmake", "--build", tmp_path / "build")
    check_example(tmp_path / "build/setpoints", simulated)


def test_a_prefix_with_spaces(tmp_path: Path, simulated: tuple[Path, list[str]]) -> None:
    """By make, and found there by pkg-config from the example's Makefile."""
    prefix = tmp_path / "a prefix"
    make = ("env", "-u", "MAKEFLAGS", "make", "--no-print-directory", "-C", ROOT)
    run(*make, "-o", "c", "-o", "library", "install", f"PREFIX={prefix}")
    (prefix / "share/hodograph/examples/embed").rename(tmp_path / "embed")
    found = f"PKG_CONFIG_PATH={prefix}/lib/pkgconfig"
    run("env", "-u", "MAKEFLAGS", found, "make", cwd=tmp_path / "embed")
    check_example(tmp_path / "embed/setpoints", simulated, "env", f"LD_LIBRARY_PATH={prefix}/lib")
    removed = run(*make, "-o", "c", "-o", "library", "uninstall", f"PREFIX={prefix}")
    assert re.match(r"uninstalled \d\d files", removed.stdout)
    assert not files(prefix)


def test_a_place_that_cannot_be_written_is_one_message(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    script = ROOT / "tools/dist/install.py"
    words = ("install", "--build", ROOT / "build", "--prefix", tmp_path / "file")
    refused = run(sys.executable, script, *words, status=1).stderr
    assert refused == f"{tmp_path}/file/lib: Not a directory\n"


def test_relative_prefix_is_refused() -> None:
    script = ROOT / "tools/dist/install.py"
    words = ("install", "--build", "build", "--prefix", "usr/local")
    assert "absolute" in run(sys.executable, script, *words, status=2).stderr


def test_only_the_public_names_are_exported() -> None:
    assert differences(LIBRARY, Abi.read()) == []


def test_a_change_of_the_interface_is_found() -> None:
    """Of a name, of a struct, of the number."""
    abi = Abi.read()
    lost = Abi(abi.number, abi.functions[1:], abi.sizes)
    assert differences(LIBRARY, lost) == [f"exported, not in the list: {abi.functions[0]}"]
    more = Abi(abi.number, [*abi.functions, "program_close"], abi.sizes)
    assert differences(LIBRARY, more) == ["in the list, not exported: program_close"]
    sizes = abi.sizes | {"program_fault": abi.sizes["program_fault"] + 8}
    assert len(differences(LIBRARY, Abi(abi.number, abi.functions, sizes))) == 1
    assert len(differences(LIBRARY, Abi(abi.number + 1, abi.functions, abi.sizes))) == 1


def test_the_manual_names_public_functions_only() -> None:
    """What the manual's list of calls names is in the list of the interface, or inline."""
    manual = (ROOT / "firmware/core/hodograph.h").read_text(encoding="utf-8")
    listed = manual.partition("## What to call")[2].partition("## Context")[0]
    named = set(
        re.findall(r"\b((?:program|kernel|coefficients|interpolator|feed|counts)\w*_\w+)\b", listed)
    )
    assert len(named) > 10
    assert named - set(Abi.read().functions) <= {"counts_from_q40_mm", "feed_override"}


def test_every_name_has_the_prefix() -> None:
    """So that the static library can be linked with anything."""
    lines = run("nm", "-g", "--defined-only", LIBRARY / "libhodograph.a").stdout.splitlines()
    names = [line.split()[2] for line in lines if len(line.split()) == 3]
    assert len(names) > len(exported(LIBRARY / f"libhodograph.so.{version()}"))
    assert [name for name in names if not name.startswith(PREFIX)] == []


def test_no_library_is_needed_but_that_of_c() -> None:
    needed = run("objdump", "-p", LIBRARY / f"libhodograph.so.{version()}").stdout
    assert re.findall(r"NEEDED\s+(\S+)", needed) in ([], ["libc.so.6"])


def test_the_folder_of_the_library_is_made_anew(library: Path, tmp_path: Path) -> None:
    """What does not belong there goes, and files that are as they should be keep their times."""
    make_library(tmp_path)
    before = (tmp_path / "src/hodograph/program.c").stat().st_mtime_ns
    (tmp_path / "src/old").mkdir()
    (tmp_path / "src/old/gone.c").write_text("")
    make_library(tmp_path)
    assert not (tmp_path / "src/old").exists()
    assert (tmp_path / "src/hodograph/program.c").stat().st_mtime_ns == before
    assert files(tmp_path) == files(library)


ARDUINO = """
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
struct Port {
    void begin(long) {}
    void print(int value) { std::printf("%d", value); }
    void print(char value) { std::putchar(value); }
    void println(int value) { std::printf("%d\\n", value); }
    void println(const char *text) { std::puts(text); std::exit(1); }
};
static Port Serial;
static uint32_t now_us;
static uint32_t micros() { return now_us += 100; }
static void delay(long) {}
"""


def test_arduino_sketch(library: Path, tmp_path: Path) -> None:
    """The sketch, as C++ on this computer with a stand-in for the board: twice the program."""
    sketch = library / "examples/Setpoints/Setpoints.ino"
    image = (ROOT / "tests/data/programs/alpha_quintic.hdgp").read_bytes()
    _, wanted = NativeProgram(image).setpoints("fixed", 1_000_000)
    (tmp_path / "main.cpp").write_text(
        f'{ARDUINO}#include "{sketch}"\n'
        "int main() { setup(); "
        f"for (int i = 0; i < {2 * len(wanted)}; i++) loop(); return 0; }}\n"
    )
    folder = sorted((library / "src/hodograph").glob("*.c"))
    for source in folder:
        run("gcc", "-O2", "-ffp-contract=off", f"-I{library}/src", "-c", source, cwd=tmp_path)
    objects = [tmp_path / f"{source.stem}.o" for source in folder]
    program = tmp_path / "sketch"
    run("g++", "-std=gnu++17", f"-I{library}/src", tmp_path / "main.cpp", *objects, "-o", program)
    lines = [f"{x} {y}" for x, y in wanted.tolist()]
    assert run(program).stdout.splitlines() == lines * 2


def test_arduino_properties(library: Path) -> None:
    """The fields that the Arduino library specification asks for, and the folder layout of its format 1.5."""
    text = (library / "library.properties").read_text(encoding="utf-8")
    fields = dict(line.split("=", 1) for line in text.splitlines())
    required = {"name", "version", "author", "maintainer", "sentence", "paragraph", "category"}
    assert required | {"url", "architectures", "includes"} == set(fields)
    assert fields["version"] == version()
    assert fields["category"] == "Device Control"
    assert (library / "src" / fields["includes"]).exists()
    (sketch,) = (library / "examples").rglob("*.ino")
    assert sketch.stem == sketch.parent.name


ZEPHYR = """
cmake_minimum_required(VERSION 3.20)
project(stand_in C)
macro(zephyr_library_named name)
  add_library(${name} STATIC)
  set(current ${name})
endmacro()
function(zephyr_library_sources)
  target_sources(${current} PRIVATE ${ARGN})
endfunction()
function(zephyr_include_directories)
  target_include_directories(${current} PUBLIC ${ARGN})
endfunction()
function(zephyr_library_compile_options)
  target_compile_options(${current} PRIVATE ${ARGN})
endfunction()
function(zephyr_library_compile_definitions)
  target_compile_definitions(${current} PRIVATE ${ARGN})
endfunction()
set(CONFIG_HODOGRAPH y)
add_subdirectory(@MODULE@ module)
add_executable(setpoints @EXAMPLE@)
target_link_libraries(setpoints hodograph)
"""


@pytest.mark.parametrize("kernels", [(), ("FLOAT", "DOUBLE")])
def test_zephyr_module(
    kernels: tuple[str, ...], library: Path, simulated: tuple[Path, list[str]], tmp_path: Path
) -> None:
    """Its CMakeLists.txt, with stand-ins for the few functions of Zephyr that it calls."""
    text = ZEPHYR.replace("@MODULE@", str(library / "zephyr"))
    text = text.replace("@EXAMPLE@", str(library / "examples/setpoints.c"))
    (tmp_path / "CMakeLists.txt").write_text(text)
    chosen = [f"-DCONFIG_HODOGRAPH_KERNEL_{kernel}=y" for kernel in kernels]
    run("cmake", "-S", tmp_path, "-B", tmp_path / "build", *chosen)
    run("cmake", "--build", tmp_path / "build")
    check_example(tmp_path / "build/setpoints", simulated)
    names = run("nm", tmp_path / "build/setpoints").stdout
    assert (f"{PREFIX}kernel_double_segment_at" in names) == ("DOUBLE" in kernels)
