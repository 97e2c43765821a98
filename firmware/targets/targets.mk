# SPDX-License-Identifier: MIT
# Makes the firmware for machines other than this one. Included by the Makefile. Writes build/firmware. A target is a
# core with its flags, a linker script of its name in this folder, and the folders of firmware/port that it is made
# from.
#
#   build/firmware/TARGET/IMAGE.elf

TARGETS := an385 an386 an500 an505 microbit rv32

an385_CPU    := -mcpu=cortex-m3 -mthumb
an386_CPU    := -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard
an500_CPU    := -mcpu=cortex-m7 -mthumb -mfpu=fpv5-sp-d16 -mfloat-abi=hard
an505_CPU    := -mcpu=cortex-m33 -mthumb -mfpu=fpv5-sp-d16 -mfloat-abi=hard
microbit_CPU := -mcpu=cortex-m0 -mthumb
rv32_CPU     := -march=rv32imc_zicsr -mabi=ilp32 -mno-relax -mcmodel=medany -fno-jump-tables
# The kernels that a target's images link: fixed, or with an FPU fixed and float (core/kernel.h).
$(foreach t,an386 an500 an505,$(eval $(t)_KERNELS := firmware/targets/kernels_float.c))
$(foreach t,an385 microbit rv32,$(eval $(t)_KERNELS := firmware/targets/kernels_fixed.c))
# Debian's libraries have no build for rv32imc: those for rv32im are linked.
rv32_LINK    := -march=rv32im -mabi=ilp32

