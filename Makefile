# SPDX-License-Identifier: MIT
# Every entry point of Hodograph; `make help` lists them. Run by hand, by .ci/run and by tests.
#
# Sources are found by wildcard, so a new file needs no line here. All output is under build/ (BUILD=...
# to change), except .venv and the cffi module, which Python has to find beside its package.
#
# C is built in variants, each with its own objects and archives:
#   build/host    the compiler of the host (CC), optimised: what runs
#   build/asan    the same under the address and undefined-behaviour sanitizers: what is tested
#   build/clang   clang, optimised: a second opinion, compiled by `make lint`
#   build/fuzz    clang, under both sanitizers, with coverage for libFuzzer: `make fuzz`

SHELL       := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.SUFFIXES:
MAKEFLAGS   += --no-builtin-rules -j$(shell nproc)
.DEFAULT_GOAL := build

BUILD  ?= build
PYTHON ?= python3
CC     := $(if $(filter default undefined,$(origin CC)),gcc,$(CC))
CLANG  ?= clang
READY  := $(BUILD)/stamps

# What was proved or counted once is not proved or counted again while nothing it depends on has changed (docs/validation/testing.md).
# STAMPS=off: it is.
STAMPS ?= on
stamps_option = $(if $(filter off,$(STAMPS)),--no-stamps)

define newline


endef

# V=1 shows the commands, else one short line for each file.
Q   := $(if $(V),,@)
say  = $(if $(V),,@printf '  %-6s %s\n' '$(1)' '$(2)')
VENV   := .venv
PY     := $(VENV)/bin/python

# A .venv that was made in another place (a moved or copied tree) is of no use: make it again.
# (By the shell throughout: make remembers what a folder held when it first looked.)
$(shell [ ! -e $(VENV)/.ready ] || [ "$$(cat $(VENV)/.ready)" = "$(CURDIR)" ] || rm -f $(VENV)/.ready)

## ---- what there is ---------------------------------------------------------------------------

OD_NAMES := $(if $(wildcard firmware/app/controller.eds),controller) $(if $(wildcard sim/node/drive.eds),drive) $(if $(wildcard sim/node/module.eds),module)
OD_C     := $(OD_NAMES:%=$(BUILD)/generated/od_%.c)
OD_H     := $(OD_NAMES:%=$(BUILD)/generated/od_%.h)

