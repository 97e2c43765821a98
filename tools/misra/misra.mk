# SPDX-License-Identifier: MIT
# Runs cppcheck's MISRA C:2012 add-on over the firmware, as a part of `make lint`. Included by the Makefile. Writes
# build/lint/misra.
MISRA_C := $(wildcard firmware/core/*.c firmware/canopen/*.c firmware/can/*.c firmware/app/*.c firmware/app/*/*.c firmware/port/*/*.c)

.PHONY: lint-misra
lint-misra: $(VENV)/.ready $(OD_H)
	$(call say,misra,firmware)
	$(Q)$(PY) tools/misra/check_misra.py --build $(BUILD)/lint/misra --jobs $(shell nproc) \
	    --include firmware --include $(BUILD)/generated $(MISRA_C)
