#!/usr/bin/env bash
# Runs tests of the numerical crates on aarch64 (NEON) under emulation, on an x86-64 Debian machine:
#
#   dpkg --add-architecture arm64 && apt-get update
#   apt-get install rustc-web libstd-rust-web-dev:arm64 gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user-static libc6:arm64
#   scripts/test-aarch64.sh [PACKAGE ...]
#
# Debian's rustc-web is a recent compiler, and the standard library for arm64 belongs to it alone: hence its own target
# folder. Where rustup has the target aarch64-unknown-linux-gnu, that serves with RUSTC unset. The emulator must find
# the C library of libc6:arm64: under that of libc6-arm64-cross (qemu -L /usr/aarch64-linux-gnu) threads never start.
set -euo pipefail
cd "$(dirname "$0")/.."

export RUSTC=${RUSTC-/usr/bin/rustc}
[ -n "$RUSTC" ] || unset RUSTC
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-target}/aarch64 CARGO_INCREMENTAL=0
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER=qemu-aarch64-static

[ $# -gt 0 ] || set -- steradian-simd steradian-sphere
for package in "$@"; do
  cargo test -p "$package" --lib --target aarch64-unknown-linux-gnu
done
