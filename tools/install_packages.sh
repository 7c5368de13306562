#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs the Debian or Ubuntu packages that the build needs, and those named as arguments, if missing.
set -eu

wanted="build-essential cmake ninja-build libembree-dev libnanoflann-dev libtbb-dev libgtest-dev $*"
# A python3 that was not installed by apt brings its own headers and venv.
python=$(command -v "${PYTHON:-python3}" || true)
case "$python" in
  "" | /usr/bin/* | /bin/*) wanted="$wanted python3 python3-dev python3-venv" ;;
esac

missing=""
for package in $wanted; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

if [ "$(id -u)" = 0 ]; then
  root=""
elif command -v sudo >/dev/null; then
  root="sudo"
else
  echo "error: packages are missing:$missing. Run as root, or install sudo, or: apt-get install$missing" >&2
  exit 1
fi
echo "Installing:$missing"
$root apt-get update -q
$root env DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends $missing
