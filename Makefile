# `make demo` shows what Fullwell does, `make test` proves it. Both install what they need into .venv; repeat runs are fast.
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
MAKEFLAGS += --no-print-directory

VENV := .venv
BIN := $(VENV)/bin
STAMPS := $(VENV)/.stamps
CONSTRAINTS := constraints/constraints.txt
JOBS ?= 2
DEMO_RECIPE := examples/01_cornell_box.yaml
DEMO_OUTPUT := demo-output

.PHONY: help setup demo test quick prepare lint format tools images constraints clean distclean

help: ## Show this list
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/\1\t\2/p' $(MAKEFILE_LIST) | expand -t 14

setup: $(STAMPS)/dev $(STAMPS)/libraries ## Install everything for development into .venv

demo: $(STAMPS)/runtime $(STAMPS)/libraries ## Render the first example and say where its picture is
	@$(BIN)/fullwell render $(DEMO_RECIPE) -o $(DEMO_OUTPUT)
	@$(BIN)/fullwell show $(DEMO_OUTPUT)

test: prepare ## Lint, types, layers, then every test
	$(BIN)/pytest -n $(JOBS)

quick: setup tools ## All tests but the slow ones: minutes
	$(BIN)/pytest -n $(JOBS) --dist loadfile -m "not slow"

prepare: setup tools lint

lint: $(STAMPS)/dev ## ruff, mypy, import-linter
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

format: $(STAMPS)/dev ## Let ruff write the code's layout
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

tools: ## The S3 server and the browser that tests use
	@bash .ci/install-versitygw
	@bash .ci/install-chromium

images: ## Build the container images
	docker build -f api/Dockerfile -t fullwell-api .
	docker build -f worker/Dockerfile -t fullwell-worker .
	docker build -f k8s/versitygw.Dockerfile -t fullwell-versitygw k8s

constraints: $(STAMPS)/dev ## Write down the versions that are installed now
	@{ sed -n '/^#/p' $(CONSTRAINTS); $(BIN)/pip freeze --exclude-editable | grep -E '^[A-Za-z0-9._-]+=='; } > $(CONSTRAINTS).new
	@mv $(CONSTRAINTS).new $(CONSTRAINTS)

clean: ## Remove what runs and tools left behind
	rm -rf $(DEMO_OUTPUT) out build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis .coverage
	find api services worker tests -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean ## Remove the environment too
	rm -rf $(VENV) .tools

$(STAMPS)/venv:
	@bash .ci/make-venv $(VENV)
	@mkdir -p $(STAMPS) && touch $@

# The build backend comes from the same constraints, so that nothing unpinned takes part.
$(STAMPS)/backend: $(STAMPS)/venv $(CONSTRAINTS)
	$(BIN)/python -m pip install -q -c $(CONSTRAINTS) hatchling editables
	@touch $@

$(STAMPS)/dev: $(STAMPS)/backend pyproject.toml
	$(BIN)/python -m pip install -q -c $(CONSTRAINTS) --no-build-isolation -e '.[dev]'
	@touch $@ $(STAMPS)/runtime

$(STAMPS)/runtime: $(STAMPS)/backend pyproject.toml
	$(BIN)/python -m pip install -q -c $(CONSTRAINTS) --no-build-isolation -e '.[serve,traffic]'
	@touch $@

$(STAMPS)/libraries: | $(STAMPS)/runtime
	@bash .ci/install-libraries $(BIN)/python && touch $@
