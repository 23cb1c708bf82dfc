//! The command as its users meet it. One program for all: each test runs commands in a folder of its own.

mod common;

mod bake;
mod batches;
mod btf;
mod command;
mod fit;
mod inspect;
mod lights;
mod local;
mod methods;
mod paths;
mod polynomials;
mod prefilter;
mod probes;
mod shadows;
mod textures;
mod transfer;
mod verify;
