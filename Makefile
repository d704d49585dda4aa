# Commands for people; the build itself is CMake (CMakePresets.json). Missing Debian packages are installed on the way.
.PHONY: help run test asan slow fuzz bench format format-check tidy install-deps build-release build-asan
.DEFAULT_GOAL := help

JOBS ?= $(shell nproc)
FUZZ_SECONDS ?= 600

packages := g++ cmake ninja-build \
  libeigen3-dev libsuitesparse-dev libmetis-dev libopenblas-dev liblapacke-dev libmumps-seq-dev libarpack2-dev libspectra-dev libsundials-dev libmuparser-dev \
  libcli11-dev libtomlplusplus-dev libpugixml-dev zlib1g-dev libssl-dev libhdf5-dev libmatio-dev libsqlite3-dev nlohmann-json3-dev libfmt-dev \
  libgtest-dev libbenchmark-dev \
  python3 python3-numpy python3-scipy python3-meshio python3-vtk9 python3-h5py
format tidy: packages += clang-format clang-tidy
asan build-asan fuzz: packages += clang libclang-rt-14-dev

sources = $(shell find fem reduction dynamics apps tests -name '*.[ch]pp')

help:
	@echo "make run           build, simulate the scene sport, write results/sport and its report"
	@echo "make test          build and run the tests; asan: the same with sanitizers; slow: the long ones"
	@echo "make fuzz          random bytes into the mesh readers, FUZZ_SECONDS (600) for each, with sanitizers"
	@echo "make bench         speed, measured"
	@echo "make format, tidy  clang-format and clang-tidy over all sources"
	@echo "make install-deps  install the Debian packages all of these need (done by each of them, too)"

run: install-deps
	cmake --preset release
	cmake --build --preset release -j $(JOBS) --target flexboom
	build/release/apps/flexboom run sport --out results/sport --report
	@echo "report: file://$(CURDIR)/results/sport/report.html"

test: build-release
	ctest --preset release -j $(JOBS)

asan: build-asan
	ctest --preset asan -j $(JOBS)

slow: build-release
	ctest --preset slow -j $(JOBS)

fuzz: install-deps
	cmake --preset fuzz
	cmake --build --preset fuzz -j $(JOBS)
	@printf '%s\n' gmsh vtu abaqus nastran | xargs -P $(JOBS) -I READER sh -c '\
	  mkdir -p build/fuzz/corpus/READER; \
	  build/fuzz/tests/fuzz/fuzz_READER -max_total_time=$(FUZZ_SECONDS) -rss_limit_mb=3000 -verbosity=0 -print_final_stats=1 \
	    -artifact_prefix=build/fuzz/READER- build/fuzz/corpus/READER tests/fem/meshes tests/fem/broken_meshes \
	    > build/fuzz/READER.log 2>&1; result=$$?; echo "== READER"; tail -n 40 build/fuzz/READER.log; exit $$result'

bench: build-release
	@for program in build/release/tests/bench_*; do [ -x "$$program" ] && [ -f "$$program" ] || continue; \
	  echo "== $${program##*/}"; "$$program" || exit 1; done

build-release build-asan: build-%: install-deps
	cmake --preset $*
	cmake --build --preset $* -j $(JOBS)

format: install-deps
	clang-format -i $(sources)

format-check:
	clang-format --dry-run --Werror $(sources)

# A folder is read as one file (unity build): Eigen is parsed four times then, not two hundred times.
tidy: install-deps
	cmake --preset tidy
	run-clang-tidy -quiet -p build/tidy -j $(JOBS) -checks=-bugprone-suspicious-include \
	  '(/unity_[0-9]+_cxx\.cxx|/(fem|reduction|dynamics|apps)/[a-z0-9_/]+\.cpp)$$'

install-deps:
	@if ! command -v apt-get >/dev/null; then \
	  echo "No apt-get here, so nothing is installed. These Debian packages, or the same under other names, are needed:"; \
	  echo "  $(packages)"; \
	  exit 0; \
	fi; \
	missing=""; \
	for package in $(packages); do \
	  dpkg-query -W -f='$${db:Status-Status}' $$package 2>/dev/null | grep -qx installed || missing="$$missing $$package"; \
	done; \
	[ -n "$$missing" ] || exit 0; \
	echo "installing:$$missing"; \
	sudo=""; \
	if [ "$$(id -u)" != 0 ]; then \
	  command -v sudo >/dev/null || { echo "Not root and no sudo; as root: apt-get install$$missing" >&2; exit 1; }; \
	  sudo=sudo; \
	fi; \
	$$sudo apt-get update && \
	$$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $$missing
