//! Runs that tasks share: the same bytes as one process makes, whatever is killed, late, or done twice.

mod bytes;
mod deploy;
mod faults;
mod names;
mod refusals;
mod run;
mod status;