LIBS        := app node injector bridge hub faults port mps2 stm32g4 canopen can sim core numerics od
core_SRC    := $(wildcard firmware/core/*.c)
canopen_SRC := $(wildcard firmware/canopen/*.c)
sim_SRC     := $(wildcard sim/plant/*.c sim/offline/*.c)
numerics_SRC := $(wildcard host_tools/numerics/*.c)
app_SRC     := $(filter-out %/main.c,$(wildcard firmware/app/*.c firmware/app/*/*.c))
port_SRC    := $(filter-out %/main.c,$(wildcard firmware/port/linux/*.c firmware/port/common/*.c))
node_SRC    := $(filter-out %/main.c,$(wildcard sim/node/*.c))
faults_SRC  := $(wildcard sim/faults/*.c)
injector_SRC := $(filter-out %/main.c,$(wildcard sim/injector/*.c))
bridge_SRC  := $(filter-out %/main.c,$(wildcard sim/gateway/*.c))
hub_SRC     := $(filter-out %/main.c,$(wildcard sim/hub/*.c))
can_SRC     := $(wildcard firmware/can/*.c)
mps2_SRC    := $(wildcard firmware/port/mps2/command_line.c)
# Without what is the core's own: tests stand in for that.
stm32g4_SRC := $(filter-out %/cpu.c %/vectors.c %/port_%.c,$(wildcard firmware/port/stm32g4/*.c))
od_SRC      := $(OD_C)

BINS            := controller drive injector bridge hub
controller_MAIN := firmware/app/main.c
drive_MAIN      := $(wildcard sim/node/main.c)
injector_MAIN   := $(wildcard sim/injector/main.c)
bridge_MAIN     := $(wildcard sim/gateway/main.c)
hub_MAIN        := $(wildcard sim/hub/main.c)
BINS            := $(foreach b,$(BINS),$(if $($(b)_MAIN),$(b)))

UNIT_SRC      := $(wildcard tests/unit/test_*.c)
UNIT_SUPPORT  := $(filter-out $(UNIT_SRC),$(wildcard tests/unit/*.c))
UNIT_NAMES    := $(UNIT_SRC:tests/unit/%.c=%)
# An archive, as the libraries: a test is linked with what it needs, so that its binary changes with nothing else.
# Fakes, which stand in for what a library has, are linked always.
UNIT_FAKES    := $(wildcard tests/unit/fake_*.c)
support_SRC   := $(filter-out $(UNIT_FAKES),$(UNIT_SUPPORT))

OWN_C    := $(wildcard firmware/targets/*.c) $(foreach l,$(filter-out od,$(LIBS)),$($(l)_SRC)) $(foreach b,$(BINS),$($(b)_MAIN))
OWN_H    := $(wildcard firmware/*/*.h firmware/app/*/*.h firmware/port/*/*.h sim/*/*.h host_tools/numerics/*.h tests/unit/*.h tests/fuzz/*.h)
FUZZ_SRC      := $(wildcard tests/fuzz/*.c)
FUZZ_NAMES    := $(patsubst tests/fuzz/%.c,%,$(wildcard tests/fuzz/fuzz_*.c))
# Replays the corpora; libFuzzer has a main() of its own.
FUZZ_SUPPORT  := tests/fuzz/fuzz.c
FUZZ_REPLAY   := tests/fuzz/replay.c
TARGET_TEST_SRC := $(wildcard tests/target/*.c)
# What only a microcontroller's compiler understands: linted by its flags (firmware/targets/targets.mk).
BARE_C   := $(filter-out $(OWN_C),$(wildcard firmware/port/*/*.c firmware/targets/*.c))

## ---- flags -----------------------------------------------------------------------------------

WARN      := -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Werror
INCLUDES  := -Ifirmware -Isim -Ihost_tools -I$(BUILD)/generated
COMMON    := -std=c99 $(WARN) -ffp-contract=off -fPIC $(INCLUDES)
UNITY_DIR := $(BUILD)/unity
UNITY_DEF := -DUNITY_INCLUDE_DOUBLE -DUNITY_SUPPORT_64
LDLIBS    := -lm -lpthread

host_CC      := $(CC)
host_CFLAGS  := $(COMMON) -O2 -g
host_LDFLAGS :=
asan_CC      := $(CC)
asan_CFLAGS  := $(COMMON) -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer
asan_LDFLAGS := -fsanitize=address,undefined
clang_CC      := $(CLANG)
clang_CFLAGS  := $(COMMON) -O2 -g
clang_LDFLAGS :=
clang_NEEDS   := $(READY)/packages-lint
fuzz_CC      := $(CLANG)
fuzz_CFLAGS  := $(COMMON) -O1 -g -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer
fuzz_LDFLAGS := -fsanitize=fuzzer,address,undefined
fuzz_NEEDS   := $(READY)/packages-fuzz
VARIANTS := host asan clang fuzz

## ---- entry points ----------------------------------------------------------------------------

.PHONY: build c dist site wheels $(MACHINES:%=wheel-%) check test test-all test-repeat unit unit-plain pytest run til faults lint format soak soak-stream cuts-stream bench compare butterfly share figures options mutants fuzz clean distclean help lock packages venv FORCE

help: ## this list
	@echo "make TARGET, from the root of the tree:"
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/\1\t\2/p' $(filter %Makefile %.mk,$(MAKEFILE_LIST)) | awk -F'\t' '{printf "  %-10s %s\n", $$1, $$2}'

build: c library $(VENV)/.editable $(if $(wildcard host_tools/hodograph/native/build_native.py),native) ## prepare everything: packages, .venv, C programs, Python module
	@true

HOST_LIBS := $(LIBS:%=$(BUILD)/host/libhodograph_%.a)
c: $(HOST_LIBS) $(BINS:%=$(BUILD)/bin/hodograph-%) ## the C archives and programs only

# Property tests with so many cases that the sanitized build runs only a part of them: optimised, in full.
PLAIN_BINS := $(BUILD)/host/tests/test_override $(BUILD)/host/tests/test_stm32g4_flash
FUZZ_BINS    := $(FUZZ_NAMES:%=$(BUILD)/fuzz/bin/%)
FUZZ_REPLAYS := $(FUZZ_NAMES:%=$(BUILD)/asan/tests/%)
ASAN_BINS := $(UNIT_NAMES:%=$(BUILD)/asan/tests/%) $(FUZZ_REPLAYS)
UNIT_BINS := $(ASAN_BINS) $(PLAIN_BINS)
TESTED    := build $(READY)/packages-test $(UNIT_BINS) $(BINS:%=$(BUILD)/asan/bin/hodograph-%)

# CHECK_S: seconds that the tests of `make check` may take together
CHECK_S ?= 40
check: build $(ASAN_BINS) lint-changed ## what an edit can break, in 90 s: C tests and Python tests that it reaches, lint of what changed
	@$(PY) tools/run_tests.py --build $(BUILD) --suite check --budget $(CHECK_S)

test: $(TESTED) ## the tests that show whether the tree is sound, C and Python, in 10 min; ends with "N passed, N failed"
	@$(PY) tools/run_tests.py --build $(BUILD)

# One after the other: each has the machine for itself. (By the plain word make: `make -n` would run a line with the variable.)
ALONE := env -u MAKEFLAGS -u MFLAGS make --no-print-directory BUILD=$(BUILD) STAMPS=off
test-all: $(TESTED) ## every test, the long ones too, all proofs and all counts, a minute of each fuzz harness, nothing taken from stamps; ends with "N passed, N failed"
	@$(PY) tools/run_parts.py --tests tests "$(PY) tools/run_tests.py --build $(BUILD) --suite all" \
	    --tests proofs "$(ALONE) proofs" --step count "$(ALONE) count" --tests fuzz "$(ALONE) fuzz FUZZ_S=60 SEED=1 FUZZ="

# RUNS: how often; MODES in turn: idle, busy (four processes that compute beside it), one-core
RUNS  ?= 20
MODES ?= idle busy one-core
test-repeat: $(TESTED) ## `make test` over and over, for a night: is its verdict always the same (RUNS=20 MODES="idle busy one-core")
	@$(PY) tools/repeat_tests.py --runs $(RUNS) --modes "$(MODES)" --out $(BUILD)/repeat

unit: $(UNIT_BINS) ## the C tests only, under the sanitizers
	@$(PY) tools/run_tests.py --build $(BUILD) --only unit

unit-plain: $(UNIT_NAMES:%=$(BUILD)/host/tests/%)

pytest: build $(READY)/packages-test ## the Python tests only
	@$(PY) tools/run_tests.py --build $(BUILD) --only python

# RUN="..." adds options of `hodograph run`
OUT ?= out
RUN ?=
run: build ## run the alpha and the heart on a CAN bus, write a report to out/, print a summary
	@tools/with-vcan $(VENV)/bin/hodograph run examples/alpha.toml examples/heart.toml --report $(OUT) $(RUN)

# SOAK_S: bus time in seconds
SOAK_S ?= 3600
soak: build ## programs over and over for SOAK_S seconds of bus time (an hour, a quarter at each period), every frame checked
	@$(PY) tools/soak.py --seconds $(SOAK_S) --json $(BUILD)/soak.json
CUTS ?= 1-100
cuts-stream: build ## streamed jobs cut at random instants and continued (CUTS="1-100"): all setpoints on the path, journal, statuses
	@$(PY) tools/stream_cuts.py --seeds $(CUTS) --json $(BUILD)/stream_cuts.json
# CHORD_MM: the job is made of G1 chords of this length; 0: of arcs
CHORD_MM ?= 0
soak-stream: build firmware ## a streamed job of SOAK_S seconds of motion on the emulated M4F in virtual time: setpoints against the offline simulation, memory of both sides
	@$(PY) tools/stream_soak.py --seconds $(SOAK_S) --chord $(CHORD_MM) --json $(BUILD)/stream_soak.json

# TARGET: one of an385 an386 an500 an505 microbit; TIL=--local: a bus of its own instead of vcan0; TIL="--local --link slcan": real time
TARGET ?= an386
TIL    ?=
til: build firmware ## target in the loop: the controller on an emulated board runs paths in the plane, in space and with five axes, the same bits as here
	@$(if $(findstring --local,$(TIL)),,tools/with-vcan) $(PY) tools/til.py --target $(TARGET) $(TIL) examples/alpha.toml examples/heart.toml examples/helix.toml examples/five_axes.toml

SEEDS ?= 5
SCENARIO ?=
faults: build ## inject faults into simulated machines, judge what comes of them, print a table (SEEDS=5, SCENARIO=...)
	@$(PY) tools/run_faults.py --seeds $(SEEDS) --output $(BUILD)/faults.json $(SCENARIO)

figures: build ## draw the figures of the manual anew (docs/images)
	@$(PY) tools/draw_figures.py

options: build ## write docs/reference/options.md and python-api.md anew, from the command line and the docstrings
	@$(PY) tools/list_options.py
	@$(PY) tools/list_api.py

# PLATFORM: of the wheel, where CC, AR and LDSHARED build for another platform
DIST     ?= dist
PLATFORM ?=
dist: $(VENV)/.editable ## source distribution and wheel in dist/, the same bytes from the same commit
	@$(PY) tools/dist/make_release.py $(DIST) $(if $(PLATFORM),--platform $(PLATFORM))

# One compiler for all platforms, which links against the oldest glibc that the platform's name promises.
ZIG       := $(abspath $(READY))/zig/bin/python -m ziglang
MACHINES  := x86_64 aarch64
zig_cc     = $(ZIG) cc -target $(1)-linux-gnu.2.17
$(READY)/zig/.ready: tools/dist/requirements.lock tools/make_venv.sh | $(READY)/packages
	@PYTHON=$(PYTHON) bash tools/make_venv.sh $(READY)/zig tools/dist/requirements.lock
wheels: $(MACHINES:%=wheel-%) ## wheels for Linux (manylinux2014) on x86-64 and aarch64, cross-compiled, in dist/
$(MACHINES:%=wheel-%): wheel-%: $(VENV)/.editable $(READY)/zig/.ready
	@CC="$(call zig_cc,$*)" LDSHARED="$(call zig_cc,$*) -shared" AR="$(ZIG) ar" \
	    $(PY) tools/dist/make_release.py $(DIST) --platform manylinux2014_$*

$(READY)/site/.ready: tools/site/requirements.lock tools/make_venv.sh | $(READY)/packages
	@PYTHON=$(PYTHON) bash tools/make_venv.sh $(READY)/site tools/site/requirements.lock
site: $(READY)/site/.ready ## the manual as a static site with search: build/site/index.html
	@$(READY)/site/bin/python tools/site/make_site.py $(BUILD)/site
	@echo "$(BUILD)/site/index.html"

share: build ## man page and shell completion in build/share, from the help
	@$(PY) tools/make_share.py $(BUILD)/share

bench: build ## every benchmark of benchmarks/; figures also in build/bench.json
	@$(PY) tools/run_benchmarks.py --build $(BUILD)

# KLIPPER: folder of a clone of Klipper, which no registry has; without it its rows are left out
KLIPPER ?=
PEER_KLIPPER := benchmarks/peers/batch_klipper/requirements.lock
$(READY)/klipper/.ready: $(PEER_KLIPPER) tools/make_venv.sh | $(READY)/packages
	@PYTHON=$(PYTHON) bash tools/make_venv.sh $(READY)/klipper $(PEER_KLIPPER)
compare: build $(if $(KLIPPER),$(READY)/klipper/.ready) ## the same toolpaths planned by Hodograph, LinuxCNC, TOPP-RA, Ruckig and Klipper (KLIPPER=CLONE); figures also in build/compare.json
	@$(PYTHON) tools/packages.py compare
	@$(PY) benchmarks/peers/compare.py --json $(BUILD)/compare.json --figure $(BUILD)/compare.svg $(if $(ONLY),--only $(ONLY)) \
	    $(if $(KLIPPER),--klipper $(KLIPPER) --klipper-python $(READY)/klipper/bin/python)

butterfly: build ## the butterfly NURBS of the literature, beside three published cycle times; figures also in build/butterfly.json
	@$(PY) benchmarks/published/butterfly.py --json $(BUILD)/butterfly.json

# AREA: some of those that tools/mutants.py --list names; COUNT mistakes for each
AREA  ?= core
COUNT ?= 20
mutants: build $(READY)/packages-test $(UNIT_BINS) ## plant mistakes in AREA="core ...", tell which the tests do not notice
	@$(PY) tools/mutants.py --build $(BUILD) --count $(COUNT) $(AREA)

# FUZZ_S: seconds of each; FUZZ="hub python-path": only these; SEED: of the random numbers
FUZZ_S ?= 60
FUZZ   ?=
SEED   ?= 1
fuzz: build $(FUZZ_BINS) ## mutated input to every parser, protocol and the controller, FUZZ_S=60 seconds each; ends with "N passed, N failed"
	@$(PY) tools/fuzz.py --build $(BUILD) --seconds $(FUZZ_S) --seed $(SEED) $(FUZZ)

clean: ## remove build/ and the cffi module
	rm -rf $(BUILD) host_tools/hodograph/native/_native*.so

distclean: clean ## clean, and remove .venv and caches
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis host_tools/*.egg-info

FORCE:

## ---- what the machine must have --------------------------------------------------------------

packages: $(READY)/packages
$(READY)/packages: tools/packages.py
	@mkdir -p $(@D)
	@$(PYTHON) tools/packages.py build
	@touch $@

$(READY)/packages-test: tools/packages.py | $(READY)/packages
	@$(PYTHON) tools/packages.py test
	@touch $@

$(READY)/packages-firmware: tools/packages.py | $(READY)/packages
	@mkdir -p $(@D)
	@$(PYTHON) tools/packages.py firmware
	@touch $@

$(READY)/packages-fuzz: tools/packages.py | $(READY)/packages
	@mkdir -p $(@D)
	@$(PYTHON) tools/packages.py fuzz
	@touch $@

$(READY)/packages-lint: tools/packages.py | $(READY)/packages
	@$(PYTHON) tools/packages.py lint
	@touch $@

venv: $(VENV)/.editable
$(VENV)/.ready: requirements.lock tools/make_venv.sh | $(READY)/packages
	@PYTHON=$(PYTHON) bash tools/make_venv.sh $(VENV) requirements.lock

$(VENV)/.editable: pyproject.toml setup.py $(VENV)/.ready
	@HODOGRAPH_BUILT_BY_MAKE=1 $(PY) -m pip install --quiet --no-deps --no-build-isolation --no-index -e .
	@touch $@

lock: $(READY)/uv/bin/uv ## write requirements.lock anew from requirements.in (newest versions)
	$(READY)/uv/bin/uv pip compile --universal --python-version 3.11 --generate-hashes --upgrade \
	    --no-header --quiet requirements.in -o requirements.lock
$(READY)/uv/bin/uv: | $(READY)/packages
	$(PYTHON) -m venv $(READY)/uv
	$(READY)/uv/bin/pip install --quiet uv

## ---- Unity, fetched ----------------------------------------------------------------------------

$(UNITY_DIR)/unity.c: tools/unity.lock tools/fetch_unity.sh $(VENV)/.ready
	@bash tools/fetch_unity.sh $(PY) tools/unity.lock $(UNITY_DIR)
$(UNITY_DIR)/unity.h: $(UNITY_DIR)/unity.c

## ---- object dictionaries, generated from the EDS files -------------------------------------------

define OD_RULE
$(BUILD)/generated/od_$(1).c $(BUILD)/generated/od_$(1).h &: $(2) $(wildcard tools/eds/*.py tools/eds/*.j2) $(VENV)/.ready
	@mkdir -p $(BUILD)/generated
	$$(call say,eds,$$<)
	$$(Q)PYTHONPATH=tools $(PY) -m eds.to_c $(2) $(1) $(BUILD)/generated
	@touch $(BUILD)/generated/od_$(1).c $(BUILD)/generated/od_$(1).h
endef
$(if $(filter controller,$(OD_NAMES)),$(eval $(call OD_RULE,controller,firmware/app/controller.eds)))
$(if $(filter drive,$(OD_NAMES)),$(eval $(call OD_RULE,drive,sim/node/drive.eds)))
$(if $(filter module,$(OD_NAMES)),$(eval $(call OD_RULE,module,sim/node/module.eds)))

## ---- C -------------------------------------------------------------------------------------------

# A list of what a file is made from, rewritten only when it changes: so a removed source or a changed
# flag rebuilds what depends on it.
define NOTE
$(1): FORCE
	@mkdir -p $$(@D)
	@printf '%s\n' '$(2)' | cmp -s - $$@ || printf '%s\n' '$(2)' > $$@
endef

# object_of VARIANT SOURCES: generated sources lie under $(BUILD) already
object_of = $(patsubst %.c,$(BUILD)/$(1)/obj/%.o,$(patsubst $(BUILD)/%,%,$(2)))

define LIB_RULE # variant, library
$(BUILD)/$(1)/libhodograph_$(2).a: $(call object_of,$(1),$($(2)_SRC)) $(BUILD)/$(1)/obj/$(2).list
	@rm -f $$@
	@ar rcs $$@ $$(filter %.o,$$^)
$(call NOTE,$(BUILD)/$(1)/obj/$(2).list,$($(2)_SRC))
endef

define LINK # variant
	@mkdir -p $$(@D)
	$$(call say,link,$$@)
	$$(Q)$$($(1)_CC) $$($(1)_LDFLAGS) -o $$@ $$(filter %.o,$$^) -Wl,--start-group $$(filter %.a,$$^) -Wl,--end-group $$(LDLIBS)
endef

define VARIANT_RULES # variant
$(call NOTE,$(BUILD)/$(1)/obj/flags,$($(1)_CC) $($(1)_CFLAGS) $(UNITY_DEF))
$(BUILD)/$(1)/obj/tests/%.o: tests/%.c $(BUILD)/$(1)/obj/flags $(UNITY_DIR)/unity.h | $(OD_H) $($(1)_NEEDS)
	@mkdir -p $$(@D)
	$$(call say,$(1),$$<)
	$$(Q)$$($(1)_CC) $$($(1)_CFLAGS) -Itests/unit -isystem $(UNITY_DIR) $(UNITY_DEF) -MMD -MP -c -o $$@ $$<
$(BUILD)/$(1)/obj/generated/%.o: $(BUILD)/generated/%.c $(BUILD)/$(1)/obj/flags | $(OD_H) $($(1)_NEEDS)
	@mkdir -p $$(@D)
	$$(call say,$(1),$$<)
	$$(Q)$$($(1)_CC) $$($(1)_CFLAGS) -MMD -MP -c -o $$@ $$<
$(BUILD)/$(1)/obj/%.o: %.c $(BUILD)/$(1)/obj/flags | $(OD_H) $(READY)/packages $($(1)_NEEDS)
	@mkdir -p $$(@D)
	$$(call say,$(1),$$<)
	$$(Q)$$($(1)_CC) $$($(1)_CFLAGS) -MMD -MP -c -o $$@ $$<
$(BUILD)/$(1)/obj/unity.o: $(UNITY_DIR)/unity.c $(BUILD)/$(1)/obj/flags
	@mkdir -p $$(@D)
	$$(call say,$(1),$$<)
	$$(Q)$$($(1)_CC) $$(filter-out -W%,$$($(1)_CFLAGS)) $(UNITY_DEF) -c -o $$@ $$<
$(foreach l,$(LIBS) support,$(eval $(call LIB_RULE,$(1),$(l))))
$(BUILD)/$(1)/tests/%: $(BUILD)/$(1)/obj/tests/unit/%.o $(call object_of,$(1),$(UNIT_FAKES)) $(BUILD)/$(1)/obj/unity.o $(LIBS:%=$(BUILD)/$(1)/libhodograph_%.a) $(BUILD)/$(1)/libhodograph_support.a
$(call LINK,$(1))
endef
$(foreach v,$(VARIANTS),$(eval $(call VARIANT_RULES,$(v))))
# Objects of tests and the marks of lint are made by chains of patterns; make would delete them.
.SECONDARY: $(foreach v,$(VARIANTS),$(call object_of,$(v),$(UNIT_SRC) $(UNIT_SUPPORT) $(FUZZ_SRC) $(TARGET_TEST_SRC))) \
            $(patsubst %,$(BUILD)/clang/obj/%.tidy-deps,$(OWN_C) $(UNIT_SRC) $(UNIT_SUPPORT) $(FUZZ_SRC) $(TARGET_TEST_SRC))

# The harnesses of tests/fuzz: with libFuzzer, and as a test that replays their corpora.
fuzz_needs = $(call object_of,$(1),$(FUZZ_SUPPORT) $(UNIT_FAKES)) $(BUILD)/$(1)/obj/unity.o $(LIBS:%=$(BUILD)/$(1)/libhodograph_%.a) $(BUILD)/$(1)/libhodograph_support.a
$(FUZZ_BINS): $(BUILD)/fuzz/bin/%: $(BUILD)/fuzz/obj/tests/fuzz/%.o $(call fuzz_needs,fuzz)
	@mkdir -p $(@D)
	$(call say,link,$@)
	$(Q)$(fuzz_CC) $(fuzz_LDFLAGS) -o $@ $(filter %.o,$^) -Wl,--start-group $(filter %.a,$^) -Wl,--end-group $(LDLIBS)
$(FUZZ_REPLAYS): $(BUILD)/asan/tests/%: $(BUILD)/asan/obj/tests/fuzz/%.o $(call object_of,asan,$(FUZZ_REPLAY)) $(call fuzz_needs,asan)
	@mkdir -p $(@D)
	$(call say,link,$@)
	$(Q)$(asan_CC) $(asan_LDFLAGS) -o $@ $(filter %.o,$^) -Wl,--start-group $(filter %.a,$^) -Wl,--end-group $(LDLIBS)

define BIN_RULE # variant, program, file
$(3): $(call object_of,$(1),$($(2)_MAIN)) $(LIBS:%=$(BUILD)/$(1)/libhodograph_%.a)
$(call LINK,$(1))
endef
$(foreach b,$(BINS),$(eval $(call BIN_RULE,host,$(b),$(BUILD)/bin/hodograph-$(b))))
$(foreach b,$(BINS),$(eval $(call BIN_RULE,asan,$(b),$(BUILD)/asan/bin/hodograph-$(b))))

-include $(foreach v,$(VARIANTS),$(patsubst %.o,%.d,$(call object_of,$(v),$(OWN_C) $(OD_C) $(UNIT_SRC) $(UNIT_SUPPORT) $(FUZZ_SRC))))

include tools/misra/misra.mk
include tests/proofs/proofs.mk
include firmware/targets/targets.mk
include tools/analysis/count.mk
include tests/target/target.mk
include packaging/packaging.mk

## ---- lint ------------------------------------------------------------------------------------------

C_FILES    := $(OWN_C) $(OWN_H) $(BARE_C) $(UNIT_SRC) $(UNIT_SUPPORT) $(FUZZ_SRC) $(TARGET_TEST_SRC) $(wildcard tests/fuzz/*.h tests/target/*.h tools/analysis/*.c tools/vcan/*.c packaging/library/*.c examples/embed/*.c)
PY_TREES   := $(wildcard host_tools tools tests benchmarks setup.py)
JS_FILES   := $(wildcard host_tools/hodograph/monitor/page/*.js)
SH_FILES   := $(wildcard tools/*.sh tools/*/*.sh .ci/run)
LINTED_C   := $(OWN_C) $(UNIT_SRC) $(UNIT_SUPPORT) $(FUZZ_SRC) $(TARGET_TEST_SRC)
# Every C file under the warning flags of gcc and of clang; the fuzz drivers too, though not linked.
LINT_OBJ   := $(foreach v,host clang,$(call object_of,$(v),$(LINTED_C) $(OD_C)))
LINT_PARTS := warnings tidy cppcheck misra clang-format ruff mypy shellcheck js directions symbols eds
.PHONY: $(LINT_PARTS:%=lint-%)

lint: $(LINT_PARTS:%=lint-%) ## compilers' warnings, clang-tidy, cppcheck, MISRA C, formats, ruff, mypy, directions, names, EDS files
	@echo "lint: all is well"

lint-warnings: $(LINT_OBJ)
lint-tidy: $(LINTED_C:%=$(BUILD)/lint/%.tidy) $(BARE_C:%=$(BUILD)/lint/%.tidy)
$(BUILD)/lint/%.tidy: % $(BUILD)/clang/obj/%.tidy-deps .clang-tidy
	@mkdir -p $(@D)
	$(call say,tidy,$<)
	$(Q)$(VENV)/bin/clang-tidy --quiet $< -- -std=c99 $(INCLUDES) -Itests/unit -isystem $(UNITY_DIR) $(UNITY_DEF) 2> $@.err || { cat $@.err; exit 1; }
	@touch $@
# A file is checked again when its clang object is newer: that one knows the headers.
$(BUILD)/clang/obj/%.c.tidy-deps: $(BUILD)/clang/obj/%.o
	@touch $@
CPPCHECK := --quiet --std=c99 --enable=warning,performance,portability --inline-suppr --error-exitcode=1 \
            --suppress=missingIncludeSystem --suppress=shiftTooManyBitsSigned $(INCLUDES)
lint-cppcheck: $(READY)/packages-lint $(OD_H)
	$(call say,cppcheck,firmware sim host_tools)
	@mkdir -p $(BUILD)/lint/cppcheck
	$(Q)cppcheck $(CPPCHECK) -j$(shell nproc) --cppcheck-build-dir=$(BUILD)/lint/cppcheck $(OWN_C) $(BARE_C) $(TARGET_TEST_SRC)
lint-clang-format: $(VENV)/.ready
	$(call say,format,C)
	$(Q)$(VENV)/bin/clang-format --dry-run -Werror $(C_FILES)
lint-ruff: $(VENV)/.ready
	$(call say,ruff,$(PY_TREES))
	$(Q)$(VENV)/bin/ruff check --quiet $(PY_TREES) tools/with-vcan && $(VENV)/bin/ruff format --quiet --diff $(PY_TREES) tools/with-vcan
lint-mypy: $(VENV)/.editable
	$(call say,mypy,host_tools tools benchmarks)
	$(Q)$(VENV)/bin/mypy --no-error-summary host_tools/hodograph tools benchmarks
lint-shellcheck: $(READY)/packages-lint
	$(call say,shell,$(SH_FILES))
	$(Q)shellcheck $(SH_FILES)
lint-js: $(READY)/packages-lint
	$(call say,js,$(JS_FILES))
	$(Q)for file in $(JS_FILES); do node --input-type=module --check < $$file || { echo "in $$file"; exit 1; }; done
lint-directions:
	$(call say,who,may use whom)
	$(Q)$(PYTHON) tools/check_directions.py
	$(Q)$(PYTHON) tools/check_users.py
	$(Q)$(PYTHON) tools/check_test_names.py
lint-symbols: $(HOST_LIBS)
	$(call say,names,of the libraries)
	$(Q)$(PYTHON) tools/check_symbols.py $(HOST_LIBS)

# The same for what differs from the last commit and was not linted as it is now; of the C files only those themselves,
# not those that include them. Ruff, mypy and the directions are quick enough for the whole tree.
.PHONY: lint-changed lint-files
lint-changed: $(VENV)/.editable $(OD_H)
	@$(PY) tools/lint_changed.py

FILES  ?=
SOME_C  := $(filter $(LINTED_C) $(BARE_C),$(FILES))
SOME_CH := $(filter $(C_FILES),$(FILES))
SOME_SH := $(filter $(SH_FILES),$(FILES))
SOME_JS := $(filter $(JS_FILES),$(FILES))
lint-files: $(if $(filter %.py tools/with-vcan pyproject.toml requirements.lock,$(FILES)),lint-ruff lint-mypy) \
            $(if $(filter %.py %.c %.h,$(FILES)),lint-directions) $(if $(filter %.eds,$(FILES)),lint-eds) $(SOME_C:%=$(BUILD)/lint/%.tidy)
	$(if $(SOME_CH),$(Q)$(VENV)/bin/clang-format --dry-run -Werror $(SOME_CH))
	$(if $(filter-out tests/%,$(SOME_C)),$(Q)cppcheck $(CPPCHECK) $(filter-out tests/%,$(SOME_C)))
	$(if $(SOME_SH),$(Q)shellcheck $(SOME_SH))
	$(foreach file,$(SOME_JS),$(Q)node --input-type=module --check < $(file) || { echo "in $(file)"; exit 1; }$(newline))
	@echo "lint of $(words $(FILES)) changed files: all is well"

format: $(VENV)/.ready ## bring C and Python into the formats that lint asks for
	$(VENV)/bin/clang-format -i $(C_FILES)
	$(VENV)/bin/ruff check --quiet --fix-only $(PY_TREES) tools/with-vcan
	$(VENV)/bin/ruff format --quiet $(PY_TREES) tools/with-vcan

lint-eds: $(VENV)/.ready
	$(call say,eds,CiA 306)
	$(Q)PYTHONPATH=tools $(PY) -m eds.check $(wildcard firmware/app/controller.eds sim/node/drive.eds sim/node/module.eds)

## ---- the native module of the Python package -------------------------------------------------------

NATIVE := host_tools/hodograph/native/_native.abi3.so
.PHONY: native
native: $(NATIVE)
$(NATIVE): host_tools/hodograph/native/build_native.py host_tools/hodograph/native/declarations.h $(BUILD)/host/libhodograph_core.a $(BUILD)/host/libhodograph_sim.a $(BUILD)/host/libhodograph_numerics.a \
           $(wildcard firmware/core/*.h sim/plant/*.h sim/offline/*.h host_tools/numerics/*.h) $(VENV)/.editable
	$(call say,cffi,$@)
	$(Q)$(PY) $< --build $(BUILD)
	@touch $@
