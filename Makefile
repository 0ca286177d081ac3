# make help lists the targets. The first one that needs it creates .venv and installs the pinned packages.

PYTHON ?= python3
SCALE ?= full
TESTS ?= HEAD
VERSIONS ?= 3.11-lowest-direct 3.12-pinned 3.13-highest
BIN := .venv/bin
RUN_STAMP := .venv/installed-to-run
STAMP := .venv/installed
BENCH_STAMP := .venv/installed-bench
LAB_STAMP := .venv/installed-lab
DOCS_STAMP := .venv/installed-docs
BROWSER_STAMP := .venv/browser
FIREFOX_STAMP := .venv/firefox
DENO := DENO_DIR=.venv/deno DENO_NO_UPDATE_CHECK=1 DENO_NO_PACKAGE_JSON=1 $(BIN)/deno
UV := $(BIN)/uv pip install --quiet --python $(BIN)/python --compile-bytecode --constraint constraints.txt

.PHONY: help quickstart reproduce-figures test test-slow notebooks documents docs bench mutants versions check types rules format clean

help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 12

quickstart: $(RUN_STAMP)  ## run a small study, print its table, draw its figure
	$(BIN)/sweep launch experiments/nguyen2024/quickstart.yaml
	$(BIN)/sweep table quickstart
	$(BIN)/sweep plot quickstart curves

reproduce-figures: $(RUN_STAMP)  ## run, draw and judge all that was published; SCALE=quick with few trials
	$(BIN)/sweep reproduce --scale $(SCALE)

test: check $(BROWSER_STAMP)  ## check the code and run the fast tests
	$(BIN)/pytest

test-slow: $(LAB_STAMP) $(DOCS_STAMP) $(BROWSER_STAMP) $(FIREFOX_STAMP)  ## run the full-size tests
	$(BIN)/pytest -m slow

notebooks: $(STAMP)  ## run the notebooks from nothing and write down what comes out
	$(BIN)/sweep warm
	$(BIN)/python notebooks/execute.py

documents: $(STAMP)  ## write what follows from the code, the scorecard and pyproject.toml: keys, headline, authors, addresses
	$(BIN)/python -m sweep.spec.key_table > docs/keys.md
	$(BIN)/python -m sweep.published.headline README.md experiments results
	$(BIN)/python -m docs.building.publisher

docs: $(DOCS_STAMP)  ## build the documentation site, build/site/index.html
	$(BIN)/python -m docs.building.site

bench: $(BENCH_STAMP) $(BROWSER_STAMP)  ## measure speed: ratios within one run
	$(BIN)/python -m tests.bench $(ONLY)

mutants: $(STAMP)  ## put small mistakes into copies, list those that no test notices; TESTS=revision
	$(BIN)/python -m tests.mutants --tests $(TESTS)

versions: $(VERSIONS:%=build/versions/%)  ## run the fast tests with other versions of Python and packages; VERSIONS=3.13-highest

# A copy of the last commit with an environment of its own: a version of Python, and the packages of
# constraints.txt ("pinned"), or the lowest or highest that pyproject.toml allows.
build/versions/%: $(STAMP) $(BROWSER_STAMP) FORCE
	rm -rf $@
	git clone --quiet . $@
	$(BIN)/uv venv --quiet --python $(firstword $(subst -, ,$*)) $@/.venv
	cd $@ && $(CURDIR)/$(BIN)/uv pip install --quiet --python .venv/bin/python --group dev --editable '.[sensitivity,view]' \
		$(if $(findstring pinned,$*),--constraint constraints.txt,--resolution $(patsubst $(firstword $(subst -, ,$*))-%,%,$*))
	$(BIN)/uv pip list --python $@/.venv/bin/python
	cd $@ && .venv/bin/pytest

FORCE:

check: $(STAMP)  ## check types, and beside them lint, formatting and rules
	@$(MAKE) --no-print-directory --jobs 2 --output-sync types rules

types: $(STAMP)  ## check the types alone
	$(BIN)/mypy

rules: $(STAMP)  ## lint, formatting and rules of the house alone
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/python -m tests.house
	$(BIN)/oxlint --config .oxlintrc.json
	$(DENO) fmt --check
	$(DENO) check --quiet
	$(BIN)/check-jsonschema --quiet --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/check-jsonschema --quiet --builtin-schema vendor.github-actions action.yml
	$(BIN)/zizmor --quiet --offline --no-progress .github/workflows action.yml

format: $(STAMP)  ## format the code
	$(BIN)/ruff check --fix
	$(BIN)/ruff format
	$(BIN)/oxlint --config .oxlintrc.json --fix
	$(DENO) fmt --quiet

clean:  ## delete the environment and all caches, not the results
	rm -rf .venv .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# What runs every built-in study and the live simulator; no tools of developers.
$(RUN_STAMP): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "boidsweep needs Python 3.11 or newer: make PYTHON=python3.11")'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt uv
	$(UV) --editable '.[sensitivity,view]'
	@touch $@

# The tests and tools too, in the same environment.
$(STAMP): $(RUN_STAMP)
	$(UV) --group dev
	@touch $@

$(BENCH_STAMP): $(STAMP)
	$(UV) --group bench
	@touch $@

$(DOCS_STAMP): $(STAMP)
	$(UV) --group docs
	@touch $@

# The widget is tested where it lives.
$(LAB_STAMP): $(STAMP)
	$(UV) --editable '.[notebook]'
	@touch $@

# Pages are tested in real browsers.
$(BROWSER_STAMP): $(STAMP)
	@$(call install,chromium)
	@touch $@

$(FIREFOX_STAMP): $(STAMP)
	@$(call install,firefox-esr)
	@touch $@

define install
command -v $(1) >/dev/null || { apt-get update -qq && apt-get install -yqq --no-install-recommends $(1); } >/dev/null \
	|| { echo 'the tests need a browser: install Debian'"'"'s package $(1)'; exit 1; }
endef
