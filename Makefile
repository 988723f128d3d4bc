# Commands for contributors; CONTRIBUTING.md describes when to run them.
PATH := $(CURDIR)/.venv/bin:$(PATH)
.PHONY: help setup nvcc format check fast test long search docs site bench

help:  ## list all targets
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' Makefile | expand -t 10

setup:  ## create .venv with urdfkin and the packages for its tests
	sh -c '. scripts/environment.sh; make_environment "[test]"' scripts/setup

nvcc:  ## install CUDA's compiler in .venv/nvcc, for the long tests of exported code and scripts/benchmark_gpu.py
	sh -c '. scripts/environment.sh; install_nvcc' scripts/setup

format:  ## format Python files, and apply the automatic fixes of ruff
	ruff format .
	ruff check --fix .

check:  ## check format, lint, types and changelog
	ruff format --check .
	ruff check .
	mypy
	python scripts/changelog_gate.py

fast:  ## the quick tests: about 70 seconds on two idle cores
	pytest -q -n 2 --dist worksteal -m "not slow and not browser"

test: check  ## all checks and tests except the long tests
	urdfkin warm
	pytest -q -n 2 --dist worksteal -m "not long"

long:  ## the long tests: processes, mutants, fuzzing, packages, browsers
	urdfkin warm
	pytest -q -n 2 --dist worksteal -m long

search:  ## the quick tests, with new random examples for property tests
	pytest -q -n 2 -m "not slow and not browser" --hypothesis-profile=search

docs:  ## generate the pages that are made from code, then the site
	python scripts/make_pages.py
	python scripts/make_tour.py
	python scripts/make_architecture.py
	python scripts/make_conventions.py
	python scripts/make_libraries.py --page
	python scripts/check_exports.py --sizes
	python scripts/measure_size.py
	python scripts/measure_start.py
	$(MAKE) site

site:  ## build the documentation site in site/index.html; needs no network
	mkdocs build --strict

bench:  ## compare the speed with Pinocchio, in seconds
	python scripts/benchmark.py --quick
