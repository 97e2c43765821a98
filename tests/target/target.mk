# SPDX-License-Identifier: MIT
# The images of this folder as processes of this machine, by two compilers, unoptimised and optimised: what their
# setpoints are compared with. Included by the Makefile. Writes build/target; `make golden` writes tests/data/bits.
#
#   build/target/setpoints-COMPILER-LEVEL STORE KERNEL FILE ...

TARGET_HOSTS := gcc-O0 gcc-O2 clang-O0 clang-O2
TARGET_HOST_SRC := tests/target/setpoints.c tests/target/commands.c tests/target/table.c tests/target/host.c firmware/app/machine/motion.c firmware/app/machine/path_counts.c $(core_SRC)
TARGET_HOST_BINS := $(TARGET_HOSTS:%=$(BUILD)/target/setpoints-%)

define TARGET_HOST_RULE # compiler, level
$(call NOTE,$(BUILD)/target/$(1)-$(2).flags,$(1) $(2) $(COMMON) $(TARGET_HOST_SRC))
$(BUILD)/target/setpoints-$(1)-$(2): $(TARGET_HOST_SRC) $(wildcard tests/target/*.h) $(OWN_H) $(BUILD)/target/$(1)-$(2).flags | $(READY)/packages $(if $(filter clang,$(1)),$(READY)/packages-lint)
	$$(call say,$(1),$$@)
	$$(Q)$(if $(filter clang,$(1)),$(CLANG),gcc) $(COMMON) -$(2) -Dmain=target_main -c -o $$@.o tests/target/setpoints.c
	$$(Q)$(if $(filter clang,$(1)),$(CLANG),gcc) $(COMMON) -$(2) -o $$@ $$@.o $$(filter-out %/setpoints.c,$$(filter %.c,$$^))
endef
$(foreach c,gcc clang,$(foreach l,O0 O2,$(eval $(call TARGET_HOST_RULE,$(c),$(l)))))

.PHONY: target-hosts
target-hosts: $(TARGET_HOST_BINS)

# What the tests of the bits run; and the hashes they compare with, for when a kernel is meant to change its bits.
test test-all pytest: firmware target-hosts
.PHONY: golden
golden: build target-hosts ## write the golden hashes of tests/data/bits anew
	@$(PY) tests/support/target_bits.py $(BUILD)
