//! Generates the book, the gallery and the tables.
fn main() {}
