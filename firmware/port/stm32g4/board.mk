# SPDX-License-Identifier: MIT
# Adds the board NUCLEO-G474RE to the targets of `make firmware`: compiler flags, kernels, sources of its port, and the
# script of OpenOCD by which `make flash` finds it. Included by firmware/targets/targets.mk. Sets variables only.
BOARDS                += nucleo_g474re
nucleo_g474re_CPU     := $(an386_CPU) -DBOARD_NODE=$(NODE) -DBOARD_CAN_BITS_S=$(CAN_BITS_S)
nucleo_g474re_KERNELS := firmware/targets/kernels_float.c
nucleo_g474re_SRC     := $(wildcard firmware/port/stm32g4/*.c)
nucleo_g474re_OPENOCD := board/st_nucleo_g4.cfg
