//! What each system does in its own way: files at offsets, private files and folders, syncing, links, room on
//! disks, memory, signals, the program's own file. Nothing here knows what the files are for.
//!
//! No other room asks on which system it runs (`tests/house/architecture.rs`). Here every item is described once, in
//! [`files`], [`names`] and [`process`], and made once for each system, in a file of its own: whoever adds an item
//! adds it to all of them, since a system that lacks one does not compile.
//!
//! | system | file | state |
//! |---|---|---|
//! | Linux | `linux.rs`, `unix.rs` | all tests run there |
//! | macOS | `macos.rs`, `unix.rs` | by review only |
//! | Windows | `windows.rs` | its tests run under wine |

pub mod files;
pub mod names;
pub mod process;

#[cfg(target_os = "linux")]
mod linux;
#[cfg(target_os = "linux")]
use linux as system;

#[cfg(target_os = "macos")]
mod macos;
#[cfg(target_os = "macos")]
use macos as system;

#[cfg(windows)]
mod windows;
#[cfg(windows)]
use windows as system;

/// What Linux and macOS have in common.
#[cfg(unix)]
mod unix;

/// For the systems whose shells leave wildcards to the programs.
#[cfg(any(windows, test))]
mod wildcards;

#[cfg(not(any(target_os = "linux", target_os = "macos", windows)))]
compile_error!("no file of src/platform is for this system");

pub use files::{
    FileAt, device, disk_free, is_local, is_private, links, make_private_folder, modified,
    open_folder, open_regular, populate, private_options, public_options, rename, sync_below,
    sync_folder, sync_names,
};
pub use names::{browser, canonical, no_name, path_bytes, path_of_bytes, program, quoted};