# Boards to hold in one's hands. They have a port of their own, whose board.mk adds them here, and of the images the
# controller (docs/guides/port-to-your-board.md).
#   make firmware NODE=2 CAN_BITS_S=500000
BOARDS     :=
NODE       ?= 1
CAN_BITS_S ?= 1000000
include $(wildcard firmware/port/*/board.mk)

$(foreach t,$(TARGETS) $(BOARDS),$(eval $(t)_CROSS := $(if $(filter rv32,$(t)),riscv64-unknown-elf-,arm-none-eabi-)))
$(foreach t,$(TARGETS) $(BOARDS),$(eval $(t)_CORE := $(if $(filter rv32,$(t)),rv32,cortex_m)))

# An image is a main with what it is linked from besides core, canopen, app and the dictionary; the targets that it is
# for, where not all; kernels, where not the target's; and what tools/check_image.py has to allow.
IMAGES := setpoints setpoints_float controller isr taylor interrupted checker stop_checker
setpoints_MAIN := tests/target/setpoints.c
setpoints_SRC  := tests/target/commands.c tests/target/table.c tests/target/exit.c $(wildcard firmware/port/semihost/*.c)

# The float kernel where floats are a library's: IEEE single is the same everywhere, which the tests show. Not for use.
setpoints_float_MAIN    := $(setpoints_MAIN)
setpoints_float_SRC     := $(setpoints_SRC)
setpoints_float_TARGETS := an385 microbit rv32
setpoints_float_KERNELS := firmware/targets/kernels_float.c
setpoints_float_CHECK   := --soft-float

isr_MAIN := tests/target/isr.c
isr_SRC  := $(setpoints_SRC) tests/target/trouble.c

interrupted_MAIN    := tests/target/interrupted.c
interrupted_SRC     := tests/target/exit.c $(wildcard firmware/port/semihost/*.c)
interrupted_TARGETS := an386

taylor_MAIN    := tests/target/taylor.c
taylor_SRC     := tests/target/exit.c $(wildcard firmware/port/semihost/*.c)
taylor_TARGETS := an385 an386
taylor_CHECK   := --soft-float

checker_MAIN    := tests/target/checker.c
checker_SRC     := tests/target/exit.c tests/target/checked.c $(wildcard firmware/port/semihost/*.c)
checker_TARGETS := an386 microbit

stop_checker_MAIN    := tests/target/stop_checker.c
stop_checker_SRC     := $(checker_SRC)
stop_checker_TARGETS := an386

controller_MAIN    := firmware/app/main.c
controller_SRC     := $(wildcard firmware/port/mps2/*.c firmware/port/semihost/*.c firmware/port/common/*.c firmware/can/*.c)
controller_TARGETS := an385 an386 an500 an505 microbit $(BOARDS)

# The same bytes wherever the tree and its build lie (tests/system/test_firmware_bytes.py). So a copy of the tree
# keeps its objects, which these paths do not change.
TARGET_PATHS  := -ffile-prefix-map=$(abspath $(BUILD))=build -ffile-prefix-map=$(CURDIR)=.
TARGET_CFLAGS := -std=c99 $(WARN) -O2 -g -ffp-contract=off -ffunction-sections -fdata-sections -fno-common -fstack-usage -DNDEBUG $(INCLUDES) $(TARGET_PATHS)
TARGET_SRC    := $(filter-out %/kernels_all.c,$(core_SRC)) $(canopen_SRC) $(app_SRC) $(OD_C)

# What the tick runs: loops of fixed length unrolled. Measured: a quarter fewer instructions.
TICK_SRC := $(addprefix firmware/core/,kernel_fixed.c feed_piece.c interpolator.c feed_override.c program_clock.c override_plan.c override_ramp.c qmath.c) \
            firmware/app/machine/motion.c

# In one function with all that it calls, the check of the limits would be longer than a Cortex-M0 can jump, and it needs
# the most stack of all. So would be the SDO server.

target_object = $(patsubst %.c,$(BUILD)/firmware/$(1)/obj/%.o,$(patsubst $(BUILD)/%,%,$(2)))

define TARGET_RULES # target
$(call NOTE,$(BUILD)/firmware/$(1)/obj/flags,$($(1)_CROSS) $($(1)_CPU) $(filter-out $(TARGET_PATHS),$(TARGET_CFLAGS)))
$(BUILD)/firmware/$(1)/obj/generated/%.o: $(BUILD)/generated/%.c $(BUILD)/firmware/$(1)/obj/flags | $(OD_H) $(READY)/packages-firmware
	@mkdir -p $$(@D)
	$$(call say,$(1),$$<)
	$$(Q)$($(1)_CROSS)gcc --specs=picolibc.specs $($(1)_CPU) $$(TARGET_CFLAGS) $$(TICK_CFLAGS) -MMD -MP -c -o $$@ $$<
$(BUILD)/firmware/$(1)/obj/%.o: %.c $(BUILD)/firmware/$(1)/obj/flags | $(OD_H) $(READY)/packages-firmware
	@mkdir -p $$(@D)
	$$(call say,$(1),$$<)
	$$(Q)$($(1)_CROSS)gcc --specs=picolibc.specs $($(1)_CPU) $$(TARGET_CFLAGS) $$(TICK_CFLAGS) -MMD -MP -c -o $$@ $$<
$(call target_object,$(1),$(TICK_SRC) $(if $(findstring float,$($(1)_KERNELS)),firmware/core/kernel_float.c)): TICK_CFLAGS := -O3
$(call target_object,$(1),firmware/core/limit_check.c): TICK_CFLAGS := -Os
$(call target_object,$(1),firmware/canopen/sdo_server.c): TICK_CFLAGS := -Os -fno-inline-functions-called-once
$(BUILD)/firmware/$(1)/libhodograph.a: $(call target_object,$(1),$(TARGET_SRC)) $(BUILD)/firmware/$(1)/obj/list
	@rm -f $$@
	@$($(1)_CROSS)ar rcs $$@ $$(filter %.o,$$^)
$(call NOTE,$(BUILD)/firmware/$(1)/obj/list,$(TARGET_SRC))
-include $(patsubst %.o,%.d,$(call target_object,$(1),$(TARGET_SRC)))
endef
$(foreach t,$(TARGETS) $(BOARDS),$(eval $(call TARGET_RULES,$(t))))

# What each image is asked after it is linked: no heap, no double, no soft float, no 64-bit division of the compiler's
# library; a stack that fits.
IMAGE_CHECK := tools/check_image.py firmware/targets/stack.toml $(addprefix tools/analysis/,effects.py forbidden.py image.py stack.py)

# A board's linker script may lie in the folder of its port; an image that wants another memory has one of its own.
target_ld = $(firstword $(wildcard firmware/port/*/$(1).ld firmware/targets/$(1)_$(2).ld) firmware/targets/$(1).ld)
image_src = $($(2)_MAIN) $(or $($(1)_SRC),$($(2)_SRC)) $(or $($(2)_KERNELS),$($(1)_KERNELS)) $(wildcard firmware/port/$($(1)_CORE)/*.c)

define IMAGE_RULE # target, image
$(BUILD)/firmware/$(1)/$(2).elf: $(call target_object,$(1),$(image_src)) $(BUILD)/firmware/$(1)/libhodograph.a $(target_ld) $(wildcard firmware/targets/mps2.ld) firmware/port/$($(1)_CORE)/sections.ld $(IMAGE_CHECK) $(BUILD)/firmware/$(1)/$(2).list
	$$(call say,link,$$@)
	$$(Q)$($(1)_CROSS)gcc --specs=picolibc.specs $(or $($(1)_LINK),$($(1)_CPU)) -nostartfiles -Wl,--gc-sections -Wl,--fatal-warnings -Wl,-Map,$$(@:.elf=.map) \
	    -Lfirmware/port/$($(1)_CORE) -Lfirmware/targets -T$(target_ld) -o $$@ $$(filter %.o,$$^) $$(filter %.a,$$^)
	$$(Q)$(PYTHON) tools/check_image.py $($(2)_CHECK) $$@
$(call NOTE,$(BUILD)/firmware/$(1)/$(2).list,$(image_src) $($(2)_CHECK))
-include $(patsubst %.o,%.d,$(call target_object,$(1),$(image_src)))
endef
$(foreach i,$(IMAGES),$(foreach t,$(or $($(i)_TARGETS),$(TARGETS)),$(eval $(call IMAGE_RULE,$(t),$(i)))))

.PHONY: firmware
firmware: $(foreach i,$(IMAGES),$(foreach t,$(or $($(i)_TARGETS),$(TARGETS)),$(BUILD)/firmware/$(t)/$(i).elf)) ## the images for all microcontroller targets

BOARD ?= nucleo_g474re
.PHONY: flash
flash: $(BUILD)/firmware/$(BOARD)/controller.elf ## put the controller into a board that is plugged in (BOARD=nucleo_g474re NODE=1 CAN_BITS_S=1000000)
	@$(PYTHON) tools/packages.py flash
	@openocd -f $($(BOARD)_OPENOCD) -c "program $< verify reset exit" || { \
	    echo "flash: openocd does not reach a $(BOARD): is it plugged in, and may you use it? (docs/guides/flash-and-run.md)"; exit 1; }

UPDATE ?=
.PHONY: size
size: firmware ## code, data, RAM and worst stack of every image; what changed since the commit (UPDATE=1: written to firmware/targets/sizes.json)
	@$(PYTHON) tools/size.py --build $(BUILD) $(if $(UPDATE),--update)

# clang-tidy reads a port's files as the compiler of its core sees them.
PICOLIBC := /usr/lib/picolibc
bare_arm  := --target=thumbv7em-none-eabihf -mfpu=fpv4-sp-d16 -isystem $(PICOLIBC)/arm-none-eabi/include
bare_rv32 := --target=riscv32-none-elf -march=rv32imc -isystem $(PICOLIBC)/riscv64-unknown-elf/include
$(BARE_C:%=$(BUILD)/lint/%.tidy): $(BUILD)/lint/%.tidy: % $(OWN_H) .clang-tidy firmware/port/.clang-tidy $(OD_H) | $(READY)/packages-firmware $(VENV)/.ready
	@mkdir -p $(@D)
	$(call say,tidy,$<)
	$(Q)$(VENV)/bin/clang-tidy --quiet $< -- $(if $(findstring /rv32/,$<),$(bare_rv32),$(bare_arm)) -std=c99 $(INCLUDES) 2> $@.err || { cat $@.err; exit 1; }
	@touch $@
