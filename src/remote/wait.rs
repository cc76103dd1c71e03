//! Waiting for a request on the thread that makes it.

use std::future::Future;

/// The result of `work`. The store's waits between repeated requests need a clock, and nothing else of a runtime.
pub(crate) fn wait<T>(work: impl Future<Output = T>) -> std::io::Result<T> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .build()?;
    Ok(runtime.block_on(work))
}
