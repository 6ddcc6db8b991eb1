#!/usr/bin/env bash
# Installs the Debian 12 packages that Wellspace needs. The one place with package lists.
#
#   deploy/install-deps.sh [GROUP…]        groups: build test interoperability solvers lint tidy fuzz node browser bench container package monitoring kubernetes runtime docs dev; default: build test
#
# As root, or through sudo. Installs only what is missing; does not touch the network when nothing is.
set -euo pipefail

# What a group needs, without what its packages already depend on (libgrpc++-dev brings OpenSSL, RE2, c-ares and gRPC's core).
declare -A packages=(
  [build]="g++ cmake ninja-build pkg-config libgrpc++-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc
           libabsl-dev libc-ares-dev libspdlog-dev libboost-dev libtbb-dev libcli11-dev nlohmann-json3-dev
           prometheus-cpp-dev libcairo2-dev libmetis-dev libmicrohttpd-dev zlib1g-dev liblzma-dev libminizip-dev libhdf5-dev
           libsqlite3-dev libpqxx-dev python3"
  [test]="libgtest-dev libgmock-dev libcgal-dev libeigen3-dev python3 python3-grpcio python3-meshio python3-numpy openssl
          metis postgresql-15 haproxy iproute2 libfaketime python3-protobuf python3-scipy python3-tqdm python3-yaml libisal2 mypy
          python3-build python3-numpydoc python3-pip python3-setuptools python3-sphinx python3-venv python3-wheel"
  [interoperability]="gmsh freefem++ python3-gmsh python3-h5py python3-meshio python3-vtk9 python3-numpy fish zsh"
  [solvers]="calculix-ccx openfoam python3-dolfinx python3-mpi4py python3-petsc4py"
  [lint]="git clang-format-14 python3"
  [tidy]="clang-tidy-14"
  [fuzz]="clang-14 libclang-rt-14-dev"
  [node]="nodejs npm"
  [browser]="chromium fonts-dejavu-core"
  [bench]="libtet1.5-dev libcgal-dev voro++-dev libbenchmark-dev python3 python3-matplotlib"
  [container]="debootstrap podman buildah"
  [package]="dpkg-dev lintian groff-base debootstrap patchelf binutils python3-build python3-setuptools python3-wheel"
  [monitoring]="prometheus"
  [kubernetes]="kubernetes-client"
  [docs]="python3 python3-grpcio python3-numpy python3-numpydoc python3-protobuf python3-sphinx"
  [runtime]="libgrpc++1.51 libprotobuf32 libabsl20220623 libspdlog1.10 libtbb12 libprometheus-cpp-core1.0 libcairo2 libmetis5 libmicrohttpd12 zlib1g
             libminizip1 liblzma5 libsz2 libsqlite3-0 libpqxx-6.4"
)
packages[dev]="${packages[build]} ${packages[test]} ${packages[lint]} ${packages[tidy]} ${packages[fuzz]}"

as_root() {
  if [[ "$(id -u)" -eq 0 ]]; then
    "$@"
  elif ! command -v sudo >/dev/null; then
    echo "install-deps: run as root or install sudo; missing packages: ${missing[*]}" >&2
    exit 1
  elif [[ -t 0 ]]; then
    sudo "$@"
  else
    sudo -n "$@" # without a terminal a password prompt would hang
  fi
}

wanted=()
for group in "${@:-build test}"; do
  for name in ${group}; do
    if [[ -z "${packages[${name}]:-}" ]]; then
      echo "install-deps: unknown group '${name}'; groups are: ${!packages[*]}" >&2
      exit 2
    fi
    # shellcheck disable=SC2206 # a list of words by design
    wanted+=(${packages[${name}]})
  done
done

missing=()
for package in $(printf '%s\n' "${wanted[@]}" | sort -u); do
  status="$(dpkg-query --show --showformat='${db:Status-Status}' "${package}" 2>/dev/null || true)"
  # A package for several architectures reports one word for each.
  [[ "${status}" == *installed* && "${status}" != *not-installed* ]] || missing+=("${package}")
done
if [[ ${#missing[@]} -eq 0 ]]; then
  exit 0
fi

echo "install-deps: installing ${missing[*]}" >&2
options=(-qq -y -o Dpkg::Use-Pty=0 --no-install-recommends -o Acquire::Retries=3 -o DPkg::Lock::Timeout=300)
as_root env DEBIAN_FRONTEND=noninteractive apt-get "${options[@]}" update </dev/null
as_root env DEBIAN_FRONTEND=noninteractive apt-get "${options[@]}" install "${missing[@]}" </dev/null
