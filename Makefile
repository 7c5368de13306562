# SPDX-License-Identifier: Apache-2.0
# Everything a developer runs. Each target does its own set-up and repeats nothing that is current.
PYTHON ?= python3
JOBS ?= $(shell nproc)
VENV := .venv
BIN := $(VENV)/bin
BUILD := build/package
OUT ?= demo-output
FUZZ_SECONDS ?= 60
FUZZ_SEED ?= 1
FUZZ_TARGETS ?= gltf obj session viewer cli
SOAK_MINUTES ?= 60
BROWSER ?= chromium fonts-dejavu-core
VALIDATOR := $(VENV)/node/node_modules/gltf-validator
# One process more than processors: some tests wait, for a browser or for clients.
PYTEST = $(BIN)/pytest -n $$(($(JOBS) + 1)) --dist worksteal

CPP_FILES = $(shell git ls-files -co --exclude-standard '*.cpp' '*.h')
SOURCES := $(shell find core bindings python -type f \
  -not -name '*.so' -not -name '*.pyc' 2>/dev/null | sort)

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help setup build demo test test-all test-half test-thorough test-setup lint format docs viewer viewer-check sanitize portable fuzz soak bench bench-peers clean FORCE

help: ## Show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-14s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(VENV)/setup.stamp ## Install system packages (apt, only what is missing) and make .venv

build: $(VENV)/package.stamp ## Build the package with all extras and install it into .venv

demo: build ## Bake the bundled atrium, move its trolley, write pictures into demo-output
	$(BIN)/deltalux demo -o $(OUT)

test: test-setup ## Run the short C++ and Python tests, which show each promise
	ctest --test-dir $(BUILD) --output-on-failure --no-tests=ignore -j $(JOBS) -LE slow
	$(PYTEST) -m "not slow"

test-all: test-setup ## Run all tests, the slow ones too
	@sh tools/install_packages.sh libllvm19 || echo "note: no libllvm19 here: some tests of Mitsuba are skipped"
	ctest --test-dir $(BUILD) --output-on-failure --no-tests=ignore -j $(JOBS)
	$(PYTEST)

# Which half of the files, the commit decides, so that a few landings run all.
test-half: export DELTALUX_HALF = $(shell git rev-parse --short=7 HEAD 2>/dev/null || date +%j)
test-half: test-all ## All short tests, and the slow ones of half of the files: what every landing runs

test-thorough: export DELTALUX_THOROUGHNESS = 1
test-thorough: test-all ## All tests, with all cases of those that draw theirs: several times as long

test-setup: build $(VENV)/test.stamp
	@sh tools/install_packages.sh $(BROWSER) openssl || echo "note: no $(BROWSER) here: tests of the page are skipped"
	@test -d $(VALIDATOR) || $(BIN)/npm install --silent --no-audit --no-fund --prefix $(VENV)/node \
	  gltf-validator@2.0.0-dev.3.10 || echo "note: no gltf-validator here: its test is skipped"
	cmake -S . -B $(BUILD) -DDELTALUX_TESTS=ON >/dev/null
	cmake --build $(BUILD) -j $(JOBS)

lint: build $(VENV)/test.stamp $(VENV)/lint.stamp ## Check formatting, linting, typing and the layer rules
	@failed=; check() { echo "== $$1"; name=$$1; shift; "$$@" || failed="$$failed $$name,"; }; \
	check ruff $(BIN)/ruff check -q .; \
	check ruff-format $(BIN)/ruff format --check -q .; \
	check clang-format $(BIN)/clang-format --dry-run -Werror $(CPP_FILES); \
	check layers $(BIN)/python tools/check_layers.py; \
	check text $(BIN)/python tools/check_text.py; \
	check functions $(BIN)/python tools/check_functions.py; \
	check imports env PYTHONPATH=python $(BIN)/lint-imports --no-cache --no-logo; \
	check mypy $(BIN)/mypy; \
	test -z "$$failed" || { echo "lint failed:$${failed%,}" >&2; exit 1; }

format: $(VENV)/lint.stamp ## Rewrite all sources in the house format
	$(BIN)/ruff check --fix-only -q .
	$(BIN)/ruff format -q .
	$(BIN)/clang-format -i $(CPP_FILES)

