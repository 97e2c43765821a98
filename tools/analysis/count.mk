# SPDX-License-Identifier: MIT
# Counts the instructions of the tick in the emulator (tools/count.py). Included by the Makefile. Writes below build/;
# `make count UPDATE=1` writes tests/data/counts.json and docs/validation/counts.md.

COUNT_PLUGIN := $(BUILD)/target/count_plugin.so

$(COUNT_PLUGIN): tools/analysis/count_plugin.c
	@mkdir -p $(@D)
	$(call say,plugin,$@)
	$(Q)$(CC) -std=c99 $(WARN) -O2 -shared -fPIC -fvisibility=hidden -o $@ $<

.PHONY: counter
counter: firmware $(COUNT_PLUGIN)

test test-all pytest bench: counter

UPDATE ?=
.PHONY: count
count: counter $(VENV)/.editable native ## instructions of the tick on all cores, compared with tests/data/counts.json (UPDATE=1 rewrites it)
	@$(PY) tools/count.py --build $(BUILD) $(stamps_option) $(if $(UPDATE),--update)
