//! A run that is killed, stopped, short of disk or damaged is resumed with the same bytes.

#[path = "../end_to_end/util.rs"]
#[allow(dead_code, reason = "written for another test")]
mod util;

mod damage;
mod formats;
mod kills;
mod refusals;
mod run;
mod stops;
mod waits;
