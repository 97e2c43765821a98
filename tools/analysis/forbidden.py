# SPDX-License-Identifier: MIT
"""Forbidden content of images: functions of libraries, by name, and float instructions outside the float kernel. Used
by tools/check_image. No I/O but that of `analysis/image`.
"""

from __future__ import annotations

import re

from analysis.image import Image

_OPERATIONS = "add|sub|rsub|mul|div|neg|pow|sqrt|eq|ne|lt|le|gt|ge|unord|cmp"

# Class of what is forbidden: why, and the names.
CLASSES: dict[str, tuple[str, re.Pattern[str]]] = {
    "heap": (
        "all memory is allotted when the image is linked",
        re.compile(
            r"_*(m|c|re|v|pv)alloc(_r|_usable_size)?|_*free(_r)?|_*sbrk(_r)?|reallocf|"
            r"(aligned|posix_mem)_?(alloc|align)|memalign|reallocarray|strn?dup"
        ),
    ),
    "double": (
        "double arithmetic is for the host",
        re.compile(
            rf"__aeabi_(d.*|cd.*|f2d|u?i2d|u?l2d)|__({_OPERATIONS})df[23]|__fix(uns)?df[sdt]i|"
            r"__float(un)?[sdt]idf|__extend(sf|hf)df2|__trunc(df[sh]f2|tfdf2)|__powidf2|"
            r"(sqrt|sin|cos|tan|atan2?|exp|log|pow|floor|ceil|fmod|round|trunc|fabs|ldexp|frexp)"
        ),
    ),
    "64-bit division": (
        "its time depends on the operands: use core/qmath.h",
        re.compile(r"__aeabi_u?ldivmod|__u?(div|mod|divmod)di[34]"),
    ),
    "soft float": (
        "float is for targets with an FPU",
        re.compile(
            rf"__aeabi_(f(add|sub|rsub|mul|div|cmp.*|2.*)|cf.*|d2f|u?i2f|u?l2f)|__({_OPERATIONS})sf[23]|"
            r"__fix(uns)?sf[sdt]i|__float(un)?[sdt]isf|__powisf2|"
            r"(sqrt|sin|cos|tan|atan2?|exp|log|pow|floor|ceil|fmod|round|trunc|fabs|ldexp|frexp)f"
        ),
    ),
}

FLOAT = "float"
WHY_FLOAT = (
    "floats are for core/kernel_float alone: the fixed kernel and all around it are integers"
)
_FLOAT_KERNEL = re.compile(r"kernel_float_\w+")
# Thumb's VFP; not vldr, vstr, vmov, vpush, ... without a type, by which the compiler copies integers as well.
_FLOAT_ARITHMETIC = re.compile(r"v[a-z]+\.(?:[a-z]\d+\.)?f(?:16|32|64)(?:\.[a-z]\d+)?")


def floats(image: Image) -> list[str]:
    """Functions with an instruction that computes with floats, except those of the float kernel."""
    return sorted(
        {
            function.name
            for function in image.functions
            if not _FLOAT_KERNEL.fullmatch(function.name)
            and any(_FLOAT_ARITHMETIC.fullmatch(i.mnemonic) for i in function.instructions)
        }
    )


def forbidden(image: Image) -> dict[str, list[str]]:
    """Class and names of what an image (or an object) has and may not have."""
    found = {
        kind: [name for name in sorted(image.symbols) if pattern.fullmatch(name)]
        for kind, (_, pattern) in CLASSES.items()
    }
    return {kind: names for kind, names in found.items() if names}
