# SPDX-License-Identifier: MIT
# NUCLEO-G474RE; included by firmware/targets/targets.mk.
BOARDS                += nucleo_g474re
nucleo_g474re_CPU     := $(an386_CPU) -DBOARD_NODE=$(NODE) -DBOARD_CAN_BITS_S=$(CAN_BITS_S)
nucleo_g474re_KERNELS := firmware/targets/kernels_float.c
nucleo_g474re_SRC     := $(wildcard firmware/port/stm32g4/*.c)
nucleo_g474re_OPENOCD := board/st_nucleo_g4.cfg