docs: build $(VENV)/docs.stamp ## Build the documentation as a site: open build/site/index.html
	rm -rf build/site
	$(BIN)/sphinx-build -E -W --keep-going -q -c docs -d build/doctrees . build/site

viewer: ## Test and build the viewer's page into the package (wants Node.js; users need none)
	cd viewer && npm ci --no-audit --no-fund && npm run check && npm test && npm run build

viewer-check: ## Check that the committed page is what its sources build
	$(PYTHON) tools/check_viewer_build.py

sanitize: setup ## Run the C++ tests under ASan+UBSan and under TSan
	@for kind in address thread; do \
	  cmake -S . -B build/$$kind -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DDELTALUX_PYTHON=OFF \
	    -DDELTALUX_TESTS=ON -DDELTALUX_ASSERTS=ON -DDELTALUX_SANITIZE=$$kind >/dev/null && \
	  cmake --build build/$$kind -j $(JOBS) && \
	  TSAN_OPTIONS="suppressions=$(CURDIR)/tests/core/tsan.supp halt_on_error=1" \
	    ctest --test-dir build/$$kind --output-on-failure --no-tests=error -j 1 || exit 1; \
	done

portable: setup ## Build the core without AVX2 and run the C++ tests
	cmake -S . -B build/portable -G Ninja -DDELTALUX_PYTHON=OFF -DDELTALUX_TESTS=ON -DDELTALUX_ISA=x86-64 >/dev/null
	cmake --build build/portable -j $(JOBS)
	ctest --test-dir build/portable --output-on-failure --no-tests=error -j 1

fuzz: build $(VENV)/test.stamp ## Fuzz readers, viewer and command line, FUZZ_SECONDS=60 each
	$(BIN)/python tests/fuzz/farm.py --seconds $(FUZZ_SECONDS) --seed $(FUZZ_SEED) $(FUZZ_TARGETS)

soak: build $(VENV)/test.stamp ## Let three clients work on a view for SOAK_MINUTES=60
	$(BIN)/python benchmarks/viewer_soak.py --minutes $(SOAK_MINUTES)

bench: build ## Measure the engine: prints a table, writes benchmarks/out/bench.json
	cmake -S . -B build/bench -G Ninja -DDELTALUX_PYTHON=OFF -DDELTALUX_BENCHMARKS=ON >/dev/null
	cmake --build build/bench -j $(JOBS)
	$(BIN)/python benchmarks/run.py
	@echo "to put it into benchmarks/RESULTS.md: $(BIN)/python benchmarks/results.py engine"

bench-peers: build $(VENV)/test.stamp ## Measure against Mitsuba 3 and Radiance
	sh tools/install_packages.sh libllvm19
	PYTHONPATH=tests $(BIN)/python benchmarks/peers/office.py
	PYTHONPATH=tests $(BIN)/python benchmarks/peers/rooms.py

clean: ## Remove everything that earlier runs left in the tree
	rm -rf $(VENV) build dist demo-output benchmarks/out viewer/node_modules python/deltalux/_core*.so \
	  .pytest_cache .hypothesis .mypy_cache .ruff_cache .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# ---- stamps: each stands for a finished step and depends on what the step reads ----------------
$(VENV)/setup.stamp: tools/install_packages.sh
	sh tools/install_packages.sh
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	  { echo "error: $(PYTHON) is older than 3.10; use make PYTHON=/path/to/newer/python3" >&2; exit 1; }
	test -x $(BIN)/pip || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -q --upgrade 'pip>=25.1'
	@touch $@

# Files that were added or removed change this list, and with it its date.
$(VENV)/sources.txt: $(VENV)/setup.stamp FORCE
	@printf '%s\n' $(SOURCES) | cmp -s - $@ || printf '%s\n' $(SOURCES) > $@

# Without build isolation nanobind keeps its place, so that the second build compiles only changes.
$(VENV)/package.stamp: $(VENV)/setup.stamp $(VENV)/sources.txt $(SOURCES) CMakeLists.txt pyproject.toml
	$(BIN)/pip install -q --group build
	$(BIN)/pip install -q --no-build-isolation -C build-dir=$(BUILD) ".[all]"
	@touch $@

$(VENV)/%.stamp: pyproject.toml $(VENV)/setup.stamp
	$(BIN)/pip install -q --group $*
	@touch $@
