# `make help` lists the targets.  Needs Python 3.11 or later, git and a network that reaches PyPI.
# What is installed is locked, with hashes, in requirements/; `make lock` renews the locks.

SHELL := /bin/sh
.DEFAULT_GOAL := help
.NOTPARALLEL:

# The simulator has wheels for Python 3.11 only, so that version is preferred where there is one.
PYTHON ?= $(shell python3.11 -c '' 2>/dev/null && echo python3.11 || echo python3)
VENV := .venv
BIN := $(VENV)/bin
DEMO := runs/demo
JOBS ?= 2
LOCK := $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --custom-compile-command 'make lock'
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check

.PHONY: help install demo test format lint types layers proofs pytest mutation clean

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

test: $(VENV)/.installed-test ## every check that CI runs; all steps run, and any that fails fails this
	@$(MAKE) --no-print-directory --keep-going format lint types layers proofs pytest

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
	@$(BIN)/pytest -n $(JOBS)

mutation: $(VENV)/.installed-test ## kill mutants of what proves, as docs/mutation.md tells: hours
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[mutation]'
	@nice $(BIN)/python tests/mutation.py $(MUTANTS)

clean: ## remove .venv, caches and runs
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache .grimp_cache .aeros runs dist mutants
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

lock: $(VENV)/.installed-release ## renew requirements/*.txt: newest versions that pyproject.toml allows, with their hashes
	@echo '== uv pip compile'
	@$(LOCK) --upgrade --extra test --no-emit-package pybullet pyproject.toml requirements/build.in -o requirements/test.txt
	@$(LOCK) --upgrade --extra audit --extra sim --no-emit-package pybullet \
	  --constraint requirements/test.txt pyproject.toml requirements/build.in -o requirements/install.txt
	@sed -n 's/^sim = .*"\(pybullet==[^"]*\)".*/\1/p' pyproject.toml | $(LOCK) --upgrade - -o requirements/simulator.txt
	@$(LOCK) --upgrade --group release --constraint requirements/test.txt -o requirements/release.txt

$(VENV)/.created:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo 'AEROS needs Python 3.11 or later; $(PYTHON) is older or missing.  Name one: make PYTHON=/path/to/python3.11'; exit 1; }
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || { \
	  echo 'creating $(VENV) with $(PYTHON)'; $(PYTHON) -m venv --clear $(VENV); }
	@touch $@

$(VENV)/.installed: $(VENV)/.created pyproject.toml requirements/install.txt requirements/simulator.txt
	@echo 'installing aeros, its solver and its simulator into $(VENV): 500 MB, a minute or two'
	@$(PIP) --require-hashes --requirement requirements/install.txt
	@if $(BIN)/python -c 'import sys; sys.exit(sys.version_info >= (3, 12))'; then \
	  $(PIP) --require-hashes --requirement requirements/simulator.txt; \
	else \
	  echo 'PyBullet has no wheel for this Python, so the physics plant is left out.  With Python 3.11 it is there; with a'; \
	  echo 'compiler: $(BIN)/python -m pip install --require-hashes --requirement requirements/simulator.txt'; \
	fi
	@$(PIP) --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/.installed-test: $(VENV)/.installed requirements/test.txt
	@echo 'installing what the tests need into $(VENV)'
	@$(PIP) --require-hashes --requirement requirements/test.txt
	@touch $@

$(VENV)/.installed-release: $(VENV)/.created requirements/release.txt
	@echo 'installing what makes releases into $(VENV)'
	@$(PIP) --require-hashes --requirement requirements/release.txt
	@touch $@
