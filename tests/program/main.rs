//! The program and its library as users see them. One test program for all, since each of them links everything.

mod change;
mod compare;
mod end_to_end;
mod ground_truth;
mod ingest;
mod levels;
mod raster;
mod resume;
mod shared;
mod skip;
mod verify;
mod view;
mod volume;
mod zoo;
