# `make help` lists the targets.  Needs Python 3.11 or later, git and a network that reaches PyPI.

SHELL := /bin/sh
.DEFAULT_GOAL := help

# The simulator has wheels for Python 3.11 only, so that version is preferred where there is one.
PYTHON ?= $(shell python3.11 -c '' 2>/dev/null && echo python3.11 || echo python3)
VENV := .venv
BIN := $(VENV)/bin
DEMO := runs/demo
# One test process more than there are cores: a third of the time of the tests is waiting.
JOBS ?= $(shell expr $$(nproc) + 1)
PYTEST = $(BIN)/pytest -n $(JOBS) --dist worksteal
# What `make quick` leaves out; tests/conftest.py says which tests have these marks.
QUICK := not slow and not page and not physics and not deep

.PHONY: help install demo quick test deep format lint types layers proofs pytest mutation clean

help: ## list the targets
	@awk -F ' ## ' '/^[a-z]+:.* ## / { sub(/:.*/, "", $$1); printf "  make %-9s %s\n", $$1, $$2 }' Makefile

install: $(VENV)/.installed ## create .venv and install aeros with its simulator into it

demo: install ## prove ecms/, then one agent makes dumplings on the simulated Panda
	@rm -rf $(DEMO) $(DEMO)-agent
	@echo '$$ aeros verify ecms/'
	@$(BIN)/aeros verify ecms/
	@echo
	@echo '$$ aeros run "make dumplings" --out $(DEMO)'
	@$(BIN)/aeros run "make dumplings" --out $(DEMO) --state $(DEMO)-agent

quick: $(VENV)/.installed-test ## what is fast: under 90 s of processor time, once mypy has its cache
	@$(MAKE) --no-print-directory --keep-going format lint types layers pytest-quick

test: $(VENV)/.installed-test ## every check that CI runs; all steps run, and any that fails fails this
	@$(MAKE) --no-print-directory --keep-going -j2 --output-sync=target types format lint layers proofs; \
	  checks=$$?; $(MAKE) --no-print-directory pytest && exit $$checks

deep: $(VENV)/.installed-test ## every test, with 25 times the examples: an hour or more, each night
	@echo '== pytest, all tests, Hypothesis profile `nightly`'
	@AEROS_HYPOTHESIS=nightly $(PYTEST)

format: $(VENV)/.installed-test
	@echo '== ruff format --check'
	@$(BIN)/ruff format --quiet --diff .

lint: $(VENV)/.installed-test
	@echo '== ruff check'
	@$(BIN)/ruff check --quiet .

types: $(VENV)/.installed-test
	@echo '== mypy --strict'
	@$(BIN)/mypy

layers: $(VENV)/.installed-test
	@echo '== lint-imports'
	@$(BIN)/lint-imports --no-cache --no-logo

proofs: $(VENV)/.installed-test
	@echo '== aeros verify ecms/ --check'
	@$(BIN)/aeros verify ecms/ --check
	@echo '== aeros prove'
	@$(BIN)/aeros prove

pytest: $(VENV)/.installed-test
	@echo '== pytest'
	@$(PYTEST) -m 'not deep'

.PHONY: pytest-quick
pytest-quick: $(VENV)/.installed-test
	@echo '== pytest, fast tests'
	@$(BIN)/pytest -m '$(QUICK)'

mutation: $(VENV)/.installed-test ## kill mutants of what proves, as docs/mutation.md tells: hours
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[mutation]'
	@nice $(BIN)/python tests/mutation.py $(MUTANTS)

clean: ## remove .venv, caches and runs
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache .grimp_cache .aeros runs dist mutants
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/.created:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo 'AEROS needs Python 3.11 or later; $(PYTHON) is older or missing.  Name one: make PYTHON=/path/to/python3.11'; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info >= (3, 12))' 2>/dev/null || \
	  echo 'PyBullet has no wheel for this Python, so pip compiles it; with Python 3.11 this takes no compiler.'
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || { \
	  echo 'creating $(VENV) with $(PYTHON)'; $(PYTHON) -m venv --clear $(VENV); }
	@touch $@

$(VENV)/.installed: $(VENV)/.created pyproject.toml
	@echo 'installing aeros, its solver and its simulator into $(VENV): 500 MB, a minute or two'
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[audit,sim]'
	@touch $@

$(VENV)/.installed-test: $(VENV)/.installed pyproject.toml
	@echo 'installing what the tests need into $(VENV)'
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@
