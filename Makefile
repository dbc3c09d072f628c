# make help lists the targets. Each makes the set-up it needs (scripts/setup.sh) and only once.
# DOLFINX=wheel|system and PYTHON=/path/to/python3 choose what it takes; docs/install.md says how.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help setup demo campaign validation validate test test-mpi bench lint api docs dist clean always

NAME ?= blade
JOBS ?= $(shell nproc)
STAMP := .venv/.setup-stamp
DOCS_STAMP := .venv/.docs-stamp
PYTHON_IN_VENV := .venv/bin/python
RUN := scripts/run $(if $(RANKS),-n $(RANKS))
REDUCED := $(if $(filter-out 0,$(QUICK)),--quick)
LESSON := $(wildcard demos/demo_$(NAME).py)
PROGRAM := tests/validation/$(NAME).py
names = $$(ls $(1) | sed -n '/^_/d; s/^$(2)\(.*\)\.py$$/\1/p')

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

# The script sees for itself whether .venv is whole and up to date, and then leaves the stamp alone.
$(STAMP): always
	@bash scripts/setup.sh

setup: $(STAMP) ## install what is missing

demo: $(STAMP) ## run the lesson NAME, or else the validation program: NAME=blade RANKS=2 QUICK=1; writes results/NAME
	@test -f $(or $(LESSON),$(PROGRAM)) || { echo "no demo '$(NAME)'; there are:" $(call names,demos,demo_) \
	    "and the validation programs" $(call names,tests/validation) >&2; exit 2; }
	@test -z '$(and $(LESSON),$(strip $(ARGS)))' || \
	    { echo "a lesson has no options: edit $(LESSON), or see make validation" >&2; exit 2; }
	$(RUN) $(or $(LESSON),$(PROGRAM) --out results/$(NAME)) $(REDUCED) $(ARGS)

validation: $(STAMP) ## run a validation program: NAME=blade QUICK=1 ARGS="--friction .1"; writes results/validation/NAME
	@test -f $(PROGRAM) || { echo "no validation program '$(NAME)'; there are:" $(call names,tests/validation) >&2; exit 2; }
	$(RUN) $(PROGRAM) $(REDUCED) $(ARGS)

validate: $(STAMP) ## run what compares results with references, and make its page: ARGS="--quick", "--only dcb"
	.venv/bin/cutsim validate -j $(JOBS) $(ARGS)

test: $(STAMP) ## run all tests on one rank, JOBS=2 files at a time, then those marked mpi on 2 ranks, and those that compare ranks on 3
	scripts/run -n 1 -m pytest -n $(JOBS) --dist loadfile --durations 20 tests $(ARGS)
	@$(MAKE) --no-print-directory test-mpi

test-mpi: $(STAMP) ## run the tests marked mpi on 2 ranks, and on 3 those that compare ranks, with two sets of parameters of each
	scripts/run -n 2 -m pytest -x -q -p no:cacheprovider -m mpi --thin --durations 12 tests $(ARGS)
	scripts/run -n 3 -m pytest -x -q -p no:cacheprovider -m mpi -k rank --thin --durations 12 tests $(ARGS)

campaign: $(STAMP) ## run random cuts, or go on with them: SEED=2 ARGS="--plane 50 --space 0"; writes results/campaign
	$(PYTHON_IN_VENV) tests/campaign/campaign.py --seed $(or $(SEED),1) $(ARGS)

bench: $(STAMP) ## print wall and CPU time, iterations, peak memory, and what a solve costs by part, of the reference problems
	for name in cube dcb blade blade_3d sliding; do echo "== $$name"; \
	    scripts/run -n $(or $(RANKS),1) tests/benchmarks/bench_$$name.py || exit 1; \
	done

lint: $(STAMP) ## ruff and mypy
	$(PYTHON_IN_VENV) -m ruff check .
	$(PYTHON_IN_VENV) -m mypy

$(DOCS_STAMP): pyproject.toml $(STAMP)
	$(PYTHON_IN_VENV) -m pip install --quiet --disable-pip-version-check -c .venv/constraints.txt -e '.[docs]'
	@touch $@

api: $(STAMP) ## write docs/api.md and the keys in docs/case_files.md from the docstrings
	$(PYTHON_IN_VENV) docs/make_api.py
	$(PYTHON_IN_VENV) docs/make_case_files.py

docs: $(DOCS_STAMP) ## build docs/_build/html
	$(PYTHON_IN_VENV) -m sphinx -W --keep-going -b html docs docs/_build/html

dist: ## build sdist and wheel into dist/, and cut with the wheel from an empty environment elsewhere
	bash scripts/dist.sh

clean: ## remove results, caches, built docs and packages; keeps .venv
	rm -rf results dist docs/_build docs/jupyter_execute docs/reference .mypy_cache .ruff_cache .pytest_cache
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +
