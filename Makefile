# Two commands suffice: `make run` flies a mission, `make test` runs every check. Both set up .venv first, at the first
# call and whenever the locks or pyproject.toml change.

# The first Python >= 3.11 that can make a virtual environment; one inside .venv itself (activated) does not count.
usable = import ensurepip, os, sys, venv; sys.exit(sys.version_info < (3, 11) or sys.prefix == os.path.abspath(".venv"))
PYTHON ?= $(shell for python in python3 python3.13 python3.12 python3.11; do \
	"$$python" -c '$(usable)' >/dev/null 2>&1 && { echo "$$python"; break; }; done)

# Passed on to `secondlook run`, e.g. make run ARGS="patchy --seed 3".
ARGS ?=
# Passed on to `uv pip compile`, e.g. make lock LOCK_ARGS=--upgrade. Without, versions already locked are kept.
LOCK_ARGS ?=

BIN := .venv/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
INSTALL_PROJECT := $(PIP) install --quiet --no-deps --no-build-isolation --editable .
COMPILE_NODES := $(BIN)/python -c "from secondlook.fleet.nodes import compile_nodes; compile_nodes()"

.PHONY: run test docs docs-figures example pictures processors golden mutants lock release clean
.DELETE_ON_ERROR:

run: .venv/.run-ready
	@$(BIN)/secondlook run $(ARGS)

# The pictures in the README and the docs, from the program itself; that of the report needs Chromium.
CHROMIUM ?= chromium
pictures: .venv/.test-ready
	@$(BIN)/secondlook paper --out docs/paper
	@$(BIN)/python -m bench.link_curve docs/figures/link-curve.json docs/link-curve.png
	@$(BIN)/python -m bench.figures --draw  # docs/reliability.png
	@rm -rf runs/pictures
	@$(BIN)/secondlook run tellaro --out runs/pictures
	@$(BIN)/python -m viz.picture runs/pictures/mission.rrd --time 1650 --out docs/mission.png
	@"$(CHROMIUM)" --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=1100,1210 \
		--screenshot=docs/report.png "file://$(CURDIR)/runs/pictures/report.html" >/dev/null 2>&1 || { \
		echo "No picture of the report: that needs Chromium (Debian, Ubuntu: chromium)." >&2; exit 1; }
	@rm -rf runs/pictures
	@$(BIN)/secondlook run headland --out runs/pictures
	@$(BIN)/python -m viz.picture runs/pictures/mission.rrd --time 4995 --out docs/headland.png
	@rm -rf runs/pictures
	@$(BIN)/secondlook run harbour --out runs/pictures
	@$(BIN)/secondlook picture runs/pictures --time 900 --out docs/harbour.png

# The pages that are made from the program, and of all pages the site: site/index.html.
docs: .venv/.test-ready
	@$(BIN)/python -m docs.pages
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --clean

# The tables of the docs that missions are flown for, all of them anew: some five hours on two cores.
docs-figures: .venv/.test-ready
	@$(BIN)/python -m bench.figures --fly all

# Whole missions, with what numpy makes of this processor and without: ten minutes on two cores.
processors: .venv/.test-ready
	@$(BIN)/python -m bench.processors

# The recorded mission that every node has to say again, and the steps that missions take, anew: after a change that is
# meant to change what nodes say.
GOLDEN := tests/secondlook/recorded/golden
golden: .venv/.run-ready
	@rm -rf runs/golden
	@$(BIN)/secondlook run tests/support/brief.yaml --bus local --out runs/golden
	@mkdir -p $(GOLDEN)
	@cp runs/golden/scenario.yaml $(GOLDEN)
	@gzip --best --no-name --stdout runs/golden/messages.mpk >$(GOLDEN)/messages.mpk.gz
	@$(BIN)/python -m bench --steps

# Which changes of the core no test notices: SAMPLE mutants, drawn by SEED, an hour on two cores that do nothing else.
# An interrupted run goes on; MUTANTS_ARGS=--again tries those anew that survived and are not judged.
SAMPLE ?= 350
SEED ?= 1
MUTANTS_ARGS ?=
mutants: .venv/.test-ready
	@$(BIN)/python -m bench.mutants --sample $(SAMPLE) --seed $(SEED) $(MUTANTS_ARGS)

# Four tests at a time, as many wait for a clock or a process. The processes they start, some hundreds, are not to compile
# each module anew.
test: export PYTHONDONTWRITEBYTECODE :=
test: .venv/.test-ready
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	$(BIN)/pytest -n 4 --dist worksteal

