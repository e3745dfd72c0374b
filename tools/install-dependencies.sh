#!/bin/sh
# Installs what building and testing need, from Debian 12's packages. Asks for nothing that is there already.
set -eu
packages="g++ cmake ninja-build ccache libopenvdb-dev libtbb-dev libboost-dev libboost-iostreams-dev libopenmesh-dev
  libnanoflann-dev nlohmann-json3-dev libcli11-dev libpng-dev libjpeg-dev lib3mf-dev libmeshoptimizer-dev libeigen3-dev libmetis-dev libimath-dev libblosc-dev zlib1g-dev
  libgtest-dev python3 python3-openvdb"
missing=""
for p in $packages; do
  dpkg-query -W -f='${Status}' "$p" 2>/dev/null | grep -q 'ok installed' || missing="$missing $p"
done
[ -z "$missing" ] && exit 0
echo "installing:$missing"
sudo=""
[ "$(id -u)" = 0 ] || sudo=sudo
export DEBIAN_FRONTEND=noninteractive
$sudo apt-get update -qq
# shellcheck disable=SC2086
$sudo apt-get install -y -qq --no-install-recommends $missing >/dev/null
