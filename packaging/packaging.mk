# SPDX-License-Identifier: MIT
# Makes libhodograph, and the packages that are made of the tree. Included by the Makefile. Writes build/ and dist/;
# `make install` writes below DESTDIR and PREFIX, `make container` an image of buildah.

LIBRARY         := $(BUILD)/library
LIBRARY_VERSION := $(shell sed -n 's/^__version__ = "\(.*\)"/\1/p' host_tools/hodograph/__init__.py)
LIBRARY_ABI     := $(shell sed -n 's/^abi //p' packaging/library/abi.txt)
LIBRARY_NAMES   := $(filter-out kernels_all,$(core_SRC:firmware/core/%.c=%)) kernels
LIBRARY_OBJ     := $(LIBRARY_NAMES:%=$(LIBRARY)/obj/%.o)
LIBRARY_SHARED  := $(LIBRARY)/libhodograph.so.$(LIBRARY_VERSION)
# CFLAGS and LDFLAGS are the packager's: of optimisation, debugging and hardening.
LIBRARY_CFLAGS   = -std=c99 $(or $(CFLAGS),-O2 -g) -ffp-contract=off -fPIC -DNDEBUG -fvisibility=hidden -ffunction-sections \
                   -ffile-prefix-map=$(CURDIR)=. -DHODOGRAPH_BUILD_SHARED -I$(LIBRARY)/tree/src

.PHONY: library abi install uninstall
library: $(LIBRARY)/libhodograph.a $(LIBRARY_SHARED) ## libhodograph, static and shared, and in build/library/tree as module for Zephyr, PlatformIO and Arduino

$(LIBRARY)/.tree: $(core_SRC) $(wildcard firmware/core/*.h packaging/library/* packaging/library/*/* examples/embed/* examples/embed/*/*) \
                  tools/dist/library.py host_tools/hodograph/__init__.py LICENSE tests/data/programs/alpha_quintic.hdgp
	@mkdir -p $(@D)
	$(call say,tree,$(LIBRARY)/tree)
	$(Q)$(PYTHON) tools/dist/library.py $(LIBRARY)/tree
	@touch $@
$(LIBRARY)/tree/%: $(LIBRARY)/.tree ;
$(eval $(call NOTE,$(LIBRARY)/flags,$(CC) $(LIBRARY_CFLAGS) $(LDFLAGS)))
$(LIBRARY_OBJ): $(LIBRARY)/obj/%.o: $(LIBRARY)/tree/src/hodograph/%.c $(LIBRARY)/flags | $(READY)/packages
	@mkdir -p $(@D)
	$(call say,lib,$<)
	$(Q)$(CC) $(LIBRARY_CFLAGS) -MMD -MP -c -o $@ $<
$(LIBRARY)/libhodograph.a: $(LIBRARY_OBJ)
	@rm -f $@
	@ar rcsD $@ $^
$(LIBRARY_SHARED): $(LIBRARY_OBJ) packaging/library/abi.txt
	$(call say,link,$@)
	$(Q)$(CC) $(LDFLAGS) -shared -Wl,-soname,libhodograph.so.$(LIBRARY_ABI) -Wl,-z,defs -Wl,--gc-sections -o $@ $(filter %.o,$^)
-include $(LIBRARY_OBJ:.o=.d)

# UPDATE=1 writes the bytes of structs anew.
abi: library ## is the interface of libhodograph what packaging/library/abi.txt says?
	@$(PYTHON) tools/dist/abi.py $(LIBRARY) $(if $(UPDATE),--update)

# LIBDIR as in PREFIX/lib/x86_64-linux-gnu
PREFIX  ?= /usr/local
DESTDIR ?=
LIBDIR  ?= $(PREFIX)/lib
placed   = $(PYTHON) tools/dist/install.py $@ --build $(BUILD) --prefix '$(PREFIX)' --libdir '$(LIBDIR)' $(if $(DESTDIR),--destdir '$(DESTDIR)')
install: c library ## programs, library, headers, EDS files and examples into PREFIX=/usr/local, below DESTDIR
	@$(placed)
uninstall: c library ## take away what make install would write
	@$(placed)

.PHONY: runtime sbom deb
runtime: $(BUILD)/runtime/.ready
$(BUILD)/runtime/.ready: requirements.lock pyproject.toml tools/dist/runtime.py tools/dist/requirements.py $(VENV)/.ready
	$(call say,venv,$(BUILD)/runtime)
	$(Q)$(PY) tools/dist/runtime.py $(BUILD)/runtime
	@touch $@

PACKAGING_TOOLS := $(READY)/packaging
$(PACKAGING_TOOLS)/.ready: packaging/tools/requirements.lock tools/make_venv.sh | $(READY)/packages
	@PYTHON=$(PYTHON) bash tools/make_venv.sh $(PACKAGING_TOOLS) packaging/tools/requirements.lock
sbom: build $(BUILD)/runtime/.ready $(PACKAGING_TOOLS)/.ready ## list of the components that are shipped (CycloneDX), in dist/
	@$(PY) tools/dist/sbom.py --build $(BUILD) --tool $(PACKAGING_TOOLS)/bin/cyclonedx-py $(DIST)

$(READY)/packages-deb: tools/packages.py | $(READY)/packages
	@$(PYTHON) tools/packages.py deb
	@touch $@
deb: build $(BUILD)/runtime/.ready $(READY)/packages-deb ## Debian packages in dist/: the host tools with their Python, the library, its development files
	@$(PY) tools/dist/debian.py --build $(BUILD) $(DIST)

# BUILDAH: with options where wanted, as in "buildah --root FOLDER". BASE: the image that it is built on.
BUILDAH  ?= buildah
CODENAME := $(shell sed -n 's/^VERSION_CODENAME=//p' /etc/os-release)
BASE     ?= debian:$(CODENAME)-slim
.PHONY: container container-base
$(READY)/packages-container: tools/packages.py | $(READY)/packages
	@$(PYTHON) tools/packages.py container
	@touch $@
container: deb $(READY)/packages-container ## container image hodograph:VERSION of the Debian package, by buildah (BASE=debian:bookworm-slim)
	$(BUILDAH) build --isolation chroot --build-arg BASE=$(BASE) --build-arg VERSION=$(LIBRARY_VERSION) --tag hodograph:$(LIBRARY_VERSION) --tag hodograph:latest \
	    --timestamp $(or $(SOURCE_DATE_EPOCH),$(shell git log -1 --format=%ct)) --file packaging/container/Containerfile $(DIST)
container-base: $(READY)/packages-container ## a base for the container without a registry: make container BASE=localhost/hodograph-base
	@mkdir -p $(BUILD)
	mmdebstrap --variant=apt --include=ca-certificates $(CODENAME) $(BUILD)/base.tar
	container=$$($(BUILDAH) from scratch) && $(BUILDAH) add --quiet $$container $(BUILD)/base.tar / && \
	    $(BUILDAH) commit --quiet --rm $$container localhost/hodograph-base
	rm -f $(BUILD)/base.tar
