#!/bin/sh
# Installs what is missing, builds in Release and decorates the built-in vase.
set -eu
cd "$(dirname "$0")/.."
sh tools/install-dependencies.sh
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build build --target pavel
mkdir -p out
build/pavel example vase -o out/scene --quiet --force
build/pavel decorate out/scene/scene.json -o out/vase --voxel 0.36 --force
