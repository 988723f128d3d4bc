# The loop of whoever changes urdfkin; CONTRIBUTING.md says when to run what.
PATH := $(CURDIR)/.venv/bin:$(PATH)
.PHONY: help setup nvcc format check fast test long search docs site bench

help:  ## this list
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' Makefile | expand -t 10

setup:  ## .venv with urdfkin and all that its tests need
	sh -c '. scripts/environment.sh; make_environment "[test]"' scripts/setup

nvcc:  ## CUDA's compiler in .venv/nvcc, for the long tests of exported code and scripts/benchmark_gpu.py
	sh -c '. scripts/environment.sh; install_nvcc' scripts/setup

format:  ## write Python as it is written here
	ruff format .
	ruff check --fix .

check:  ## format, lint, types, changelog
	ruff format --check .
	ruff check .
	mypy
	python scripts/changelog_gate.py

fast:  ## the quick tests: a minute on two quiet cores
	pytest -q -n 2 -m "not slow and not browser"

test: check  ## everything that must pass, but the long tests
	urdfkin warm
	pytest -q -n 2 --dist worksteal -m "not long"

long:  ## the long tests: processes, mutants, fuzzing, packages, browsers
	urdfkin warm
	pytest -q -n 2 --dist worksteal -m long

search:  ## the quick tests, their properties on examples that were never tried
	pytest -q -n 2 -m "not slow and not browser" --hypothesis-profile=search

docs:  ## the pages that are generated from the code, then the site
	python scripts/make_pages.py
	python scripts/make_tour.py
	python scripts/make_architecture.py
	python scripts/make_conventions.py
	python scripts/make_libraries.py --page
	python scripts/check_exports.py --sizes
	python scripts/measure_size.py
	python scripts/measure_start.py
	$(MAKE) site

site:  ## the documentation as a site, in site/index.html: no network, now or later
	mkdocs build --strict

bench:  ## beside Pinocchio, in seconds
	python scripts/benchmark.py --quick
