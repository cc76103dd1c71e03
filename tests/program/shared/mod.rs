//! Runs that tasks share: the same bytes as one process makes, whatever is killed, late, or done twice.

#[path = "../end_to_end/util.rs"]
#[allow(dead_code, reason = "written for another test")]
mod util;

mod bytes;
mod deploy;
mod faults;
mod names;
mod refusals;
mod run;
mod status;
