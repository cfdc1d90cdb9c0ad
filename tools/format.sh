#!/bin/sh
# Formats all C++ sources that git knows; with --check, changes nothing and fails where one is not formatted.
set -eu

cd "$(dirname "$0")/.."
if [ "${1:-}" = --check ]; then mode="--dry-run -Werror"; else mode=-i; fi
git ls-files -z -- '*.h' '*.cc' '*.cpp' '*.inl' | xargs -0 -r clang-format $mode