# The examples' types and tests, as a user checks them: against the wheel, in an environment of its own, away from this
# folder.
example: .venv/.test-ready
	@set -e; home=$$(mktemp -d); trap 'rm -rf "$$home" build' EXIT; rm -rf build; \
	echo "Installing the wheel into an environment of its own"; \
	$(PIP) wheel --quiet --no-deps --no-build-isolation --wheel-dir "$$home" .; \
	sed -n '/^[^ ].*==/s/ *\\$$//p' requirements-dev.lock >"$$home/constraints.txt"; \
	"$(PYTHON)" -m venv "$$home/venv"; \
	"$$home/venv/bin/python" -m pip --disable-pip-version-check install --quiet \
		--constraint "$$home/constraints.txt" "$$(ls "$$home"/*.whl)[testing]" mypy types-shapely; \
	cp -R examples "$$home/examples"; cd "$$home/examples/own_allocator"; \
	printf '[mypy]\nstrict = True\n[mypy-msgpack]\nignore_missing_imports = True\n' >mypy.ini; \
	"$$home/venv/bin/python" -m mypy . ../vehicle/vehicle.py ../read_a_mission.py; \
	"$$home/venv/bin/python" -m pytest

# Wheel and source archive in dist/, checked as an index checks them; the wheel is flown from an environment of its own,
# away from this folder. The wheel is built from the archive, so that nothing is missing there.
RELEASE_TOOLS := build==1.3.0 twine==6.2.0 setuptools==80.9.0
release: .venv/.run-ready
	@set -e; home=$$(mktemp -d); trap 'rm -rf "$$home"' EXIT; rm -rf dist; \
	"$(PYTHON)" -m venv "$$home/tools"; \
	"$$home/tools/bin/python" -m pip --disable-pip-version-check install --quiet $(RELEASE_TOOLS); \
	"$$home/tools/bin/python" -m build --no-isolation --outdir dist . >"$$home/log" 2>&1 || { cat "$$home/log"; exit 1; }; \
	"$$home/tools/bin/python" -m twine check --strict dist/*; \
	"$(PYTHON)" -m venv "$$home/venv"; \
	"$$home/venv/bin/python" -m pip --disable-pip-version-check install --quiet --require-hashes \
		--requirement requirements.lock; \
	"$$home/venv/bin/python" -m pip --disable-pip-version-check install --quiet --no-deps dist/*.whl; \
	cp tests/support/brief.yaml "$$home"; cd "$$home"; venv/bin/secondlook --version; \
	venv/bin/secondlook check brief.yaml; venv/bin/secondlook run brief.yaml --out out

# The stamps are what makes a second call start at once.
.venv/.made:
	@"$(PYTHON)" -c '$(usable)' 2>/dev/null || { echo "No usable Python found: secondlook needs Python 3.11 or newer" \
		"with its venv module (on Debian and Ubuntu: python3-venv); name one with make PYTHON=/path/to/python3." >&2; \
		exit 1; }
	@rm -rf .venv
	@echo "Setting up .venv with $(PYTHON)"
	@"$(PYTHON)" -m venv .venv
	@touch $@

.venv/.run-ready: .venv/.made requirements.lock pyproject.toml
	@echo "Installing what running needs (requirements.lock)"
	@$(PIP) install --quiet --require-hashes --requirement requirements.lock
	@$(INSTALL_PROJECT)
	@echo "Compiling what is worked on number by number"
	@$(COMPILE_NODES)
	@touch $@

# What testing needs includes what running needs, so this makes both ready.
.venv/.test-ready: .venv/.made requirements-dev.lock pyproject.toml
	@echo "Installing what testing needs (requirements-dev.lock)"
	@$(PIP) install --quiet --require-hashes --requirement requirements-dev.lock
	@$(INSTALL_PROJECT)
	@echo "Compiling what is worked on number by number"
	@$(COMPILE_NODES)
	@touch .venv/.run-ready $@

# The locks hold for every Python >= 3.11 and every platform, each package in one version for all of them, and name no
# index. The tool that writes them has an environment of its own, so that a broken lock can still be made anew.
UV_VERSION := 0.13.8
COMPILE = .venv-lock/bin/uv pip compile --no-config --universal --fork-strategy fewest --python-version 3.11 \
	--generate-hashes --no-emit-index-url --no-emit-find-links --no-annotate --no-header --quiet $(LOCK_ARGS)

lock: .venv-lock/.uv-$(UV_VERSION)
	$(COMPILE) pyproject.toml --group build --output-file requirements.lock
	$(COMPILE) pyproject.toml --all-extras --group build --group dev --constraint requirements.lock \
		--output-file requirements-dev.lock

.venv-lock/.uv-$(UV_VERSION):
	@rm -rf .venv-lock
	@"$(PYTHON)" -m venv .venv-lock
	@.venv-lock/bin/python -m pip --disable-pip-version-check install --quiet uv==$(UV_VERSION)
	@touch $@

# What the targets above have made, but for the missions in runs/, and nothing else.
SOURCES := bench comms coordinator docs examples modem planner secondlook sim_world tests vehicle_agent viz
clean:
	rm -rf .venv .venv-lock build secondlook.egg-info .mypy_cache .ruff_cache .pytest_cache .import_linter_cache \
		.hypothesis site runs/golden runs/pictures
	find $(SOURCES) -name __pycache__ -type d -prune -exec rm -rf {} +
