# Thin wrappers; the work is done by CMake (see CMakePresets.json) and tools/.
#
#   make test     build everything and run all tests
#   make demo     build, reconstruct a small synthetic world, say where the pictures are
#   make build    build everything
#   make bench    build and run the benchmarks
#   make results  make the thesis's tables and figures anew in docs/results; more than an hour
#   make format   format the sources
#   make docs     write docs/options.md anew from the options table
#
# PRESET=dev|release|asan|tsan picks the build (folder build/PRESET); JOBS=N limits parallel jobs.
PRESET ?= release
JOBS ?= $(shell nproc)
export ROXEL_COMPILER_LAUNCHER ?= $(shell command -v ccache)
export CCACHE_SLOPPINESS ?= pch_defines,time_macros

.PHONY: all setup configure build test demo bench results format docs clean
all: build

setup:
	@tools/setup.sh

configure: setup
	cmake --preset $(PRESET)

build: configure
	cmake --build --preset $(PRESET) -j $(JOBS)

test: build
	ctest --preset $(PRESET) -j $(JOBS)

demo: configure
	cmake --build --preset $(PRESET) -j $(JOBS) --target roxel
	tools/demo.sh build/$(PRESET)/apps/roxel/roxel

bench:
	tools/setup.sh dev
	cmake --preset $(PRESET) -DROXEL_BUILD_BENCHMARKS=ON
	cmake --build --preset $(PRESET) -j $(JOBS)
	tools/bench.sh build/$(PRESET)
	benchmarks/runtime/end_to_end.py --roxel build/$(PRESET)/apps/roxel/roxel

results: setup
	cmake --preset $(PRESET) -DROXEL_BUILD_BENCHMARKS=ON
	cmake --build --preset $(PRESET) -j $(JOBS) --target roxel agreement_figures contact_sheet facade_figure update_figure
	build/$(PRESET)/benchmarks/quality/agreement_figures docs/results
	build/$(PRESET)/benchmarks/quality/update_figure docs/results
	benchmarks/quality/tables.py --roxel build/$(PRESET)/apps/roxel/roxel --sheets build/$(PRESET)/benchmarks/quality/contact_sheet
	build/$(PRESET)/benchmarks/quality/facade_figure build/quality/street docs/results
	benchmarks/quality/figures.py --roxel build/$(PRESET)/apps/roxel/roxel --sheets build/$(PRESET)/benchmarks/quality/contact_sheet
	benchmarks/quality/sky_table.py --roxel build/$(PRESET)/apps/roxel/roxel

format:
	tools/setup.sh dev
	tools/format.sh

docs: configure
	cmake --build --preset $(PRESET) -j $(JOBS) --target docs_test
	ROXEL_UPDATE_DOCS=1 build/$(PRESET)/tests/docs_test

clean:
	rm -rf build/$(PRESET)
