//! A run that is killed, stopped, starved of disk or damaged goes on and gives the same bytes.

#[path = "../end_to_end/util.rs"]
#[allow(dead_code, reason = "written for another test")]
mod util;

mod damage;
mod kills;
mod refusals;
mod run;
mod stops;
