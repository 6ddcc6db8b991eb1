# Sourced by the scripts: the root of the repository, and how many jobs a build may run.
# shellcheck shell=bash

set -euo pipefail
ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "${ROOT}"

# One compiler per core, but at most one per 1.5 GB of free memory: gRPC's headers are hungry.
build_jobs() {
  local cores memory_kb by_memory
  cores="$(nproc)"
  memory_kb="$(awk '/^MemAvailable:/ {print $2}' /proc/meminfo)"
  by_memory=$((memory_kb / 1500000))
  if ((by_memory < 1)); then by_memory=1; fi
  echo $((cores < by_memory ? cores : by_memory))
}

# build PRESET TARGETS [CMAKE OPTION…]: configures build/PRESET, and builds the targets there, words; "all" is one.
build() {
  local preset="$1" targets
  read -ra targets <<<"$2"
  shift 2
  cmake --preset "${preset}" "$@" </dev/null
  cmake --build --preset "${preset}" --target "${targets[@]}" --parallel "$(build_jobs)" </dev/null
}

# node_modules FOLDER: installs what FOLDER/package-lock.json says, if it is not there yet; fails if it cannot. It is for
# development only.
node_modules() {
  # Node.js from elsewhere brings npm along, and Debian's package npm would contradict it.
  if ! command -v npm >/dev/null; then deploy/install-deps.sh node || return; fi
  if [[ ! "$1/node_modules/.package-lock.json" -nt "$1/package-lock.json" ]]; then
    npm ci --prefix "$1" --ignore-scripts --no-audit --no-fund </dev/null && touch "$1/node_modules/.package-lock.json"
  fi
}
