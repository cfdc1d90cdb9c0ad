#!/bin/sh
# Installs the Debian packages that roxel is built from, where some are missing. With root or passwordless
# sudo it installs them; otherwise it prints the one command to run and fails.
#
#     tools/setup.sh        what `make test` and `make demo` need
#     tools/setup.sh dev    and what contributors need besides (format, lint, faster rebuilds, benchmarks)
set -eu

build="g++ cmake ninja-build python3
  libopenvdb-dev libboost-iostreams-dev zlib1g-dev libtbb-dev libeigen3-dev
  libopenimageio-dev openimageio-tools
  libembree-dev libnova-dev libceres-dev libmeshoptimizer-dev libtinygltf-dev libhwy-dev
  nlohmann-json3-dev libcli11-dev libgtest-dev libgmock-dev librapidcheck-dev libopenvdb-tools"
dev="clang-format clang-tidy ccache libbenchmark-dev"

wanted=$build
if [ "${1:-}" = dev ]; then wanted="$build $dev"; fi

if ! command -v dpkg-query >/dev/null; then
  echo "setup: this is no Debian system; docs/dependencies.md lists what roxel needs" >&2
  exit 0
fi

missing=""
for package in $wanted; do
  state=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  if [ "$state" != installed ]; then missing="$missing $package"; fi
done
if [ -z "$missing" ]; then exit 0; fi

install="apt-get install -y --no-install-recommends$missing"
if [ "$(id -u)" = 0 ]; then
  run="env DEBIAN_FRONTEND=noninteractive"
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
  run="sudo -n env DEBIAN_FRONTEND=noninteractive"
else
  echo "setup: packages are missing, and this user may not install them. Run:" >&2
  echo "    sudo apt-get update && sudo $install" >&2
  exit 1
fi
echo "setup: installing$missing"
$run apt-get update -q </dev/null
$run $install </dev/null
