# `make help` lists the targets.  Needs Python 3.11 or later, git and a network that reaches PyPI.
# What is installed is locked, with hashes, in requirements/; `make lock` renews the locks.

SHELL := /bin/sh
.DEFAULT_GOAL := help

# PyBullet has wheels for Python 3.11 only, so that version is preferred where there is one.
PYTHON ?= $(shell python3.11 -c '' 2>/dev/null && echo python3.11 || echo python3)
VENV := .venv
BIN := $(VENV)/bin
DEMO := runs/demo
# As many test processes as there are cores: each imports all tests and proves the modules that its tests need.
JOBS ?= $(shell nproc)
# Commands that tests start a hundred times would otherwise compile their modules each time.
unexport PYTHONDONTWRITEBYTECODE
PYTEST = $(BIN)/pytest -n $(JOBS) --dist worksteal
# What `make quick` leaves out; tests/conftest.py says which tests have these marks.
QUICK := not slow and not page and not physics and not deep

# Percent of statements and branches that tests/coverage.txt must reach, by part.
COVERED := 97:aeros/runtime/gate/*.py,aeros/runtime/gate/compiled/*.py 98:aeros/spec/expr/*.py,aeros/spec/expr/typecheck/*.py 98:aeros/spec/obligations/*.py
# Extras stay in the locks: without `coverage[toml]==…`, pip 23 takes a newer `coverage[toml]`, which has no hash, and fails.
LOCK := $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-strip-extras --custom-compile-command 'make lock'
PIP := $(BIN)/python -m pip install --no-compile --quiet --disable-pip-version-check
INSTALL_UV := $(PIP) --only-binary :all: --require-hashes --requirement requirements/uv.txt
# Install what a lock lists: by uv, in a third of pip's time; where uv cannot, as it reads no pip.conf, by pip.
define install-lock
$(BIN)/uv pip install --quiet --python $(BIN)/python --require-hashes --requirement $(1) 2>/dev/null \
  || { echo 'uv cannot install $(1) here; pip does, which takes longer'; $(PIP) --require-hashes --requirement $(1); }
endef

.PHONY: help install demo clips quick test deep format lint types layers proofs pytest mutation coverage benchmark ros hook tools schemas site dist lock clean

help: ## list the targets
	@awk -F ' ## ' '/^[a-z]+:.* ## / { sub(/:.*/, "", $$1); printf "  make %-9s %s\n", $$1, $$2 }' Makefile

install: $(VENV)/.installed ## create .venv and install aeros with its simulator into it

demo: install ## prove ecms/, then one agent makes dumplings on the simulated Panda
	@rm -rf $(DEMO) $(DEMO)-agent
	@$(BIN)/aeros demo --out $(DEMO) --state $(DEMO)-agent

clips: $(VENV)/.installed-test ## make the clips of the README anew: 20 minutes of two cores; CLIPS='gate' for one
	@$(BIN)/python -m tools.make_clips $(CLIPS)

quick: $(VENV)/.installed-test ## what is fast: under 90 s of processor time, once mypy has its cache
	@$(MAKE) --no-print-directory --keep-going format lint types layers pytest-quick

test: $(VENV)/.installed-test ## every check that CI runs; all steps run, and any that fails fails this
	@$(MAKE) --no-print-directory --keep-going -j2 --output-sync=target types format lint layers proofs; \
	  checks=$$?; $(MAKE) --no-print-directory pytest && exit $$checks

deep: $(VENV)/.installed-test ## every test, with 25 times the examples: an hour or more, each night
	@$(PIP) --editable '.[learned-proof]'
	@$(PIP) --editable '.[franka]'
	@echo '== pytest, all tests, Hypothesis profile `nightly`'
	@AEROS_HYPOTHESIS=nightly $(PYTEST)

format: $(VENV)/.installed-test
	@echo '== ruff format --check, aeros fmt --diff'
	@$(BIN)/ruff format --quiet --diff . && $(BIN)/aeros fmt --quiet --diff $(wildcard aeros docs ecms experiments learned services)

lint: $(VENV)/.installed-test
	@echo '== ruff check, codespell'
	@$(BIN)/ruff check --quiet . && $(BIN)/codespell

types: $(VENV)/.installed-test
	@echo '== mypy --strict'
	@$(BIN)/mypy

layers: $(VENV)/.installed-test
	@echo '== lint-imports'
	@$(BIN)/lint-imports --no-cache --no-logo

proofs: $(VENV)/.installed-test
	@echo '== aeros verify ecms/ --check, aeros verify learned/ --check'
	@$(BIN)/aeros verify ecms/ --check
	@$(BIN)/aeros verify learned/ --check
	@echo '== aeros prove'
	@$(BIN)/aeros prove

pytest: $(VENV)/.installed-test
	@echo '== pytest'
	@$(PYTEST) -m 'not deep'

.PHONY: pytest-quick
pytest-quick: $(VENV)/.installed-test
	@echo '== pytest, fast tests'
	@$(BIN)/pytest -m '$(QUICK)'

mutation: $(VENV)/.installed-test ## mutants of the kernel, as docs/mutation.md says: make mutation MUTANTS='try gate'
	@$(PIP) --editable '.[mutation]'
	@nice $(BIN)/python -m tests.mutation $(or $(MUTANTS),summary)

