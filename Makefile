# One word per thing a person wants. `make` alone lists them.
PYTHON ?= python3
BIN := $(if $(filter Windows_NT,$(OS)),.venv/Scripts,.venv/bin)
unexport PYTHONDONTWRITEBYTECODE  # a test file whose assertions were once rewritten is read, not rewritten, the next time

.PHONY: help env console demo test quick bytecode check long pythons newest mutants likeness javascript bench docs format clean

help:  ## list the words
	@grep -E '^[a-z]+:.*##' Makefile | sed -E 's/:.*## /\t/' | expand -t 10

env:  ## make .venv with everything a builder needs; keeps what is there
	@$(PYTHON) scripts/make_env.py

console: env  ## open the console: train, watch, compare and import cars in a browser
	@$(BIN)/racecraft console

demo: env  ## train the default car on re:Invent 2018 from its camera until it races, and show what came of it
	@$(BIN)/racecraft train

test: bytecode  ## every test that CI runs, on two cores: tests with warnings as errors, doctests, examples
	@# three workers on two cores: many tests wait for servers and programs
	$(BIN)/python -m pytest -q -n 3 --dist loadfile

quick: env  ## the everyday loop: what takes longer than 0.1 s (tests/slow.txt) is left to `make test`
	$(BIN)/python -m pytest -q --quick -n 2 --dist loadfile

bytecode: env
	@$(BIN)/python -m compileall -q -j 2 src  # two hundred programs that tests start find it, where Python may write none

check: env  ## form: format, lint, types, import rules, generated docs current
	$(BIN)/ruff format --check src tests scripts benchmarks examples
	$(BIN)/ruff check src tests scripts benchmarks examples
	$(BIN)/mypy
	$(BIN)/python -m pytest -q tests/test_imports.py
	$(BIN)/python scripts/generate_docs.py --check
	$(BIN)/mkdocs build --strict --quiet

long: env  ## slow proofs, never CI
	$(BIN)/python -m pytest -q -m long -o timeout=0

pythons: env  ## the tests on every promised Python that is installed
	$(BIN)/python scripts/try_pythons.py

newest: env  ## the tests with the newest version of every dependency
	$(BIN)/python scripts/try_pythons.py --newest -- -q -n 3 --dist loadfile

mutants: env  ## break the code on purpose and list what no test notices
	$(BIN)/python scripts/mutants.py --count 300

likeness: env  ## compare what this commit leaves with what its parent leaves
	$(BIN)/python scripts/compare_revisions.py

javascript: env  ## check the types of our JavaScript; needs Node
	@$(BIN)/python scripts/check_javascript.py

bench: env  ## the benchmarks; run them when nothing else runs
	$(BIN)/python benchmarks/run_all.py

docs: env  ## build the documentation into site/
	$(BIN)/python scripts/generate_docs.py
	$(BIN)/mkdocs build --strict

format: env  ## put every file into shape
	$(BIN)/ruff check --fix src tests scripts benchmarks examples
	$(BIN)/ruff format src tests scripts benchmarks examples

clean:  ## remove what was built; runs stay
	rm -rf build dist site .mypy_cache .ruff_cache .pytest_cache
