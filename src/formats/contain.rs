//! Catches panics of third-party decoders.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    static CONTAINED: Cell<bool> = const { Cell::new(false) };
}

static HOOK: Once = Once::new();

/// From now on, panics of third-party decoders, which are caught, print nothing: wraps the panic hook of the
/// process, once. For programs; readers leave the hook alone.
pub fn hide_caught_panics() {
    HOOK.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |info| {
            if !CONTAINED.get() {
                before(info);
            }
        }));
    });
}

/// Runs `work` and converts a panic to its message. `work` must not leave state behind that is used after a
/// panic.
pub(super) fn contain<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    CONTAINED.set(true);
    let result = catch_unwind(AssertUnwindSafe(work));
    CONTAINED.set(false);
    result.map_err(|panic| {
        let text = panic
            .downcast_ref::<&str>()
            .map(ToString::to_string)
            .or_else(|| panic.downcast_ref::<String>().cloned());
        format!(
            "corrupt data (decoder: {})",
            text.unwrap_or_default().lines().next().unwrap_or_default()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_a_panic_into_its_message() {
        assert_eq!(contain(|| 7), Ok(7));
        let message = contain(|| [1, 2, 3][std::hint::black_box(9)]).unwrap_err();
        assert!(message.contains("index out of bounds"), "{message}");
    }
}
