//! Memory, time and end of the process.
#![allow(unsafe_code, reason = "the standard library has no functions for them")]

use super::check;
use std::sync::OnceLock;
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;
use windows_sys::Win32::Foundation::FILETIME;
use windows_sys::Win32::System::Console::{CTRL_BREAK_EVENT, CTRL_C_EVENT, SetConsoleCtrlHandler};
use windows_sys::Win32::System::JobObjects::{
    JOB_OBJECT_LIMIT_JOB_MEMORY, JOB_OBJECT_LIMIT_PROCESS_MEMORY,
    JOBOBJECT_EXTENDED_LIMIT_INFORMATION, JobObjectExtendedLimitInformation,
    QueryInformationJobObject,
};
use windows_sys::Win32::System::ProcessStatus::{K32GetProcessMemoryInfo, PROCESS_MEMORY_COUNTERS};
use windows_sys::Win32::System::SystemInformation::{GlobalMemoryStatusEx, MEMORYSTATUSEX};
use windows_sys::Win32::System::Threading::{GetCurrentProcess, GetProcessTimes, TerminateProcess};

/// Bytes of memory of the machine.
fn physical() -> u64 {
    let mut about = MEMORYSTATUSEX {
        dwLength: size_of::<MEMORYSTATUSEX>() as u32,
        ..MEMORYSTATUSEX::default()
    };
    // SAFETY: the structure tells its size.
    match unsafe { GlobalMemoryStatusEx(&raw mut about) } {
        0 => 4 << 30,
        _ => about.ullTotalPhys,
    }
}

/// The smallest of physical memory and the limits of the job.
pub fn memory_allowed() -> u64 {
    let mut limits = JOBOBJECT_EXTENDED_LIMIT_INFORMATION::default();
    let (to, bytes) = ((&raw mut limits).cast(), size_of_val(&limits) as u32);
    let none = std::ptr::null_mut();
    let class = JobObjectExtendedLimitInformation;
    // SAFETY: the answer has the room that is told; without a handle the job is that of this process.
    let found =
        check(unsafe { QueryInformationJobObject(none, class, to, bytes, none.cast()) }).is_ok();
    match found {
        true => allowed(&limits, physical()),
        false => physical(),
    }
}

/// The smallest of the bytes of memory of the machine and those limits of a job that are in force.
fn allowed(limits: &JOBOBJECT_EXTENDED_LIMIT_INFORMATION, physical: u64) -> u64 {
    let flags = limits.BasicLimitInformation.LimitFlags;
    [
        (JOB_OBJECT_LIMIT_PROCESS_MEMORY, limits.ProcessMemoryLimit),
        (JOB_OBJECT_LIMIT_JOB_MEMORY, limits.JobMemoryLimit),
    ]
    .into_iter()
    .filter(|(flag, _)| flags & flag != 0)
    .fold(physical, |least, (_, bytes)| least.min(bytes as u64))
}

fn memory() -> PROCESS_MEMORY_COUNTERS {
    let bytes = size_of::<PROCESS_MEMORY_COUNTERS>() as u32;
    let mut memory = PROCESS_MEMORY_COUNTERS {
        cb: bytes,
        ..PROCESS_MEMORY_COUNTERS::default()
    };
    // SAFETY: the structure tells its size. What cannot be had stays 0.
    unsafe { K32GetProcessMemoryInfo(GetCurrentProcess(), &raw mut memory, bytes) };
    memory
}

pub fn peak_resident() -> u64 {
    memory().PeakWorkingSetSize as u64
}

pub fn resident() -> u64 {
    memory().WorkingSetSize as u64
}

/// Not known.
pub fn resident_file() -> u64 {
    0
}

pub fn cpu_seconds() -> f64 {
    let mut times = [FILETIME::default(); 4];
    let [begun, ended, kernel, user] = &mut times;
    // SAFETY: each answer has the room of a time. What cannot be had stays 0.
    unsafe { GetProcessTimes(GetCurrentProcess(), begun, ended, kernel, user) };
    let ticks = |t: &FILETIME| u64::from(t.dwHighDateTime) << 32 | u64::from(t.dwLowDateTime);
    (ticks(kernel) + ticks(user)) as f64 * 1e-7
}

/// Open files are not limited.
pub fn open_many_files() {}

pub const CAN_TRIM: bool = false;

pub fn trim(_: impl FnOnce(&(dyn Fn() + Sync))) {}

/// Where the events go.
static EVENTS: OnceLock<Sender<i32>> = OnceLock::new();

/// Time for which the end of a session, or of the console, is held up. The system waits for five seconds.
const HELD: Duration = Duration::from_secs(5);

/// Called by the system, in a thread of its own.
unsafe extern "system" fn event(kind: u32) -> i32 {
    let asked = [CTRL_C_EVENT, CTRL_BREAK_EVENT].contains(&kind);
    let sent = EVENTS
        .get()
        .is_some_and(|events| events.send(if asked { 2 } else { 15 }).is_ok());
    if sent && !asked {
        // The process ends when this returns.
        std::thread::sleep(HELD);
    }
    sent.into()
}

pub fn on_stop(mut tell: impl FnMut(i32) -> bool + Send + 'static) -> bool {
    let (sender, events) = channel();
    if EVENTS.set(sender).is_err() {
        return false;
    }
    // SAFETY: the function may be called in any thread.
    if check(unsafe { SetConsoleCtrlHandler(Some(event), 1) }).is_err() {
        return false;
    }
    std::thread::spawn(move || events.iter().all(&mut tell));
    true
}

/// The exit code of a process that was killed, as elsewhere.
const KILLED: u32 = 137;

pub fn kill() {
    // SAFETY: it does not return, and nothing is left to be used.
    unsafe { TerminateProcess(GetCurrentProcess(), KILLED) };
}

/// There is no such signal, so this thread sleeps.
pub fn freeze() {
    std::thread::sleep(Duration::from_secs(u64::MAX));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The system of the tests may have no jobs, so their limits are given here.
    #[test]
    fn limits_of_a_job_count_if_they_are_in_force() {
        let mut limits = JOBOBJECT_EXTENDED_LIMIT_INFORMATION {
            ProcessMemoryLimit: 1000,
            JobMemoryLimit: 500,
            ..JOBOBJECT_EXTENDED_LIMIT_INFORMATION::default()
        };
        assert_eq!(allowed(&limits, 2000), 2000);
        limits.BasicLimitInformation.LimitFlags = JOB_OBJECT_LIMIT_PROCESS_MEMORY;
        assert_eq!(allowed(&limits, 2000), 1000);
        limits.BasicLimitInformation.LimitFlags |= JOB_OBJECT_LIMIT_JOB_MEMORY;
        assert_eq!(allowed(&limits, 2000), 500);
        assert_eq!(allowed(&limits, 100), 100);
        assert!(memory_allowed() > 0 && memory_allowed() <= physical());
    }
}
