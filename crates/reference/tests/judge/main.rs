#![allow(clippy::print_stderr, clippy::unwrap_used)]
//! The reference against closed forms, against an independent brute-force sum, and against itself.

mod brute;
mod closed_forms;
mod honesty;
mod real;
mod support;
