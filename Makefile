# Two commands do all their own set-up: `make validate` and `make test`.
VENV ?= .venv
PYTHON ?= python3
BIN = $(VENV)/bin
# Compiled files are kept, also where the environment says not to: the tests start hundreds of processes.
export PYTHONDONTWRITEBYTECODE =

.PHONY: validate test test-all machines machines-all margins fuzz mutants lint docs pages bench-measure bench-planner bench-cost reference proof agreement crowded clean

validate: $(VENV)/.installed
	$(BIN)/ice validate task1 --fresh

test: lint
	$(BIN)/pytest -n 2 --dist worksteal -m "not long"

# Those of tests/long.txt as well (ten minutes more).
test-all: lint
	$(BIN)/pytest -n 2 --dist worksteal

# Part of the tests as on two other processors: BLAS kernels and threads, the instruction sets of NumPy and Embree (4 minutes).
machines: $(VENV)/.test-installed
	$(BIN)/python -m tests.machines

# All that `make test` runs, on four (half an hour).
machines-all: $(VENV)/.test-installed
	$(BIN)/python -m tests.machines --all

# Which comparisons of the tests come within a factor 5 of their limits, and do not say why? (15 minutes)
margins: $(VENV)/.test-installed
	$(BIN)/python -m tests.margins -n 2 --dist worksteal

# How near estimators and ellipses come to the Cramer-Rao bound, on our images and on GalSim's, and how fast (15 minutes).
bench-measure: $(VENV)/.test-installed
	$(BIN)/python -m tests.benchmarks.estimators
	$(BIN)/python -m tests.benchmarks.independent

# 20,000 hostile files, run directories, options and arrays: no traceback, no hang, at most 1 GiB (5 minutes).
fuzz: $(VENV)/.test-installed
	OMP_NUM_THREADS=1 $(BIN)/python -m tests.hard.fuzzing --count 20000 --workers 2

# 200 slips planted one at a time: which of them does no test notice? (more than an hour; known outcomes are kept)
mutants: $(VENV)/.test-installed
	$(BIN)/python -m tests.proofs.mutants --count 200 --workers 2

bench-planner: $(VENV)/.installed
	$(BIN)/python -m tests.benchmarks.search

# Accuracies and budgets asked for and reached, beside parameters set by hand (40 minutes).
bench-cost: $(VENV)/.installed
	$(BIN)/python -m tests.proofs.cost task1

lint: $(VENV)/.test-installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports --no-cache
	$(BIN)/ty check --python $(VENV)

# The pages of docs/, into build/docs: offline, every warning an error.
docs: $(VENV)/.docs-installed
	OMP_NUM_THREADS=1 $(BIN)/sphinx-build -W -n --keep-going -q -d build/docs/.doctrees docs build/docs
	@echo build/docs/index.html

# The pages that are made from the program; the notebook needs pandas.
pages: $(VENV)/.test-installed
	$(BIN)/python -m scenes.reference docs
	$(BIN)/python -m validation.report.executed docs/notebook.ipynb
	$(BIN)/python -m validation.cli.reference docs

# Store the run and the documents that the tests compare with anew, after a change of the measurement that was wanted.
reference: $(VENV)/.installed
	ICE_VARIANT=scalar_rgb $(BIN)/ice validate tests/regression/reference.toml --renders 500 --seed 1 --workers 1 --fresh --out runs/reference
	cp runs/reference/result.json tests/regression/reference.json
	$(BIN)/python -m tests.regression.test_documents $$(mktemp -d)
	$(BIN)/python -m tests.regression.test_numbers
	$(BIN)/python -m tests.regression.test_returns
	$(BIN)/python -m tests.unit.test_fields
	$(BIN)/python -m tests.unit.test_defaults

# A run killed 20 times ends with the numbers of an unbroken one.
proof: $(VENV)/.installed
	$(BIN)/python -m tests.proofs kill --times 20

# Is every variance that is said the one that 1000 pictures show, in every scene and by every estimator? (10 minutes)
agreement: $(VENV)/.test-installed
	$(BIN)/python -m tests.proofs.agreement

# Does the arrangement estimator stand at the bound, unbiased, where edges crowd? (random poses, small images, blocks)
crowded: $(VENV)/.test-installed
	$(BIN)/python -m tests.proofs crowded
	$(BIN)/python -m tests.proofs conditions

$(VENV)/.installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e .
	$(BIN)/python -m compileall -q imaging measure planner render scenes validation
	touch $@

$(VENV)/.test-installed: $(VENV)/.installed
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[test]"
	touch $@

$(VENV)/.docs-installed: $(VENV)/.installed
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[docs]"
	touch $@

clean:
	rm -rf $(VENV) runs build .pytest_cache .ruff_cache .hypothesis