coverage: $(VENV)/.installed-test ## branch coverage of gate, expressions and obligations, each with a floor
	@$(BIN)/coverage erase
	@$(BIN)/pytest -n $(JOBS) --cov --cov-report= -m 'not physics' @tests/coverage.txt
	@$(BIN)/coverage html --quiet --directory runs/coverage
	@status=0; \
	for part in $(COVERED); do \
	  echo "== branch coverage of $${part#*:}: at least $${part%%:*} %"; \
	  $(BIN)/coverage report --fail-under "$${part%%:*}" --include "$${part#*:}" || status=1; \
	done; exit $$status

benchmark: $(VENV)/.installed-test ## run one: make benchmark BENCHMARK=verify; its figures go to runs/benchmarks/
	@$(PIP) --editable '.[benchmark]'
	@mkdir -p runs/benchmarks
	@$(BIN)/python -m benchmarks.$(BENCHMARK) > runs/benchmarks/$(BENCHMARK).txt
	@cat runs/benchmarks/$(BENCHMARK).txt

ros: ## ROS 2 from PyPI in an environment of its own: build the messages, and measure beside rclpy alone
	@test -x runs/ros/bin/python || $(PYTHON) -m venv runs/ros
	@runs/ros/bin/python -m pip install --no-compile --quiet --disable-pip-version-check --editable '.[kinematic]' --editable '.[ros2]'
	@runs/ros/bin/aeros ros2-messages
	@runs/ros/bin/python -m benchmarks.ros2

hook: $(VENV)/.installed-test $(VENV)/.installed-tools ## let pre-commit install and run the hook for users: reaches PyPI
	@AEROS_NETWORK=1 $(BIN)/pytest tests/repo/test_ci_integration.py

tools: $(VENV)/.installed-tools ## install pre-commit, towncrier and what else no test needs

schemas: $(VENV)/.installed ## write the JSON Schemas that .vscode/settings.json maps to manifests and sites
	@for kind in ecm faults people robot scene site; do $(BIN)/aeros schema $$kind > .vscode/$$kind.schema.json || exit 1; done

site: $(VENV)/.installed-tools ## build the pages of docs/ as a site into runs/site; a dead link fails
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet --strict
	@echo "$(CURDIR)/runs/site/index.html"

dist: $(VENV)/.installed-tools ## build the package into dist/ and check what a package index would show of it
	@rm -rf dist
	@$(BIN)/python -m build --quiet --no-isolation
	@$(BIN)/twine check --strict dist/*

lock: $(VENV)/.installed-tools ## renew requirements/*.txt: newest versions that pyproject.toml allows, with their hashes
	@echo '== uv pip compile'
	@$(LOCK) --upgrade --extra test --no-emit-package pybullet pyproject.toml requirements/build.in -o requirements/test.txt
	@$(LOCK) --upgrade --extra sim --extra film --no-emit-package pybullet \
	  --constraint requirements/test.txt pyproject.toml requirements/build.in -o requirements/install.txt
	@sed -n 's/^sim = .*"\(pybullet==[^"]*\)".*/\1/p' pyproject.toml | $(LOCK) --upgrade - -o requirements/simulator.txt
	@echo uv | $(LOCK) --upgrade - -o requirements/uv.txt
	@$(LOCK) --upgrade --group tools --constraint requirements/uv.txt --constraint requirements/test.txt requirements/build.in -o requirements/tools.txt

clean: ## remove .venv, caches and runs
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache .grimp_cache .coverage .aeros runs dist mutants
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(VENV)/.created:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo 'AEROS needs Python 3.11 or later; $(PYTHON) is older or missing.  Name one: make PYTHON=/path/to/python3.11'; exit 1; }
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || { \
	  echo 'creating $(VENV) with $(PYTHON)'; $(PYTHON) -m venv --clear $(VENV); }
	@touch $@

$(VENV)/.installed: $(VENV)/.created pyproject.toml requirements/install.txt requirements/simulator.txt requirements/uv.txt
	@echo 'installing aeros, its solver and its simulator into $(VENV): 500 MB, a minute or two'
	@$(INSTALL_UV) || echo 'pip cannot install uv'
	@$(call install-lock,requirements/install.txt)
	@if $(BIN)/python -c 'import sys; sys.exit(sys.version_info >= (3, 12))'; then \
	  $(call install-lock,requirements/simulator.txt); \
	else \
	  echo 'PyBullet has no wheel for this Python: use --plant mujoco.  With a compiler:'; \
	  echo '$(BIN)/python -m pip install --require-hashes --requirement requirements/simulator.txt'; \
	fi
	@$(PIP) --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/.installed-test: $(VENV)/.installed requirements/test.txt
	@echo 'installing what the tests need into $(VENV)'
	@$(call install-lock,requirements/test.txt)
	@touch $@

$(VENV)/.installed-tools: $(VENV)/.created requirements/tools.txt requirements/uv.txt
	@echo 'installing pre-commit, towncrier and the like into $(VENV)'
	@$(INSTALL_UV)
	@$(call install-lock,requirements/tools.txt)
	@touch $@
