//! A run that is killed, stopped, short of disk or damaged is resumed with the same bytes.

mod damage;
mod formats;
mod kills;
mod refusals;
mod run;
mod stops;
mod waits;
