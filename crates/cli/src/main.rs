//! The steradian command.
fn main() {}
