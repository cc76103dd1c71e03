//! Whole runs, through the library and through the program. One test binary, to link only once.

mod attributes;
mod bad_input;
mod cli;
mod compressed;
mod coordinates;
mod determinism;
mod facing;
mod filters;
mod installed;
mod library;
mod messages;
mod normals;
mod odd;
mod outdoor;
mod outputs;
mod pages;
mod regions;
mod report;
mod scanners;
mod scans;
mod stop;
mod systems;
mod text;
mod topology;
mod util;
mod versions;
