#!/bin/sh
# Installs what is missing, builds with warnings as errors and runs all tests.
set -eu
cd "$(dirname "$0")/.."
sh tools/install-dependencies.sh
cmake -S . -B build/dev -G Ninja -DCMAKE_BUILD_TYPE=Release -DPAVEL_WERROR=ON >/dev/null
cmake --build build/dev
ctest --test-dir build/dev --output-on-failure -j "$(nproc)"
