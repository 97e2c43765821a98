# SPDX-License-Identifier: MIT
# Runs the proofs of tests/proofs by Frama-C and CBMC (tools/analysis/prove.py); included by the Makefile.
# PROOFS="eva_piece ..." runs these only. Downloads the provers once; writes build/provers, build/proofs and stamps.
PROVERS := $(BUILD)/provers/.ready

.PHONY: proofs
PROOFS ?=
proofs: $(PROVERS) ## no overflow, no bad shift, index or division: shown by Frama-C and CBMC (PROOFS=...); ends with "N passed, N failed"
	@nice $(PYTHON) tools/analysis/prove.py --build $(BUILD) --jobs $(shell nproc) $(stamps_option) $(PROOFS)

$(PROVERS): tools/analysis/provers.lock tools/analysis/fetch_provers.sh | $(READY)/packages
	$(call say,fetch,Frama-C and CBMC)
	@bash tools/analysis/fetch_provers.sh tools/analysis/provers.lock $(@D)
	@touch $@
